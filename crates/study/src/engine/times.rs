//! How long estimates took, and on which processor.

use serde::{Deserialize, Serialize};

/// Processor and wall time of passes over all integrals, or over blocks of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// The passes over each block of integrals.
    blocks: Vec<Vec<PassTime>>,
}

/// One pass: what `trials` of all integrals of a block took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PassTime {
    pub(super) trials: f64,
    pub(super) cpu: f64,
    pub(super) wall: f64,
}

impl Times {
    /// Adds a pass over the last block.
    pub(super) fn add(&mut self, pass: PassTime) {
        match self.blocks.last_mut() {
            Some(block) => block.push(pass),
            None => self.blocks.push(vec![pass]),
        }
    }

    /// Adds the times of other integrals.
    pub(super) fn join(&mut self, other: Self) {
        self.blocks.extend(other.blocks);
    }

    /// Processor seconds and number of all passes.
    pub(super) fn total(&self) -> (f64, usize) {
        let passes = || self.blocks.iter().flatten();
        (passes().map(|p| p.cpu).sum(), passes().count())
    }

    /// Returns the sum over blocks of `of` applied to their passes; NaN where there are none.
    fn sum(&self, of: impl Fn(&[PassTime]) -> f64) -> f64 {
        if self.blocks.is_empty() {
            return f64::NAN;
        }
        self.blocks.iter().map(|block| of(block)).sum()
    }

    /// Processor seconds of one trial over all threads: the mean of all passes; NaN where it is not
    /// known.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.sum(|block| mean(block, |p| p.cpu))
    }

    /// Seconds on the wall of one trial.
    #[must_use]
    pub fn wall_seconds(&self) -> f64 {
        self.sum(|block| mean(block, |p| p.wall))
    }

    /// Standard deviation of [`Times::seconds`] over passes, in seconds: how far a pass of its own,
    /// 10 ms or more, is from the mean. NaN for one pass, which says nothing of it.
    ///
    /// It is not divided by the root of the number of passes: what disturbs a shared machine lasts
    /// longer than a pass, and would make the mean's error too small. Those of blocks are added:
    /// what disturbs one disturbs its neighbours.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.sum(deviation)
    }
}

fn mean(block: &[PassTime], of: fn(&PassTime) -> f64) -> f64 {
    let trials: f64 = block.iter().map(|p| p.trials).sum();
    block.iter().map(of).sum::<f64>() / trials
}

fn deviation(block: &[PassTime]) -> f64 {
    let mean = mean(block, |p| p.cpu);
    let n = block.len() as f64;
    let square = |p: &PassTime| (p.cpu / p.trials - mean).powi(2);
    (block.iter().map(square).sum::<f64>() / (n - 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pass(trials: f64, cpu: f64) -> PassTime {
        PassTime {
            trials,
            cpu,
            wall: 2.0 * cpu,
        }
    }

    #[test]
    fn passes_are_averaged_and_blocks_added() {
        // 3 s for two trials and 3 s for one: 2 s a trial, ½ s and 1 s from it.
        let of = |passes: [PassTime; 2]| Times {
            blocks: vec![passes.to_vec()],
        };
        let mut times = of([pass(2.0, 3.0), pass(1.0, 3.0)]);
        assert_eq!((times.seconds(), times.wall_seconds()), (2.0, 4.0));
        assert!((times.error() - 1.25f64.sqrt()).abs() < 1e-15);
        times.join(of([pass(4.0, 2.0), pass(4.0, 2.0)]));
        assert_eq!((times.seconds(), times.total()), (2.5, (10.0, 4)));
        assert!(Times::default().seconds().is_nan() && Times::default().error().is_nan());
    }
}

//! Times of estimates: the passes that timed each block of integrals, and their mean and deviation.

use serde::{Deserialize, Serialize};

/// The processor and wall times of passes over all integrals, or over blocks of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// The passes over each block of integrals: one list of passes for each block.
    blocks: Vec<Vec<PassTime>>,
}

/// The time of one pass: the seconds that `trials` trials of all integrals of a block took.
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

    /// Appends the times of other blocks of integrals.
    pub(super) fn join(&mut self, other: Self) {
        self.blocks.extend(other.blocks);
    }

    /// Returns the processor seconds of all passes, and their number.
    pub(super) fn total(&self) -> (f64, usize) {
        let passes = || self.blocks.iter().flatten();
        (passes().map(|p| p.cpu).sum(), passes().count())
    }

    /// Returns the sum over all blocks of `of(passes)`, where `passes` are the passes over a block;
    /// NaN if there are no blocks.
    fn sum(&self, of: impl Fn(&[PassTime]) -> f64) -> f64 {
        if self.blocks.is_empty() {
            return f64::NAN;
        }
        self.blocks.iter().map(|block| of(block)).sum()
    }

    /// Returns the processor seconds of one trial of all integrals, summed over threads: the mean
    /// over all passes, or NaN where no pass was timed.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.sum(|block| mean(block, |p| p.cpu))
    }

    /// Returns the seconds on the wall of one trial of all integrals.
    #[must_use]
    pub fn wall_seconds(&self) -> f64 {
        self.sum(|block| mean(block, |p| p.wall))
    }

    /// Returns the standard deviation of [`Times::seconds`] over passes, in seconds: how far one
    /// pass, of 10 ms or more, is from the mean. NaN if there is only one pass.
    ///
    /// It is not divided by the root of the number of passes: other work on a shared machine lasts
    /// longer than a pass, so that passes are not independent and such an error of the mean would
    /// be too small. The deviations of blocks are added, since whatever disturbs one block also
    /// disturbs its neighbours.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.sum(deviation)
    }
}

/// Returns the mean of a time over the passes of a block, for one trial.
fn mean(block: &[PassTime], of: fn(&PassTime) -> f64) -> f64 {
    let trials: f64 = block.iter().map(|p| p.trials).sum();
    block.iter().map(of).sum::<f64>() / trials
}

/// Returns the standard deviation over passes of the processor time of one trial of a block.
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
        // 3 s for two trials and 3 s for one: 2 s per trial, from which the passes differ by ½ s
        // and 1 s.
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

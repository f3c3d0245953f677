//! The reference that estimates are scored against, and how wrong it is itself.

use super::bytes::vectors;
use super::window::Window;
use super::{Cell, Method, Problem, Truth, run_cell};
use linelit_geometry::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The seed of references is far from that of any trial.
const REFERENCE_SEED: u64 = 0x5EED_0F7E_FE7E_4CE5;

/// Reference value of each integral.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Per integral; of a computed one the mean over all replicates.
    pub values: Vec<DVec3>,
    /// Variance of each of `values`, from the spread of the replicates; none where they are known.
    pub variances: Vec<DVec3>,
    /// Independent replicates that each value is the mean of, at least; 0 where they are known.
    pub replicates: u32,
    /// Mean squared error of `values`, from the spread of the replicates: the average over pixels
    /// and channels. Zero where the values are known.
    pub mse: f64,
    /// Text for the report: estimator, samples and replicates. Empty for known values.
    pub source: String,
}

impl Reference {
    /// Values without an error of their own.
    #[must_use]
    pub const fn known(values: Vec<DVec3>) -> Self {
        Self {
            values,
            variances: Vec::new(),
            replicates: 0,
            mse: 0.0,
            source: String::new(),
        }
    }

    /// The values of all integrals.
    pub(super) fn all(&self) -> Values<'_> {
        Values {
            values: &self.values,
            variances: &self.variances,
            replicates: self.replicates,
        }
    }

    /// The values of some integrals; `None` beyond them.
    pub(super) fn of(&self, integrals: Range<usize>) -> Option<Values<'_>> {
        let values = self.values.get(integrals.clone())?;
        Some(Values {
            values,
            variances: self.variances.get(integrals).unwrap_or_default(),
            replicates: self.replicates,
        })
    }
}

/// What some integrals are held to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values<'a> {
    pub(super) values: &'a [DVec3],
    /// As [`Reference::variances`].
    pub(super) variances: &'a [DVec3],
    /// As [`Reference::replicates`].
    pub(super) replicates: u32,
}

impl Values<'_> {
    /// The variance of δ² − s², summed over channels: δ the error of a value, s² its variance as
    /// the replicates have it.
    ///
    /// Of a normal δ of variance σ² and R replicates it is 2σ⁴R/(R − 1), and the mean of s⁴ is
    /// σ⁴(R + 1)/(R − 1): hence 2s⁴R/(R + 1). Channels that err together add up before the square.
    pub(super) fn variance_of_square(&self, variance: DVec3) -> f64 {
        let r = f64::from(self.replicates);
        2.0 * r / (r + 1.0) * variance.element_sum().powi(2)
    }
}

/// One round of a computed reference on some integrals: number, mean and sum of squared deviations
/// (M2) of independent replicates, for each integral and channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferencePart {
    /// The first integral.
    pub(super) first: usize,
    /// Replicates of each.
    pub(super) replicates: u32,
    #[serde(with = "vectors")]
    pub(super) mean: Vec<DVec3>,
    #[serde(with = "vectors")]
    pub(super) square: Vec<DVec3>,
}

/// Runs a round of the reference by a method with so many samples, on some integrals.
pub(super) fn round<P: Problem>(
    problem: &P,
    method: &Method<P::Settings>,
    samples: u32,
    round: u32,
    integrals: Range<usize>,
) -> ReferencePart {
    let window = Window {
        problem,
        first: integrals.start,
        step: 1,
        count: integrals.len(),
    };
    let seed = REFERENCE_SEED.wrapping_add(u64::from(round).wrapping_mul(0x0123_4567_89AB_CDEF));
    let cell = Cell {
        settings: method.settings.clone(),
        samples,
        seed,
        trials: method.trials,
    };
    let run = run_cell(&window, cell);
    let n = f64::from(method.trials);
    let mut part = ReferencePart {
        first: integrals.start,
        replicates: method.trials,
        mean: Vec::with_capacity(integrals.len()),
        square: Vec::with_capacity(integrals.len()),
    };
    for integral in 0..integrals.len() {
        let all = run.trials_of(integral);
        let mean = all.iter().copied().sum::<DVec3>() / n;
        let square = all.iter().map(|v| (*v - mean) * (*v - mean)).sum();
        part.mean.push(mean);
        part.square.push(square);
    }
    part
}

/// The replicates of a reference, put together from parts: the same bits if the parts come in the
/// same order.
#[derive(Clone, Debug)]
pub struct Replicates {
    count: Vec<u32>,
    mean: Vec<DVec3>,
    square: Vec<DVec3>,
}

impl Replicates {
    /// None yet, of so many integrals.
    #[must_use]
    pub fn new(integrals: usize) -> Self {
        Self {
            count: vec![0; integrals],
            mean: vec![DVec3::ZERO; integrals],
            square: vec![DVec3::ZERO; integrals],
        }
    }

    /// Adds the replicates of a part (Chan, Golub & LeVeque 1983, eq. 2.1). What is beyond the
    /// integrals is ignored.
    pub fn add(&mut self, part: &ReferencePart) {
        let b = f64::from(part.replicates);
        let own = self.count.iter_mut().zip(&mut self.mean);
        let own = own.zip(&mut self.square).skip(part.first);
        for (((count, mean), square), (m, s)) in own.zip(part.mean.iter().zip(&part.square)) {
            let a = f64::from(*count);
            let distance = *m - *mean;
            *count = count.saturating_add(part.replicates);
            // The first is taken as it is.
            *mean = if a > 0.0 {
                *mean + distance * (b / (a + b))
            } else {
                *m
            };
            *square += *s + distance * distance * (a * b / (a + b));
        }
    }

    /// The reference by a method with so many samples. Its error is NaN where an integral has fewer
    /// than two replicates.
    pub(super) fn reference<S>(self, method: &Method<S>, samples: u32, pixels: usize) -> Reference {
        let variance = |(square, count): (&DVec3, &u32)| {
            let r = f64::from(*count);
            *square / ((r - 1.0) * r)
        };
        let variances: Vec<DVec3> = self.square.iter().zip(&self.count).map(variance).collect();
        let total: f64 = variances.iter().map(|v| v.element_sum() / 3.0).sum();
        let replicates = self.count.iter().min().copied().unwrap_or(0);
        let (estimator, sampler) = (&method.estimator, &method.sampler);
        Reference {
            values: self.mean,
            variances,
            replicates,
            mse: total / pixels.max(1) as f64,
            source: format!(
                "{replicates} replicates of {estimator} with {samples} {sampler} samples"
            ),
        }
    }
}

/// The reference of a problem. A computed one takes `samples` to a replicate, and so many rounds
/// of the method's trials, one at least.
///
/// # Panics
/// If known values are not one for each integral.
#[must_use]
pub fn reference<P: Problem>(
    problem: &P,
    truth: &Truth<P::Settings>,
    samples: u32,
    rounds: u32,
) -> Reference {
    let method = match truth {
        Truth::Known(values) => {
            assert_eq!(values.len(), problem.integrals(), "a value per integral");
            return Reference::known(values.clone());
        }
        Truth::Computed(method) => method,
    };
    let mut replicates = Replicates::new(problem.integrals());
    for k in 0..rounds.max(1) {
        replicates.add(&round(problem, method, samples, k, 0..problem.integrals()));
    }
    replicates.reference(method, samples, problem.pixels())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replicates_of_parts_are_those_of_all() {
        let part = |first, replicates, mean: f64, square: f64| ReferencePart {
            first,
            replicates,
            mean: vec![DVec3::splat(mean)],
            square: vec![DVec3::splat(square)],
        };
        let mut all = Replicates::new(2);
        // Of the second integral 1 and 3, then 4, 5 and 9; of the first 7 and 7.
        for part in [
            part(1, 2, 2.0, 2.0),
            part(0, 2, 7.0, 0.0),
            part(1, 3, 6.0, 14.0),
        ] {
            all.add(&part);
        }
        all.add(&part(2, 9, 1.0, 1.0));
        let method = Method {
            estimator: "e".to_owned(),
            sampler: "s".to_owned(),
            trials: 1,
            settings: (),
        };
        let found = all.reference(&method, 8, 2);
        // Mean 22/5, squares 132 − 5·4.4² = 35.2, over 4·5, over two pixels.
        assert!((found.values[1].x - 4.4).abs() < 1e-15 && (found.values[0].x - 7.0).abs() < 1e-15);
        assert!(
            (found.mse - 35.2 / 20.0 / 2.0).abs() < 1e-15,
            "{}",
            found.mse
        );
        assert!(found.source.starts_with("2 replicates of e with 8 s"));
    }
}

//! The reference that estimates are scored against, and the error that it has itself. A computed
//! reference is the mean of independent replicates, whose spread gives its variance.

use super::run::run_span;
use super::{Method, Problem};
use linelit_geometry::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The first seed of a computed reference, which is a number that no trial uses as its seed, so
/// that references and trials are independent.
const REFERENCE_SEED: u64 = 0x5EED_0F7E_FE7E_4CE5;

/// The reference value of each integral, with its variance.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The value of each integral; in a computed reference it is the mean over all replicates.
    pub values: Vec<DVec3>,
    /// The variance of each of `values`, from the spread of the replicates; empty if the values are
    /// known.
    pub variances: Vec<DVec3>,
    /// The least number of independent replicates behind a value; 0 if the values are known.
    pub replicates: u32,
    /// The mean squared error of `values`, averaged over pixels and channels, from the spread of
    /// the replicates; 0 if the values are known.
    pub mse: f64,
    /// The estimator, samples and replicates in words, for the report; empty if the values are
    /// known.
    pub source: String,
}

impl Reference {
    /// Creates the reference that is the mean of replicates by a method with this many samples. Its
    /// error is NaN where an integral has fewer than two replicates.
    pub(super) fn new<S>(
        all: &[Replicates],
        method: &Method<S>,
        samples: u32,
        pixels: usize,
    ) -> Self {
        let variances: Vec<DVec3> = all.iter().map(Replicates::variance).collect();
        let total: f64 = variances.iter().map(|v| v.element_sum() / 3.0).sum();
        let replicates = all.iter().map(|r| r.count).min().unwrap_or(0);
        let (estimator, sampler) = (&method.estimator, &method.sampler);
        Self {
            values: all.iter().map(|r| r.mean.into()).collect(),
            variances,
            replicates,
            mse: total / pixels.max(1) as f64,
            source: format!(
                "{replicates} replicates of {estimator} with {samples} {sampler} samples"
            ),
        }
    }

    /// Creates a reference of known values, which have no error.
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

    /// Returns the variance of δ² − s², summed over channels, where δ is the error of a value and
    /// s² its `variance` as estimated from the replicates.
    ///
    /// For a normal δ of variance σ² and R replicates it is 2σ⁴R/(R − 1), and the mean of s⁴ is
    /// σ⁴(R + 1)/(R − 1): hence 2s⁴R/(R + 1). Channels may err together, so their variances add up
    /// before the square.
    pub(super) fn variance_of_square(&self, variance: DVec3) -> f64 {
        let r = f64::from(self.replicates);
        2.0 * r / (r + 1.0) * variance.element_sum().powi(2)
    }
}

/// The number of independent replicates of one integral, their mean, and the sum of their squared
/// deviations from it (M2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Replicates {
    count: u32,
    mean: [f64; 3],
    square: [f64; 3],
}

impl Replicates {
    /// Returns the number, the mean and the sum of squared deviations (M2) of the replicates of one
    /// integral.
    fn of(values: &[DVec3]) -> Self {
        let mean = values.iter().copied().sum::<DVec3>() / values.len() as f64;
        let square: DVec3 = values.iter().map(|v| (*v - mean) * (*v - mean)).sum();
        Self {
            count: u32::try_from(values.len()).unwrap_or(u32::MAX),
            mean: mean.into(),
            square: square.into(),
        }
    }

    /// Adds other replicates of the same integral (Chan, Golub & LeVeque 1983, eq. 2.1). If there
    /// were none before, the other moments are copied unchanged.
    fn join(&mut self, other: &Self) {
        if self.count == 0 {
            *self = *other;
            return;
        }
        let [a, b] = [self.count, other.count].map(f64::from);
        let [mean, square, m, s] =
            [self.mean, self.square, other.mean, other.square].map(DVec3::from);
        let distance = m - mean;
        self.count = self.count.saturating_add(other.count);
        self.mean = (mean + distance * (b / (a + b))).into();
        self.square = (square + (s + distance * distance * (a * b / (a + b)))).into();
    }

    /// Returns the variance of the mean of the replicates, M2/(n(n − 1)), for each channel.
    fn variance(&self) -> DVec3 {
        let n = f64::from(self.count);
        DVec3::from(self.square) / ((n - 1.0) * n)
    }
}

/// One round of a computed reference on a range of integrals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferencePart {
    /// The index of the first integral of the range.
    first: usize,
    replicates: Vec<Replicates>,
}

impl ReferencePart {
    /// Runs one round by a method with this many samples, on some integrals.
    pub(super) fn new<P: Problem>(
        problem: &P,
        method: &Method<P::Settings>,
        samples: u32,
        round: u32,
        integrals: Range<usize>,
    ) -> Self {
        let far = u64::from(round).wrapping_mul(0x0123_4567_89AB_CDEF);
        let cell = method.cell(samples, REFERENCE_SEED.wrapping_add(far));
        let run = run_span(problem, cell, integrals.clone().into());
        let of = |k| Replicates::of(run.trials_of(k));
        Self {
            first: integrals.start,
            replicates: (0..integrals.len()).map(of).collect(),
        }
    }

    /// Adds the replicates of this part to the replicates of all integrals. The result has the same
    /// bits whenever parts are added in the same order; replicates beyond the last integral are
    /// ignored.
    pub(super) fn add_to(&self, all: &mut [Replicates]) {
        for (own, part) in all.iter_mut().skip(self.first).zip(&self.replicates) {
            own.join(part);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replicates_of_parts_are_those_of_all() {
        let part = |first, values: &[f64]| {
            let values: Vec<DVec3> = values.iter().map(|v| DVec3::splat(*v)).collect();
            let replicates = vec![Replicates::of(&values)];
            ReferencePart { first, replicates }
        };
        let mut all = vec![Replicates::default(); 2];
        for part in [
            part(1, &[1.0, 3.0]),
            part(0, &[7.0, 7.0]),
            part(1, &[4.0, 5.0, 9.0]),
            part(2, &[1.0, 1.0]),
        ] {
            part.add_to(&mut all);
        }
        let method = Method {
            estimator: "e".to_owned(),
            sampler: "s".to_owned(),
            trials: 1,
            settings: (),
        };
        let found = Reference::new(&all, &method, 8, 2);
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

//! The laws of a reflection and its sampling.
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

use super::technique::cell;
use super::{Broken, surface};
use crate::chi2::{ChiSquare, chi2_test};
use crate::quadrature::cubature;
use crate::rng::SplitMix64;
use crate::ztest::{Welford, critical_z, z_score};

/// A check of the laws of a reflection and of its sampling, above a surface with the normal (0, 0,
/// 1); create it by [`Bsdf::new`] and its setters.
///
/// A reflection is three closures of unit vectors that point away from the surface: `eval(wi, wo)`
/// is its value in 1/sr, without the cosine; `sample(u, wo)` is a direction wi, if any; `pdf(wi,
/// wo)` is the density of that direction in 1/sr.
///
/// ```
/// use linelit_testkit::laws::Bsdf;
/// use std::f64::consts::{PI, TAU};
/// let sample = |[u, v]: [f64; 2], _: [f64; 3]| {
///     let (r, turn) = (u.sqrt(), TAU * v);
///     Some([r * turn.cos(), r * turn.sin(), (1.0 - u).sqrt()])
/// };
/// let pdf = |wi: [f64; 3], _: [f64; 3]| wi[2].max(0.0) / PI;
/// let found = Bsdf::new("half").check([0.6, 0.0, 0.8], |_, _| 0.5 / PI, sample, pdf);
/// assert!((found.albedo - 0.5).abs() < 1e-6);
/// // A reflection that gives more than it gets.
/// let broken = Bsdf::new("two").try_check([0.6, 0.0, 0.8], |_, _| 2.0 / PI, sample, pdf);
/// assert!(broken.unwrap_err().message.contains("more than"));
/// ```
#[derive(Clone, Debug)]
pub struct Bsdf {
    name: String,
    samples: usize,
    alpha: f64,
    seed: u64,
    most: f64,
    lost: f64,
    reciprocity: f64,
}

/// The measurements of a check that passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// ∫ f cos θ dω by quadrature: the fraction that is reflected.
    pub albedo: f64,
    /// ∫ pdf dω above the surface; it is below one where samples are drawn below the surface.
    pub drawn: f64,
    /// The χ² test of the histogram of samples against the integrated pdf.
    pub chi2: ChiSquare,
    /// The z score of the mean of f cos θ/pdf against the albedo.
    pub z: f64,
}

/// The number of cells of the histogram, along the azimuth and along the cosine.
const CELLS: usize = 16;

/// The largest number of times that a cell is halved: this resolves lobes of about 2⁻¹⁰ of a cell.
const DEPTH: u32 = 10;

/// The absolute error to which the integral over a cell of the hemisphere is computed.
const CELL: f64 = 2e-6;

impl Bsdf {
    /// Creates a check with 100 000 samples, α = 10⁻⁴ for each of its tests, seed 1, an albedo up
    /// to one, reciprocity to 10⁻⁸, and no samples below the surface.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            samples: 100_000,
            alpha: 1e-4,
            seed: 1,
            most: 1.0,
            lost: 0.0,
            reciprocity: 1e-8,
        }
    }

    /// Sets the number of samples.
    #[must_use]
    pub fn samples(mut self, samples: usize) -> Self {
        self.samples = samples;
        self
    }

    /// Sets the level of each statistical test; use [`sidak`](crate::chi2::sidak) of it for several
    /// checks.
    #[must_use]
    pub fn alpha(mut self, alpha: f64) -> Self {
        self.alpha = alpha;
        self
    }

    /// Sets the seed of the uniform numbers.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Sets the largest albedo, for models that are known to reflect more than they receive.
    #[must_use]
    pub fn most(mut self, albedo: f64) -> Self {
        self.most = albedo;
        self
    }

    /// Sets the largest fraction that may be drawn below the surface, as microfacets do.
    #[must_use]
    pub fn lost(mut self, share: f64) -> Self {
        self.lost = share;
        self
    }

    /// Sets the relative difference that f(wi, wo) and f(wo, wi) may have; infinite for models that
    /// are not reciprocal.
    #[must_use]
    pub fn reciprocity(mut self, relative: f64) -> Self {
        self.reciprocity = relative;
        self
    }

    /// Checks a reflection seen from `wo`; see [`Bsdf::try_check`].
    ///
    /// # Panics
    /// If a law is broken.
    pub fn check(
        &self,
        wo: [f64; 3],
        eval: impl Fn([f64; 3], [f64; 3]) -> f64,
        sample: impl Fn([f64; 2], [f64; 3]) -> Option<[f64; 3]>,
        pdf: impl Fn([f64; 3], [f64; 3]) -> f64,
    ) -> Measured {
        self.try_check(wo, eval, sample, pdf)
            .unwrap_or_else(|broken| panic!("{broken}"))
    }

    /// Checks the laws as [`Bsdf::check`] does, and returns a broken one.
    ///
    /// The laws: values are finite, not negative and reciprocal; no more is reflected than arrives;
    /// the density integrates to one; samples are unit vectors with a positive density, which
    /// follow it by a χ² test; and the mean of f cos θ/pdf over them is the albedo by quadrature,
    /// by a z test. The standard error of this mean is unreliable for lobes that are sampled by a
    /// much too narrow density.
    ///
    /// # Errors
    /// The first broken law.
    pub fn try_check(
        &self,
        wo: [f64; 3],
        eval: impl Fn([f64; 3], [f64; 3]) -> f64,
        sample: impl Fn([f64; 2], [f64; 3]) -> Option<[f64; 3]>,
        pdf: impl Fn([f64; 3], [f64; 3]) -> f64,
    ) -> Result<Measured, Broken> {
        // Check reciprocity and the albedo.
        self.reciprocal(wo, &eval)?;
        let albedo: f64 = masses(|w| eval(w, wo) * w[2]).iter().sum();
        // All cells together may be off by the errors of each.
        let error = (CELLS * CELLS) as f64 * CELL;
        if albedo.is_nan() || albedo > self.most + error {
            return self.broken(format!("it reflects {albedo:?}, more than {}", self.most));
        }
        // Check the integral of the density.
        let mut expected = masses(|w| pdf(w, wo));
        let drawn: f64 = expected.iter().sum();
        if !(1.0 - self.lost - error..=1.0 + error).contains(&drawn) {
            let lost = self.lost;
            return self.broken(format!(
                "∫ pdf = {drawn:?}, not 1 (or less by up to {lost})"
            ));
        }
        // Draw samples, and check them against the density.
        let (observed, mean) = self.draw(wo, eval, sample, pdf)?;
        expected.push((1.0 - drawn).max(0.0));
        for mass in &mut expected {
            *mass *= self.samples as f64;
        }
        let chi2 = chi2_test(&observed, &expected, 5.0);
        if chi2.p_value < self.alpha {
            return self.broken(format!("samples do not follow the pdf: {chi2:?}"));
        }
        // Check the mean against the albedo.
        let z = z_score(mean.mean(), albedo, mean.standard_error().hypot(error));
        if z.is_nan() || z.abs() > critical_z(self.alpha) {
            let mean = mean.mean();
            return self.broken(format!(
                "the mean of f cos/pdf is {mean:?}, not {albedo:?}: z = {z:.1}"
            ));
        }
        Ok(Measured {
            albedo,
            drawn,
            chi2,
            z,
        })
    }

    /// Checks values and reciprocity at 500 random directions.
    fn reciprocal(
        &self,
        wo: [f64; 3],
        eval: &impl Fn([f64; 3], [f64; 3]) -> f64,
    ) -> Result<(), Broken> {
        let mut rng = SplitMix64::new(self.seed);
        for _ in 0..500 {
            let ((wi, _), there) = (
                (surface::hemisphere().place)([rng.next_f64(), rng.next_f64()]),
                wo,
            );
            let (ab, ba) = (eval(wi, there), eval(there, wi));
            if !(ab >= 0.0 && ab.is_finite()) {
                return self.broken(format!("f({wi:?}, {wo:?}) = {ab:?}"));
            }
            if (ab - ba).abs() > self.reciprocity * ab.abs() {
                return self.broken(format!(
                    "f({wi:?}, {wo:?}) = {ab:?}, but {ba:?} the other way"
                ));
            }
        }
        Ok(())
    }

    /// Draws samples: returns their histogram, with a cell for samples below the surface, and the
    /// mean of f cos/pdf.
    fn draw(
        &self,
        wo: [f64; 3],
        eval: impl Fn([f64; 3], [f64; 3]) -> f64,
        sample: impl Fn([f64; 2], [f64; 3]) -> Option<[f64; 3]>,
        pdf: impl Fn([f64; 3], [f64; 3]) -> f64,
    ) -> Result<(Vec<u64>, Welford), Broken> {
        let mut observed = vec![0_u64; CELLS * CELLS + 1];
        let (mut mean, mut rng) = (Welford::new(), SplitMix64::new(self.seed));
        let locate = surface::hemisphere().locate;
        for _ in 0..self.samples {
            let u = [rng.next_f64(), rng.next_f64()];
            // Samples below the surface are counted, and reflect zero.
            let Some((wi, at)) = sample(u, wo).and_then(|w| Some((w, locate(w)?))) else {
                observed[CELLS * CELLS] += 1;
                mean.push(0.0);
                continue;
            };
            // Check and count a sample above the surface.
            let length = wi.iter().map(|x| x * x).sum::<f64>();
            let density = pdf(wi, wo);
            if (length - 1.0).abs() > 1e-9 || !(density > 0.0 && density.is_finite()) {
                return self.broken(format!("sample({u:?}) = {wi:?} has pdf {density:?}"));
            }
            observed[cell(at[0], CELLS) * CELLS + cell(at[1], CELLS)] += 1;
            mean.push(eval(wi, wo) * wi[2] / density);
        }
        Ok((observed, mean))
    }

    /// Returns the error of a broken law.
    fn broken<T>(&self, story: String) -> Result<T, Broken> {
        Err(Broken {
            message: format!("{} (seed {}): {story}", self.name, self.seed),
        })
    }
}

/// Returns the integrals over the cells of the hemisphere.
fn masses(f: impl Fn([f64; 3]) -> f64) -> Vec<f64> {
    let place = surface::hemisphere().place;
    let edge = |i: usize| i as f64 / CELLS as f64;
    let at = |turn: f64, z: f64| {
        let (w, measure) = place([turn, z]);
        f(w) * measure
    };
    (0..CELLS * CELLS)
        .map(|k| {
            let (i, j) = (k / CELLS, k % CELLS);
            let sides = [[edge(i), edge(i + 1)], [edge(j), edge(j + 1)]];
            cubature(at, sides[0], sides[1], CELL, DEPTH).value
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    type Vector = [f64; 3];

    fn cosine([u, v]: [f64; 2], _: Vector) -> Option<Vector> {
        let (r, turn) = (u.sqrt(), TAU * v);
        Some([r * turn.cos(), r * turn.sin(), (1.0 - u).sqrt()])
    }

    fn density(wi: Vector, _: Vector) -> f64 {
        wi[2].max(0.0) / PI
    }

    const WO: Vector = [0.6, 0.0, 0.8];

    fn story(eval: impl Fn(Vector, Vector) -> f64, pdf: impl Fn(Vector, Vector) -> f64) -> String {
        let broken = Bsdf::new("own").try_check(WO, eval, cosine, pdf);
        broken.unwrap_err().message
    }

    #[test]
    fn a_right_one_passes() {
        let tinted = |wi: Vector, wo: Vector| wi[2] * wo[2] / PI;
        // ∫ z² dω/π · 0.8 = 2/3 · 0.8.
        let found = Bsdf::new("own").check(WO, tinted, cosine, density);
        assert!((found.albedo - 1.6 / 3.0).abs() < 1e-6 && (found.drawn - 1.0).abs() < 1e-6);
    }

    #[test]
    fn each_law_can_be_broken() {
        let half = |_: Vector, _: Vector| 0.5 / PI;
        assert!(story(|wi, _| wi[2] / PI, density).contains("the other way"));
        assert!(story(|_, _| -0.1, density).contains("-0.1"));
        assert!(story(|_, _| 1.01 / PI, density).contains("more than"));
        assert!(story(half, |wi, _| 0.99 * density(wi, WO)).contains("∫ pdf"));
        // Normalised and 10 % off in shape.
        assert!(story(half, |wi, _| (0.1 + 1.8 * wi[2]) / TAU).contains("do not follow"));
        let below =
            |u, wo| cosine(u, wo).map(|[x, y, z]| if u[0] < 0.1 { [x, y, -z] } else { [x, y, z] });
        let broken = Bsdf::new("own")
            .try_check(WO, half, below, density)
            .unwrap_err();
        assert!(broken.message.contains("do not follow"), "{broken}");
        // Values that quadrature sees and samples do not.
        let hidden = |wi: Vector, _: Vector| if wi[2] < 0.5 { 0.5 / PI } else { 0.6 / PI };
        assert!(
            Bsdf::new("own")
                .reciprocity(f64::INFINITY)
                .try_check(WO, hidden, cosine, density)
                .is_ok()
        );
    }
}

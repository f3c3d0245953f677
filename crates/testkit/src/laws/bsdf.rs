//! The laws of a reflection.
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

use super::technique::cell;
use super::{Broken, surface};
use crate::chi2::{ChiSquare, chi2_test};
use crate::quadrature::cubature;
use crate::rng::SplitMix64;
use crate::ztest::{Welford, critical_z, z_score};

/// The laws of a reflection and of how it is drawn, above a surface with the normal (0, 0, 1): what
/// to check and how hard; build with [`Bsdf::new`] and the setters.
///
/// A reflection is three closures of unit vectors that lead away from the surface: `eval(wi, wo)`
/// its value in 1/sr, without the cosine; `sample(u, wo)` a direction wi, if any; `pdf(wi, wo)` its
/// density in 1/sr.
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

/// The measurements of a passing check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// ∫ f cos θ dω by quadrature: the share that is reflected.
    pub albedo: f64,
    /// ∫ pdf dω above the surface: below one by what is drawn beneath it.
    pub drawn: f64,
    /// The χ² test of the histogram of samples against the integrated pdf.
    pub chi2: ChiSquare,
    /// The z score of the mean of f cos θ/pdf against the albedo.
    pub z: f64,
}

/// Cells of the histogram, by the azimuth and by the cosine.
const CELLS: usize = 16;

/// Cells cut in half, and their halves again, so often at most: lobes about 2⁻¹⁰ of a cell.
const DEPTH: u32 = 10;

/// The absolute error of the integral over a cell.
const CELL: f64 = 2e-6;

impl Bsdf {
    /// Checks with 100 000 samples, α = 10⁻⁴ for each of its tests, seed 1, an albedo up to one,
    /// reciprocity to 10⁻⁸, and nothing drawn below the surface.
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

    /// Sets the number of samples to draw.
    #[must_use]
    pub fn samples(mut self, samples: usize) -> Self {
        self.samples = samples;
        self
    }

    /// The level of each statistical test; [`sidak`](crate::chi2::sidak) of it for several.
    #[must_use]
    pub fn alpha(mut self, alpha: f64) -> Self {
        self.alpha = alpha;
        self
    }

    /// The seed of the uniform numbers.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The largest albedo, of models that are known to reflect more than they get.
    #[must_use]
    pub fn most(mut self, albedo: f64) -> Self {
        self.most = albedo;
        self
    }

    /// The largest share that may be drawn below the surface, as microfacets do.
    #[must_use]
    pub fn lost(mut self, share: f64) -> Self {
        self.lost = share;
        self
    }

    /// The relative difference that f(wi, wo) and f(wo, wi) may have; infinite for models that are
    /// not reciprocal.
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

    /// Checks the laws as [`Bsdf::check`] does, returning the one that is broken.
    ///
    /// The laws: values are finite, not negative and the same the other way round; no more is
    /// reflected than arrives; the density integrates to one; samples are unit vectors with a
    /// positive density, which follow it by a χ² test; and the mean of f cos θ/pdf over them is the
    /// albedo by quadrature, by a z test, whose standard error cannot be trusted of lobes that are
    /// drawn by much too narrow a density.
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
        self.reciprocal(wo, &eval)?;
        let albedo: f64 = masses(|w| eval(w, wo) * w[2]).iter().sum();
        // As many cells, each to its own error.
        let error = (CELLS * CELLS) as f64 * CELL;
        if albedo.is_nan() || albedo > self.most + error {
            return self.broken(format!("it reflects {albedo:?}, more than {}", self.most));
        }
        let mut expected = masses(|w| pdf(w, wo));
        let drawn: f64 = expected.iter().sum();
        if !(1.0 - self.lost - error..=1.0 + error).contains(&drawn) {
            let lost = self.lost;
            return self.broken(format!(
                "∫ pdf = {drawn:?}, not 1 (or less by up to {lost})"
            ));
        }
        let (observed, mean) = self.draw(wo, eval, sample, pdf)?;
        expected.push((1.0 - drawn).max(0.0));
        for mass in &mut expected {
            *mass *= self.samples as f64;
        }
        let chi2 = chi2_test(&observed, &expected, 5.0);
        if chi2.p_value < self.alpha {
            return self.broken(format!("samples do not follow the pdf: {chi2:?}"));
        }
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

    /// The histogram of samples, with a cell for those below the surface, and f cos/pdf.
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
            let Some((wi, at)) = sample(u, wo).and_then(|w| Some((w, locate(w)?))) else {
                observed[CELLS * CELLS] += 1;
                mean.push(0.0);
                continue;
            };
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

    fn broken<T>(&self, story: String) -> Result<T, Broken> {
        Err(Broken {
            message: format!("{} (seed {}): {story}", self.name, self.seed),
        })
    }
}

/// Integrals over the cells of the hemisphere.
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

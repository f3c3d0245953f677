//! The four laws of a sampler in one call: its histogram follows its pdf, its pdf integrates to
//! one, its pdf is the inverse of the Jacobian of its samples, and the inverse of a sample returns
//! to the same sample.

use super::jacobian::{Off, densities};
use super::{Broken, Surface};
use crate::chi2::{ChiSquare, chi2_test};
use crate::quadrature::{gauss_kronrod, gauss_legendre};
use crate::rng::SplitMix64;
use std::cell::RefCell;

/// A check of the laws of a technique that draws numbers, points or directions; create it by
/// [`Technique::new`] and its setters.
///
/// A technique is three closures: `sample` maps uniform numbers in [0, 1) into the domain, `pdf` is
/// the density with respect to the domain's own measure (zero where no samples are drawn), `invert`
/// maps a point back to uniform numbers.
///
/// ```
/// use linelit_testkit::laws::{Technique, surface};
/// // p(x) = 2x on [0, 1].
/// Technique::new("ramp").check_1d([0.0, 1.0], |u| u.sqrt(), |x| 2.0 * x, |x| Some(x * x));
///
/// // Points of a triangle, uniform by area ½.
/// let triangle = surface::triangle([0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]);
/// let sample = |[u, v]: [f64; 2]| [v.sqrt(), u * v.sqrt(), 0.0];
/// let invert = |p: [f64; 3]| Some([p[1] / p[0], p[0] * p[0]]);
/// Technique::new("triangle").check_2d(&triangle, sample, |_| 2.0, invert);
/// // A density that forgets the half is no density.
/// let broken = Technique::new("triangle").try_2d(&triangle, sample, |_| 1.0, invert);
/// assert!(broken.unwrap_err().message.contains("not 1"));
/// ```
#[derive(Clone, Debug)]
pub struct Technique {
    name: String,
    samples: usize,
    bins: usize,
    alpha: f64,
    seed: u64,
    round_trip: f64,
    resolution: Option<f64>,
    mass: f64,
    kinks: Vec<f64>,
    cells: Vec<f64>,
    sure: f64,
    density: f64,
}

/// The measurements of a check that passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The χ² test of the histogram against the integrated pdf.
    pub chi2: ChiSquare,
    /// ∫ pdf over the domain.
    pub integral: f64,
    /// The error estimate of that integral.
    pub integral_error: f64,
    /// The largest error of a round trip, in the uniform number.
    pub round_trip: f64,
    /// The fraction of positions at which derivatives of samples were accurate enough to be
    /// compared with the pdf.
    pub sure: f64,
}

/// The largest error estimate of the integral of a pdf that is accepted; with a larger one, the
/// check fails.
const WORST_INTEGRAL_ERROR: f64 = 5e-3;

impl Technique {
    /// Creates a check with 100 000 samples, 64 bins, α = 10⁻⁴, seed 1, and round trips to 2⁻⁴⁰.
    ///
    /// The level is low because each run uses a fixed seed: a correct sampler fails with
    /// probability α once, when the test is written, and never after. Pass
    /// [`crate::chi2::sidak`]`(α, n)` when one test checks n configurations.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            samples: 100_000,
            bins: 64,
            alpha: 1e-4,
            seed: 1,
            round_trip: 2f64.powi(-40),
            resolution: None,
            mass: 1e-9,
            kinks: Vec::new(),
            cells: Vec::new(),
            sure: 0.2,
            density: 3e-7,
        }
    }

    /// Sets the number of samples.
    #[must_use]
    pub fn samples(mut self, samples: usize) -> Self {
        self.samples = samples;
        self
    }

    /// Sets the number of bins of equal width.
    #[must_use]
    pub fn bins(mut self, bins: usize) -> Self {
        self.bins = bins;
        self
    }

    /// Sets the level of the χ² test.
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

    /// Sets the allowed error of round trips, in the uniform number, if positions are exact (see
    /// [`Technique::resolution`]).
    #[must_use]
    pub fn round_trip(mut self, tolerance: f64) -> Self {
        self.round_trip = tolerance;
        self
    }

    /// Sets how far rounding moves a position in the domain; round trips may additionally be off by
    /// this distance times the pdf. The default is the tolerance of round trips times the domain's
    /// extent.
    #[must_use]
    pub fn resolution(mut self, distance: f64) -> Self {
        self.resolution = Some(distance);
        self
    }

    /// Sets how far the integral of the pdf may be from one, in addition to the quadrature's own
    /// error: 1e-9 by default.
    #[must_use]
    pub fn mass(mut self, tolerance: f64) -> Self {
        self.mass = tolerance;
        self
    }

    /// Sets how far the pdf may be from the derivatives of samples, as a fraction of the pdf: 3e-7
    /// by default. Techniques that find their samples to a tolerance need more.
    #[must_use]
    pub fn density(mut self, tolerance: f64) -> Self {
        self.density = tolerance;
        self
    }

    /// Sets the least fraction of positions at which derivatives of samples have to be accurate to
    /// 1e-8: by default a fifth. Set a lower one where rounding of positions, or corners of the
    /// pdf, leave fewer.
    #[must_use]
    pub fn sure(mut self, share: f64) -> Self {
        self.sure = share;
        self
    }

    /// Sets the positions where the pdf jumps or has a corner, at which the quadrature splits.
    #[must_use]
    pub fn kinks(mut self, places: &[f64]) -> Self {
        self.kinks = places.to_vec();
        self
    }

    /// Sets the borders of the bins, ascending from one end of the domain to the other, instead of
    /// bins of equal width.
    #[must_use]
    pub fn cells(mut self, borders: Vec<f64>) -> Self {
        self.cells = borders;
        self
    }

    /// Checks a sampler on the interval `domain`; see [`Technique::try_1d`].
    ///
    /// # Panics
    /// If a law is broken.
    pub fn check_1d(
        &self,
        domain: [f64; 2],
        sample: impl FnMut(f64) -> f64,
        pdf: impl FnMut(f64) -> f64,
        invert: impl FnMut(f64) -> Option<f64>,
    ) -> Report {
        self.try_1d(domain, sample, pdf, invert)
            .unwrap_or_else(|broken| panic!("{broken}"))
    }

    /// Checks the laws as [`Technique::check_1d`] does, and returns a broken one.
    ///
    /// The laws: every sample lies in the domain and has a positive, finite pdf; `invert` recovers
    /// its uniform number, to [`Technique::round_trip`] and [`Technique::resolution`] times the
    /// pdf; the histogram passes a χ² test against the pdf integrated over each bin, between its
    /// [`Technique::kinks`], to 1e-10; these integrals sum to one; and the pdf is, to 3e-7, the
    /// inverse of the derivative of the sample by its number, wherever differences are accurate
    /// enough.
    ///
    /// # Errors
    /// The first broken law.
    pub fn try_1d(
        &self,
        domain: [f64; 2],
        mut sample: impl FnMut(f64) -> f64,
        mut pdf: impl FnMut(f64) -> f64,
        mut invert: impl FnMut(f64) -> Option<f64>,
    ) -> Result<Report, Broken> {
        // Divide the domain into bins.
        let [low, high] = domain;
        let equal = |i: usize| low + (high - low) * (i as f64 / self.bins as f64);
        let borders = match self.cells.as_slice() {
            [] => (0..=self.bins).map(equal).collect(),
            told => told.to_vec(),
        };
        let bins = borders.len() - 1;
        // Draw samples, and invert each.
        let mut histogram = vec![0_u64; bins];
        let mut rng = SplitMix64::new(self.seed);
        let mut worst = 0.0_f64;
        for _ in 0..self.samples {
            let u = rng.next_f64();
            let x = sample(u);
            if !(low..=high).contains(&x) {
                return self.broken(format!(
                    "sample({u:?}) = {x:?} lies outside the domain {domain:?}"
                ));
            }
            histogram[borders[1..bins].partition_point(|b| *b <= x)] += 1;
            worst = worst.max(self.trip(u, x, pdf(x), invert(x), high - low)?);
        }
        // Check the integral of the pdf, and the histogram against it.
        let (masses, error) = self.masses(&borders, &mut pdf);
        let integral = masses.iter().sum();
        self.normalised(integral, error, self.mass)?;
        let expected: Vec<f64> = masses.iter().map(|m| m * self.samples as f64).collect();
        let chi2 = self.fits(&histogram, &expected, |i| {
            format!("{:.4}", 0.5 * (borders[i] + borders[i + 1]))
        })?;
        // Check the pdf against derivatives of the samples.
        let sure = self.spread({
            let places = RefCell::new(&mut sample);
            let draw = |u| (places.borrow_mut())(u);
            densities(
                self.density,
                |[u]: [f64; 1]| Some([draw(u)]),
                |[u]| pdf(draw(u)),
            )
        })?;
        Ok(Report {
            chi2,
            integral,
            integral_error: error,
            round_trip: worst,
            sure,
        })
    }

    /// Checks a technique on a surface; see [`Technique::try_2d`].
    ///
    /// # Panics
    /// If a law is broken.
    pub fn check_2d<P, L>(
        &self,
        surface: &Surface<P, L>,
        sample: impl FnMut([f64; 2]) -> [f64; 3],
        pdf: impl FnMut([f64; 3]) -> f64,
        invert: impl FnMut([f64; 3]) -> Option<[f64; 2]>,
    ) -> Report
    where
        P: Fn([f64; 2]) -> ([f64; 3], f64),
        L: Fn([f64; 3]) -> Option<[f64; 2]>,
    {
        self.try_2d(surface, sample, pdf, invert)
            .unwrap_or_else(|broken| panic!("{broken}"))
    }

    /// Checks the laws as [`Technique::check_2d`] does, and returns a broken one.
    ///
    /// The laws are the same as for [`Technique::try_1d`], with these differences. There are a
    /// quarter of its bins along each coordinate of the surface. The pdf is integrated over each
    /// bin by the Gauss–Legendre rule of 12 × 12 nodes, whose error is estimated by the difference
    /// from the rule of 8 × 8 nodes. Round trips are measured between points: the sample of a
    /// sample's inverse has to lie within [`Technique::resolution`] of the sample or, if that is
    /// not set, within [`Technique::round_trip`] times the surface's extent.
    ///
    /// # Errors
    /// The first broken law.
    pub fn try_2d<P, L>(
        &self,
        surface: &Surface<P, L>,
        mut sample: impl FnMut([f64; 2]) -> [f64; 3],
        mut pdf: impl FnMut([f64; 3]) -> f64,
        mut invert: impl FnMut([f64; 3]) -> Option<[f64; 2]>,
    ) -> Result<Report, Broken>
    where
        P: Fn([f64; 2]) -> ([f64; 3], f64),
        L: Fn([f64; 3]) -> Option<[f64; 2]>,
    {
        // Find the extent of the surface, and the allowed distance of round trips.
        let bins = (self.bins / 4).max(2);
        let corners =
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|c| (surface.place)(c).0);
        let extent = corners
            .iter()
            .map(|c| distance(*c, corners[0]))
            .fold(0.0, f64::max);
        let near = self.resolution.unwrap_or(self.round_trip * extent);
        // Draw samples, and invert each.
        let mut histogram = vec![0_u64; bins * bins];
        let mut rng = SplitMix64::new(self.seed);
        let mut worst = 0.0_f64;
        for _ in 0..self.samples {
            let u = [rng.next_f64(), rng.next_f64()];
            let p = sample(u);
            let Some(at) = (surface.locate)(p) else {
                return self.broken(format!("sample({u:?}) = {p:?} lies beside the surface"));
            };
            histogram[cell(at[0], bins) * bins + cell(at[1], bins)] += 1;
            let density = pdf(p);
            if density <= 0.0 || !density.is_finite() {
                return self.broken(format!("sample({u:?}) = {p:?} has pdf {density:?}"));
            }
            let Some(back) = invert(p) else {
                return self.broken(format!("invert({p:?}) finds nothing, yet it was sampled"));
            };
            let error = distance(sample(back), p);
            if error.is_nan() || error > near {
                return self.broken(format!(
                    "sample(invert({p:?}) = {back:?}) is off by {error:.1e}, more than {near:.1e}"
                ));
            }
            worst = worst.max(error);
        }
        // Check the integral of the pdf, and the histogram against it.
        let (masses, error) = masses_2d(surface, bins, &mut pdf);
        let integral = masses.iter().sum();
        self.normalised(integral, error, self.mass)?;
        let expected: Vec<f64> = masses.iter().map(|m| m * self.samples as f64).collect();
        let middle = |i: usize| (i as f64 + 0.5) / bins as f64;
        let chi2 = self.fits(&histogram, &expected, |i| {
            let (p, _) = (surface.place)([middle(i / bins), middle(i % bins)]);
            format!("{p:.4?}")
        })?;
        // Check the pdf against derivatives of the samples.
        let sure = self.spread_2d(surface, &mut sample, &mut pdf)?;
        Ok(Report {
            chi2,
            integral,
            integral_error: error,
            round_trip: worst,
            sure,
        })
    }

    /// Compares the pdf with derivatives of samples on a surface.
    fn spread_2d<P, L>(
        &self,
        surface: &Surface<P, L>,
        sample: impl FnMut([f64; 2]) -> [f64; 3],
        mut pdf: impl FnMut([f64; 3]) -> f64,
    ) -> Result<f64, Broken>
    where
        P: Fn([f64; 2]) -> ([f64; 3], f64),
        L: Fn([f64; 3]) -> Option<[f64; 2]>,
    {
        let sample = RefCell::new(sample);
        let draw = |u| (sample.borrow_mut())(u);
        self.spread(densities(
            self.density,
            |u| (surface.locate)(draw(u)),
            |u| {
                let p = draw(u);
                let at = (surface.locate)(p).unwrap_or([f64::NAN; 2]);
                pdf(p) * (surface.place)(at).1
            },
        ))
    }

    /// Turns the result of the comparison of the pdf with derivatives of samples into that of a
    /// law.
    fn spread(&self, found: Result<f64, Off>) -> Result<f64, Broken> {
        match found {
            Err(Off { at, product }) => self.broken(format!(
                "pdf(sample({at:?})) times the measure that samples spread over there is \
                 {product:?}, not 1"
            )),
            Ok(share) if share < self.sure => self.broken(format!(
                "the pdf is held by differences at a share {share:.2} of places alone"
            )),
            Ok(share) => Ok(share),
        }
    }

    /// Returns the distance of the inverse of a sample from the sample's random number.
    fn trip(
        &self,
        u: f64,
        x: f64,
        density: f64,
        back: Option<f64>,
        extent: f64,
    ) -> Result<f64, Broken> {
        if density <= 0.0 || !density.is_finite() {
            return self.broken(format!("sample({u:?}) = {x:?} has pdf {density:?}"));
        }
        let Some(back) = back else {
            return self.broken(format!("invert({x:?}) finds nothing, yet it was sampled"));
        };
        let resolution = self.resolution.unwrap_or(self.round_trip * extent);
        let allowed = self.round_trip + resolution * density;
        let error = (back - u).abs();
        if error > allowed || !(0.0..=1.0).contains(&back) {
            return self.broken(format!(
                "invert(sample({u:?}) = {x:?}) = {back:?}, off by more than {allowed:.1e}"
            ));
        }
        Ok(error)
    }

    /// Returns the integrals of the pdf over the bins, and the sum of their estimated errors.
    fn masses(&self, borders: &[f64], mut pdf: impl FnMut(f64) -> f64) -> (Vec<f64>, f64) {
        let mut error = 0.0;
        let mass = |bin: &[f64]| {
            let mut cuts = bin.to_vec();
            let inside = |k: &&f64| **k > bin[0] && **k < bin[1];
            cuts.extend(self.kinks.iter().filter(inside));
            cuts.sort_by(f64::total_cmp);
            let part = |cut: &[f64]| {
                let part = gauss_kronrod(&mut pdf, cut[0], cut[1], 1e-10);
                error += part.error;
                part.value
            };
            cuts.windows(2).map(part).sum()
        };
        (borders.windows(2).map(mass).collect(), error)
    }

    /// Tests counts against the expectations from the pdf; `place` describes a cell.
    fn fits(
        &self,
        histogram: &[u64],
        expected: &[f64],
        place: impl Fn(usize) -> String,
    ) -> Result<ChiSquare, Broken> {
        let chi2 = chi2_test(histogram, expected, 5.0);
        if chi2.p_value >= self.alpha {
            return Ok(chi2);
        }
        // Name the three cells that deviate the most.
        let excess =
            |i: usize| (histogram[i] as f64 - expected[i]).powi(2) / expected[i].max(1e-300);
        let mut order: Vec<usize> = (0..expected.len()).collect();
        order.sort_by(|&i, &j| excess(j).total_cmp(&excess(i)));
        let words = order.iter().take(3).map(|&i| {
            let (seen, wanted) = (histogram[i], expected[i]);
            format!("near {}: {seen} seen, {wanted:.1} expected", place(i))
        });
        self.broken(format!(
            "the histogram of {} samples does not follow the pdf: {chi2:?}, α = {:.1e}; worst cells: {}",
            self.samples,
            self.alpha,
            words.collect::<Vec<_>>().join("; ")
        ))
    }

    /// Checks that the integral of the pdf is one.
    fn normalised(&self, integral: f64, error: f64, rounding: f64) -> Result<(), Broken> {
        if !integral.is_finite() || error > WORST_INTEGRAL_ERROR {
            return self.broken(format!(
                "∫ pdf = {integral:?} cannot be computed well enough (± {error:.1e})"
            ));
        }
        if (integral - 1.0).abs() > error + rounding {
            return self.broken(format!("∫ pdf = {integral:?} ± {error:.1e}, not 1"));
        }
        Ok(())
    }

    /// Returns the error of a broken law.
    fn broken<T>(&self, story: String) -> Result<T, Broken> {
        Err(Broken {
            message: format!("{} (seed {}): {story}", self.name, self.seed),
        })
    }
}

/// Returns the distance of two points.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let square = |k: usize| (a[k] - b[k]).powi(2);
    (square(0) + square(1) + square(2)).sqrt()
}

/// Returns the cell of a number in [0, 1].
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a number of cells"
)]
pub(super) fn cell(at: f64, cells: usize) -> usize {
    ((at * cells as f64) as usize).min(cells - 1)
}

/// Returns the integrals of a density over the cells of a surface, split at its seams, and the sum
/// of their estimated errors.
pub(super) fn masses_2d<P, L>(
    surface: &Surface<P, L>,
    bins: usize,
    mut pdf: impl FnMut([f64; 3]) -> f64,
) -> (Vec<f64>, f64)
where
    P: Fn([f64; 2]) -> ([f64; 3], f64),
{
    // Integrate by a fine and a coarse rule, whose difference is the error.
    let rules = [gauss_legendre(12), gauss_legendre(8)];
    let edge = |i: usize| i as f64 / bins as f64;
    let mut density = |s: f64, t: f64| {
        let (p, measure) = (surface.place)([s, t]);
        pdf(p) * measure
    };
    let (mut masses, mut error) = (Vec::with_capacity(bins * bins), 0.0);
    for i in 0..bins {
        // Split the cells of a column at the seams.
        let mut cuts = vec![edge(i), edge(i + 1)];
        let inside = |s: &&f64| **s > edge(i) && **s < edge(i + 1);
        cuts.extend(surface.seams.iter().filter(inside));
        cuts.sort_by(f64::total_cmp);
        for j in 0..bins {
            let side = [edge(j), edge(j + 1)];
            let [fine, coarse] = rules.each_ref().map(|rule| {
                let part = |c: &[f64]| rule.integrate_2d([c[0], c[1]], side, &mut density);
                cuts.windows(2).map(part).sum::<f64>()
            });
            masses.push(fine);
            error += (fine - coarse).abs();
        }
    }
    (masses, error)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Technique {
        Technique::new("ramp").samples(50_000)
    }

    #[test]
    fn a_correct_ramp_passes() {
        let report = ramp().check_1d([0.0, 1.0], f64::sqrt, |x| 2.0 * x, |x| Some(x * x));
        assert!((report.integral - 1.0).abs() < 1e-12);
        assert_eq!(report.chi2.dof, 63);
    }

    #[test]
    fn wrong_pdf_is_seen() {
        // Normalised, positive, but 10 % off in shape.
        let broken = ramp()
            .try_1d([0.0, 1.0], f64::sqrt, |x| 0.2 + 1.6 * x, |x| Some(x * x))
            .unwrap_err();
        assert!(broken.message.contains("does not follow"), "{broken}");
    }

    #[test]
    fn unnormalised_pdf_is_seen() {
        let broken = ramp()
            .try_1d([0.0, 1.0], f64::sqrt, |x| 2.001 * x, |x| Some(x * x))
            .unwrap_err();
        assert!(broken.message.contains("not 1"), "{broken}");
    }

    #[test]
    fn wrong_or_missing_inverse_is_seen() {
        let broken = ramp()
            .try_1d(
                [0.0, 1.0],
                f64::sqrt,
                |x| 2.0 * x,
                |x| Some(x * x * (1.0 - 1e-9)),
            )
            .unwrap_err();
        assert!(broken.message.contains("off by"), "{broken}");
        let broken = ramp()
            .try_1d([0.0, 1.0], |u| u, |_| 1.0, |_| None)
            .unwrap_err();
        assert!(broken.message.contains("finds nothing"), "{broken}");
    }

    #[test]
    fn stray_samples_are_seen() {
        let broken = ramp()
            .try_1d([0.0, 1.0], |u| 1.1 * u, |_| 1.0, |x| Some(x / 1.1))
            .unwrap_err();
        assert!(broken.message.contains("outside"), "{broken}");
        let broken = ramp()
            .try_1d([0.0, 1.0], |u| u, |x| f64::from(x > 0.01), Some)
            .unwrap_err();
        assert!(broken.message.contains("has pdf 0"), "{broken}");
    }

    #[test]
    fn false_alarms_are_as_rare_as_alpha_says() {
        let mut alarms = 0;
        for seed in 0..200 {
            let laws = Technique::new("uniform")
                .samples(2000)
                .alpha(0.05)
                .seed(seed);
            alarms += u32::from(laws.try_1d([0.0, 1.0], |u| u, |_| 1.0, Some).is_err());
        }
        // Binomial(200, 0.05): mean 10, standard deviation 3.1; five of them.
        assert!((1..=25).contains(&alarms), "{alarms} alarms");
    }
}

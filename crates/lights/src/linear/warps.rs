//! Baselines: clipped solid angle sampling with the cosine approximated in primary sample space.
//!
//! Hart, Pharr, Müller, Lopes, McGuire & Shirley 2020, "Practical product sampling by fitting and
//! composing warps": the random number is warped by a density that is linear or quadratic and
//! interpolates the cosine at the ends (and the middle), then handed to the solid-angle technique.
//! Peters 2021, Fig. 6e–f compares against them.

use super::view::LineView;
use crate::linear::numbers::Bounds;
use crate::pieces::sample_linear;
use linelit_geometry::finite::fraction;

/// A density on [0, 1] in Bernstein form of degree 2, coefficients ≥ 0: linear where the middle one
/// is the mean.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Warp {
    b: [f64; 3],
    linear: bool,
}

impl Warp {
    /// The density that runs linearly between the cosines at the ends. `None` if both vanish.
    pub(crate) fn linear(view: &LineView) -> Option<Self> {
        let [c0, c1] = view.end_cosines();
        (c0 + c1).is_usable().then_some(Self {
            b: [c0, 0.5 * (c0 + c1), c1],
            linear: true,
        })
    }

    /// The density that interpolates the cosine at both ends and in the middle of the solid angle.
    /// A negative Bernstein coefficient (the parabola dipping below zero near a grazing end) is
    /// raised to zero, which keeps the density positive inside.
    pub(crate) fn quadratic(view: &LineView) -> Option<Self> {
        let [c0, c1] = view.end_cosines();
        let middle = view.sample_solid_angle(0.5).lambda;
        let m = view.cosine(middle);
        let b1 = (2.0 * m - 0.5 * (c0 + c1)).max(0.0);
        (c0 + c1 + b1).is_usable().then_some(Self {
            b: [c0, b1, c1],
            linear: false,
        })
    }

    fn total(&self) -> f64 {
        self.b[0] + self.b[1] + self.b[2]
    }

    /// Normalised density.
    pub(crate) fn pdf(&self, t: f64) -> f64 {
        let s = 1.0 - t;
        let [b0, b1, b2] = self.b;
        3.0 * (b0 * s * s + 2.0 * b1 * s * t + b2 * t * t) / self.total()
    }

    pub(crate) fn cdf(&self, t: f64) -> f64 {
        let s = 1.0 - t;
        let total = self.total();
        // The CDF in Bernstein form of degree 3: coefficients 0, b0, b0 + b1, b0 + b1 + b2.
        let [b0, b1, _] = self.b;
        (t * (3.0 * s * s * b0 + t * (3.0 * s * (b0 + b1) + t * total)) / total).clamp(0.0, 1.0)
    }

    /// The warped number. Quadratic: Newton's method on the cubic CDF, kept in a bracket, to 4 ε.
    pub(crate) fn sample(&self, xi: f64) -> f64 {
        let xi = fraction(xi);
        let start = sample_linear(xi, self.b[0], self.b[2]);
        if self.linear {
            return start;
        }
        let close = 4.0 * f64::EPSILON * xi.at_most(1.0 - xi).at_least(f64::EPSILON);
        let mut bracket = [0.0, 1.0];
        let mut t = start;
        for _ in 0..60 {
            let excess = self.cdf(t) - xi;
            if excess.abs() <= close {
                break;
            }
            // By index: a branch on which end moves would be mispredicted.
            bracket[usize::from(excess > 0.0)] = t;
            let [lo, hi] = bracket;
            let next = t - excess / self.pdf(t);
            let inside = next > lo && next < hi;
            let step = if inside { next } else { 0.5 * (lo + hi) };
            if (step - t).abs() <= f64::EPSILON * t {
                break;
            }
            t = step;
        }
        t
    }
}

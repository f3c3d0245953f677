//! This module holds baselines for comparison: clipped solid-angle sampling with the cosine
//! approximated in primary sample space.
//!
//! In Hart, Pharr, Müller, Lopes, McGuire & Shirley 2020, "Practical product sampling by fitting
//! and composing warps", the random number is warped by a linear or quadratic density that
//! interpolates the cosine at the ends (and in the middle), and is then passed to the solid-angle
//! technique. Peters 2021, Fig. 6e–f, compares with them.

use super::view::LineView;
use crate::linear::numbers::Bounds;
use crate::pieces::sample_linear;
use linelit_geometry::finite::fraction;

/// A density on [0, 1] in Bernstein form of degree 2 with coefficients ≥ 0; it is linear if the
/// middle one is the mean of the others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Warp {
    b: [f64; 3],
    linear: bool,
}

impl Warp {
    /// Returns the density that is linear between the cosines at the ends; `None` if both are zero.
    pub(crate) fn linear(view: &LineView) -> Option<Self> {
        let [c0, c1] = view.end_cosines();
        (c0 + c1).is_usable().then_some(Self {
            b: [c0, 0.5 * (c0 + c1), c1],
            linear: true,
        })
    }

    /// Returns the density that interpolates the cosine at both ends and in the middle of the solid
    /// angle. A negative Bernstein coefficient, for a parabola that would dip below zero near a
    /// grazing end, is raised to zero, which keeps the density positive inside.
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

    /// Returns the normalised density.
    pub(crate) fn pdf(&self, t: f64) -> f64 {
        let s = 1.0 - t;
        let [b0, b1, b2] = self.b;
        3.0 * (b0 * s * s + 2.0 * b1 * s * t + b2 * t * t) / self.total()
    }

    /// Returns the CDF at `t`.
    pub(crate) fn cdf(&self, t: f64) -> f64 {
        let s = 1.0 - t;
        let total = self.total();
        // Write the CDF in Bernstein form of degree 3: coefficients 0, b0, b0 + b1, b0 + b1 + b2.
        let [b0, b1, _] = self.b;
        (t * (3.0 * s * s * b0 + t * (3.0 * s * (b0 + b1) + t * total)) / total).clamp(0.0, 1.0)
    }

    /// Returns the warped number: in closed form for a linear density, and by Newton's method on
    /// the cubic CDF, within a bracket and to 4 ε, for a quadratic one.
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
            // Choose the end by index: a branch on which end moves would be mispredicted.
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

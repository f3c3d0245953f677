//! This module holds a baseline for comparison: projected solid angle by Newton's method with
//! bisection (Li, Aittala, Durand & Lehtinen 2018, §5.2).
//!
//! Their renderer samples edges by the antiderivative of the cosine along the line. It inverts it
//! by Newton's method in the line coordinate, with a bisection when a step leaves the bracket.
//! Peters 2021 compares with it (Table 1, Fig. 6g). Differences of the antiderivative cancel for
//! lines that are short, distant or nearly collinear with the shading point, until no digits are
//! left; the baseline keeps this weakness, for the comparison. The tolerance is the backward error
//! of Peters' two steps, so that costs are compared at equal accuracy.

use super::view::LineView;
use linelit_elementary::atan;
use linelit_geometry::DVec3;
use linelit_geometry::finite::fraction;

/// Iterations end when the error of the CDF, which is in [0, 1], is below this number.
const TOLERANCE: f64 = 1.58e-5;
/// Iterations end after this many steps at the latest. (The 20 of Li et al. are too few for a line
/// 1e5 times as long as its distance: the error is then 3e-4.)
const MOST: u32 = 60;

/// The line in its own coordinates: s along it, from the point closest to the shading point, which
/// is at the distance h. The cosine is (a + b s)/r.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineIntegral {
    h: f64,
    a: f64,
    b: f64,
    s0: f64,
    s1: f64,
    f0: f64,
    total: f64,
}

impl LineIntegral {
    /// Sets the integral up; `None` if it is not a positive number.
    pub(crate) fn new(view: &LineView, normal: DVec3) -> Option<Self> {
        let (p0, p1) = view.ends();
        let d = (p1 - p0).try_normalize()?;
        let (s0, s1) = (p0.dot(d), p1.dot(d));
        let q = p0 - d * s0;
        let mut out = Self {
            h: view.line_distance(),
            a: normal.dot(q),
            b: normal.dot(d),
            s0,
            s1,
            f0: 0.0,
            total: 0.0,
        };
        out.f0 = out.antiderivative(s0);
        out.total = out.antiderivative(s1) - out.f0;
        (out.total > 0.0 && out.projected_solid_angle().is_finite()).then_some(out)
    }

    /// Returns ∫ (a + b s) h/(h² + s²)² ds.
    fn antiderivative(&self, s: f64) -> f64 {
        let h = self.h;
        let r2 = h * h + s * s;
        self.a * (s / (2.0 * h * r2) + atan(s / h) / (2.0 * h * h)) - self.b * h / (2.0 * r2)
    }

    /// Returns the projected solid angle per radius: twice the integral.
    pub(crate) fn projected_solid_angle(&self) -> f64 {
        2.0 * self.total
    }

    /// Returns the fraction of the mass below a position on the clipped line.
    pub(crate) fn cdf(&self, lambda: f64) -> f64 {
        let s = self.s0 + (self.s1 - self.s0) * lambda;
        (self.antiderivative(s) - self.f0) / self.total
    }

    /// Returns the position on the clipped line below which the fraction `xi` of the mass lies.
    pub(crate) fn sample(&self, xi: f64) -> f64 {
        let xi = fraction(xi);
        let (mut lo, mut hi) = (self.s0, self.s1);
        let mut s = 0.5 * (lo + hi);
        for _ in 0..MOST {
            if !(s >= lo && s <= hi) {
                s = 0.5 * (lo + hi);
            }
            let excess = (self.antiderivative(s) - self.f0) / self.total - xi;
            if excess.abs() < TOLERANCE {
                break;
            }
            if excess > 0.0 {
                hi = s;
            } else {
                lo = s;
            }
            let r2 = self.h * self.h + s * s;
            let slope = (self.a + self.b * s) * self.h / (r2 * r2) / self.total;
            s -= excess / slope;
        }
        fraction((s - self.s0) / (self.s1 - self.s0))
    }
}

//! This module computes the solid angle of the part of a rectangle before a line parallel to an
//! edge, and inverts it, in closed form: it draws the offset of a line without iteration.
//!
//! Ureña et al. 2013 ("An area-preserving parametrization for spherical rectangles") add up the
//! four angles of the spherical rectangle; for a small or distant rectangle all digits cancel. Here
//! every quantity is measured from the line that is farther from the shading point's foot, and the
//! terms of each sum have one sign. The rectangle spans y₀ to y₁ along its lines at the height z; u
//! is the offset from the foot, mirrored so that the farther line has u₁ > 0:
//!
//! ```text
//!         y
//!      y₁ ├ · · ┌─────────┬────────┐
//!         │     │         │ δ = ξΩ │    Θ(u): the solid angle from the foot, u = 0, to the line u.
//!      y₀ ├ · · └─────────┴────────┘    sin Θ = u e(u)/z,  e(u) = (z/h)² (r₀/q₀)(r₁/q₁) η(u)
//!         └─────┼─────────┼────────┼ u  h, rᵢ, qᵢ: distances of (u, 0), (u, yᵢ) and (0, yᵢ);
//!         foot  u₀        u        u₁   η: the span of sin φ along the line.
//! ```
//!
//! With Θ = asin(k₁ s) − asin(k₀ s), s = u/h and kᵢ = yᵢ/qᵢ (each an angle of a corner's
//! rectangle), s is a fraction of sin Θ and cos Θ alone, and of two lines, P = cos Θ − cos Θ₁ ≥ 0,
//!
//! ```text
//! e² = e₁² + P (b + P)                 b = 2 (z/h₁)² (r₀ r₁ − y₀ y₁)/(q₀ q₁)   at u₁
//! u₁² − u² = h₁² P (2 G + P)/e²        G = (z/h₁)² (r₀/q₀)(r₁/q₁)
//! P = 2 sin(δ/2) sin(Θ₁ − δ/2)         δ = Θ₁ − Θ
//! ```
//!
//! from which u₁ − u follows for a given δ, and δ, by its tangent, for a given u.

use crate::line::piece::Line;
use linelit_elementary::atan2;
use linelit_geometry::ParallelLines;
use linelit_geometry::finite::fraction;
use linelit_simd::{One, sine};

/// A polygon counts as a rectangle if it deviates from one by at most this fraction of its sides:
/// its corners may be rounded to ε of coordinates a thousand times as large. The solid angle is
/// then the polygon's to 1e-12. The density of offsets is the density of the rectangle's lines, and
/// exact for any deviation.
const ROUNDED: f64 = 1e-12;

/// A rectangle whose lines are parallel to an edge, seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    /// The line at the first offset, relative to the foot; other lines differ by their offset only.
    first: Line,
    width: f64,
    z: f64,
    /// The distances qᵢ from the shading point to the ends of a line at the offset 0.
    q: [f64; 2],
    /// Whether the line farther from the foot is the first one.
    is_reversed: bool,
    far: Cut,
    b: f64,
    whole: f64,
}

/// The quantities at one line from which the solid angle is computed.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// The offset, mirrored if the far line is the first one.
    u: f64,
    h: f64,
    g: f64,
    e: f64,
    sin: f64,
    cos: f64,
    /// The quotient of r₀² + y₁² and r₀ r₁ + y₀ y₁.
    beyond: f64,
}

impl Rectangle {
    /// Sets up the rectangle that the lines cover at the height `z`. `None` if they cover another
    /// shape, or if its solid angle is not a positive number.
    pub(crate) fn new(lines: &ParallelLines, foot: (f64, f64), z: f64) -> Option<Self> {
        let ([lo, hi], [from, to]) = sides(lines)?;
        let y = [lo - foot.1, lo - foot.1 + (hi - lo)];
        let first = Line {
            u: from - foot.0,
            lo: y[0],
            hi: y[1],
            length: hi - lo,
        };
        let width = to - from;
        let last = first.u + width;
        let is_reversed = first.u.abs() > last.abs();
        let (far, near) = if is_reversed {
            (-first.u, -last)
        } else {
            (last, first.u)
        };
        let q = y.map(|y| (y * y + z * z).sqrt());
        let far = Cut::new(&first, q, z, far);
        // Compute b from terms of one sign: r₀ r₁ − y₀ y₁ = h² (r₀² + y₁²)/(r₀ r₁ + y₀ y₁).
        let (k, tilt) = ((y[0] / q[0]) * (y[1] / q[1]), z / far.h);
        let b = if k > 0.0 {
            2.0 * (z / q[0]) * (z / q[1]) * far.beyond
        } else {
            2.0 * (far.g - k * tilt * tilt)
        };
        let mut out = Self {
            first,
            width,
            z,
            q,
            is_reversed,
            far,
            b,
            whole: 0.0,
        };
        out.whole = out.beyond(near, width);
        (out.whole > 0.0 && out.whole.is_finite()).then_some(out)
    }

    /// Returns the solid angle of the rectangle in sr.
    pub(crate) fn solid_angle(&self) -> f64 {
        self.whole
    }

    /// Returns the line of the rectangle at the offset `u` from the shading point's foot in the
    /// light's plane. All lines have the same ends.
    pub(crate) fn line(&self, u: f64) -> Line {
        Line { u, ..self.first }
    }

    /// Returns the solid angle of the part of the rectangle between its far line and the line at
    /// the offset `u`, mirrored so that the far line has a positive offset. `step` is the distance
    /// between the two lines, which has more digits than the difference of the offsets.
    fn beyond(&self, u: f64, step: f64) -> f64 {
        let far = &self.far;
        let cut = Cut::new(&self.first, self.q, self.z, u);
        // Compute P from u by the root of its quadratic that has no subtraction.
        let d = (step / far.h) * ((far.u + u) / far.h) * (cut.e * cut.e);
        let p = d / (far.g + (far.g * far.g + d).sqrt());
        // tan δ/2 is P over the sum of the sines, or the difference of the sines over the sum of
        // the cosines.
        let (sum, difference) = (far.sin + cut.sin, far.sin - cut.sin);
        2.0 * if u > 0.0 || p > difference {
            atan2(p, sum)
        } else {
            atan2(difference, far.cos + cut.cos)
        }
    }

    /// Returns the fraction of the width before the line that has the fraction `place` of the solid
    /// angle before it.
    pub(crate) fn find(&self, place: f64) -> f64 {
        let share = if self.is_reversed { place } else { 1.0 - place };
        // Compute sine and cosine of δ/2 from those of δ/4, where δ is the angle from the far line.
        let quarter = sine(One, 0.25 * self.whole * share);
        let rest = ((1.0 - quarter) * (1.0 + quarter)).sqrt();
        let (s, c) = (2.0 * quarter * rest, 1.0 - 2.0 * quarter * quarter);
        // Rotate Θ₁ back by δ/2 to the middle, and by δ/2 again to Θ.
        let far = &self.far;
        let middle = [far.sin * c - far.cos * s, far.cos * c + far.sin * s];
        let sin = middle[0] * c - middle[1] * s;
        let p = 2.0 * s * middle[0].max(0.0);
        let square = far.e * far.e + p * (self.b + p);
        let u = self.z * sin / square.sqrt();
        // If the foot is before the line, u₁ − u is computed as the difference of squares over the
        // sum; otherwise it is a sum.
        let step = if u > 0.0 {
            p * (2.0 * far.g + p) / square * (far.h / (far.u + u)) * far.h
        } else {
            far.u - u
        };
        self.turned_around(fraction(step / self.width))
    }

    /// Returns the fraction of the solid angle before the line at the fraction `s` of the width.
    pub(crate) fn place(&self, s: f64) -> f64 {
        let step = self.width * self.turned_around(s);
        self.turned_around(fraction(self.beyond(self.far.u - step, step) / self.whole))
    }

    /// Converts a fraction that counts from the far line to one that counts from the first line,
    /// and back.
    fn turned_around(&self, s: f64) -> f64 {
        if self.is_reversed { s } else { 1.0 - s }
    }
}

impl Cut {
    /// Computes the quantities at the line with the offset `u`.
    fn new(first: &Line, [q0, q1]: [f64; 2], z: f64, u: f64) -> Self {
        let line = Line { u, ..*first };
        let (y0, y1) = (line.lo, line.hi);
        let square = u * u + z * z;
        let h = square.sqrt();
        let (r0, r1) = ((y0 * y0 + square).sqrt(), (y1 * y1 + square).sqrt());
        let (tilt, across) = (z / h, u / h);
        let ratio = (r0 / q0) * (r1 / q1);
        let g = ratio * (tilt * tilt);
        let slope = line.sine_range(z) * ratio * tilt;
        Self {
            u,
            h,
            g,
            e: slope * tilt,
            sin: slope * across,
            cos: g + (y0 / q0) * (y1 / q1) * (across * across),
            beyond: (r0 * r0 + y1 * y1) / (r0 * r1 + y0 * y1),
        }
    }
}

/// Returns the ends of the lines and the range of their offsets if the lines cover a rectangle.
fn sides(lines: &ParallelLines) -> Option<([f64; 2], [f64; 2])> {
    let (u, lo, hi) = (lines.knots(), lines.lower(), lines.upper());
    let (from, to) = lines.range();
    // Two corners of one side that are rounded apart cut a sliver off that end: skip it.
    let sliver = ROUNDED * (to - from);
    let first = u.iter().rposition(|u| u - from <= sliver)?;
    let last = u.iter().position(|u| to - u <= sliver)?;
    let (l, h) = (lo[first], hi[first]);
    let slack = ROUNDED * (h - l);
    let is_even = |k: usize| (lo[k] - l).abs() <= slack && (hi[k] - h).abs() <= slack;
    (first < last && slack > 0.0 && (first..=last).all(is_even)).then_some(([l, h], [from, to]))
}

//! This module holds a piece of a light between the parallel lines through two neighbouring
//! vertices, in coordinates about the shading point's foot in the light's plane.

use crate::line::trapezoid::Trapezoid;
use linelit_elementary::{atan2, hypot, sin};
use linelit_geometry::DVec3;
use linelit_geometry::finite::fraction;

/// The largest |sin φ| at an end of a line whose points [`Line::fraction_at`] finds, where φ is the
/// angle of the end from the line's point that is closest to the shading point. Beyond it the
/// rounding of sin φ is amplified more than 32 times in cos φ.
const OBLIQUE: f64 = 0.984;

/// A piece between neighbouring knots: its first line relative to the foot, and the differences to
/// its last line, which were formed before the foot was subtracted.
///
/// With `CLOSE`, near the light's plane, the line nearer to the foot comes first, and the width is
/// negative if this line has the larger offset.
#[derive(Clone, Copy)]
pub(crate) struct Piece<const CLOSE: bool> {
    pub(crate) first: Line,
    /// The changes of the offset and of both ends over the piece.
    pub(crate) width: f64,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

/// A line relative to the foot of the shading point: its offset, beginning, end and length. These
/// numbers are redundant because near the light's plane each is more accurate than its value
/// computed from the others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) u: f64,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
    pub(crate) length: f64,
}

impl Line {
    /// Returns the square of the line's distance from the foot.
    pub(crate) fn square(&self) -> f64 {
        let v = self.lo.max(-self.hi).max(0.0);
        self.u * self.u + v * v
    }

    /// Returns the range of sin φ along the line in a plane at the height `z`: half its solid angle
    /// per radius, times its distance. The formula is the one of
    /// [`crate::linear::LineView::solid_angle`].
    #[inline(always)]
    pub(crate) fn sine_range(&self, z: f64) -> f64 {
        let (y0, y1) = (self.lo, self.hi);
        let h2 = self.u * self.u + z * z;
        let (r0, r1) = ((y0 * y0 + h2).sqrt(), (y1 * y1 + h2).sqrt());
        let (dot, product) = (y0 * y1 + h2, r0 * r1);
        if dot > 0.0 {
            h2 / product * (self.length / (product + dot)) * (r0 + r1)
        } else {
            y1 / r1 - y0 / r0
        }
    }

    /// Returns the position on the line, as a fraction of its length, before which the fraction
    /// `place` of the line's solid angle lies, to some 32 ε; `None` for a line that is seen too
    /// obliquely for that (see [`OBLIQUE`]).
    ///
    /// From the first end to the point sin φ grows by a share of its span, d, and with c the
    /// cosines y grows by
    ///
    /// ```text
    /// y − y₀ = h d/(c₀ c) √((1 + c₀ c + s₀ s)/(1 + c₀ c − s₀ s))
    /// ```
    ///
    /// in which nothing cancels between |s| = 1/√2 and its negative, and little up to [`OBLIQUE`].
    #[inline(always)]
    pub(crate) fn fraction_at(&self, z: f64, place: f64) -> Option<f64> {
        let (y0, y1) = (self.lo, self.hi);
        let h2 = self.u * self.u + z * z;
        let (r0, r1) = ((y0 * y0 + h2).sqrt(), (y1 * y1 + h2).sqrt());
        let (s0, s1) = (y0 / r0, y1 / r1);
        if s0.abs().max(s1.abs()) > OBLIQUE {
            return None;
        }
        let (h, d) = (h2.sqrt(), place * self.sine_range(z));
        let (c0, s) = (h / r0, s0 + d);
        let c = ((1.0 - s) * (1.0 + s)).sqrt();
        let (even, odd) = (1.0 + c0 * c, s0 * s);
        let step = h * d / (c0 * c) * ((even + odd) / (even - odd)).sqrt();
        Some(fraction(step / self.length))
    }
}

impl<const CLOSE: bool> Piece<CLOSE> {
    /// Returns the same piece with its last line, `last`, as the first one.
    pub(crate) fn reversed(self, last: Line) -> Self {
        Self {
            first: last,
            width: -self.width,
            lower: -self.lower,
            upper: -self.upper,
        }
    }

    /// Whether the first line is the one with the larger offset.
    pub(crate) fn is_reversed(&self) -> bool {
        CLOSE && self.width < 0.0
    }

    /// Returns the offsets as angles, ascending from the first line.
    pub(crate) fn angles(&self, z: f64) -> Angles {
        let sign = if self.is_reversed() { -1.0 } else { 1.0 };
        Angles::new(sign * self.first.u, sign * self.width, z)
    }

    /// Returns the line at the fraction `s` of the width.
    pub(crate) fn at(&self, s: f64) -> Line {
        let lo = self.first.lo + self.lower * s;
        let length = (self.first.length + (self.upper - self.lower) * s).max(0.0);
        Line {
            u: self.first.u + self.width * s,
            lo,
            hi: if CLOSE {
                self.first.hi + self.upper * s
            } else {
                lo + length
            },
            length,
        }
    }

    /// Returns the part of the piece from its first line to the line at the fraction `s`.
    pub(crate) fn part(&self, s: f64, z: f64) -> Trapezoid<CLOSE> {
        let (a, b) = (self.first, self.at(s));
        let width = self.width * s;
        let corner = |line: Line, v: f64| DVec3::new(v, line.u, z);
        Trapezoid {
            corners: [
                corner(a, a.lo),
                corner(a, a.hi),
                corner(b, b.hi),
                corner(b, b.lo),
            ],
            edges: [
                DVec3::new(a.length, 0.0, 0.0),
                DVec3::new(self.upper * s, width, 0.0),
                DVec3::new(-b.length, 0.0, 0.0),
                DVec3::new(-self.lower * s, -width, 0.0),
            ],
            width,
            z,
        }
    }
}

/// A density over a piece that is linear in the angle, from `first` to `last`.
pub(crate) struct Warp {
    pub(crate) angles: Angles,
    pub(crate) first: f64,
    pub(crate) last: f64,
}

impl Warp {
    /// Returns the integral of the density over the piece.
    pub(crate) fn mass(&self) -> f64 {
        0.5 * (self.first + self.last) * self.angles.end
    }

    /// Returns the density at the fraction `t` of the angle.
    pub(crate) fn at(&self, t: f64) -> f64 {
        self.first + (self.last - self.first) * t
    }

    /// Returns the fraction of the piece's angle at which an offset from its first line is seen.
    pub(crate) fn place(&self, offset: f64, z: f64) -> f64 {
        let from = self.angles.first;
        let v = atan2(z * offset, z * z + from * (from + offset));
        fraction(v / self.angles.end)
    }
}

/// The angles under which a piece is seen from the shading point: an offset is z tan ψ, and v is
/// the angle from the first line.
pub(crate) struct Angles {
    pub(crate) first: f64,
    pub(crate) end: f64,
    pub(crate) r: [f64; 2],
}

impl Angles {
    pub(crate) fn new(u: f64, width: f64, z: f64) -> Self {
        let last = u + width;
        Self {
            first: u,
            end: atan2(z * width, z * z + u * last),
            r: [hypot(u, z), hypot(last, z)],
        }
    }

    /// Returns the ratio of the largest to the smallest distance of a line of the piece.
    pub(crate) fn spread(&self, z: f64) -> f64 {
        let [a, b] = self.r;
        // If the angle exceeds a right angle, the foot is inside the piece, or almost.
        let least = if self.end > 1.5 { z } else { a.min(b) };
        a.max(b) / least
    }

    /// Returns the fraction of the width at the angle `v`, as a ratio of positive weights.
    pub(crate) fn fraction(&self, v: f64) -> f64 {
        let (w1, w0) = (sin(v) / self.r[1], sin(self.end - v) / self.r[0]);
        fraction(w1 / (w0 + w1))
    }
}

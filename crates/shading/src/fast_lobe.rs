//! This module holds the fast path of a lobe along a segment, on which everything except the power
//! is algebra.
//!
//! The robust form ([`lobe`](crate::lobe)) finds the fan, its angle and the lobe's centre by arc
//! tangents, sines and exact products. The fast path is for segments whose ends are clearly above
//! the horizon and above the lobe's own horizon (see [`fast_path`](crate::fast_path)), for a
//! moderate exponent and a lobe that is smooth at its end. There the tangents of half of all angles
//! are rational functions of the dot products and a few roots, and there is no cancellation that
//! the exponent would magnify. All factors are within a factor of eight of their largest value, so
//! that a shorter rule on a narrower window is enough.

use crate::fast_path::{CLEAR, FAR, LEAST_COSINE, LONG_NORMAL, NEAR, Point, SHORT, dot, max, min};
use crate::lobe::{Panel, SMOOTH};
use linelit_elementary::ln;
use std::f64::consts::FRAC_1_SQRT_2;

/// The depth at which a panel ends: the integrand there is below e⁻²⁷ of its peak. Sixteen nodes
/// then have an error of at most 5e-12, for a lobe that falls like a Gaussian or like an
/// exponential. See `docs/decisions/005-lobe-along-a-line.md`.
const DEPTH: f64 = 27.0;

/// The largest exponent: up to here, k times the rounding errors of plain dot products (20 ε) is
/// below 5e-12.
const LARGEST: f64 = 1024.0;

/// The largest square of the axis' length, over 64: its power must not overflow.
const LONG_AXIS: f64 = 2.0 / 64.0;

/// If the logarithm of the lobe's peak is below this, a part of the power is multiplied at the end.
const SHIFT_BELOW: f64 = -550.0;
/// The part of the logarithm that is multiplied at the end.
const SHIFT: f64 = -450.0;
/// e to the power of this part.
const SHIFTED: f64 = 3.693_883_068_487_256e-196;

/// The products of a segment from which the integral is computed.
pub(crate) struct Products {
    /// axis·p and n·p at the ends.
    lobe: [f64; 2],
    facing: [f64; 2],
    /// |p|² at the ends, and the dot product of the ends.
    squares: [f64; 2],
    dot: f64,
    /// The rise of the lobe from each end towards the other, times |p0 × p1| and that end's
    /// distance: `axis·(X × p0)` and `axis·(p1 × X)` with X = p0 × p1. It is formed from X, because
    /// the equivalent differences of dot products cancel on short segments.
    rise: [f64; 2],
    /// l² and |p0 × p1|².
    square: f64,
    area: f64,
}

/// Returns the products of a segment, or `None` if the fast path is not accurate for its integral.
#[inline(always)]
pub(crate) fn measure(p0: Point, p1: Point, n: Point, axis: Point, k: f64) -> Option<Products> {
    // Form all products without a branch.
    let (a, b, d) = (dot(p0, p0), dot(p1, p1), dot(p0, p1));
    let e = [p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]];
    let square = dot(e, e);
    let x = [
        p0[1] * e[2] - p0[2] * e[1],
        p0[2] * e[0] - p0[0] * e[2],
        p0[0] * e[1] - p0[1] * e[0],
    ];
    let area = dot(x, x);
    let turned = [
        axis[1] * x[2] - axis[2] * x[1],
        axis[2] * x[0] - axis[0] * x[2],
        axis[0] * x[1] - axis[1] * x[0],
    ];
    let (c0, c1, z0, z1) = (dot(n, p0), dot(n, p1), dot(axis, p0), dot(axis, p1));
    let (normal, length) = (CLEAR * dot(n, n), CLEAR * dot(axis, axis));
    // Test the conditions of the fast path.
    let (low, far) = (min(min(c0, c1), min(z0, z1)), max(a, b));
    let low2 = low * low;
    let smooth = k >= SMOOTH || k.fract() == 0.0;
    // The segment subtends at most 104°: an obtuse angle has cos² < 1/16.
    let narrow = d * d.abs() >= -LEAST_COSINE * LEAST_COSINE * (a * b);
    let clear = (low > 0.0)
        & (low2 >= max(normal, length) * far)
        & (low2 >= NEAR)
        & (far <= FAR)
        & (square >= SHORT)
        & (area >= CLEAR * (a * square))
        & (normal < LONG_NORMAL)
        & (length < LONG_AXIS)
        & (k > 0.0)
        & (k <= LARGEST)
        & smooth
        & narrow;
    clear.then_some(Products {
        lobe: [z0, z1],
        facing: [c0, c1],
        squares: [a, b],
        dot: d,
        rise: [dot(turned, p0), -dot(turned, p1)],
        square,
        area,
    })
}

impl Products {
    /// Returns 1/h.
    #[inline]
    pub(crate) fn inverse_distance(&self) -> f64 {
        (self.square / self.area).sqrt()
    }

    /// Returns `∫ (n·ω) (1/|p|) (axis·ω)ᵏ dφ` over the angle along the segment.
    ///
    /// It is inlined, and has no arrays: memory that is stored by halves and read in pairs stalls
    /// the processor.
    #[inline(always)]
    pub(crate) fn integrate(&self, k: f64) -> f64 {
        let ([z0, z1], [a, b], d) = (self.lobe, self.squares, self.dot);
        let lobe = Lobe {
            k,
            deep: 0.5 * DEPTH / k,
        };
        let (r0, r1) = (a.sqrt(), b.sqrt());
        let (i0, i1) = (1.0 / r0, 1.0 / r1);
        let (e0, e1) = (i0, i1);
        let (f0, f1) = (self.facing[0] * i0, self.facing[1] * i1);
        let [rise0, rise1] = self.rise;
        let area = self.area.sqrt();
        if min(rise0, rise1) <= 0.0 {
            // The lobe is highest at an end. Choose it without a branch, which would be
            // mispredicted.
            let second = rise0 > 0.0;
            let pick = |x: f64, y: f64| if second { y } else { x };
            let (high, fall) = (pick(z0, z1), -min(rise0, rise1));
            let start = [pick(f0, f1), pick(e0, e1)];
            let end = [pick(f1, f0), pick(e1, e0)];
            let reach = area / (r0 * r1 + d);
            lobe.piece(
                high * pick(i0, i1),
                [start, end],
                reach,
                [fall, high * area],
            )
        } else {
            self.two_pieces(&lobe, [f0, f1], [e0, e1], [i0, i1])
        }
    }

    /// Integrates a lobe whose centre is within the arc, as one piece on either side.
    #[inline(never)]
    fn two_pieces(
        &self,
        lobe: &Lobe,
        facing: [f64; 2],
        closeness: [f64; 2],
        inverse: [f64; 2],
    ) -> f64 {
        let ([z0, z1], [rise0, rise1]) = (self.lobe, self.rise);
        let area = self.area.sqrt();
        // This is √(z² + z′²) at the first end, times |p0|.
        let peak = (z0 * z0 + (rise0 / area) * (rise0 / area)).sqrt() * inverse[0];
        let scale = 1.0 / (peak * area);
        let sines = [rise0 * inverse[0] * scale, rise1 * inverse[1] * scale];
        let over_sine = 1.0 / (area * (inverse[0] * inverse[1]));
        // Interpolate the two factors at the centre.
        let middle = |f: [f64; 2]| (sines[1] * f[0] + sines[0] * f[1]) * over_sine;
        let centre = [middle(facing), middle(closeness)];
        let cosines = [z0 * inverse[0] / peak, z1 * inverse[1] / peak];
        let side = |end: usize| {
            let reach = sines[end] / (1.0 + cosines[end]);
            lobe.piece(
                peak,
                [centre, [facing[end], closeness[end]]],
                reach,
                [0.0, 1.0],
            )
        };
        side(0) + side(1)
    }
}

/// The exponent of the lobe, and how much of the lobe is integrated.
struct Lobe {
    k: f64,
    /// The smallest q outside the window.
    deep: f64,
}

impl Lobe {
    /// Integrates a piece of the arc that starts at the lobe's highest point on it, where `reach`
    /// is the tangent of half its angle. The piece is cut where the lobe has fallen below e⁻²⁷. The
    /// slope τ is the quotient of `fall` and `high`.
    ///
    /// With t the tangent of half the angle and q = t (t + τ)/(1 − τ t), the lobe is ((1 − q)/(1 +
    /// q))ᵏ of its peak, whose logarithm is at most −2 k q. For a given q, t = 2q/(λ + √(λ² + 4q))
    /// with λ = τ (1 + q). The largest of λ, 2√q and (λ + 2√q)/√2 approximates the root from below,
    /// to 8 %, and makes the window wider by at most as much.
    ///
    /// Where the piece is cut, the factors are interpolated from its ends by the sines of the two
    /// parts, which follow from the tangents of their halves: t and (r − t)/(1 + r t).
    #[inline(always)]
    fn piece(
        &self,
        peak: f64,
        [start, end]: [[f64; 2]; 2],
        reach: f64,
        [fall, high]: [f64; 2],
    ) -> f64 {
        let log = self.k * ln(peak);
        // If terms would underflow, multiply a part of the power at the end.
        let (shift, rest) = if log > SHIFT_BELOW {
            (0.0, 1.0)
        } else {
            (SHIFT, SHIFTED)
        };
        let offset = log - shift;
        // Find the end of the window, or of the piece.
        let lean = fall * (1.0 + self.deep);
        let level = 2.0 * self.deep.sqrt();
        let flat = level * high;
        let root = max(max(lean, flat), FRAC_1_SQRT_2 * (lean + flat));
        let window = 2.0 * self.deep * high / (lean + root);
        let to_end = min(window, reach);
        // Interpolate the factors there.
        let inverse = 1.0 / (reach * (1.0 + to_end * to_end));
        let from = (reach - to_end) * (1.0 + reach * to_end) * inverse;
        let to = to_end * (1.0 + reach * reach) * inverse;
        let [cosine, closeness] = [0, 1].map(|i| [start[i], from * start[i] + to * end[i]]);
        let slope = fall / high;
        let panel = Panel {
            half_tan: to_end,
            slope,
            factors: [cosine, closeness],
        };
        rest * panel.short_sum(self.k, offset)
    }
}

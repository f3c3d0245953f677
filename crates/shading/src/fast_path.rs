//! This module holds the fast path of the line models. It is for segments whose ends are both
//! clearly above the horizon (by 7°), which subtend less than 104°, at distances far from the
//! limits of `f64`.
//!
//! Plain dot products are accurate there. A value takes two or three roots, two divisions and some
//! seventy products and sums, without a branch. Each function returns with its value whether the
//! conditions held; if they did not, the caller evaluates the model's robust form.
//!
//! The same code serves one segment and eight segments at once ([`batch`](crate::batch)). It takes
//! single coordinates: a vector passed by reference to the robust form would be stored in memory,
//! and reading it back in pairs stalls the processor.

use linelit_simd::{Lanes, One};

/// The coordinates of a point.
pub(crate) type Point = [f64; 3];

/// The smallest squared cosine of the angle with the normal, (1/8)², at which a plain dot product
/// loses 3 of 53 bits.
pub(crate) const CLEAR: f64 = 1.0 / 64.0;
/// The smallest cosine of the angle that the segment subtends for which the fast path is used.
pub(crate) const LEAST_COSINE: f64 = -0.25;
/// The largest |n|²/64 of the normal for which the fast path is used.
pub(crate) const LONG_NORMAL: f64 = 1e9;
/// The smallest square of n·p at an end of the segment for which the fast path is used.
pub(crate) const NEAR: f64 = 1e-70;
/// The largest squared distance |p|² of an end of the segment for which the fast path is used.
pub(crate) const FAR: f64 = 1e80;
/// The smallest squared length l² of a segment for which the fast path is used.
pub(crate) const SHORT: f64 = 1e-250;

/// The numerator and the denominator of G(c) = (δ − sin δ cos δ)/sin³ δ as polynomials of s = 1 +
/// cos δ, for s from 3/4 to 2.
///
/// They interpolate at 14 points and were found with 60 digits: the error is 2e-17 relative, with
/// rounded coefficients. All terms except the denominator's first, which is a hundredth of the
/// second, have one sign, so that nothing cancels: 2.4 ε as evaluated here.
pub(crate) const LUNE: [[f64; 2]; 8] = [
    [968.3402807960268, -1.0],
    [13360.324669601221, 101.61085194704766],
    [49184.18588033879, 3897.689890662791],
    [66629.7022295337, 24007.784154658882],
    [36003.20579246009, 45220.114749553875],
    [7284.881794098986, 30147.87535163386],
    [410.18265213010466, 6886.38064698695],
    [0.0, 410.04971133274756],
];

/// The numerator and the denominator of A(c) = δ/sin δ with c = cos δ as polynomials of s = 1 + cos
/// δ, for s from 3/4 to 2.
///
/// They interpolate at 15 points and were found with 60 digits: the error is 9e-17 relative, with
/// rounded coefficients. All terms are positive, so that nothing cancels.
const ARC: [[f64; 2]; 8] = [
    [5.206095749598854, 0.17706388940683435],
    [121.75672176294223, 15.475775501483161],
    [610.5759696490409, 167.63921426292148],
    [976.4851598715009, 514.4740320581808],
    [553.0900699218265, 559.2088883763545],
    [105.42840824163278, 225.0691150557065],
    [5.123686457304177, 30.632988479197188],
    [0.012281830389148662, 1.0],
];

/// The largest value of the function δ/sin δ that [`ARC`] approximates, at s = 3/4.
pub(crate) const LONGEST_ARC: f64 = 1.89;

/// The products of a segment that both models use.
struct Products<L: Lanes> {
    /// The squared distance |p0|² of the first end; the next fields are |p1|² and p0·p1.
    a: L::D,
    b: L::D,
    dot: L::D,
    /// The segment as a vector, and its squared length.
    edge: [L::D; 3],
    square: L::D,
    /// The product n·p at the first end; the next field is the product at the second end.
    c0: L::D,
    c1: L::D,
    /// Whether both ends are clearly above the horizon, at moderate distances.
    clear: L::M,
}

/// Returns a·b of single vectors.
#[inline(always)]
pub(crate) fn dot(a: Point, b: Point) -> f64 {
    products::<One>(a, b)
}

/// Returns a·b in each lane, summed from the left.
#[inline(always)]
fn products<L: Lanes>(a: [L::D; 3], b: [L::D; 3]) -> L::D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the smaller number, or `b` if they are not ordered, in one instruction.
#[inline(always)]
pub(crate) fn min(a: f64, b: f64) -> f64 {
    One.dmin(a, b)
}

/// Returns the larger number, or `b` if they are not ordered.
#[inline(always)]
pub(crate) fn max(a: f64, b: f64) -> f64 {
    One.dmax(a, b)
}

/// Computes the products of a segment, and whether they are accurate.
#[inline(always)]
fn measure<L: Lanes>(l: L, p0: [L::D; 3], p1: [L::D; 3], n: [L::D; 3]) -> Products<L> {
    let (a, b) = (products::<L>(p0, p0), products::<L>(p1, p1));
    let edge = [p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]];
    let square = products::<L>(edge, edge);
    let (c0, c1) = (products::<L>(n, p0), products::<L>(n, p1));
    let least = products::<L>(n, n) * CLEAR;
    let (low, far) = (l.dmin(c0, c1), l.dmax(a, b));
    let low2 = low * low;
    // A comparison with NaN is false; the square of a normal that is not a number exceeds the
    // bound.
    let clear = l.dlt(l.dsplat(0.0), low)
        & l.dle(least * far, low2)
        & l.dle(l.dsplat(NEAR), low2)
        & l.dle(far, l.dsplat(FAR))
        & l.dle(l.dsplat(SHORT), square)
        & l.dlt(least, l.dsplat(LONG_NORMAL));
    Products {
        a,
        b,
        dot: products::<L>(p0, p1),
        edge,
        square,
        c0,
        c1,
        clear,
    }
}

impl<L: Lanes> Products<L> {
    /// Returns `scale (c0 w0 + c1 w1)/(r0² r1²)` with the weights of [`ribbon`](crate::ribbon), and
    /// whether the conditions held.
    #[inline(always)]
    fn weighted(&self, l: L, scale: L::D) -> (L::D, L::M) {
        let square = self.a * self.b;
        let product = l.dsqrt(square);
        let lever = self.c0 * (self.b - self.dot) + self.c1 * (self.a - self.dot);
        // Let the next segments start while these wait for their root.
        let [product, lever, facing, scale] = l.abreast([product, lever, self.c0 + self.c1, scale]);
        let cos = self.dot / product;
        let [over, under] = l.polynomials(&LUNE, cos + 1.0);
        let below = product * under;
        let sum = facing * below + lever * over;
        let value = (scale * sum) / (square * below);
        (value, self.clear & l.dle(l.dsplat(LEAST_COSINE), cos))
    }
}

/// Returns [`ribbon::line_integral`](crate::ribbon::line_integral), and whether the conditions
/// held.
#[inline(always)]
pub(crate) fn ribbon<L: Lanes>(l: L, p0: [L::D; 3], p1: [L::D; 3], n: [L::D; 3]) -> (L::D, L::M) {
    let segment = measure(l, p0, p1, n);
    segment.weighted(l, l.dsqrt(segment.square) * 0.5)
}

/// Returns [`cylinder::irradiance`](crate::cylinder::irradiance), and whether the conditions held.
/// They also require that the first end and the segment are not within 7° of parallel.
#[inline(always)]
pub(crate) fn cylinder<L: Lanes>(l: L, p0: [L::D; 3], p1: [L::D; 3], n: [L::D; 3]) -> (L::D, L::M) {
    let segment = measure(l, p0, p1, n);
    let e = segment.edge;
    let x = [
        p0[1] * e[2] - p0[2] * e[1],
        p0[2] * e[0] - p0[0] * e[2],
        p0[0] * e[1] - p0[1] * e[0],
    ];
    let area = products::<L>(x, x);
    let (value, held) = segment.weighted(l, l.dsqrt(area));
    (
        value,
        held & l.dle(segment.a * segment.square * CLEAR, area),
    )
}

/// Returns three things for the edge from `a` to `b`: its term of Lambert's sum, Θ (a × b)·n/|a ×
/// b|; the square of |b − a|/|b|, to which the rounding error is proportional; and whether the
/// conditions held. They require that Θ is not above 104°.
///
/// **Error**: 8 ε [`LONGEST_ARC`] |n||b − a|/|b|. The cross product with the difference contributes
/// 4 ε of |a||b − a|, the product with n 3 ε, and the factors the rest.
#[inline(always)]
pub(crate) fn edge<L: Lanes>(l: L, a: [L::D; 3], b: [L::D; 3], n: [L::D; 3]) -> (L::D, L::D, L::M) {
    let e = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let x = [
        a[1] * e[2] - a[2] * e[1],
        a[2] * e[0] - a[0] * e[2],
        a[0] * e[1] - a[1] * e[0],
    ];
    let (a2, b2) = (products::<L>(a, a), products::<L>(b, b));
    let product = l.dsqrt(a2 * b2);
    let cos = products::<L>(a, b) / product;
    let [over, under] = l.polynomials(&ARC, cos + 1.0);
    let value = (over * products::<L>(x, n)) / (under * product);
    let held = l.dle(l.dsplat(LEAST_COSINE), cos)
        & l.dle(l.dsplat(NEAR), l.dmin(a2, b2))
        & l.dle(l.dmax(a2, b2), l.dsplat(FAR));
    (value, products::<L>(e, e) / b2, held)
}

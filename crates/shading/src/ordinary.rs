//! The three line models by the shortest way, for segments that need no care.
//!
//! A segment is *ordinary* when both ends are clearly above the horizon (by 7°), it subtends less
//! than 104°, and its distances are far from the limits of `f64`. Then plain dot products are
//! accurate, and all that is left is two or three roots, two divisions and some seventy products
//! and sums, without a branch. Each function says at its end whether its result may be trusted; if
//! not, the model's careful form is evaluated instead.
//!
//! These are the scalar twins of the vector kernels in [`simd`](crate::simd): the same operations
//! in the same order, so the same bits. They take bare coordinates: a vector passed on by reference
//! to the careful form would be kept in memory, and reading it back in pairs stalls the processor.

use crate::simd::side_by_side;

/// Coordinates.
pub(crate) type Point = [f64; 3];

/// Least squared cosine of the angle with the normal: 1/8, which costs 3 of 53 bits.
pub(crate) const CLEAR: f64 = 1.0 / 64.0;
/// Least cosine of the angle that the segment subtends.
pub(crate) const LEAST_COSINE: f64 = -0.25;
/// Greatest |n|²/64.
pub(crate) const LONG_NORMAL: f64 = 1e9;
/// Least square of n·p.
pub(crate) const NEAR: f64 = 1e-70;
/// Greatest |p|².
pub(crate) const FAR: f64 = 1e80;
/// Least l².
pub(crate) const SHORT: f64 = 1e-250;

/// Numerator and denominator of G(c) = (δ − sin δ cos δ)/sin³ δ as polynomials of s = 1 + cos δ,
/// from s = 3/4 to 2.
///
/// Interpolated at 14 points with 60 digits: 2e-17 relative, with the coefficients rounded. All
/// terms but the denominator's first, which is a hundredth of the second, are of one sign, so that
/// nothing cancels: 2.4 ε as evaluated here.
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

/// What all models need of a segment.
struct Seen {
    /// |p0|², |p1|², p0·p1.
    a: f64,
    b: f64,
    dot: f64,
    /// The segment as a vector, and its squared length.
    edge: Point,
    square: f64,
    /// n·p at the ends.
    c0: f64,
    c1: f64,
    /// Whether both ends are clearly above the horizon, at moderate distances.
    clear: bool,
}

#[inline(always)]
pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The lesser, or `b` where there is no lesser: one instruction.
#[inline(always)]
pub(crate) fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater, or `b`.
#[inline(always)]
pub(crate) fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn see(p0: Point, p1: Point, n: Point) -> Seen {
    let (a, b) = (dot(p0, p0), dot(p1, p1));
    let edge = [p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]];
    let square = dot(edge, edge);
    let (c0, c1) = (dot(n, p0), dot(n, p1));
    let least = CLEAR * dot(n, n);
    let (low, far) = (min(c0, c1), max(a, b));
    let low2 = low * low;
    // A comparison with NaN fails; a normal that is no number has no square below the bound.
    let clear = (low > 0.0)
        & (low2 >= least * far)
        & (low2 >= NEAR)
        & (far <= FAR)
        & (square >= SHORT)
        & (least < LONG_NORMAL);
    Seen {
        a,
        b,
        dot: dot(p0, p1),
        edge,
        square,
        c0,
        c1,
        clear,
    }
}

impl Seen {
    /// `scale (c0 w0 + c1 w1)/(r0² r1²)` with the weights of [`ribbon`](crate::ribbon), and whether
    /// it may be trusted.
    #[inline(always)]
    fn weighted(&self, scale: f64) -> (f64, bool) {
        let square = self.a * self.b;
        let product = square.sqrt();
        let cos = self.dot / product;
        let [over, under] = lune(1.0 + cos);
        let lever = self.c0 * (self.b - self.dot) + self.c1 * (self.a - self.dot);
        let below = product * under;
        let sum = (self.c0 + self.c1) * below + lever * over;
        let value = (scale * sum) / (square * below);
        (value, self.clear & (cos >= LEAST_COSINE))
    }
}

/// Numerator and denominator of G side by side: the two sums have one shape.
#[inline(always)]
fn lune(s: f64) -> [f64; 2] {
    let s2 = s * s;
    side_by_side(s, s2, s2 * s2)
}

/// [`ribbon::irradiance`](crate::ribbon::irradiance) and whether it may be trusted.
#[inline(always)]
pub(crate) fn ribbon(p0: Point, p1: Point, n: Point) -> (f64, bool) {
    let seen = see(p0, p1, n);
    seen.weighted(0.5 * seen.square.sqrt())
}

/// [`cylinder::irradiance`](crate::cylinder::irradiance) and whether it may be trusted: not where
/// the first end and the segment are within 7° of parallel.
#[inline(always)]
pub(crate) fn cylinder(p0: Point, p1: Point, n: Point) -> (f64, bool) {
    let seen = see(p0, p1, n);
    let e = seen.edge;
    let x = [
        p0[1] * e[2] - p0[2] * e[1],
        p0[2] * e[0] - p0[0] * e[2],
        p0[0] * e[1] - p0[1] * e[0],
    ];
    let area = dot(x, x);
    let (value, trusted) = seen.weighted(area.sqrt());
    (value, trusted & (area >= CLEAR * (seen.a * seen.square)))
}

/// [`point_line::irradiance`](crate::point_line::irradiance) and whether it may be trusted.
#[inline(always)]
pub(crate) fn point_line(p0: Point, p1: Point, n: Point) -> (f64, bool) {
    let seen = see(p0, p1, n);
    let (r0, r1) = (seen.a.sqrt(), seen.b.sqrt());
    let product = r0 * r1;
    let sum = seen.c0 * r1 + seen.c1 * r0;
    let value = seen.square.sqrt() * sum / (product * (product + seen.dot));
    (value, seen.clear & (seen.dot >= LEAST_COSINE * product))
}

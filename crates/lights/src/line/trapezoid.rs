//! This module computes the solid angle and the irradiance of small pieces of a light, from which
//! the CDFs over line offsets are built.

use crate::polygon::spherical_triangle::{self, cross_in_plane};
use linelit_elementary::{asin, atan2, hypot};
use linelit_geometry::finite::{fraction, power_of_two_over};
use linelit_geometry::{DVec3, predicates};

/// The value of (z/r)² below which Lambert's sum is split into two parts, with z the distance of
/// the plane and r the distance of the trapezoid from the shading point: at this value the sum has
/// lost two of sixteen digits.
const GRAZING: f64 = 1e-4;

/// The value of (size/r)² below which a trapezoid near the plane is integrated by [`gauss`]. The
/// nearest singularity is then 15 half widths away, and the error below 30⁻¹².
const SMALL: f64 = 1.0 / 64.0;

/// Returns the positions in (0, 1) and the weights of the Gauss–Legendre rule with six points.
fn gauss() -> impl Iterator<Item = (f64, f64)> {
    const RULE: [(f64, f64); 3] = [
        (0.238_619_186_083_196_9, 0.467_913_934_572_691_05),
        (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
        (0.932_469_514_203_152, 0.171_324_492_379_170_36),
    ];
    let both = |(x, w): (f64, f64)| [(0.5 - 0.5 * x, 0.5 * w), (0.5 + 0.5 * x, 0.5 * w)];
    RULE.into_iter().flat_map(both)
}

/// A trapezoid of the light between two parallel lines, relative to the shading point: (a, b) on
/// one line, (d, c) on the other line at the distance `width`.
///
/// ```text
///   a────────b     the first line
///    ╲        ╲
///     d────────c   the last line, `width` away
/// ```
///
/// With `CLOSE`, the first line's distance from the foot is known more precisely than the last
/// line's. The distance of the edge da from the foot is then computed from a.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trapezoid<const CLOSE: bool> {
    pub(crate) corners: [DVec3; 4],
    /// The edges b − a, c − b, d − c and a − d, formed without the shading point.
    pub(crate) edges: [DVec3; 4],
    pub(crate) width: f64,
    /// The distance of the plane from the shading point.
    pub(crate) z: f64,
}

impl<const CLOSE: bool> Trapezoid<CLOSE> {
    /// Returns Ω as the sum of two triangles whose determinants are `z × width × line length`, so
    /// that nothing cancels.
    pub(crate) fn solid_angle(&self) -> f64 {
        let [a, b, c, d] = self.corners;
        let [ab, bc, cd, da] = self.edges;
        let diagonal = ab + bc;
        let area = self.z * self.width;
        let half = spherical_triangle::half_angle_in_plane;
        let [la, lb, lc, ld] = self.corners.map(DVec3::length);
        2.0 * (half([a, b, c], [ab, bc, -diagonal], [la, lb, lc], area * ab.x)
            + half([a, c, d], [diagonal, cd, da], [la, lc, ld], -area * cd.x))
    }

    /// Returns `∫ max(0, n·ω) dω` for a trapezoid that is above the horizon of `n`.
    ///
    /// If the size is half the distance or more, it is Lambert's sum over edges, `½ Σ Θᵢ
    /// (Xᵢ·n)/|Xᵢ|`. For smaller trapezoids it is the form of this sum centred on the first corner,
    /// in which the terms of the full turn are cancelled algebraically. In both sums the component
    /// of n across the plane contributes terms of the size 1 that add up to z²/r². Near the plane,
    /// if the foot of the perpendicular from the shading point is outside, [`Trapezoid::beside`]
    /// therefore computes that part. The relative error is about 100 ε for the trapezoid as given,
    /// that is without the rounding of its corners.
    pub(crate) fn irradiance(&self, n: DVec3) -> f64 {
        let grazing = if CLOSE { 1.0 } else { GRAZING };
        if CLOSE && self.size_squared() < SMALL * self.corners[0].length_squared() {
            return self.by_quadrature(n);
        }
        let grazes = self.z * self.z < grazing * self.corners[0].length_squared();
        if grazes && self.foot_is_outside() && self.foot_is_beyond_height() {
            return self.beside(n).abs();
        }
        if self.size_squared() < 0.25 * self.corners[0].length_squared() {
            self.centred(n).abs()
        } else {
            self.by_edges(n).abs()
        }
    }

    /// Returns the square of the longest edge.
    fn size_squared(&self) -> f64 {
        let squares = self.edges.iter().map(|e| e.length_squared());
        squares.fold(0.0, f64::max)
    }

    /// Computes [`Trapezoid::irradiance`] of a small trapezoid, z ∫ n·p/|p|⁴ dA, by Gauss's rule.
    /// Its terms have one sign, whereas the sums over edges cancel down to what is left above the
    /// horizon.
    fn by_quadrature(&self, n: DVec3) -> f64 {
        let (a, bc, da) = (self.corners[0], self.edges[1], self.edges[3]);
        let mut sum = 0.0;
        for (s, ws) in gauss() {
            let from = a - da * s;
            let length = self.edges[0].x + (bc.x + da.x) * s;
            for (t, wt) in gauss() {
                let p = DVec3::new(from.x + length * t, from.y, self.z);
                let square = p.length_squared();
                sum += ws * wt * length * n.dot(p) / (square * square);
            }
        }
        (sum * self.z * self.width).abs()
    }

    /// Returns the corner on the edge `i` from which the edge's distance from the foot of the
    /// perpendicular from the shading point is computed.
    #[inline(always)]
    fn on_edge(&self, i: usize) -> DVec3 {
        self.corners[if CLOSE && i == 3 { 0 } else { i }]
    }

    /// Whether the foot of the shading point in the plane is outside, by exact signs.
    fn foot_is_outside(&self) -> bool {
        let turn = |i: usize| {
            let (p, e) = (self.on_edge(i), self.edges[i]);
            predicates::diff_of_products(p.x, e.y, p.y, e.x)
        };
        let turns = [turn(0), turn(1), turn(2), turn(3)];
        turns.iter().any(|&t| t > 0.0) && turns.iter().any(|&t| t < 0.0)
    }

    /// Whether the foot is farther from all edges than the shading point is from the plane. If it
    /// is nearer, the angle of the turn about the foot is known less precisely than the rest, but
    /// the cancellation is not large either.
    #[cold]
    #[inline(never)]
    fn foot_is_beyond_height(&self) -> bool {
        (0..4).all(|i| {
            let (p, e) = (self.corners[i].truncate(), self.edges[i].truncate());
            let t = fraction(-p.dot(e) / e.length_squared());
            (p + e * t).length_squared() > self.z * self.z
        })
    }

    /// Computes [`Trapezoid::irradiance`] near the plane with the foot outside.
    ///
    /// The part of n in the plane is a sum over the edges of Θᵢ z/|Xᵢ|, of the order of the result.
    /// The part across the plane is, in polar coordinates (r, φ) about the foot, `−½ n_z z² Σ ∫
    /// dφ/(r² + z²)`, because the full turns `∮ dφ` add up to zero: see [`edge_below_turn`].
    #[cold]
    #[inline(never)]
    fn beside(&self, n: DVec3) -> f64 {
        // Scale by a power of two, so that fourth powers of lengths do not overflow.
        let largest = self
            .corners
            .map(DVec3::length)
            .into_iter()
            .fold(0.0, f64::max);
        let unit = power_of_two_over(largest);
        let (p, e) = (self.corners.map(|p| p * unit), self.edges.map(|e| e * unit));
        let z = self.z * unit;
        let scaled = Self {
            corners: p,
            edges: e,
            width: self.width * unit,
            z,
        };
        // Sum the part of n in the plane over the edges.
        let in_plane = DVec3::new(n.x, n.y, 0.0);
        let along = if scaled.size_squared() < 0.25 * p[0].length_squared() {
            scaled.centred(in_plane)
        } else {
            scaled.by_edges(in_plane)
        };
        // Sum the part across, each edge from the end nearer to the foot if this end is known
        // better.
        let ends = |i: usize| {
            let j = (i + 1) % 4;
            let nearer = p[j].length_squared() < p[i].length_squared();
            let back = i == 3 || (i != 1 && nearer);
            if CLOSE && back {
                -edge_below_turn(p[j], -e[i], z, true)
            } else {
                edge_below_turn(p[i], e[i], z, CLOSE)
            }
        };
        let across: f64 = (0..4).map(ends).sum();
        along - 0.5 * n.z * across
    }

    /// Returns Lambert's sum over the edges.
    fn by_edges(&self, n: DVec3) -> f64 {
        let mut sum = 0.0;
        for i in 0..4 {
            let (p, q) = (self.corners[i], self.corners[(i + 1) % 4]);
            let x = cross_in_plane(self.on_edge(i), self.edges[i]);
            let length = x.length();
            if length > 0.0 {
                sum += atan2(length, p.dot(q)) * (x.dot(n) / length);
            }
        }
        0.5 * sum
    }

    /// Returns Lambert's sum, centred on the first corner so that the terms of the full turn cancel
    /// algebraically.
    fn centred(&self, n: DVec3) -> f64 {
        let v0 = self.corners[0];
        let big = v0.length();
        let r = self.corners.map(DVec3::length);
        // Form eᵢ = vᵢ − v₀ and dᵢ = rᵢ − r₀.
        let e = [
            DVec3::ZERO,
            self.edges[0],
            self.edges[0] + self.edges[1],
            -self.edges[3],
        ];
        let d = [0, 1, 2, 3].map(|i| e[i].dot(2.0 * v0 + e[i]) / (r[i] + big));
        let (mut flat, mut tilt) = (0.0, DVec3::ZERO);
        for i in 0..4 {
            let j = (i + 1) % 4;
            let product = r[i] * r[j];
            let sine = cross_in_plane(self.on_edge(i), self.edges[i]).length() / product;
            let pm = arc_over_sine_minus_one(sine);
            let w = (pm + 1.0) / product;
            let dw = pm / product - (big * (d[i] + d[j]) + d[i] * d[j]) / (big * big * product);
            flat += w * n.z * predicates::diff_of_products(e[i].x, e[j].y, e[i].y, e[j].x);
            tilt += self.edges[i] * dw;
        }
        0.5 * (flat + n.dot(v0.cross(tilt)))
    }
}

/// Returns `z² ∫ dφ/(r² + z²)` along an edge, in polar coordinates about the foot. This is the turn
/// φ − (p/d) θ between the two ends of the edge, where p is the distance of the edge's line from
/// the foot in the plane, d its distance from the shading point, and tan φ = t/p and tan θ = t/d
/// for a point at the distance t along the line.
///
/// φ − θ has the tangent `k t/(p d + t²)` with k = z²/(d + p), and 1 − p/d is k/d, so that no large
/// terms cancel. Where the edge runs away from the foot (p ≪ t), both terms agree to (p/t)²; near
/// the plane, with `close`, [`radial`] then computes the difference.
fn edge_below_turn(from: DVec3, edge: DVec3, z: f64, close: bool) -> f64 {
    let length = hypot(edge.x, edge.y);
    if length <= 0.0 {
        return 0.0;
    }
    let turn = predicates::diff_of_products(from.x, edge.y, from.y, edge.x);
    let p = turn.abs() / length;
    let t0 = predicates::sum_of_products(from.x, edge.x, from.y, edge.y) / length;
    let t1 = t0 + length;
    let d = hypot(p, z);
    let nearer = t0.abs().min(t1.abs());
    if close && t0 * t1 > 0.0 && d < RADIAL * nearer {
        return (radial(p, d, z, t1) - radial(p, d, z, t0)).copysign(turn);
    }
    let k = z * z / (d + p);
    let product = p * d;
    let first = atan2(
        k * length * (product - t0 * t1),
        (product + t0 * t0) * (product + t1 * t1) + k * k * (t0 * t1),
    );
    let angle = atan2(d * length, t0 * t1 + d * d);
    (first + angle * (k / d)).copysign(turn)
}

/// The ratio d/t below which [`radial`] is used: its ninth term is 64⁻⁹ of the first.
const RADIAL: f64 = 1.0 / 8.0;

/// Returns φ − (p/d) θ minus its limit for t → ±∞: `−(p/t) (z/t)² Σ (−1)ᵐ hₘ/((2m + 3) t²ᵐ)` with
/// hₘ = (d²ᵐ⁺² − p²ᵐ⁺²)/z², from the series of the arc tangents of p/t and d/t.
fn radial(p: f64, d: f64, z: f64, t: f64) -> f64 {
    let (x, y, per) = (d / t * (d / t), p / t * (p / t), z / t * (z / t));
    let (mut h, mut power, mut sign, mut odd, mut sum) = (1.0, y, -1.0, 3.0, 0.0);
    for _ in 0..10 {
        sum += sign * h / odd;
        h = x * h + power;
        power *= y;
        sign = -sign;
        odd += 2.0;
    }
    p / t * per * sum
}

/// The coefficients binom(2k, k)/4ᵏ/(2k + 1), k ≥ 1, of arcsin(s)/s as a series in s².
const ARC: [f64; 24] = {
    let mut out = [0.0; 24];
    let (mut k, mut binomial) = (0, 1.0);
    while k < 24 {
        let n = 2.0 * (k as f64 + 1.0);
        binomial *= (n - 1.0) / n;
        out[k] = binomial / (n + 1.0);
        k += 1;
    }
    out
};

/// Returns `Θ/sin Θ − 1` for Θ < π/2, given the sine; by a series for sin Θ < ½.
fn arc_over_sine_minus_one(sine: f64) -> f64 {
    if sine > 0.5 {
        return asin(sine.min(1.0)) / sine - 1.0;
    }
    let y = sine * sine;
    // The terms shrink by the factor y: sum as many as needed, from the smallest.
    let used = if y < 1e-4 {
        4
    } else if y < 0.02 {
        9
    } else {
        ARC.len()
    };
    y * ARC[..used].iter().rev().fold(0.0, |sum, c| sum * y + c)
}

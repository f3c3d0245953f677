//! Proptest strategies for inputs that are hard for floating point: neighbouring values, all
//! exponents, slivers, grazing directions, scenes that are tiny, huge or far from the origin.
//!
//! Vectors are `[f64; 3]`, triangles `[[f64; 3]; 3]`, so that any vector library can take them in.
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

use crate::close::nudge;
use crate::rng::SplitMix64;
use proptest::prelude::*;

/// A point or direction.
pub type Vector = [f64; 3];
/// The three corners of a triangle.
pub type Corners = [Vector; 3];

/// Generates any finite `f64`: all bit patterns except NaN and infinities, with zeros and
/// subnormals.
pub fn finite() -> impl Strategy<Value = f64> {
    use proptest::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

/// Generates numbers that a function must survive in any argument: NaN, infinities, zeros of both
/// signs, subnormals, the largest and the smallest numbers, their square roots and fourth roots
/// (where squares of lengths and areas overflow), any bits; and, half of the time, an
/// [ordinary](moderate) number, so that one argument is hostile while the others are not.
pub fn hostile() -> impl Strategy<Value = f64> {
    let special = vec![
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        0.0,
        -0.0,
        1.0,
        f64::from_bits(1),
        -f64::from_bits(1),
        1e-310,
        f64::MIN_POSITIVE,
        1e308,
        -1e308,
        f64::MAX,
        f64::MIN,
        1e154,
        -1e155,
        1e-154,
        1e-162,
        1e-170,
        1e77,
        -1e78,
        1e-77,
        1e-81,
    ];
    prop_oneof![
        10 => moderate(),
        7 => proptest::sample::select(special),
        2 => across_exponents(-1022, 1022),
        1 => any::<u64>().prop_map(f64::from_bits),
    ]
}

/// Generates a vector of [hostile] coordinates, or of ordinary ones, or with one [hostile]
/// coordinate among ordinary ones.
pub fn hostile_vector() -> impl Strategy<Value = Vector> {
    let one = ([moderate(), moderate(), moderate()], 0..3_usize, hostile());
    prop_oneof![
        2 => [hostile(), hostile(), hostile()],
        3 => [moderate(), moderate(), moderate()],
        2 => one.prop_map(|(mut v, k, x)| {
            v[k] = x;
            v
        }),
    ]
}

/// Generates several vectors that are related more often than by chance: each is
/// [hostile](hostile_vector), or equal to an earlier one, within 10⁻¹⁷…10⁻¹ of it, a multiple of
/// it, or ordinary, and all are scaled by one factor, often 1.
pub fn hostile_vectors<const N: usize>() -> impl Strategy<Value = [Vector; N]> {
    let each = proptest::collection::vec((hostile_vector(), 0..8_u32, small(), 0..N), N);
    (
        each,
        prop_oneof![2 => Just(1.0), 1 => across_exponents(-1000, 1000)],
    )
        .prop_map(|(each, scale)| {
            let mut out = [[0.0; 3]; N];
            for k in 0..N {
                let (v, kind, size, from) = each[k];
                let earlier = out[from.min(k.saturating_sub(1))];
                out[k] = match kind {
                    _ if k == 0 => v,
                    0 => earlier,
                    1 => offset(earlier, v, size),
                    2 => earlier.map(|c| c * v[0]),
                    3 => v.map(|c| if c.is_finite() { c } else { size }),
                    _ => v,
                };
            }
            out.map(|v| v.map(|c| c * scale))
        })
}

/// Generates a vector that is a unit vector in three of four cases, and otherwise
/// [hostile](hostile_vector): for normals and axes.
pub fn hostile_direction() -> impl Strategy<Value = Vector> {
    prop_oneof![3 => unit_vector(), 1 => hostile_vector()]
}

/// Generates a number in [0, 1) in three of four cases, and otherwise a [hostile] one: for random
/// numbers.
pub fn hostile_unit() -> impl Strategy<Value = f64> {
    prop_oneof![3 => unit_interval(), 1 => hostile()]
}

/// Generates signed values with a uniformly distributed binary exponent in `low..=high` (2^low ≤
/// |x| < 2^(high+1)).
pub fn across_exponents(low: i32, high: i32) -> impl Strategy<Value = f64> {
    (low..=high, 1.0..2.0_f64, any::<bool>()).prop_map(|(exponent, mantissa, negative)| {
        let size = mantissa * 2f64.powi(exponent);
        if negative { -size } else { size }
    })
}

/// Generates values between 2⁻²⁰ and 2²⁰, small integers, and exact zeros, where cancellation is
/// likely.
pub fn moderate() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => across_exponents(-20, 20),
        2 => (-4..=4_i32).prop_map(f64::from),
        1 => Just(0.0),
        1 => Just(-0.0),
    ]
}

/// Generates a uniform number in [0, 1), or a hard one: 0, the smallest, ½ and its neighbours, the
/// largest below 1.
pub fn unit_interval() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => 0.0..1.0_f64,
        1 => Just(0.0),
        1 => Just(2f64.powi(-53)),
        1 => Just(f64::MIN_POSITIVE),
        1 => (-2..=2_i64).prop_map(|k| nudge(0.5, k)),
        1 => (1..=4_i64).prop_map(|k| nudge(1.0, -k)),
    ]
}

/// Generates a direction of unit length (to a few ulps): uniform, along an axis, or off an axis by
/// 10⁻¹⁸…10⁻¹.
pub fn unit_vector() -> impl Strategy<Value = Vector> {
    (
        any::<u64>(),
        0..3_usize,
        any::<bool>(),
        -18..0_i32,
        0..4_u32,
    )
        .prop_map(|(seed, axis, flip, exponent, kind)| {
            let random = SplitMix64::new(seed).unit_vector();
            let mut pole = [0.0; 3];
            pole[axis] = if flip { -1.0 } else { 1.0 };
            match kind {
                0 | 1 => random,
                2 => pole,
                _ => normalized(offset(pole, random, 10f64.powi(exponent))),
            }
        })
}

/// Generates a unit normal and a unit vector that is nearly (or exactly, up to rounding) orthogonal
/// to it: grazing light.
pub fn grazing() -> impl Strategy<Value = (Vector, Vector)> {
    (unit_vector(), any::<u64>(), small(), any::<bool>()).prop_map(|(n, seed, size, flip)| {
        let side = normalized(cross(n, SplitMix64::new(seed).unit_vector()));
        (
            n,
            normalized(offset(side, n, if flip { -size } else { size })),
        )
    })
}

/// Generates a point in the cube [−scale, scale]³, sometimes with coordinates that are exactly
/// zero.
pub fn point(scale: f64) -> impl Strategy<Value = Vector> {
    let coordinate = move || prop_oneof![7 => -scale..scale, 1 => Just(0.0)];
    [coordinate(), coordinate(), coordinate()]
}

/// Generates a triangle of ordinary shape in the cube [−1, 1]³.
pub fn triangle() -> impl Strategy<Value = Corners> {
    [point(1.0), point(1.0), point(1.0)]
}

/// Generates a triangle whose third corner is within 10⁻¹⁷…10⁻¹ of the line through the others (or
/// exactly on it, or on a corner).
pub fn sliver() -> impl Strategy<Value = Corners> {
    (
        point(1.0),
        point(1.0),
        -0.5..1.5_f64,
        any::<u64>(),
        small(),
        0..6_u32,
    )
        .prop_map(|(a, b, t, seed, size, kind)| {
            let t = if kind == 0 { 0.0 } else { t };
            let on_line = [0, 1, 2].map(|k| a[k] + t * (b[k] - a[k]));
            [
                a,
                b,
                offset(on_line, SplitMix64::new(seed).unit_vector(), size),
            ]
        })
}

/// The position and size of a scene: points become origin + scale·p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The factor of coordinates; 2⁻³⁰ to 2³⁰.
    pub scale: f64,
    /// The position that is added to scaled coordinates; zero, or up to 10⁶ scales away.
    pub origin: Vector,
}

impl Placement {
    /// Returns origin + scale·p.
    pub fn apply(&self, p: Vector) -> Vector {
        [0, 1, 2].map(|k| self.origin[k] + self.scale * p[k])
    }

    /// Returns the largest coordinate that a point of the cube [−1, 1]³ may take: rounding errors
    /// are ε times this.
    pub fn magnitude(&self) -> f64 {
        self.scale + self.origin.iter().fold(0.0_f64, |m, c| m.max(c.abs()))
    }
}

/// Generates scenes of human size at the origin, tiny ones, huge ones, and distant ones.
pub fn placement() -> impl Strategy<Value = Placement> {
    (-30..=30_i32, point(1.0), 0..=6_i32, 0..4_u32).prop_map(|(exponent, direction, far, kind)| {
        let scale = if kind == 0 { 1.0 } else { 2f64.powi(exponent) };
        let distance = if kind < 3 {
            0.0
        } else {
            scale * 10f64.powi(far)
        };
        Placement {
            scale,
            origin: direction.map(|c| c * distance),
        }
    })
}

/// Generates a convex polygon of 3 to 8 corners in the plane z = 0, counter-clockwise seen from +z,
/// with corners on an ellipse around the origin.
pub fn convex_polygon_2d() -> impl Strategy<Value = Vec<[f64; 2]>> {
    (
        proptest::collection::vec(0.05..1.0_f64, 3..=8),
        0.2..1.0_f64,
        0.0..1.0_f64,
    )
        .prop_map(|(gaps, squash, turn)| {
            let total: f64 = gaps.iter().sum();
            let mut angle = turn * std::f64::consts::TAU;
            let corners = gaps.iter().map(|gap| {
                angle += gap / total * std::f64::consts::TAU;
                [angle.cos(), squash * angle.sin()]
            });
            corners.collect()
        })
}

/// Generates zero or a size from 10⁻¹⁷ to 10⁻¹.
fn small() -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 6 => (-17..0_i32).prop_map(|e| 10f64.powi(e))]
}

/// Returns p + `size` `direction`.
fn offset(p: Vector, direction: Vector, size: f64) -> Vector {
    [0, 1, 2].map(|k| p[k] + size * direction[k])
}

fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns `v` at unit length; the z axis for a zero vector.
fn normalized(v: Vector) -> Vector {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length > 0.0 {
        v.map(|c| c / length)
    } else {
        [0.0, 0.0, 1.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot(a: Vector, b: Vector) -> f64 {
        (0..3).map(|k| a[k] * b[k]).sum()
    }

    proptest! {
        #[test]
        fn ranges_hold(x in across_exponents(-3, 4), u in unit_interval(), f in finite()) {
            prop_assert!((0.125..32.0).contains(&x.abs()));
            prop_assert!((0.0..1.0).contains(&u));
            prop_assert!(f.is_finite());
        }

        #[test]
        fn unit_vectors_are_unit(v in unit_vector(), (n, w) in grazing()) {
            for v in [v, n, w] {
                prop_assert!((dot(v, v) - 1.0).abs() <= 8.0 * f64::EPSILON);
            }
            prop_assert!(dot(n, w).abs() < 0.11);
        }

        #[test]
        fn slivers_are_thin(t in sliver()) {
            let edge = |i: usize, j: usize| [0, 1, 2].map(|k| t[j][k] - t[i][k]);
            let normal = cross(edge(0, 1), edge(0, 2));
            // Height ≤ 0.1 over a base ≤ 2√3.
            prop_assert!(dot(normal, normal).sqrt() <= 0.1 * 3.5 + 1e-12);
        }

        #[test]
        fn polygons_turn_left(p in convex_polygon_2d()) {
            for i in 0..p.len() {
                let (a, b, c) = (p[i], p[(i + 1) % p.len()], p[(i + 2) % p.len()]);
                let turn = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
                prop_assert!(turn > 0.0);
            }
        }

        #[test]
        fn placed_points_stay_within_magnitude(place in placement(), p in point(1.0)) {
            let q = place.apply(p);
            prop_assert!(q.iter().all(|c| c.abs() <= place.magnitude() * (1.0 + 4.0 * f64::EPSILON)));
        }
    }
}

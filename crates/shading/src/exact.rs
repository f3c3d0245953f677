//! Dot and cross products that pay for exactness only where it is needed.

use crate::span::power_of_two_unit;
use linelit_geometry::{DVec3, predicates};

/// a·b, accurate relative to itself (8 ε): plain where the terms do not cancel, in twice the
/// working precision where they do.
#[inline(always)]
pub(crate) fn dot(a: DVec3, b: DVec3) -> f64 {
    let p = a * b;
    let sum = p.x + p.y + p.z;
    if sum.abs() >= 0.125 * (p.x.abs() + p.y.abs() + p.z.abs()) {
        sum
    } else {
        careful_dot(a, b)
    }
}

#[cold]
#[inline(never)]
fn careful_dot(a: DVec3, b: DVec3) -> f64 {
    predicates::dot(a, b)
}

/// a × b for the ends of a segment: accurate relative to its length (30 ε).
///
/// Plain from the nearer end where its angle with the segment has a sine above 1/8, else from
/// exact products.
#[inline(always)]
pub(crate) fn area_vector(a: DVec3, b: DVec3) -> DVec3 {
    let edge = b - a;
    let (a2, b2) = (a.length_squared(), b.length_squared());
    let near = if a2 <= b2 { a } else { b };
    let x = near.cross(edge);
    if 64.0 * x.length_squared() > a2.min(b2) * edge.length_squared() {
        x
    } else {
        predicates::cross(a, b)
    }
}

/// |v|, also where the squares of its components are beyond the range of numbers; zero for what is no
/// number.
#[inline(always)]
pub(crate) fn length(v: DVec3) -> f64 {
    let length = v.length();
    if length > 1e-140 && length < 1e140 {
        length
    } else {
        extreme_length(v)
    }
}

#[cold]
#[inline(never)]
fn extreme_length(v: DVec3) -> f64 {
    power_of_two_unit(v.abs().max_element()).map_or(0.0, |unit| settle((v * unit).length() / unit))
}

/// v/|v|, also where the squares of its components are beyond the range of numbers; zero for zero and
/// for what is no number.
#[inline(always)]
pub(crate) fn direction(v: DVec3) -> DVec3 {
    let square = v.length_squared();
    if square > 1e-280 && square < 1e280 {
        v.normalize_or_zero()
    } else {
        extreme_direction(v)
    }
}

#[cold]
#[inline(never)]
fn extreme_direction(v: DVec3) -> DVec3 {
    power_of_two_unit(v.abs().max_element())
        .filter(|_| v.is_finite())
        .map_or(DVec3::ZERO, |unit| (v * unit).normalize_or_zero())
}

/// a·b − c·d as an unevaluated sum of two numbers, to 2 ε² of its terms.
#[inline]
fn wide_difference(a: f64, b: f64, c: f64, d: f64) -> (f64, f64) {
    let (p, ep) = predicates::two_product(a, b);
    let (q, eq) = predicates::two_product(c, d);
    let (s, es) = predicates::two_sum(p, -q);
    predicates::two_sum(s, es + (ep - eq))
}

/// a·b as an unevaluated sum of two numbers, to 10 ε² of its terms.
fn wide_dot(a: DVec3, b: DVec3) -> (f64, f64) {
    let (p0, e0) = predicates::two_product(a.x, b.x);
    let (p1, e1) = predicates::two_product(a.y, b.y);
    let (p2, e2) = predicates::two_product(a.z, b.z);
    let (s1, r1) = predicates::two_sum(p0, p1);
    let (s2, r2) = predicates::two_sum(s1, p2);
    predicates::two_sum(s2, ((e0 + e1) + e2) + (r1 + r2))
}

/// k·q at the point q of the line through a and b where m·q = 0, for m·a and m·b of unlike sign:
/// (k·a m·b − k·b m·a)/(m·b − m·a), in twice the working precision.
///
/// Where k·a and k·b are of unlike sign too, that is a difference of numbers that may agree in all
/// their digits: 3 ε of the result, plus 50 ε² of |k||a||b|/(|a| + |b|).
#[cold]
#[inline(never)]
pub(crate) fn value_at_crossing(k: DVec3, m: DVec3, a: DVec3, b: DVec3) -> f64 {
    let [ka, kb] = [wide_dot(k, a), wide_dot(k, b)];
    let [ma, mb] = [wide_dot(m, a), wide_dot(m, b)];
    wide_products(ka, mb, kb, ma) / (mb.0 - ma.0)
}

/// a × q at the point q of the line through b and c where m·q = 0, for m·b and m·c of unlike sign:
/// (a × b m·c − a × c m·b)/(m·c − m·b), in twice the working precision.
///
/// It is small where a and q are (nearly) opposite, and then a difference of vectors that may agree in all
/// their digits: 3 ε of the result, plus 50 ε² of |a| |b||c|/(|b| + |c|).
#[cold]
#[inline(never)]
pub(crate) fn cross_at_crossing(m: DVec3, a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let [mb, mc] = [wide_dot(m, b), wide_dot(m, c)];
    let [(x, x_low), (y, y_low)] = [wide_cross(a, b), wide_cross(a, c)];
    let part = |i: usize| wide_products((x[i], x_low[i]), mc, (y[i], y_low[i]), mb);
    DVec3::new(part(0), part(1), part(2)) / (mc.0 - mb.0)
}

/// a·b − c·d of numbers that are unevaluated sums of two.
fn wide_products(a: (f64, f64), b: (f64, f64), c: (f64, f64), d: (f64, f64)) -> f64 {
    let (p, ep) = predicates::two_product(a.0, b.0);
    let (q, eq) = predicates::two_product(c.0, d.0);
    let (s, es) = predicates::two_sum(p, -q);
    s + (es + ((ep - eq) + ((a.0 * b.1 + a.1 * b.0) - (c.0 * d.1 + c.1 * d.0))))
}

/// a × b as an unevaluated sum of two vectors.
pub(crate) fn wide_cross(a: DVec3, b: DVec3) -> (DVec3, DVec3) {
    let x = wide_difference(a.y, b.z, a.z, b.y);
    let y = wide_difference(a.z, b.x, a.x, b.z);
    let z = wide_difference(a.x, b.y, a.y, b.x);
    (DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1))
}

/// det(a, b, c) from the differences to the shortest of the three, in twice the working precision: 1 ulp
/// plus 30 ε² of the product of that one and the differences.
pub(crate) fn determinant(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let [x, y, z] = [a, b, c].map(|p| p.length_squared());
    let [a, b, c] = if x <= y && x <= z {
        [a, b, c]
    } else if y <= z {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let ((u, u_low), (v, v_low)) = (wide_step(a, b), wide_step(a, c));
    let (x, low) = wide_cross(u, v);
    let low = low + (u.cross(v_low) + u_low.cross(v));
    let (p0, e0) = predicates::two_product(x.x, a.x);
    let (p1, e1) = predicates::two_product(x.y, a.y);
    let (p2, e2) = predicates::two_product(x.z, a.z);
    let (s1, r1) = predicates::two_sum(p0, p1);
    let (s2, r2) = predicates::two_sum(s1, p2);
    s2 + ((e0 + e1 + e2) + (r1 + r2) + low.dot(a))
}

/// b − a as an unevaluated sum of two vectors, exactly.
fn wide_step(a: DVec3, b: DVec3) -> (DVec3, DVec3) {
    let [x, y, z] = [0, 1, 2].map(|i| predicates::two_sum(b[i], -a[i]));
    (DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1))
}

/// Nothing below zero, nothing infinite, no NaN.
#[inline(always)]
#[allow(
    clippy::manual_clamp,
    reason = "clamp would let NaN through; max replaces it by zero"
)]
pub(crate) fn settle(value: f64) -> f64 {
    value.max(0.0).min(f64::MAX)
}

/// [`settle`] by component.
#[inline(always)]
pub(crate) fn settled(value: DVec3) -> DVec3 {
    DVec3::new(settle(value.x), settle(value.y), settle(value.z))
}

/// Into [0, 1], NaN becoming 0.
#[inline(always)]
#[allow(
    clippy::manual_clamp,
    reason = "clamp would let NaN through; max replaces it by zero"
)]
pub(crate) fn fraction(value: f64) -> f64 {
    value.max(0.0).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::assert_close;
    use linelit_testkit::precise::Precise;
    use linelit_testkit::real::{Real, cross, dot, length, sub, vector};
    use linelit_testkit::rng::SplitMix64;

    /// A corner opposite the cut of the side that it does not end, to 1e-12 to 1.
    #[test]
    fn a_diagonal_of_nearly_half_a_turn_is_accurate_relative_to_itself() {
        let mut rng = SplitMix64::new(3);
        for case in 0..2000 {
            let random = |rng: &mut SplitMix64| DVec3::from_array(rng.unit_vector());
            let (b, c, m) = (random(&mut rng), random(&mut rng), random(&mut rng));
            let (mb, mc) = (m.dot(b), m.dot(c));
            if mb * mc >= 0.0 {
                continue;
            }
            let near = 10f64.powf(rng.in_range(-12.0, 0.0));
            let cut = (b * mc - c * mb) / (mc - mb);
            let a = random(&mut rng) * near - cut;
            let got = cross_at_crossing(m, a, b, c);
            let [x, y, z, k] = [a, b, c, m].map(|v| vector::<Precise>(v.to_array()));
            let (ky, kz) = (dot(&k, &y), dot(&k, &z));
            let q = [0, 1, 2].map(|i| {
                (y[i].clone() * kz.clone() - z[i].clone() * ky.clone()) / (kz.clone() - ky.clone())
            });
            let want = cross(&x, &q);
            let off = length(&sub(&vector::<Precise>(got.to_array()), &want)) / length(&want);
            // 3 ε, and of 50 ε² of at most 2 over 1e-13 nothing is seen.
            assert_close!(
                off.to_f64(),
                0.0,
                4.0 * f64::EPSILON,
                "case {case}, {near:e}"
            );
        }
    }
}

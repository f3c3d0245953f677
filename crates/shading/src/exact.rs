//! Dot and cross products that pay for exactness only where it is needed.

use crate::span::power_of_two_unit;
use linelit_geometry::{DVec3, finite::nonnegative, predicates};

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
    power_of_two_unit(v.abs().max_element())
        .map_or(0.0, |unit| nonnegative((v * unit).length() / unit))
}

/// v/|v|, also where the squares of its components are beyond the range of numbers; zero for zero
/// and for what is no number.
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

/// a·b of vectors that are unevaluated sums of two: 1 ulp plus 20 ε² of its terms.
pub(crate) fn wide_dot_of(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> f64 {
    let (sum, low) = wide_dot(a.0, b.0);
    sum + (low + (a.0.dot(b.1) + a.1.dot(b.0)))
}

/// a × b of vectors that are unevaluated sums of two, as another: to 20 ε² of its terms.
pub(crate) fn wide_cross_of(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    let (x, low) = wide_cross(a.0, b.0);
    let low = low + (a.0.cross(b.1) + a.1.cross(b.0));
    let [x, y, z] = [0, 1, 2].map(|i| predicates::two_sum(x[i], low[i]));
    (DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1))
}

/// det(a, b, c) from the differences to the shortest of the three, in twice the working precision:
/// 1 ulp plus 30 ε² of the product of that one and the differences.
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

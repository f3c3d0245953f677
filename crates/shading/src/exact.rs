//! This module holds dot and cross products that use extended precision only where plain ones would
//! lose digits.

use linelit_geometry::double::{self, vector};
use linelit_geometry::{DVec3, finite::nonnegative, predicates};

/// Returns a·b with a relative error of 8 ε: by the plain formula where the terms do not cancel,
/// and in twice the working precision where they do.
#[inline(always)]
pub(crate) fn dot(a: DVec3, b: DVec3) -> f64 {
    let p = a * b;
    let sum = p.x + p.y + p.z;
    if sum.abs() >= 0.125 * (p.x.abs() + p.y.abs() + p.z.abs()) {
        sum
    } else {
        accurate_dot(a.x, a.y, a.z, b.x, b.y, b.z)
    }
}

/// Computes a dot product accurately. It takes single numbers: for vectors passed by reference,
/// every caller would copy its own, and stall where it reads in pairs the numbers that it has
/// stored by halves.
#[cold]
#[inline(never)]
fn accurate_dot(ax: f64, ay: f64, az: f64, bx: f64, by: f64, bz: f64) -> f64 {
    predicates::dot(DVec3::new(ax, ay, az), DVec3::new(bx, by, bz))
}

/// Returns a × b for the ends of a segment, with an error of 30 ε relative to the length of the
/// product.
///
/// The formula is plain, from the nearer end, where the sine of the angle between this end and the
/// segment is above 1/8; otherwise the products are exact.
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

/// Returns the length of v, also where the squares of its components overflow or underflow; zero
/// for a vector that is not a number.
#[inline(always)]
pub(crate) fn length(v: DVec3) -> f64 {
    let length = v.length();
    if length > 1e-140 && length < 1e140 {
        length
    } else {
        extreme_length(v)
    }
}

/// Returns the length of a vector whose squares may overflow or underflow.
#[cold]
#[inline(never)]
fn extreme_length(v: DVec3) -> f64 {
    nonnegative(predicates::length(v))
}

/// Returns v/|v|; zero for zero, and for a vector that is not a number.
#[inline(always)]
pub(crate) fn direction(v: DVec3) -> DVec3 {
    predicates::normalize(v).unwrap_or(DVec3::ZERO)
}

/// Returns k·q at the point q of the line through a and b where m·q = 0, for m·a and m·b of
/// different signs: (k·a m·b − k·b m·a)/(m·b − m·a), in twice the working precision.
///
/// Where k·a and k·b also differ in sign, this is a difference of numbers that may be almost equal.
/// The error is 3 ε of the result, plus 50 ε² of |k||a||b|/(|a| + |b|).
#[cold]
#[inline(never)]
pub(crate) fn value_at_crossing(k: DVec3, m: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (ka, kb) = (double::dot_of(k, a), double::dot_of(k, b));
    let (ma, mb) = (double::dot_of(m, a), double::dot_of(m, b));
    (ka * mb - kb * ma).hi() / (mb.hi() - ma.hi())
}

/// Returns det(a, b, c) from the differences to the shortest of the three vectors, in twice the
/// working precision. The error is 1 ulp plus 30 ε² of the product of the shortest vector and the
/// differences.
pub(crate) fn determinant(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let [x, y, z] = [a, b, c].map(|p| p.length_squared());
    let [a, b, c] = if x <= y && x <= z {
        [a, b, c]
    } else if y <= z {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let [u, v] = [b, c].map(|p| double::difference(p, a));
    double::dot(double::cross(u, v), vector(a)).hi()
}

//! A Phong or cosine lobe over a convex polygon: Arvo's double-axis moment.
//!
//! Symbols: vertices relative to the shading point; n shading normal, w the lobe's axis, k its
//! exponent (any real number ≥ 0; max(0, z)⁰ is one for z > 0 and zero elsewhere), z = w·ω; the
//! polygon is clipped to n·ω ≥ 0 and w·ω ≥ 0. For each edge, G is the inward unit normal of its
//! plane through the shading point, g = G·w, x the angle along the edge from the point nearest to
//! the axis, ψ the azimuth about the axis. For a triangle, â, b̂, ĉ are the directions of its
//! corners, v the angle along the side from b̂ to ĉ, which is δ long, ρ the angle along the arc
//! from â to the point of the side at v, which is R long.

mod boundary;
mod cut;
mod lines;
pub(crate) mod triangles;

use crate::exact::{dot, length};
use crate::horizon::crossing;
use crate::lobe::log_axis_length;
use crate::polygon::clip_with;
use crate::span::power_of_two_unit;
use linelit_elementary::exp;
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{ConvexPolygon, DVec3};

/// The most vertices taken at once, before clipping; larger polygons are fanned out.
const CHUNK: usize = ConvexPolygon::CAPACITY;
const CAPACITY: usize = CHUNK + 4;

/// The sum over the edges is good enough with that error relative to itself.
const ENOUGH: f64 = 1e-11;

/// Cut corners that are not nearer than one in so many of the greatest distance are right enough.
const NEAR: f64 = 100.0;

/// Nearer to the lobe's horizon, rounded corners do not know how high they are.
const LOWEST: f64 = 1e-6;

/// Over a smaller polygon that sum cancels unless the lobe is as narrow.
const SMALL: f64 = 1e-3;

/// `∫ max(0, n·ω) max(0, w·ω)ᵏ dω` over the polygon, dimensionless. Times
/// [`normalisation`](crate::phong::normalisation) and k_s it is the radiance that a Phong surface
/// reflects for each unit of the light's radiance.
///
/// **Formula**: by Stokes' theorem, twice, an integral over the boundary,
///
/// ```text
/// (k + 2) T = Σ_edges ∫ [ (w·n) g (1 − zᵏ)/(1 − z²) + (G·n) zᵏ ] dx
/// ```
///
/// Within the lobe's window along an edge the bracket is smooth and integrated on two panels of 24
/// Gauss–Legendre nodes; beyond it zᵏ has vanished and the rest, ∫ g dx/(1 − z²) = Δψ, is an
/// arctangent. Where the axis passes well outside, the ones add up to nothing over all edges and
/// are left out. The terms have signs; where they cancel (slivers, polygons that are small for the
/// lobe, light at the horizon), which their magnitudes tell, the integral is evaluated over
/// triangles,
///
/// ```text
/// T = Σ_triangles det(â, b̂, ĉ) ∫ dv/sin δ ∫ dρ/sin R · (sin ρ/sin R) (n·ω) zᵏ
/// ```
///
/// where every term is positive: the inner integral as a lobe along a line
/// ([`phong`](crate::phong)), the outer one by sixteen nodes on halves of the lobe's window, until
/// they agree. What both horizons leave of a triangle is known by products and quotients of
/// determinants, which are exact but for their last digit. Neither cost grows with k: some 10 µs
/// and, where it is needed, 40 to 300 µs.
///
/// **Domain**: convex, either order, any number of vertices, their plane at zero or 1e-280 of their
/// size at least (nearer, cosines with the horizons are below the range of numbers); w of any
/// length, as in [`cosine_lobe`](crate::cosine_lobe).
///
/// **Error**: below 1e-10 relative at any exponent from 0 to 1e5, for slivers, edge-on and in the
/// tails alike, down to results of 1e-280 (`docs/accuracy.md`).
///
/// **Source**: Arvo 1995, "Applications of Irradiance Tensors", whose recursion costs O(k) for each
/// edge and needs an integer; both forms are our own.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::phong_polygon;
/// // A huge square overhead, the lobe straight up: 2π/(k + 2).
/// let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
///     .map(|(x, y)| DVec3::new(1e6 * x, 1e6 * y, 1.0));
/// let t = phong_polygon::irradiance(&square, DVec3::Z, DVec3::Z, 1000.0);
/// assert!((t * 1002.0 / (2.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn irradiance(vertices: &[DVec3], n: DVec3, w: DVec3, k: f64) -> f64 {
    let Some((first, rest)) = vertices.split_first() else {
        return 0.0;
    };
    let largest = vertices
        .iter()
        .map(|v| v.abs().max_element())
        .fold(0.0, f64::max);
    let Some(unit) = power_of_two_unit(largest).filter(|_| k >= 0.0) else {
        return 0.0;
    };
    // Pieces of as many vertices as are taken at once, all with the first one.
    let mut piece = [*first * unit; CHUNK];
    let mut sum = 0.0;
    let mut at = 0;
    while rest.len() > at + 1 {
        let next = &rest[at..rest.len().min(at + CHUNK - 1)];
        for (to, from) in piece[1..].iter_mut().zip(next) {
            *to = *from * unit;
        }
        sum += scaled(&piece[..=next.len()], n, w, k);
        // A piece begins where the one before ends.
        at += next.len() - 1;
    }
    nonnegative(sum)
}

/// [`irradiance`] to `tolerance` times what a lobe of exponent 0 would give
/// ([`polygon::irradiance`](crate::polygon::irradiance), the most that it can be), for the time of
/// some fifteen lines where that can be told, and none where the lobe points elsewhere.
///
/// **Formula**: ∫ h [`ribbon`](crate::phong::ribbon) ds across the polygon, h the height of the
/// shading point over its plane, s = h tan φ the offset of lines along its longest side, by
/// Kronrod's fifteen nodes in φ on panels between vertices and crossings of the horizons.
///
/// **Domain** as for [`irradiance`], which answers for more than eight corners, slivers, and
/// polygons that are tiny or edge-on from the shading point or just above a horizon, where it would
/// take more than twelve panels of 3/√(k + 1) or a radian, and where the difference from Gauss'
/// seven nodes says that the tolerance is not met.
///
/// `w` is a unit vector.
///
/// **Error**: below the tolerance as above, and not below [`irradiance`]'s own: the estimate of
/// QUADPACK's (Piessens et al. 1983), which is on the safe side for integrands as smooth as these.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::phong_polygon::{irradiance, irradiance_to};
/// let corners = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)];
/// let square = corners.map(|(x, y)| DVec3::new(x, y, 1.0));
/// let (n, w) = (DVec3::Z, DVec3::new(0.1, 0.2, 0.9));
/// let exact = irradiance(&square, n, w, 40.0);
/// let quick = irradiance_to(&square, n, w, 40.0, 1e-6);
/// assert!((quick / exact - 1.0).abs() < 1e-6);
/// ```
#[must_use]
pub fn irradiance_to(vertices: &[DVec3], n: DVec3, w: DVec3, k: f64, tolerance: f64) -> f64 {
    lines::integral(vertices, n, w, k, tolerance)
        .map_or_else(|| irradiance(vertices, n, w, k), nonnegative)
}

/// [`irradiance`] of at most `CHUNK` vertices near one in magnitude.
fn scaled(vertices: &[DVec3], n: DVec3, w: DVec3, k: f64) -> f64 {
    let mut polygon = [DVec3::ZERO; CAPACITY];
    polygon[..vertices.len()].copy_from_slice(vertices);
    let mut count = vertices.len();
    for plane in [n, w] {
        // Of cut corners rounding may say that nothing is above.
        if !vertices.iter().any(|p| dot(plane, *p) > 0.0) {
            return 0.0;
        }
        if count == 0 {
            break;
        }
        let source = polygon;
        let source = &source[..count];
        let cut = |i: usize, j: usize, ci, cj| crossing(source[i], source[j], plane, ci, cj);
        count = clip_with(source, plane, |i| source[i], cut, &mut polygon);
    }
    let polygon = &polygon[..count];
    let size = extent(polygon);
    if count >= 3 && size > SMALL {
        let sum = boundary::integral(polygon, n, w.normalize_or_zero(), k);
        // Cut corners are rounded, which turns the sides they end: the more, the nearer they are to
        // the shading point, as where both horizons cut a light from within its plane.
        let cut = if *polygon == *vertices {
            0.0
        } else {
            f64::EPSILON * (k + 2.0) * (spread(polygon) / NEAR).max(1.0)
        };
        if boundary::error(k, size) * sum.size + 2.0 * cut < ENOUGH * sum.value {
            let length = exp(k * log_axis_length(w));
            return sum.value / (k + 2.0) * length;
        }
    }
    let highest = highest(polygon, w);
    let peak = if highest > LOWEST { highest } else { 0.0 };
    triangles::integral(vertices, n, w, k, peak).abs()
}

/// How far the other vertices are from the first one, at most, over its distance.
fn extent(polygon: &[DVec3]) -> f64 {
    let Some(first) = polygon.first() else {
        return 0.0;
    };
    let square = |p: &DVec3| (*p - *first).length_squared();
    let reach = polygon.iter().map(square).fold(0.0, f64::max);
    (reach / first.length_squared()).sqrt()
}

/// The greatest distance of a vertex over the least.
fn spread(polygon: &[DVec3]) -> f64 {
    let lengths = polygon.iter().map(|p| length(*p));
    let [least, most] = lengths.fold([f64::INFINITY, 0.0], |[least, most], s| {
        [s.min(least), s.max(most)]
    });
    most / least
}

/// The greatest cosine with the axis of a vertex.
fn highest(polygon: &[DVec3], w: DVec3) -> f64 {
    let cosine = |p: &DVec3| dot(w, *p) / length(*p);
    polygon.iter().map(cosine).fold(0.0, f64::max)
}

//! This module integrates over a convex polygon, as a diffuse surface receives it.

use crate::exact::{area_vector, direction, dot, length};
use crate::horizon::crossing;
use crate::lambert;
pub use crate::lambert::boundary_irradiance;
use crate::span::{NEAREST, near_one, power_of_two_unit};
use crate::special::{arc, arc_excess};
use crate::triangle_sum;
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{ConvexPolygon, DVec3, predicates};
use std::f64::consts::PI;

/// The largest number of vertices that are integrated at once, before clipping; larger polygons are
/// divided into a fan.
const CHUNK: usize = ConvexPolygon::CAPACITY;
const CAPACITY: usize = CHUNK + 2;
/// A sum that is smaller than this fraction of its terms' magnitudes has lost too many digits.
const CANCELLED: f64 = 2e-3;
/// The cosine of an edge's angle (179.7°) beyond which clipped ends do not determine the edge's
/// plane. If the shading point is above the light and within rounding of its plane, they do not
/// even determine the direction of the turn.
const NEARLY_STRAIGHT: f64 = -0.99999;
/// A bound on Σ (|b − a|/|b|)² over edges from a to b. Beyond it, differences lose the digits of
/// the nearer end; for eight edges the error is 1e-12 there.
const NEAR_CORNER: f64 = 1e4;
/// A bound below all cosines, for ends that are not clipped, which determine the plane.
const ANY: f64 = -2.0;

/// Returns `∫ max(0, n·ω) dω` over the polygon: the irradiance for each unit of radiance (times
/// k_d/π, the radiance reflected by a diffuse surface).
///
/// `vertices` are relative to the shading point, of a convex polygon, of any number; `n` is the
/// surface's unit normal (the result is proportional to its length). The order of the vertices
/// makes no difference: both sides of the polygon count as lit. If a light emits to one side only,
/// the caller has to leave out its back, as the estimators do (`AreaLight::faces` in
/// `linelit-lights`).
///
/// **Formula**: after clipping to the horizon, Lambert's sum over the edges
///
/// ```text
/// E = ½ Σ (Θᵢ/sin Θᵢ) (vᵢ × vᵢ₊₁)·n/(rᵢ rᵢ₊₁)
/// ```
///
/// with Θ/sin Θ as an analytic function of cos Θ, eight edges at a time where no edge is clipped
/// and little cancels. Otherwise a polygon smaller than half its distance takes the centred form,
/// from which the cancelling terms have been removed algebraically: with eᵢ = vᵢ − v, R = |v|, dᵢ =
/// rᵢ − R and p = Θ/sin Θ − 1 (by its own function of cos Θ),
///
/// ```text
/// E = ½ [ Σ wᵢ (eᵢ × eᵢ₊₁)·n + n·(v × Σ ωᵢ (eᵢ₊₁ − eᵢ)) ],   wᵢ = (1 + p)/(rᵢ rᵢ₊₁),
/// ωᵢ = wᵢ − 1/R² = p/(rᵢ rᵢ₊₁) − (R (dᵢ + dᵢ₊₁) + dᵢ dᵢ₊₁)/(R² rᵢ rᵢ₊₁)
/// ```
///
/// If the magnitudes of the terms show that they still cancel (slivers, grazing incidence, light
/// seen edge-on), a sum over triangles with positive terms replaces it:
///
/// ```text
/// E = Σ_triangles det(â, b̂, ĉ) ∫ dv/sin δ · ½ [(n·â) (1 − G cos R) + (n·ê) G]
/// ```
///
/// with â, b̂, ĉ the directions of a triangle's corners, v the angle along the side from b̂ to ĉ,
/// whose length is δ, ê the direction there, R its angle with â, and G = (R − sin R cos R)/sin³ R.
/// The integral takes sixteen nodes on each part of at most 96°. Determinants and cosines of the
/// part of a triangle above the horizon are products and quotients, exact except for their last
/// digits.
///
/// **Domain**: finite vertices; fewer than three give 0.
///
/// **Error**: below 1e-12 relative (`docs/accuracy.md`).
///
/// **Source**: Lambert 1760; clipping after Baum, Rushmeier & Winget 1989; the centred form is our
/// own.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::polygon;
/// // A huge square overhead fills the hemisphere: π.
/// let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
///     .map(|(x, y)| DVec3::new(1e9 * x, 1e9 * y, 1.0));
/// assert!((polygon::irradiance(&square, DVec3::Z) - std::f64::consts::PI).abs() < 1e-8);
/// ```
#[must_use]
pub fn irradiance(vertices: &[DVec3], n: DVec3) -> f64 {
    let value = lambert::polygon(vertices, n).unwrap_or_else(|| signed(vertices, n));
    // The integral over all directions above the horizon is π: rounding must not exceed it.
    nonnegative(value.abs()).min(PI * n.length())
}

/// Computes [`irradiance`] with a sign: positive where the vertices are counter-clockwise as seen
/// from the shading point (det(v₀, v₁, v₂) > 0).
fn signed(vertices: &[DVec3], n: DVec3) -> f64 {
    if vertices.len() < 3 {
        return 0.0;
    }
    // Divide a large polygon into pieces.
    if vertices.len() > CHUNK {
        let (head, tail) = vertices.split_at(CHUNK);
        let mut rest = [DVec3::ZERO; CHUNK];
        let mut sum = signed(head, n);
        // Each further piece has the first vertex, the last one of the previous piece, and up to 22
        // more.
        let mut last = head[CHUNK - 1];
        for piece in tail.chunks(CHUNK - 2) {
            rest[0] = vertices[0];
            rest[1] = last;
            rest[2..2 + piece.len()].copy_from_slice(piece);
            sum += signed(&rest[..2 + piece.len()], n);
            last = piece[piece.len() - 1];
        }
        return sum;
    }
    // Scale to about unit size.
    let largest = vertices
        .iter()
        .map(|v| v.abs().max_element())
        .fold(0.0, f64::max);
    let Some(unit) = power_of_two_unit(largest) else {
        return 0.0;
    };
    let mut scaled = [DVec3::ZERO; CHUNK];
    for (to, from) in scaled.iter_mut().zip(vertices) {
        *to = *from * unit;
    }
    let scaled = &scaled[..vertices.len()];
    // Choose the form by the size of the polygon relative to its distance.
    let first = scaled[0];
    let reach = scaled
        .iter()
        .map(|p| (*p - first).length_squared())
        .fold(0.0, f64::max);
    let [value, size] = if reach < 0.25 * first.length_squared() {
        centred(scaled, n)
    } else {
        plain(scaled, n)
    };
    // Accept the sum unless its terms cancel.
    let dark = || scaled.iter().all(|p| dot(n, *p) <= 0.0);
    if value.abs() > CANCELLED * size || dark() {
        value
    } else {
        triangle_sum::irradiance(scaled, n)
    }
}

/// Collects the part above the horizon of `n`, in order, and returns its number of vertices.
/// `vertex(i)` makes a vertex, and `cut(i, j, ci, cj)` the crossing of an edge with the horizon.
fn clip_with(
    vertices: &[DVec3],
    n: DVec3,
    vertex: impl Fn(usize) -> DVec3,
    cut: impl Fn(usize, usize, f64, f64) -> DVec3,
    out: &mut [DVec3],
) -> usize {
    let mut count = 0;
    let mut push = |p: DVec3| {
        if let Some(slot) = out.get_mut(count) {
            *slot = p;
            count += 1;
        }
    };
    // Walk around the polygon, and add a vertex wherever an edge crosses the horizon.
    let mut last = vertices.len() - 1;
    let mut c_last = dot(n, vertices[last]);
    for (i, &v) in vertices.iter().enumerate() {
        let c = dot(n, v);
        if (c_last > 0.0 && c < 0.0) || (c_last < 0.0 && c > 0.0) {
            push(cut(last, i, c_last, c));
        }
        if c >= 0.0 {
            push(vertex(i));
        }
        (last, c_last) = (i, c);
    }
    count
}

/// Computes [`irradiance`] by Lambert's sum over the edges without corrections. It is faster, with
/// an absolute error below 1e-12 |n|, not a relative one (1e-8 for a light whose width is a
/// ten-thousandth of its distance). There may be at most [`ConvexPolygon::CAPACITY`] vertices.
///
/// **Error**: 8 ε |n| Σ |b − a|/|b| over the edges from a to b while that is below 1e-12, and
/// otherwise the error of [`edge`]. A corner that the horizon of `n` cuts off is rounded, by ε over
/// the sine of the angle between the horizon and the light's plane if this plane is next to the
/// shading point.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::polygon;
/// let square = [[-1.0, -1.0, 2.0], [-1.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0]];
/// let square = square.map(DVec3::from);
/// let fast = polygon::irradiance_by_edges(&square, DVec3::Z);
/// let careful = polygon::irradiance(&square, DVec3::Z);
/// assert!((fast - careful).abs() < 1e-14);
/// ```
#[must_use]
pub fn irradiance_by_edges(vertices: &[DVec3], n: DVec3) -> f64 {
    let mut above = [DVec3::ZERO; ConvexPolygon::CAPACITY + 2];
    let count = clip_to_horizon(vertices, n, &mut above);
    let above = &above[..count];
    let one_by_one = || {
        let next = above.iter().cycle().skip(1);
        above.iter().zip(next).map(|(a, b)| edge(*a, *b, n)).sum()
    };
    let sum: f64 = match lambert::sum(above, n) {
        Some([sum, squares]) if squares < NEAR_CORNER => sum,
        _ => one_by_one(),
    };
    nonnegative(0.5 * sum.abs())
}

/// Clips to the horizon of `n` into `out`, and returns the number of vertices; 0 if `out` is too
/// short.
pub(crate) fn clip_to_horizon(vertices: &[DVec3], n: DVec3, out: &mut [DVec3]) -> usize {
    if vertices.len() < 3 || vertices.len() + 2 > out.len() {
        return 0;
    }
    let cut = |i: usize, j: usize, ci, cj| crossing(vertices[i], vertices[j], n, ci, cj);
    clip_with(vertices, n, |i| vertices[i], cut, out)
}

/// Returns Lambert's sum, and the sum of its terms' magnitudes, to which its rounding is relative.
fn plain(vertices: &[DVec3], n: DVec3) -> [f64; 2] {
    let mut clipped = [DVec3::ZERO; CAPACITY];
    let cut = |i: usize, j: usize, ci, cj| crossing(vertices[i], vertices[j], n, ci, cj);
    let count = clip_with(vertices, n, |i| vertices[i], cut, &mut clipped);
    if count < 3 {
        return [0.0; 2];
    }
    let mut last = clipped[count - 1];
    // Clipped corners are rounded.
    let clipped_off = count != vertices.len() || clipped[..count] != *vertices;
    let (mut sum, mut size) = (0.0, if clipped_off { n.length() } else { 0.0 });
    let straight = if clipped_off { NEARLY_STRAIGHT } else { ANY };
    for &v in &clipped[..count] {
        let [value, error] = term(last, v, n, straight);
        sum += value;
        size += error;
        last = v;
    }
    [0.5 * sum, 0.5 * size]
}

/// Returns an edge's term of Lambert's sum, Θ (a × b)·n/|a × b|. Half the sum over the boundary of
/// a region (with the region on its left, as seen from the shading point) is the region's
/// irradiance, if the whole region is above the horizon. Use it for regions that are not convex
/// polygons.
///
/// **Domain**: a and b relative to the shading point, not opposite to each other. Equal points and
/// the shading point itself give 0. **Error**: 1e-15 of the angle Θ, so that a region that fills a
/// small angle s loses ε/s relative to itself, unlike [`irradiance`]. Points that are not finite
/// give 0.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::polygon;
/// let square = [[-1.0, -1.0, 2.0], [-1.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0]];
/// let square = square.map(DVec3::from);
/// let sum: f64 = (0..4).map(|i| polygon::edge(square[i], square[(i + 1) % 4], DVec3::Z)).sum();
/// assert!((0.5 * sum.abs() - polygon::irradiance(&square, DVec3::Z)).abs() < 1e-14);
/// ```
#[must_use]
pub fn edge(a: DVec3, b: DVec3, n: DVec3) -> f64 {
    let near = |p: DVec3| (1e-70..1e70).contains(&p.abs().max_element()) && p.is_finite();
    if near(a) && near(b) && near(n) {
        term(a, b, n, ANY)[0]
    } else {
        extreme_edge(a, b, n)
    }
}

/// Computes [`edge`] where products of lengths may overflow or underflow: only directions matter.
#[cold]
fn extreme_edge(a: DVec3, b: DVec3, n: DVec3) -> f64 {
    let size = n.abs().max_element();
    let (a, b, unit) = (direction(a), direction(b), power_of_two_unit(size));
    let Some(unit) = unit.filter(|_| n.is_finite()) else {
        return 0.0;
    };
    (term(a, b, n * unit, ANY)[0] / unit).clamp(-f64::MAX, f64::MAX)
}

/// Returns [`edge`], and the magnitude to which its rounding is relative; this is infinite if the
/// cosine of the edge's angle is below `straight`.
#[inline]
fn term(a: DVec3, b: DVec3, n: DVec3, straight: f64) -> [f64; 2] {
    let product = a.length() * b.length();
    if product < NEAREST {
        return next_to_the_point(a, b, n, straight);
    }
    let cos = (a.dot(b) / product).clamp(-1.0, 1.0);
    let (x, factor) = if cos >= 0.0 {
        (predicates::cross(a, b), arc(cos))
    } else if cos < straight {
        return [0.0, f64::INFINITY];
    } else {
        let x = area_vector(a, b);
        let sine = (length(x) / product).min(1.0);
        if sine <= 0.0 {
            return [0.0; 2];
        }
        (x, PI / sine - arc(-cos))
    };
    [
        factor * (dot(x, n) / product),
        factor * (x.abs().dot(n.abs()) / product),
    ]
}

/// Computes [`term`] where an end is so near that its square has lost digits: only directions
/// matter.
#[cold]
#[inline(never)]
fn next_to_the_point(a: DVec3, b: DVec3, n: DVec3, straight: f64) -> [f64; 2] {
    let (a, b) = (near_one(a), near_one(b));
    if a == DVec3::ZERO || b == DVec3::ZERO {
        return [0.0; 2];
    }
    term(a, b, n, straight)
}

/// Does what [`plain`] does for polygons smaller than half their distance: angles are below 60°.
fn centred(vertices: &[DVec3], n: DVec3) -> [f64; 2] {
    // The formula holds about any point: the first vertex need not be above the horizon.
    let origin = vertices[0];
    let radius = origin.length();
    let offset = |i: usize| vertices[i] - origin;
    let cut = |i: usize, j: usize, ci: f64, cj: f64| {
        let span = cj - ci;
        offset(i) * (cj / span) + offset(j) * (-ci / span)
    };
    // Clip the offsets from the first vertex.
    let mut clipped = [DVec3::ZERO; CAPACITY];
    let count = clip_with(vertices, n, offset, cut, &mut clipped);
    if count < 3 {
        return [0.0; 2];
    }
    let measure = |e: DVec3| {
        let r = (origin + e).length();
        (r, (2.0 * origin.dot(e) + e.dot(e)) / (r + radius))
    };
    // Sum the terms of the edges.
    let mut last = clipped[count - 1];
    let (mut r_last, mut d_last) = measure(last);
    let (mut direct, mut lever) = (0.0, DVec3::ZERO);
    let (mut size, mut arm, height) = (0.0, 0.0, n.length());
    for &e in &clipped[..count] {
        let (r, d) = measure(e);
        let product = r_last * r;
        let (a, step) = (origin + last, e - last);
        let sine_squared = a.cross(step).length_squared() / (product * product);
        let cos = (a.dot(origin + e) / product).clamp(0.0, 1.0);
        let excess = sine_squared * arc_excess(cos);
        let weight = (excess + 1.0) / product;
        let change =
            excess / product - (radius * (d_last + d) + d_last * d) / (radius * radius * product);
        let (turn, push) = (predicates::cross(last, e), step * change);
        direct += weight * dot(turn, n);
        // Differences are rounded: count their magnitudes.
        size += weight * last.length() * e.length() * height;
        lever += push;
        arm += push.length();
        (last, r_last, d_last) = (e, r, d);
    }
    let moment = dot(n, predicates::cross(origin, lever));
    [
        0.5 * (direct + moment),
        0.5 * (size + radius * arm * height),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::assert_close;

    fn ring(count: u32, radius: f64, height: f64) -> Vec<DVec3> {
        (0..count)
            .map(|i| {
                let (s, c) = (2.0 * PI * f64::from(i) / f64::from(count)).sin_cos();
                DVec3::new(radius * c, radius * s, height)
            })
            .collect()
    }

    #[test]
    fn many_vertices_approach_the_disk() {
        // A regular N-gon has the area of its circle but for (2 pi^2/3)/N^2; its irradiance is
        // within the same order of the disk's pi sin^2.
        for count in [25, 46, 47, 100, 1000] {
            let e = irradiance(&ring(count, 1.0, 1.0), DVec3::Z);
            let gap = 7.0 / f64::from(count * count);
            assert_close!(e, PI / 2.0, rel = gap, "{count}-gon against the disk");
            let by_fan: f64 = {
                let ring = ring(count, 1.0, 1.0);
                (1..ring.len() - 1)
                    .map(|i| signed(&[ring[0], ring[i], ring[i + 1]], DVec3::Z))
                    .sum()
            };
            let tolerance = 8.0 * f64::EPSILON * f64::from(count);
            assert_close!(
                e,
                by_fan,
                rel = tolerance,
                "a few roundings for each of {count} triangles"
            );
        }
    }
}

//! Division of flat polygons into convex parts, and the checks that refuse invalid outlines.

use crate::patches::FLAT;
use linelit_geometry::{ConvexPolygon, DVec3};

/// The reason why an outline is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refused {
    NoArea,
    NotFlat,
    Crossing,
}

/// The largest distance of corners from the plane of their polygon, relative to its size and
/// coordinates: what rounding to `f32` in a file leaves, and what `ConvexPolygon::new` accepts.
const FILE_PRECISION: f64 = 1e-6;

/// Divides a flat polygon into convex parts: itself if it is convex, or triangles. The corners are
/// relative to a point near them; `largest` is the largest coordinate as given, to whose rounding
/// the corners are precise. Returns the reason if the outline is refused.
pub(crate) fn convex_parts(corners: &[DVec3], largest: f64) -> Result<Vec<Vec<DVec3>>, Refused> {
    if corners.len() < 3 {
        return Err(Refused::NoArea);
    }
    if corners.len() <= 16 && ConvexPolygon::new(corners).is_ok() {
        return Ok(vec![corners.to_vec()]);
    }
    // Compute Newell's normal; its length is twice the area.
    let first = corners[0];
    let fan = corners.windows(2);
    let normal: DVec3 = fan.map(|w| (w[0] - first).cross(w[1] - first)).sum();
    let size = corners
        .iter()
        .map(|v| v.distance(first))
        .fold(0.0, f64::max);
    let area = normal.length();
    if !(area > FLAT * largest * size) {
        return Err(Refused::NoArea);
    }
    let normal = normal / area;
    // Check that the polygon is flat and does not cross itself.
    let bend = corners
        .iter()
        .map(|v| normal.dot(*v - first).abs())
        .fold(0.0, f64::max);
    let extent = corners
        .iter()
        .fold(0.0_f64, |most, v| most.max(v.abs().max_element()));
    let is_flat = bend <= FILE_PRECISION * (size + extent) || bend <= FLAT * largest;
    if !is_flat || bend > 1e-3 * size {
        return Err(Refused::NotFlat);
    }
    if crosses_itself(corners, normal) {
        return Err(Refused::Crossing);
    }
    let room = FLAT * largest * size;
    let triangles = ears(corners, normal, room);
    // Cut off ears. Each has a positive area, and together they have the area of the whole, up to
    // rounding.
    let sum: f64 = triangles
        .iter()
        .map(|t| turn(t[0], t[1], t[2], normal))
        .sum();
    if (sum - area).abs() > room * corners.len() as f64 {
        return Err(Refused::Crossing);
    }
    Ok(triangles)
}

/// Returns twice the signed area of a triangle, which is positive if the triangle is
/// counter-clockwise as seen against a normal.
fn turn(a: DVec3, b: DVec3, c: DVec3, normal: DVec3) -> f64 {
    normal.dot((b - a).cross(c - a))
}

/// Whether two edges of an outline meet, except for neighbours at their common corner.
fn crosses_itself(corners: &[DVec3], normal: DVec3) -> bool {
    let n = corners.len();
    let edge = |k: usize| (corners[k], corners[(k + 1) % n]);
    let apart = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| {
        let sides = [turn(a, b, c, normal), turn(a, b, d, normal)];
        sides[0] * sides[1] > 0.0
    };
    let boxes_meet = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| {
        !(a.max(b).cmplt(c.min(d)) | c.max(d).cmplt(a.min(b))).any()
    };
    (0..n).any(|i| {
        let (a, b) = edge(i);
        let others = (i + 2..n).filter(|j| (j + 1) % n != i).map(edge);
        { others }.any(|(c, d)| boxes_meet(a, b, c, d) && !apart(a, b, c, d) && !apart(c, d, a, b))
    })
}

/// Divides a simple polygon into triangles by cutting off ears: corners whose triangle contains no
/// other corner.
fn ears(corners: &[DVec3], normal: DVec3, room: f64) -> Vec<Vec<DVec3>> {
    let mut left = corners.to_vec();
    let mut triangles = Vec::new();
    while left.len() > 3 {
        let n = left.len();
        let at = |k: usize| left[k % n];
        let is_inside = |p: DVec3, t: [DVec3; 3]| {
            let edges = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
            edges.iter().all(|(a, b)| turn(*a, *b, p, normal) >= 0.0)
        };
        let is_ear = |&k: &usize| {
            let triangle = [at(k + n - 1), at(k), at(k + 1)];
            let [a, b, c] = triangle;
            let others = (2..n - 1).map(|j| at(k + j));
            turn(a, b, c, normal) > 0.0 && { others }
                .all(|p| triangle.contains(&p) || !is_inside(p, triangle))
        };
        // Of all ears, cut off the one with the largest least angle, since slivers are numerically
        // poor.
        let quality = |k: usize| {
            let [a, b, c] = [at(k + n - 1), at(k), at(k + 1)];
            let longest = (b - a).length_squared().max((c - b).length_squared());
            turn(a, b, c, normal) / longest.max((a - c).length_squared())
        };
        let best = (0..n)
            .filter(is_ear)
            .max_by(|i, j| quality(*i).total_cmp(&quality(*j)));
        // A simple polygon has at least two ears; if none is found, there are corners on the
        // straight line between their neighbours, which are dropped.
        let flat = || {
            let is_flat = |k: &usize| turn(at(k + n - 1), at(*k), at(k + 1), normal).abs() <= room;
            (0..n).find(is_flat)
        };
        let Some(k) = best.or_else(flat) else { break };
        if best.is_some() {
            triangles.push(vec![at(k + n - 1), at(k), at(k + 1)]);
        }
        left.remove(k);
    }
    if left.len() == 3 {
        triangles.push(left);
    }
    triangles
}

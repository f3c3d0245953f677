//! Cutting polygons into triangles.

use crate::monotone;
use linelit_geometry::{DVec2, DVec3, Frame};

/// Polygons with more corners than this are swept over: ears cost time in proportion to the square
/// of the corners, but do something for every polygon that crosses itself.
const MAX_EARS: usize = 256;

/// Appends the triangles of a polygon given by its corners, all in range.
///
/// Convex polygons become fans from the first corner (a quad `0 1 2 3` becomes `0 1 2`, `0 2 3`,
/// as in pbrt); others are cut in their mean plane. Polygons of more than 256 corners that cross
/// themselves there become fans, too.
pub fn triangulate(positions: &[DVec3], corners: &[u32], out: &mut Vec<[u32; 3]>) {
    let n = corners.len();
    if n < 3 {
        return;
    }
    let fan = |out: &mut Vec<[u32; 3]>| {
        out.extend((1..n - 1).map(|k| [corners[0], corners[k], corners[k + 1]]));
    };
    if n == 3 {
        fan(out);
        return;
    }
    let points: Vec<DVec3> = corners.iter().map(|i| positions[*i as usize]).collect();
    let normal: DVec3 = (1..n - 1)
        .map(|k| (points[k] - points[0]).cross(points[k + 1] - points[0]))
        .sum();
    let Some(normal) = normal.try_normalize() else {
        fan(out);
        return;
    };
    let frame = Frame::from_normal(normal);
    let flat: Vec<DVec2> = points
        .iter()
        .map(|p| *p - points[0])
        .map(|p| DVec2::new(p.dot(frame.x), p.dot(frame.y)))
        .collect();
    if n > MAX_EARS {
        match monotone::triangulate(&flat) {
            Some(triangles) => out.extend(triangles.iter().map(|t| t.map(|k| corners[k]))),
            None => fan(out),
        }
    } else if (0..n).all(|i| turn(flat[(i + n - 1) % n], flat[i], flat[(i + 1) % n]) >= 0.0) {
        fan(out);
    } else {
        cut_ears(&flat, corners, out);
    }
}

/// Twice the signed area of a triangle.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Cuts ears off; whether a corner is an ear is asked again only when a neighbour goes, so that
/// the time is in proportion to the square of the corners.
fn cut_ears(points: &[DVec2], corners: &[u32], out: &mut Vec<[u32; 3]>) {
    let is_ear = |left: &[usize], i: usize| {
        let n = left.len();
        let (a, b, c) = (left[(i + n - 1) % n], left[i], left[(i + 1) % n]);
        let (pa, pb, pc) = (points[a], points[b], points[c]);
        let inside = |k: usize| {
            let p = points[k];
            turn(pa, pb, p) >= 0.0 && turn(pb, pc, p) >= 0.0 && turn(pc, pa, p) >= 0.0
        };
        let others = left.iter().filter(|k| ![a, b, c].contains(k));
        turn(pa, pb, pc) > 0.0 && !others.into_iter().any(|k| inside(*k))
    };
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut ears: Vec<bool> = (0..points.len()).map(|i| is_ear(&left, i)).collect();
    while left.len() > 3 {
        let n = left.len();
        // A polygon that crosses itself may have no ear: then any corner will do.
        let i = ears.iter().position(|e| *e).unwrap_or(0);
        let triangle = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
        out.push(triangle.map(|k| corners[k]));
        left.remove(i);
        ears.remove(i);
        let n = left.len();
        for neighbour in [(i + n - 1) % n, i % n] {
            ears[neighbour] = is_ear(&left, neighbour);
        }
    }
    out.push([corners[left[0]], corners[left[1]], corners[left[2]]]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concave_arrow_keeps_its_area() {
        let p = [(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (0.5, 1.0)];
        let p: Vec<DVec3> = p.iter().map(|(x, y)| DVec3::new(*x, *y, 3.0)).collect();
        let mut out = Vec::new();
        triangulate(&p, &[3, 0, 1, 2], &mut out);
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| p[i as usize]);
            0.5 * (b - a).cross(c - a).z
        };
        assert_eq!(out.len(), 2);
        assert!(out.iter().all(|t| area(t) > 0.0), "{out:?}");
        assert!((out.iter().map(area).sum::<f64>() - 1.5).abs() < 1e-12);
    }

    #[test]
    fn quads_are_cut_as_pbrt_cuts_them() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let mut out = Vec::new();
        triangulate(&p, &[0, 1, 2, 3], &mut out);
        assert_eq!(out, [[0, 1, 2], [0, 2, 3]]);
    }
}

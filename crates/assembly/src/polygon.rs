//! The triangulation of polygons, convex or not.

use linelit_geometry::{DVec2, DVec3, Frame};

/// The largest number of corners of a polygon that is not convex; polygons with more are an error,
/// as the time grows with the square of this number.
const MOST_CORNERS: usize = 1024;

/// Appends the triangles of a polygon, whose `corners` are indices of `positions`, to `out`.
///
/// Convex polygons become fans from the first corner (a quad `0 1 2 3` becomes `0 1 2`, `0 2 3`,
/// as in pbrt). Other polygons are projected to their mean plane and triangulated there.
///
/// # Errors
/// The polygon is not convex and has more than 1024 corners. The message is a sentence without its
/// subject, the polygon.
pub fn triangulate(
    positions: &[DVec3],
    corners: &[u32],
    out: &mut Vec<[u32; 3]>,
) -> Result<(), String> {
    // Make a fan of a triangle.
    let n = corners.len();
    if n < 3 {
        return Ok(());
    }
    let fan = |out: &mut Vec<[u32; 3]>| {
        out.extend((1..n - 1).map(|k| [corners[0], corners[k], corners[k + 1]]));
        Ok(())
    };
    if n == 3 {
        return fan(out);
    }
    // Project the corners to the plane of the area vector; without one, a fan is as good as any.
    let points: Vec<DVec3> = corners.iter().map(|i| positions[*i as usize]).collect();
    let normal: DVec3 = (1..n - 1)
        .map(|k| (points[k] - points[0]).cross(points[k + 1] - points[0]))
        .sum();
    let Some(normal) = normal.try_normalize() else {
        return fan(out);
    };
    let frame = Frame::from_normal(normal);
    let flat: Vec<DVec2> = points
        .iter()
        .map(|p| *p - points[0])
        .map(|p| DVec2::new(p.dot(frame.x), p.dot(frame.y)))
        .collect();
    // Make a fan of a polygon that turns left at each corner.
    if (0..n).all(|i| turn(flat[(i + n - 1) % n], flat[i], flat[(i + 1) % n]) >= 0.0) {
        return fan(out);
    }
    // Cut ears off all others.
    if n > MOST_CORNERS {
        return Err(format!(
            "has {n} corners and is not convex; at most {MOST_CORNERS} are cut into triangles"
        ));
    }
    cut_ears(&flat, corners, out);
    Ok(())
}

/// Returns twice the signed area of a triangle: positive if a, b, c turn left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Triangulates a simple polygon by ear clipping.
///
/// ```text
///       b            An ear is a corner b that turns left and whose triangle a b c with both
///      / \           neighbours contains no other corner. Every simple polygon has one. It is
///     /   \          cut off, which leaves a polygon with one corner less.
///  ──a─ ─ ─c──
/// ```
///
/// Whether a corner is an ear is tested again only when a neighbour has been cut off, so that the
/// time is in proportion to the square of the number of corners.
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
    // Cut off ears until a triangle is left. `left` has the corners that are left.
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut ears: Vec<bool> = (0..points.len()).map(|i| is_ear(&left, i)).collect();
    while left.len() > 3 {
        let n = left.len();
        // A polygon that crosses itself may have no ear; then any corner is cut off.
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
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn ring(n: u32, radius: impl Fn(u32) -> f64) -> Vec<DVec3> {
        let corner = |k| radius(k) * DVec2::from_angle(f64::from(k) * TAU / f64::from(n));
        (0..n).map(|k| corner(k).extend(3.0)).collect()
    }

    fn cut(polygon: &[DVec3]) -> Result<Vec<[u32; 3]>, String> {
        let (corners, mut out): (Vec<u32>, _) = ((0..).take(polygon.len()).collect(), Vec::new());
        triangulate(polygon, &corners, &mut out).map(|()| out)
    }

    /// Returns the area of each triangle, seen from above.
    fn areas(polygon: &[DVec3], triangles: &[[u32; 3]]) -> Vec<f64> {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| polygon[i as usize]);
            0.5 * (b - a).cross(c - a).z
        };
        triangles.iter().map(area).collect()
    }

    #[test]
    fn a_concave_arrow_keeps_its_area() {
        let p = [(0.0, 2.0), (0.5, 1.0), (0.0, 0.0), (2.0, 1.0)];
        let p = p.map(|(x, y)| DVec3::new(x, y, 3.0));
        let areas = areas(&p, &cut(&p).unwrap());
        assert_eq!(areas.len(), 2);
        assert!(areas.iter().all(|area| *area > 0.0), "{areas:?}");
        assert!((areas.iter().sum::<f64>() - 1.5).abs() < 1e-12);
    }

    #[test]
    fn quads_are_cut_as_pbrt_cuts_them() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        assert_eq!(cut(&p).unwrap(), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn of_very_many_corners_only_convex_polygons_are_cut() {
        let star = |n| cut(&ring(n, |k| 1.0 + 0.1 * f64::from(k % 2)));
        assert_eq!(star(1024).unwrap().len(), 1022);
        let message = "has 1026 corners and is not convex; at most 1024 are cut into triangles";
        assert_eq!(star(1026), Err(message.to_owned()));
        assert_eq!(cut(&ring(10_000, |_| 1.0)).unwrap().len(), 9998);
    }

    proptest! {
        #[test]
        fn stars_are_cut(radii in prop::collection::vec(0.01..10.0_f64, 5..200)) {
            let star = ring(u32::try_from(radii.len()).unwrap(), |k| radii[k as usize]);
            let areas = areas(&star, &cut(&star).unwrap());
            let fan = (0..star.len()).map(|k| (star[k], star[(k + 1) % star.len()]));
            let whole: f64 = fan.map(|(a, b)| 0.5 * a.cross(b).z).sum();
            // Coordinates up to 10: an area rounds by 6 ε · 20²/2 at most.
            prop_assert!(areas.len() == star.len() - 2 && areas.iter().all(|area| *area > -3e-13));
            prop_assert!((areas.iter().sum::<f64>() - whole).abs() < 200.0 * 6e-13);
        }
    }
}

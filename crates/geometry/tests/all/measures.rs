//! Lengths, areas and points against their definitions, up to a few roundings: identities that hold
//! for every shape.

use linelit_geometry::{
    CloseLines, ConvexPolygon, DVec2, DVec3, Margins, PlaneFrame, Segment, ShadowTriangle,
    Triangle, predicates,
};
use linelit_testkit::assert_close;
use linelit_testkit::cases::cases;
use proptest::prelude::*;

const EPS: f64 = f64::EPSILON;

fn vector() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-2.0..2.0f64).prop_map(DVec3::from_array)
}

/// Whether two points are equal up to `k` roundings of coordinates of up to `size`.
fn assert_same(a: DVec3, b: DVec3, k: f64, size: f64) {
    assert!(
        (a - b).length() <= k * EPS * size,
        "{a} {b}: {:e}",
        (a - b).length()
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(256), ..ProptestConfig::default() })]

    #[test]
    fn places_on_a_segment_divide_it(p0 in vector(), p1 in vector(), t in 0.0..1.0f64) {
        let segment = Segment::new(p0, p1);
        assert_same(segment.at(t), p0 * (1.0 - t) + p1 * t, 4.0, 4.0);
        let square = (p1.x - p0.x).powi(2) + (p1.y - p0.y).powi(2) + (p1.z - p0.z).powi(2);
        assert_close!(segment.length() * segment.length(), square, rel = 8.0 * EPS, "{segment:?}");
        assert_close!(segment.length(), segment.direction().dot(p1 - p0), rel = 8.0 * EPS, "{segment:?}");
        let piece = segment.piece(0.25 * t, t);
        assert_close!(piece.length(), 0.75 * t * segment.length(), 32.0 * EPS, "{segment:?}");
    }

    /// Lagrange's identity: (2 A)² = |u|²|v|² − (u·v)², of which rounding is relative to the first.
    #[test]
    fn areas_of_triangles_are_those_of_their_sides(a in vector(), b in vector(), c in vector(), s in 0.0..1.0f64, t in 0.0..1.0f64) {
        let triangle = Triangle::new(a, b, c);
        let (u, v) = (b - a, c - a);
        let squares = u.length_squared() * v.length_squared();
        let want = squares - u.dot(v) * u.dot(v);
        assert_close!(4.0 * triangle.area() * triangle.area(), want, 32.0 * EPS * squares, "{triangle:?}");
        let vector = triangle.area_vector();
        assert_close!(vector.length(), 2.0 * triangle.area(), rel = 4.0 * EPS, "{triangle:?}");
        assert_same(vector, triangle.normal() * (2.0 * triangle.area()), 8.0, 32.0);
        assert_same(triangle.centroid(), (a + b + c) / 3.0, 8.0, 4.0);
        assert_same(triangle.at(s, t), a * (1.0 - s - t) + b * s + c * t, 8.0, 8.0);
    }

    /// The condition for the nearest point q of a convex set: no corner x is farther in the
    /// direction of p than q is, (p − q)·(x − q) ≤ 0, and q itself is in the set. Weights are
    /// quotients by the square of the doubled area.
    #[test]
    fn no_corner_is_beyond_the_nearest_point(a in vector(), b in vector(), c in vector(), p in vector()) {
        let triangle = Triangle::new(a, b, c);
        prop_assume!(triangle.area() > 0.1);
        let q = triangle.nearest(p);
        let rounding = 64.0 * EPS * 64.0 / triangle.area().powi(2).min(1.0);
        for corner in [a, b, c] {
            let towards = (p - q).dot(corner - q);
            prop_assert!(towards <= rounding, "{triangle:?} {p}: {towards:e}");
        }
        let normal = triangle.normal();
        prop_assert!((q - a).dot(normal).abs() <= rounding, "{triangle:?} {p}");
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let inside = normal.dot((to - from).cross(q - from));
            prop_assert!(inside >= -rounding, "{triangle:?} {p}: {inside:e}");
        }
    }

    #[test]
    fn frames_of_a_plane_measure_it(origin in vector(), normal in vector(), tangent in vector(), p in vector(), angle in -3.0..3.0f64) {
        prop_assume!(normal.cross(tangent).length() > 0.05);
        let frame = PlaneFrame::new(origin, normal, tangent);
        // The plane coordinates and the height determine a point.
        let there = frame.from_plane(frame.to_plane(p)) + frame.axes.z * frame.height(p);
        assert_same(there, p, 16.0, 8.0);
        assert_close!(frame.height(p), normal.dot(p - origin) / normal.length(), 16.0 * EPS * 8.0, "{frame:?}");
        let turned = frame.turned(angle);
        assert_close!(turned.turn_from(&frame), angle, 32.0 * EPS, "{frame:?}");
        assert_same(turned.from_plane(DVec2::X), frame.from_plane(DVec2::new(angle.cos(), angle.sin())), 16.0, 4.0);
    }

    /// A clipped polygon keeps its corners on the right side, and has new ones on the border.
    #[test]
    fn clipped_polygons_end_at_the_border(angle in 0.0..6.3f64, at in -0.9..0.9f64, tilt in -1.0..1.0f64) {
        let corners: Vec<DVec3> = (0..7).map(|k| { let (s, c) = (0.9 * f64::from(k)).sin_cos(); DVec3::new(c, s, 1.0) }).collect();
        let polygon = ConvexPolygon::new(&corners).expect("a polygon");
        let direction = DVec3::new(angle.cos(), angle.sin(), tilt);
        let point = DVec3::new(at * angle.cos(), at * angle.sin(), 1.0);
        let Some(kept) = polygon.clip(point, direction) else { return Ok(()) };
        for &v in kept.vertices() {
            let side = direction.dot(v - point);
            let is_old = polygon.vertices().contains(&v);
            prop_assert!(if is_old { side >= 0.0 } else { side.abs() <= 16.0 * EPS }, "{v}: {side:e}");
        }
    }

    /// The point of the line that a chord reports for one of its own points is the projection of
    /// that point: both are on one line with the shading point, up to the rounding of the chord's
    /// ends over the sine of the angle between the triangle and the shadow triangle.
    #[test]
    fn places_of_a_cut_are_before_their_points(x in vector(), p0 in vector(), p1 in vector(), t in prop::array::uniform3(vector()), s in 0.0..1.0f64) {
        let line = Segment::new(p0, p1);
        let Some(shadow) = ShadowTriangle::new(x, &line) else { return Ok(()) };
        let Some(chord) = shadow.chord(&t.map(|p| shadow.vertex(p))) else { return Ok(()) };
        let fan = (p0 - x).cross(p1 - x);
        let triangle = Triangle::new(t[0], t[1], t[2]);
        let sine = fan.normalize().cross(triangle.normal()).length();
        prop_assume!(fan.length() > 0.1 && triangle.area() > 0.1 && sine > 0.1);
        let ends = chord.ends().map(|[b, c]| triangle.at(b, c));
        let place = ends[0] * (1.0 - s) + ends[1] * s;
        let behind = line.at(chord.t(s)) - x;
        let off = behind.cross(place - x).length() / behind.length();
        // Positions are quotients by heights of corners over the plane of the line.
        prop_assume!(ends.iter().all(|e| e.distance(x) > 0.1));
        let lowest = t.iter().map(|p| shadow.vertex(*p).sigma.abs()).fold(f64::INFINITY, f64::min);
        prop_assert!(off <= 1e3 * EPS / lowest.min(1.0), "{off:e} {lowest}");
    }

    /// By the definition, and from 1e-15 to 1e-2 of the plane.
    #[test]
    fn heights_nearby_are_known_to_themselves(exponent in -15.0..-2.0f64, foot in prop::array::uniform2(-0.3..0.3f64), angle in 0.0..3.0f64) {
        // Exactly in a plane of one coordinate.
        let height = 10f64.powf(exponent);
        let corners = [(-1.0, -0.5), (1.0, -0.75), (0.25, 1.0)].map(|(u, v)| DVec3::new(u, v, 0.0));
        let polygon = ConvexPolygon::new(&corners).expect("a triangle");
        let x = DVec3::new(foot[0], foot[1], -height);
        let close = CloseLines::new(&polygon, angle, x, DVec3::Z).expect("all of it is above");
        assert_close!(close.height, height, rel = 16.0 * EPS, "{x}");
    }

    #[test]
    fn margins_grow_with_the_reach(reach in 0.0..3.0f64, distance in 0.1..3.0f64) {
        let margins = Margins { point: 1e-3, light: 0.0 };
        let want = 1e-3 * (reach / distance).min(1.0);
        assert_close!(margins.near(reach, distance), want, rel = 4.0 * EPS, "{reach} {distance}");
    }

    /// Exactly two times the largest distance where one of its ends is the first corner, which here
    /// is one of the three sides of every other triangle at least.
    #[test]
    fn diameters_are_twice_the_largest_distance_from_the_first_corner(corners in prop::array::uniform3(vector())) {
        let Ok(polygon) = ConvexPolygon::new(&corners) else { return Ok(()) };
        let [a, b, c] = corners;
        let from_first = a.distance(b).max(a.distance(c));
        assert_close!(polygon.diameter(), 2.0 * from_first, rel = 4.0 * EPS, "{corners:?}");
        prop_assert!(polygon.diameter() >= b.distance(c) * (1.0 - 4.0 * EPS), "{corners:?}");
    }

    #[test]
    fn lengths_are_roots_of_squares(v in vector(), exponent in -300..300_i32) {
        let scaled = v * 2f64.powi(exponent);
        let want = v.length() * 2f64.powi(exponent);
        assert_close!(predicates::length(scaled), want, rel = 4.0 * EPS, "{scaled}");
        if let Some(unit) = predicates::normalize(scaled) {
            assert_same(unit * v.length(), v, 8.0, 4.0);
        }
    }
}

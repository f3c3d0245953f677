//! What a query cannot represent in its numbers is never reported as visible.

use crate::common::{self, InSpace, Mesh, NONE, by_hand, chord, light, nearest, soup};
use linelit_geometry::{ConvexPolygon, DVec3, MAX_VERTICES, Segment};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{LightCorners, Occluders, Ray, Scratch, ShaftClass, ShaftQuery};
use proptest::prelude::*;

/// The visible fractions of lines on a light, and whether the points in their middles are.
fn ask(
    mesh: &Mesh,
    point: DVec3,
    corners: &[DVec3],
    lines: &[Segment],
) -> (ShaftClass, Vec<(f64, bool)>) {
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    let mut scratch = Scratch::new();
    let (class, out) = common::ask(&occluders, point, (corners, lines), &NONE, &mut scratch);
    let query = ShaftQuery::new(point, LightCorners::new(corners).unwrap());
    let mut shaft = occluders.shaft(query, &mut scratch);
    let seen = (0..lines.len())
        .map(|i| (out.fraction(i), shaft.point_visible(lines[i].at(0.5))))
        .collect();
    (class, seen)
}

/// Coordinates up to 1e18, many of them equal, in the plane of the point, in the light's plane, or
/// next to it.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -2.0..2.0_f32,
        2 => prop::sample::select(vec![0.0, 1.0, 0.999_999, 1e-10, -1e-10, 0.5, 4096.0, 1e-38]),
        1 => (-1.0..1.0_f32, -40..18).prop_map(|(m, e)| m * 10.0_f32.powi(e)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: linelit_testkit::cases::cases(96),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Polygons of any number of corners, cut by one to eight horizons: as many corners as there
    /// can be.
    #[test]
    fn lights_cut_by_horizons_agree_with_brute_force(
        seed in any::<u64>(),
        corners in prop_oneof![3..=MAX_VERTICES, Just(MAX_VERTICES)],
        cuts in 1..=8,
        wall in any::<bool>(),
    ) {
        let mut rng = SplitMix64::new(seed);
        // The whole light is beyond the wall: a parallelogram extends up to 1.7 from its corner.
        let whole = light(&mut rng, corners, DVec3::new(0.0, 0.0, 1.9), 0.8);
        let mut polygon = ConvexPolygon::new(&whole).unwrap();
        for _ in 0..cuts {
            // Close to a corner, so that the clip adds one.
            let v = polygon.vertices();
            let corner = v[rng.index(v.len())];
            let inwards = polygon.centroid() - corner;
            let at = corner + inwards * rng.in_range(0.001, 0.04);
            polygon = polygon.clip(at, inwards + rng.in_cube(0.02)).unwrap_or(polygon);
        }
        let mut mesh = soup(&mut rng, 60, 0.3, DVec3::ZERO, 1.0);
        if wall {
            let corner = |x: f64, y: f64| DVec3::new(x, y, 0.1);
            mesh.triangle(corner(-90.0, -90.0), corner(90.0, -90.0), corner(0.0, 90.0));
        }
        let point = rng.in_cube(0.5) - DVec3::Z;
        let lines: Vec<_> =
            (0..9).map(|_| chord(&mut rng, polygon.vertices(), Some(0.7))).collect();
        let (class, seen) = ask(&mesh, point, polygon.vertices(), &lines);
        for (line, (got, _)) in lines.iter().zip(seen) {
            let want = by_hand(&mesh, point, line);
            // As in `agreement`: 1e-9 of the line.
            prop_assert!((got - want).abs() <= 1e-9, "{} {} {:?}", got, want, class);
            prop_assert!(!wall || got == 0.0);
        }
    }

    /// A wall hides the light no matter what else is there: triangles of any size, slivers, and
    /// triangles along the planes at which kernels clip.
    #[test]
    fn nothing_opens_a_wall(
        corners in prop::collection::vec(prop::array::uniform3(coordinate()), 3..60),
        number in 2..=MAX_VERTICES,
        seed in any::<u64>(),
    ) {
        let mut rng = SplitMix64::new(seed);
        let mut mesh = Mesh::default();
        for triangle in corners.chunks_exact(3) {
            let at = |k: usize| DVec3::from(triangle[k].map(f64::from));
            mesh.triangle(at(0), at(1), at(2));
        }
        let corner = |x: f64, y: f64| DVec3::new(x, y, 0.5);
        mesh.triangle(corner(-90.0, -90.0), corner(90.0, -90.0), corner(0.0, 90.0));
        // The whole light is beyond the wall: a parallelogram extends up to 0.85 from its corner.
        let whole = light(&mut rng, number, DVec3::Z * 1.5, 0.4);
        let lines: Vec<_> = (0..9).map(|_| chord(&mut rng, &whole, Some(0.7))).collect();
        let (_, seen) = ask(&mesh, rng.in_cube(0.05), &whole, &lines);
        prop_assert_eq!(seen, vec![(0.0, false); 9]);
    }

    /// Lights far beyond all occluders, as moons and suns are, seen as if through a window. Brute
    /// force determines what hides them, and so do rays that begin at the point itself, which
    /// ignore how close an occluder may be.
    #[test]
    fn lights_beyond_the_scene_agree_with_brute_force(
        seed in any::<u64>(),
        corners in 2..=MAX_VERTICES,
        distance in (0.0..29.0_f64).prop_map(|e| 10.0_f64.powf(e)),
        size in -3.0..0.0_f64,
        dense in any::<bool>(),
    ) {
        let mut rng = SplitMix64::new(seed);
        let towards = (DVec3::Z + rng.in_cube(0.5)) * distance;
        let size = 10.0_f64.powf(size) * distance;
        let v = light(&mut rng, corners, towards, size);
        let count = if dense { 900 } else { 40 };
        let mesh = soup(&mut rng, count, 0.5, DVec3::Z * 1.1, 1.0);
        let point = rng.in_cube(1.0);
        let lines: Vec<_> = if corners == 2 {
            vec![Segment::new(v[0], v[1])]
        } else {
            (0..5).map(|_| chord(&mut rng, &v, None)).collect()
        };
        let (_, seen) = ask(&mesh, point, &v, &lines);
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let on_light = (&v[..], &lines[..]);
        let (_, out) = common::ask(&occluders, point, on_light, &NONE, &mut Scratch::new());
        for (i, (line, (got, middle))) in lines.iter().zip(seen).enumerate() {
            let want = by_hand(&mesh, point, line);
            prop_assert!((got - want).abs() <= 1e-9, "{} {} at {:e}", got, want, distance);
            prop_assert!(if middle { want > 0.0 } else { want < 1.0 }, "{} {}", want, middle);
            for k in 0..8 {
                let t = (f64::from(k) + 0.5) / 8.0;
                let ends = out.line(i).iter().flat_map(|part| [part.lo, part.hi]);
                let ray = Ray {
                    origin: point,
                    direction: line.at(t) - point,
                    t_min: 0.0,
                    t_max: 1.0,
                };
                if let Some(hit) = nearest(&mesh, &ray)
                    && ends.fold(1.0, |room: f64, end| room.min((end - t).abs())) > 1e-6
                {
                    let sees = out.line(i).iter().any(|part| part.lo < t && t < part.hi);
                    prop_assert_eq!(sees, hit.is_none_or(|hit| hit > 1.0), "{} at {:e}", t, distance);
                }
            }
        }
    }

    /// Lights seen edge on up to the last digits, from outside and from within, and lights far
    /// larger and smaller than `f32` can represent.
    #[test]
    fn lights_beyond_the_kernels_agree_with_brute_force(
        seed in any::<u64>(),
        corners in 3..=MAX_VERTICES,
        above in prop_oneof![
            Just(0.0),
            -1e-16..1e-16,
            (-17.0..-3.0_f64).prop_map(|e| 10.0_f64.powf(e)),
            (-17.0..-3.0_f64).prop_map(|e| -10.0_f64.powf(e)),
        ],
        inside in any::<bool>(),
    ) {
        let mut rng = SplitMix64::new(seed);
        let whole = light(&mut rng, corners, DVec3::ZERO, 0.8);
        let polygon = ConvexPolygon::new(&whole).unwrap();
        let v = polygon.vertices();
        let away = if inside { DVec3::ZERO } else { (v[0] - polygon.centroid()) * 2.0 };
        let point = polygon.centroid() + away + polygon.normal() * above;
        let mesh = soup(&mut rng, 40, 0.5, DVec3::ZERO, 0.7);
        let lines: Vec<_> = (0..5).map(|_| chord(&mut rng, v, None)).collect();
        let (_, seen) = ask(&mesh, point, v, &lines);
        for (line, (got, _)) in lines.iter().zip(seen) {
            // Lines that are seen end on, too, have no shadow triangle to tell where they end.
            let offset = (point - line.p0).cross(line.vector().normalize()).length();
            if offset > 1e-3 {
                let want = by_hand(&mesh, point, line);
                // As in `agreement`: 1e-9 of the line. Also, points on the light are known to four
                // roundings of its corners, divided by the least height at which its frame is used:
                // add how much lines differ that are this far to either side.
                let aside = polygon.normal().cross(line.vector()).normalize() * (4.0 * f64::EPSILON / 1e-5);
                let moved = [aside, -aside].map(|d| {
                    by_hand(&mesh, point, &Segment::new(line.p0 + d, line.p1 + d))
                });
                let room = 1e-9 + (moved[0] - moved[1]).abs();
                prop_assert!((got - want).abs() <= room, "{} {} {:e}", got, want, room);
            }
        }
    }
}

/// A wall before lights of any size, near and far, even beyond what `f32` can represent, as long as
/// the square of a shadow triangle's area is finite and normal.
#[test]
fn walls_hide_lights_of_any_size() {
    let mut mesh = Mesh::default();
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.5);
    mesh.triangle(corner(-9.0, -9.0), corner(9.0, -9.0), corner(0.0, 20.0));
    // Hides half of what is beyond it: y > 0.
    let mut half = Mesh::default();
    half.triangle(corner(-900.0, 0.0), corner(900.0, 0.0), corner(0.0, 2000.0));
    for exponent in (-300..=75).step_by(3) {
        let size = 10f64.powi(exponent);
        // Small lights at a distance of one, large ones at a distance of their size.
        let centre = DVec3::Z * size.max(1.0);
        let square = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]
            .map(|(x, y)| centre + DVec3::new(x * size, y * size, 0.0));
        let lines = [
            Segment::new(square[0], square[3]),
            Segment::new(square[0].midpoint(square[1]), square[2].midpoint(square[3])),
            Segment::new(square[1], square[2]),
        ];
        let (_, seen) = ask(&mesh, DVec3::ZERO, &square, &lines);
        assert_eq!(seen, [(0.0, false); 3], "1e{exponent}");
        let (_, seen) = ask(&mesh, DVec3::ZERO, &[square[0], square[2]], &lines[1..2]);
        assert_eq!(seen, [(0.0, false)], "1e{exponent}");
        let (_, seen) = ask(&half, DVec3::ZERO, &square, &lines);
        for (line, (got, _)) in lines.iter().zip(seen) {
            let (want, room) = match exponent {
                // The largest coordinate, 2,000, is more than 1e15 sizes of the light: it counts as
                // visible only if both ends are.
                ..=-12 => (0.0, 0.0),
                // A few roundings of that coordinate in units of the light.
                -11..0 => (0.5, 8.0 * f64::EPSILON * 2000.0 / size),
                _ => (by_hand(&half, DVec3::ZERO, line), 1e-9),
            };
            assert!((got - want).abs() <= room, "1e{exponent}: {got} {want}");
        }
    }
}

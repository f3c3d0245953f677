//! Degenerate input: the cases that a scene should not contain, and does.

use crate::common::{InSpace, Mesh, NONE, ask, by_hand, nearest, soup};
use linelit_geometry::{DVec3, Segment};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{
    LightCorners, Occluders, Ray, Scratch, ShaftClass, ShaftQuery, VisibleLines,
};

/// A unit square light at height two, and three lines on it.
fn square() -> (Vec<DVec3>, Vec<Segment>) {
    let o = DVec3::new(-0.5, -0.5, 2.0);
    let light = vec![o, o + DVec3::X, o + DVec3::X + DVec3::Y, o + DVec3::Y];
    let lines = [0.0, 0.37, 1.0]
        .map(|s| Segment::new(o + DVec3::X * s, o + DVec3::X * s + DVec3::Y))
        .to_vec();
    (light, lines)
}

/// The fractions of the square's lines that are visible from `point`, which must agree with brute
/// force.
fn fractions(mesh: &Mesh, point: DVec3) -> (ShaftClass, Vec<f64>) {
    let (light, lines) = square();
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    let on_light = (&light[..], &lines[..]);
    let (class, out) = ask(&occluders, point, on_light, &NONE, &mut Scratch::new());
    let got: Vec<f64> = (0..lines.len()).map(|i| out.fraction(i)).collect();
    for (line, got) in lines.iter().zip(&got) {
        if (line.p0 - point).cross(line.p1 - point) == DVec3::ZERO {
            // Seen end on: no shadow triangle.
            assert!([0.0, 1.0].contains(got), "{got}");
            continue;
        }
        let want = by_hand(mesh, point, line);
        assert!(
            (got - want).abs() < 1e-9,
            "{got} {want} of {line:?} from {point}"
        );
    }
    (class, got)
}

fn one(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.triangle(a.into(), b.into(), c.into());
    mesh
}

#[test]
fn nothing_at_all() {
    let (class, f) = fractions(&Mesh::default(), DVec3::ZERO);
    assert_eq!((class, f), (ShaftClass::Empty, vec![1.0; 3]));
}

#[test]
fn one_occluder_hides_the_light() {
    let mesh = one([-9.0, -9.0, 1.0], [9.0, -9.0, 1.0], [0.0, 20.0, 1.0]);
    let (class, f) = fractions(&mesh, DVec3::ZERO);
    assert_eq!((class, f), (ShaftClass::Blocked, vec![0.0; 3]));
}

#[test]
fn occluders_behind_the_point_beyond_or_in_the_light() {
    for z in [-1.0, 2.0, 3.0] {
        let mesh = one([-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 20.0, z]);
        let (class, f) = fractions(&mesh, DVec3::ZERO);
        assert_eq!((class, f), (ShaftClass::Empty, vec![1.0; 3]), "{z}");
    }
}

#[test]
fn occluder_that_touches_the_light_or_crosses_its_plane() {
    // From below into the light's plane, and through it.
    for top in [2.0, 2.7] {
        let mesh = one([-9.0, 0.0, 1.0], [9.0, 0.0, 1.0], [0.0, 0.0, top]);
        fractions(&mesh, DVec3::ZERO);
        fractions(&mesh, DVec3::new(0.1, 3.0, 0.3));
    }
}

#[test]
fn occluder_around_the_shading_point() {
    let floor = one([-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 20.0, 0.0]);
    // On the occluder's plane, just above and just below it.
    let (class, f) = fractions(&floor, DVec3::new(0.0, 0.0, 2e-6));
    assert_eq!((class, f), (ShaftClass::Empty, vec![1.0; 3]));
    let (_, f) = fractions(&floor, DVec3::new(0.0, 0.0, -2e-6));
    assert_eq!(f, vec![0.0; 3]);
    fractions(&floor, DVec3::ZERO);
    // Through the plane W = 0, on an edge, and at a corner.
    let wall = one([0.1, -9.0, -5.0], [0.1, 9.0, -5.0], [0.2, 0.0, 9.0]);
    fractions(&wall, DVec3::ZERO);
    fractions(&wall, DVec3::new(0.1, -9.0, -5.0));
    fractions(&wall, DVec3::new(0.1, 0.0, -5.0));
    fractions(&wall, DVec3::new(0.15, 0.0, 2.0 - 1e-4));
}

#[test]
fn the_point_in_the_lights_plane() {
    let mut rng = linelit_testkit::cases::rng(3);
    let mesh = soup(&mut rng, 50, 0.5, DVec3::new(0.0, 0.0, 1.5), 1.0);
    // Points in the light's plane, in the light itself, and slightly off the plane.
    let places = [
        DVec3::new(4.0, 0.3, 2.0),
        DVec3::new(0.1, 0.2, 2.0),
        DVec3::new(4.0, 0.3, 2.0 + 1e-15),
        square().0[0],
    ];
    let seen = places.map(|point| fractions(&mesh, point).1);
    let hidden = seen.iter().flatten().filter(|f| **f < 1.0).count();
    assert!(hidden >= 3, "{hidden}");
}

#[test]
fn lights_and_lines_without_extent() {
    let mesh = one([-9.0, -9.0, 1.0], [9.0, -9.0, 1.0], [0.0, 20.0, 1.0]);
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    let mut scratch = Scratch::new();
    let mut out = VisibleLines::new();
    let p = DVec3::new(0.0, 0.0, 2.0);
    let towards = [p, p * 2.0];
    let nan = [p, DVec3::NAN, DVec3::X];
    assert_eq!(LightCorners::new(&[]), None);
    assert_eq!(LightCorners::new(&[p]), None);
    // Such a light has no frame, but queries are answered nevertheless: a triangle is before `p`,
    // and none before the lines below it.
    let below = DVec3::new(0.3, 0.2, 0.5);
    for light in [&[p, p][..], &[p, p, p], &towards, &nan] {
        let query = ShaftQuery::new(DVec3::ZERO, LightCorners::new(light).unwrap());
        let mut shaft = occluders.shaft(query, &mut scratch);
        assert_eq!(shaft.class(), ShaftClass::Partial, "{light:?}");
        assert!(shaft.is_dense() && shaft.images().is_none());
        let asked = [
            (Segment::new(p, p), 0.0),
            (Segment::new(p, p * 2.0), 0.0),
            (Segment::new(p * 0.2, p * 0.3), 1.0),
            (Segment::new(p, p + DVec3::X), 0.0),
            (Segment::new(below, below + DVec3::X), 1.0),
            (Segment::new(below, DVec3::NAN), 0.0),
        ];
        shaft.visible(&asked.map(|a| a.0), &mut out);
        for (i, (line, want)) in asked.iter().enumerate() {
            let got = out.fraction(i);
            assert!(
                (got - want).abs() < 1e-12,
                "{light:?} {line:?}: {got} {want}"
            );
        }
        assert!(!shaft.point_visible(p) && !shaft.point_visible(DVec3::NAN));
        assert!(shaft.point_visible(below));
    }
    // A line without length among others, on an ordinary light: nothing of it is visible.
    let half = one([-9.0, 0.0, 1.0], [9.0, 0.0, 1.0], [0.0, 20.0, 1.0]);
    let occluders = Occluders::build(&half.positions, &half.triangles);
    let (light, mut lines) = square();
    lines.insert(1, Segment::new(p, p));
    lines.push(Segment::new(p, DVec3::NAN));
    let query = ShaftQuery::new(DVec3::ZERO, LightCorners::new(&light).unwrap());
    let mut shaft = occluders.shaft(query, &mut scratch);
    shaft.visible(&lines, &mut out);
    let got: Vec<f64> = (0..lines.len()).map(|i| out.fraction(i)).collect();
    for (got, want) in got.iter().zip([0.5, 0.0, 0.5, 0.5, 0.0]) {
        assert!((got - want).abs() < 1e-12, "{got} {want}");
    }
}

#[test]
fn triangles_that_hide_nothing_are_left_out() {
    let mut mesh = one([-9.0, -9.0, 1.0], [9.0, -9.0, 1.0], [0.0, 20.0, 1.0]);
    let v = mesh.positions.len();
    mesh.positions
        .extend([[f32::NAN, 0.0, 0.0], [f32::INFINITY, 0.0, 0.0]]);
    let v = u32::try_from(v).unwrap();
    mesh.triangles
        .extend([[0, 1, v], [0, 1, v + 1], [0, 1, 99], [0, 0, 1], [2, 1, 2]]);
    let mut occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    assert_eq!((occluders.triangle_count(), occluders.left_out()), (1, 5));
    assert!(occluders.memory() > 0);
    // One of them is the caller's mistake: a corner index without a position.
    assert_eq!(occluders.out_of_range(), 1);
    mesh.triangles[3] = [0, 1, v];
    occluders.refit(&mesh.positions, &mesh.triangles);
    assert_eq!((occluders.left_out(), occluders.out_of_range()), (5, 0));
}

#[test]
fn triangles_without_positions_are_counted_in_all_threads() {
    // More triangles than one parallel task handles, in several threads.
    let triangles: Vec<[u32; 3]> = (0..100_000)
        .map(|i| [i % 7, i % 7 + 1, i % 7 + 2])
        .collect();
    let positions: Vec<[f32; 3]> = (0..8_u8).map(|i| [i.into(), (i * i).into(), 1.0]).collect();
    let expected = triangles.iter().filter(|t| t[2] > 7).count();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(3)
        .build()
        .unwrap();
    for occluders in [
        Occluders::build(&positions, &triangles),
        pool.install(|| Occluders::build(&positions, &triangles)),
    ] {
        assert_eq!(occluders.out_of_range(), expected);
        assert_eq!(occluders.left_out(), expected);
    }
}

#[test]
fn rays_that_are_none() {
    let mesh = one([-9.0, -9.0, 1.0], [9.0, -9.0, 1.0], [0.0, 20.0, 1.0]);
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    let mut scratch = Scratch::new();
    let good = Ray {
        origin: DVec3::ZERO,
        direction: DVec3::Z,
        t_min: 0.0,
        t_max: f64::INFINITY,
    };
    let hit = occluders.closest_hit(&good, &mut scratch).unwrap();
    assert_eq!(hit.t.to_bits(), 1.0_f64.to_bits());
    for bad in [
        Ray {
            direction: DVec3::ZERO,
            ..good
        },
        Ray {
            direction: DVec3::NAN,
            ..good
        },
        Ray {
            origin: DVec3::INFINITY,
            ..good
        },
        Ray {
            t_min: f64::NAN,
            ..good
        },
        Ray {
            t_min: 2.0,
            t_max: 1.0,
            ..good
        },
        Ray { t_max: 0.5, ..good },
        Ray {
            direction: DVec3::X,
            ..good
        },
    ] {
        assert_eq!(occluders.closest_hit(&bad, &mut scratch), None, "{bad:?}");
        assert!(!occluders.any_hit(&bad, &NONE, &mut scratch), "{bad:?}");
    }
    assert!(!occluders.any_hit(&good, &(0..1), &mut scratch));
}

/// A closed box.
fn closed_box(lo: DVec3, hi: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    let corner = |k: usize| {
        let pick = |bit: usize, a: f64, b: f64| if k >> bit & 1 == 0 { a } else { b };
        DVec3::new(
            pick(0, lo.x, hi.x),
            pick(1, lo.y, hi.y),
            pick(2, lo.z, hi.z),
        )
    };
    for k in 0..8 {
        mesh.vertex(corner(k));
    }
    for [a, b, c, d] in [
        [0, 1, 3, 2],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 3, 7, 5],
    ] {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

#[test]
fn the_point_inside_a_mesh() {
    // The light is outside: hidden from every point inside, also from a wall's inner side.
    let small = closed_box(DVec3::splat(-0.5), DVec3::splat(0.5));
    let mut rng = linelit_testkit::cases::rng(5);
    for _ in 0..200 {
        let (_, f) = fractions(&small, rng.in_cube(0.499));
        assert_eq!(f, vec![0.0; 3]);
    }
    for point in [
        DVec3::new(0.499_999, 0.1, 0.2),
        DVec3::new(0.0, 0.0, 0.499_999),
        DVec3::new(0.499_999, 0.499_999, 0.499_999),
    ] {
        let (_, f) = fractions(&small, point);
        assert_eq!(f, vec![0.0; 3], "{point}");
    }
    // The point is between the box and the light: the light is visible.
    let (class, f) = fractions(&small, DVec3::new(0.0, 0.0, 0.7));
    assert_eq!((class, f), (ShaftClass::Empty, vec![1.0; 3]));
    // The light and the point are both inside: visible.
    let room = closed_box(DVec3::splat(-3.0), DVec3::splat(3.0));
    for _ in 0..200 {
        let (class, f) = fractions(&room, rng.in_cube(1.9));
        assert_eq!((class, f), (ShaftClass::Empty, vec![1.0; 3]));
    }
}

#[test]
fn occluders_seen_edge_on() {
    // A triangle in a plane with the shading point hides nothing, in any orientation.
    for mesh in [
        one([0.0, -9.0, 0.0], [0.0, 9.0, 0.0], [0.0, 0.0, 5.0]),
        one([-0.1, 0.0, 0.5], [0.1, 0.0, 0.5], [0.0, 0.0, 1.9]),
        one([-0.5, -0.5, 1.0], [0.5, 0.5, 1.0], [0.25, 0.25, 1.5]),
    ] {
        let (_, f) = fractions(&mesh, DVec3::ZERO);
        // The visible part is cut in two at most, at a rounded position.
        assert!(
            f.iter().all(|f| (f - 1.0).abs() <= 4.0 * f64::EPSILON),
            "{f:?}"
        );
    }
}

/// The same picture a million times larger or smaller; with powers of two, to the bit.
#[test]
fn scaled_scenes_look_the_same() {
    let mut rng = linelit_testkit::cases::rng(6);
    let mut scratch = Scratch::new();
    for case in 0..60 {
        let mesh = soup(&mut rng, 80, 0.4, DVec3::new(0.0, 0.0, 1.0), 1.0);
        let point = rng.in_cube(0.3) - DVec3::Z;
        let (light, lines) = square();
        let mut look = |scale: f64| {
            let mut large = mesh.clone();
            for v in large.positions.as_flattened_mut() {
                #[allow(clippy::cast_possible_truncation, reason = "as f32 as the original")]
                {
                    *v = (f64::from(*v) * scale) as f32;
                }
            }
            let occluders = Occluders::build(&large.positions, &large.triangles);
            let light: Vec<DVec3> = light.iter().map(|v| *v * scale).collect();
            let lines: Vec<Segment> = lines
                .iter()
                .map(|l| Segment::new(l.p0 * scale, l.p1 * scale))
                .collect();
            let on_light = (&light[..], &lines[..]);
            let (_, out) = ask(&occluders, point * scale, on_light, &NONE, &mut scratch);
            (0..lines.len())
                .map(|i| out.fraction(i))
                .collect::<Vec<f64>>()
        };
        let plain = look(1.0);
        for scale in [1e6, 1e-6] {
            // Vertices move by half an f32 unit, 6e-8 of a coordinate up to two; the light is one
            // across, at least half as far again as an occluder, and a line crosses sides at up
            // to a slope of a hundred.
            for (a, b) in plain.iter().zip(look(scale)) {
                assert!((a - b).abs() <= 1e-3, "case {case}, {scale:e}: {a} {b}");
            }
        }
        for power in [20, -20] {
            assert_eq!(plain, look(2.0_f64.powi(power)), "case {case}, 2^{power}");
        }
    }
}

/// A thousand copies of a triangle, and a row of triangles in one plane.
#[test]
fn copies_and_rows() {
    let mut rng = SplitMix64::new(11);
    let mut copies = Mesh::default();
    let mut row = Mesh::default();
    for k in 0..1000 {
        copies.triangle(
            DVec3::new(-0.4, -0.3, 1.0),
            DVec3::new(0.5, -0.2, 1.0),
            DVec3::new(0.0, 0.6, 1.0),
        );
        let x = 0.01 * f64::from(k - 500);
        row.triangle(
            DVec3::new(x, -0.2, 1.0),
            DVec3::new(x + 0.01, -0.2, 1.0),
            DVec3::new(x, 0.3, 1.0),
        );
    }
    for mesh in [copies, row] {
        let mut seen = [false; 2];
        for _ in 0..100 {
            let (_, f) = fractions(&mesh, rng.in_cube(0.5) - DVec3::Z * 0.2);
            seen[0] |= f.iter().any(|f| *f < 0.99);
            seen[1] |= f.iter().any(|f| *f > 0.01);
        }
        assert_eq!(seen, [true; 2]);
    }
}

/// A strip of which a few corners are far away: farther than areas fit into `f32` from 2e19 on.
#[test]
fn corners_far_away() {
    let mut rng = SplitMix64::new(12);
    let mut scratch = Scratch::new();
    for far in [1e15_f32, 1e18, 1e19, 1e20, 1e25, 1e30, f32::MAX] {
        let mut mesh = Mesh::default();
        for k in 0..30_u8 {
            let x = 0.2 * f64::from(k) - 3.0;
            mesh.triangle(
                DVec3::new(x, -1.0, 1.0),
                DVec3::new(x + 0.2, -1.0, 1.0),
                DVec3::new(x, 1.0, 1.1),
            );
        }
        for (axis, k) in [(2, 0), (0, 40), (1, 80)] {
            mesh.positions[k][axis] = far;
        }
        // Two such corners of one triangle: a product of their coordinates overflows.
        mesh.positions[45] = [far, far, 1.0];
        mesh.positions[46] = [0.5 * far, far, 1.0];
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        assert_eq!(occluders.left_out(), 0);
        let mut hits = 0;
        for _ in 0..300 {
            let origin = rng.in_cube(0.5) - DVec3::Z;
            let ray = Ray {
                origin,
                direction: rng.in_cube(1.0) + DVec3::Z * 0.7,
                t_min: 0.0,
                t_max: f64::INFINITY,
            };
            let Some(want) = nearest(&mesh, &ray) else {
                continue;
            };
            let hit = occluders.closest_hit(&ray, &mut scratch);
            // t is the quotient of a volume and an area, of which a slanted plane loses 1e6
            // roundings.
            let same = match (hit, want) {
                (Some(hit), Some(t)) => (hit.t - t).abs() <= 1e6 * f64::EPSILON * t,
                (None, None) => true,
                (Some(_), None) | (None, Some(_)) => false,
            };
            assert!(same, "{far:e}, {ray:?}: {hit:?}, {want:?}");
            assert_eq!(
                occluders.any_hit(&ray, &NONE, &mut scratch),
                want.is_some(),
                "{far:e}, {ray:?}"
            );
            hits += u32::from(hit.is_some());
        }
        assert!(hits > 50, "{far:e}: {hits}");
        // Scenes have no corners beyond 2^60.
        if far <= 1e18 {
            for _ in 0..100 {
                fractions(&mesh, rng.in_cube(0.5) - DVec3::Z);
            }
        }
    }
}

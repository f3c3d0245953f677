//! Lights that triangles hide together, none of them alone.

use crate::common::{InSpace, Mesh, ask, by_hand, light};
use linelit_geometry::{DVec3, Segment};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{Occluders, Scratch, ShaftClass};

/// A bumpy sheet of `n` × `n` cells across z = 1, from −`half` to `half`, of which each triangle
/// may have vertices of its own.
fn sheet(rng: &mut SplitMix64, n: u32, half: f64, bumps: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let step = 2.0 * half / f64::from(n);
    let mut rows: Vec<Vec<DVec3>> = Vec::new();
    for j in 0..=n {
        let place = |i: u32| DVec3::new(f64::from(i), f64::from(j), 0.0) * step - half;
        let row = (0..=n)
            .map(place)
            .map(|p| p.with_z(1.0) + rng.in_cube(bumps));
        rows.push(row.collect());
    }
    for pair in rows.windows(2) {
        for i in 0..n as usize {
            let [a, b, c, d] = [pair[0][i], pair[0][i + 1], pair[1][i + 1], pair[1][i]];
            mesh.triangle(a, b, c);
            mesh.triangle(c, d, a);
        }
    }
    mesh
}

/// A light above the sheet, and lines on it: two along its sides, and others across.
fn lamp(rng: &mut SplitMix64, corners: usize) -> (Vec<DVec3>, Vec<Segment>) {
    let at = DVec3::new(rng.in_range(-0.2, 0.2), rng.in_range(-0.2, 0.2), 2.0);
    let light = light(rng, corners, at, 0.3);
    let between = |k: usize, t: f64| light[k].lerp(light[(k + 1) % corners], t);
    let mut lines = vec![Segment::new(light[0], light[1])];
    for k in 1..64 {
        let [s, t] = [0.37, 0.61].map(|x| (x * f64::from(k)).fract());
        let (a, b) = match corners {
            2 => (light[0], light[1]),
            _ => (
                between(k as usize % corners, s),
                between((k as usize + 1) % corners, t),
            ),
        };
        lines.push(Segment::new(a, b));
    }
    (light, lines)
}

/// Sheets of 2 to 50 triangles in flat and in bumpy scenes, whole and with a triangle left out:
/// a light is reported as hidden where no line on it is visible past any triangle, and there alone.
#[test]
fn triangles_that_share_edges_hide_a_light_together() {
    let mut rng = SplitMix64::new(linelit_testkit::cases::seed(23));
    let (mut scratch, mut counts) = (Scratch::new(), [0; 3]);
    for case in 0..400_u32 {
        // Lay the sheet, with or without a hole, and with more triangles that do not hide the
        // light.
        let n = [1, 1, 2, 3, 5][case as usize % 5];
        let mut mesh = sheet(&mut rng, n, 1.5, [0.0, 0.1][case as usize % 2]);
        let has_hole = case % 3 == 0;
        if has_hole {
            mesh.triangles.swap_remove(rng.index(mesh.triangles.len()));
        }
        for _ in 0..case % 4 {
            let c = DVec3::new(0.0, 0.0, 0.6) + rng.in_cube(0.2);
            let [a, b] = [(); 2].map(|()| c + rng.in_cube(0.1));
            mesh.triangle(a, b, c);
        }
        // Look at a light from below.
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let (light, lines) = lamp(&mut rng, [4, 3, 2, 5][case as usize % 4]);
        let point = DVec3::new(rng.in_range(-0.2, 0.2), rng.in_range(-0.2, 0.2), 0.0);
        let (class, _) = ask(&occluders, point, (&light, &lines), &(0..0), &mut scratch);
        let visible: f64 = lines.iter().map(|line| by_hand(&mesh, point, line)).sum();
        match (has_hole, class) {
            (false, _) => assert_eq!(class, ShaftClass::Blocked, "case {case}"),
            (true, ShaftClass::Blocked) => assert!(visible <= 0.0, "case {case}"),
            (true, _) => counts[2] += u32::from(visible > 0.0),
        }
        counts[usize::from(has_hole)] += 1;
    }
    assert!(counts[2] > 20, "{counts:?}");
}

/// The two halves of a ceiling with a gap of a rounding between them, or with an overlap of as
/// much, are no one surface: what they hide is found as before, to the last bit.
#[test]
fn halves_that_share_no_edge_do_not_hide_a_light_together() {
    let light = [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]];
    let light = light.map(|[x, y]| DVec3::new(x, y, 2.0));
    let line = Segment::new(light[0].with_y(0.01), light[1].with_y(0.01));
    for (gap, class) in [(0.0, ShaftClass::Blocked), (1e-3, ShaftClass::Partial)] {
        let mut mesh = Mesh::default();
        let corner = |x: f64, y: f64| DVec3::new(x, y, 1.0);
        mesh.triangle(corner(-2.0, -2.0), corner(2.0, -2.0), corner(2.0, 2.0));
        mesh.triangle(
            corner(2.0, 2.0 + gap),
            corner(-2.0, 2.0),
            corner(-2.0, -2.0 + gap),
        );
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let (lines, point) = ([line], DVec3::ZERO);
        let asked = ask(
            &occluders,
            point,
            (&light, &lines),
            &(0..0),
            &mut Scratch::new(),
        );
        assert_eq!(asked.0, class);
        let visible: f64 = asked.1.line(0).iter().map(|part| part.hi - part.lo).sum();
        assert!((visible - by_hand(&mesh, point, &line)).abs() < 1e-12);
        assert_eq!(visible > 0.0, gap > 0.0);
    }
}

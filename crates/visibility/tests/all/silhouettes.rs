//! Fine closed meshes, which lines in dense shafts see by their silhouettes.

use crate::common::{InSpace, Mesh, NONE, chord, closed, light, past_all};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{
    InstructionSet, LightCorners, Occluders, Scratch, ShaftQuery, VisibleLines,
};
use std::{f64::consts::TAU, ops::Range};

/// A closed surface with soft bumps: `rows` × `2 rows` quads and two caps. `open` leaves out that
/// many triangles at the end.
fn bumpy(rows: u32, centre: DVec3, radius: f64, open: usize) -> Mesh {
    let columns = 2 * rows;
    let mut mesh = Mesh::default();
    let place = |mesh: &mut Mesh, i: u32, j: u32| {
        let u = TAU * f64::from(i % columns) / f64::from(columns);
        let v = 0.5 * TAU * f64::from(j) / f64::from(rows);
        let at = DVec3::new(v.sin() * u.cos(), v.sin() * u.sin(), v.cos());
        let waves = (5.0 * at.x).sin() * (6.0 * at.y).cos() + (7.0 * at.z).sin();
        mesh.vertex(centre + at * (radius * (1.0 + 0.1 * waves)))
    };
    let grid: Vec<Vec<u32>> = (0..=rows)
        .map(|j| {
            let count = if j == 0 || j == rows { 1 } else { columns };
            (0..count).map(|i| place(&mut mesh, i, j)).collect()
        })
        .collect();
    for pair in grid.windows(2) {
        let at = |j: usize, i: u32| pair[j][i as usize % pair[j].len()];
        for i in 0..columns {
            let [a, b, c, d] = [at(0, i), at(0, i + 1), at(1, i), at(1, i + 1)];
            let quad = [[a, c, d], [a, d, b]];
            let whole = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
            mesh.triangles.extend(quad.into_iter().filter(whole));
        }
    }
    mesh.triangles.truncate(mesh.triangles.len() - open);
    mesh
}

/// Adds a mesh, with some of its triangles reversed.
fn add(mesh: &mut Mesh, other: Mesh, turned: Option<&mut SplitMix64>) {
    let first = u32::try_from(mesh.positions.len()).unwrap();
    mesh.positions.extend(other.positions);
    let mut moved: Vec<_> = other
        .triangles
        .into_iter()
        .map(|t| t.map(|i| i + first))
        .collect();
    if let Some(rng) = turned {
        for t in &mut moved {
            if rng.index(3) == 0 {
                t.swap(1, 2);
            }
        }
    }
    mesh.triangles.extend(moved);
}

/// Meshes of a thousand triangles or more, in a cube of half side one around `centre`: smooth and
/// crumpled ones, intersecting, two at the same position, open, with reversed triangles, and with
/// other triangles between them.
fn bodies(rng: &mut SplitMix64, case: usize, centre: DVec3, scale: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for k in 0..3 {
        let at = centre + rng.in_cube(0.7) * scale;
        let radius = rng.in_range(0.2, 0.5) * scale;
        let body = match (case + k) % 4 {
            0 => closed(rng, 40, 30, 0.5, at, radius),
            _ => bumpy(30, at, radius, if case % 5 == 1 { 7 } else { 0 }),
        };
        if case % 7 == 2 && k == 0 {
            add(&mut mesh, body.clone(), None);
        }
        add(&mut mesh, body, (case % 3 == 2).then_some(&mut *rng));
    }
    for _ in 0..case % 2 * 20 {
        let at = centre + rng.in_cube(1.0) * scale;
        let [a, b, c] = [(); 3].map(|()| at + rng.in_cube(0.2) * scale);
        mesh.triangle(a, b, c);
    }
    mesh
}

fn ends(parts: &[Interval]) -> Vec<f64> {
    parts.iter().flat_map(|part| [part.lo, part.hi]).collect()
}

/// What is visible of lines, on an instruction set, and how many shafts were dense.
fn see(
    occluders: &Occluders,
    (point, light): (DVec3, &[DVec3]),
    lines: &[Segment],
    exclude: &Range<u32>,
) -> (VisibleLines, u64) {
    let (mut scratch, mut out) = (Scratch::new(), VisibleLines::new());
    let query =
        ShaftQuery::new(point, LightCorners::new(light).unwrap()).excluding(exclude.clone());
    occluders
        .shaft(query, &mut scratch)
        .visible(lines, &mut out);
    (out, scratch.counters.dense_shafts)
}

/// Points and lights anywhere: on the meshes, inside, between, far away; with some triangles
/// excluded. Intervals agree with brute force, and on all instruction sets to the bit.
#[test]
fn lines_past_fine_meshes_agree_with_brute_force() {
    let mut rng = linelit_testkit::cases::rng(31);
    let places = [
        (DVec3::ZERO, 1.0),
        (DVec3::new(1e4, -1e4, 1e4), 100.0),
        (DVec3::new(0.0, 1.0, 0.0), 1e-3),
    ];
    let (mut dense, mut crossed, mut asked) = (0, 0, 0);
    for case in 0..120 {
        let (centre, scale) = places[case % 3];
        let mesh = bodies(&mut rng, case, centre, scale);
        let build = || Occluders::build(&mesh.positions, &mesh.triangles);
        let plain = build().limited_to(InstructionSet::Scalar);
        let best = build();
        for turn in 0..4 {
            let triangle = mesh.corners(rng.index(mesh.triangles.len()));
            let on = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
            let point = match turn {
                0 => on + rng.in_cube(1e-3) * scale,
                1 => centre + rng.in_cube(0.7) * scale,
                _ => centre + rng.direction() * (rng.in_range(1.5, 4.0) * scale),
            };
            let at = centre + (centre - point) * rng.in_range(0.2, 1.5) + rng.in_cube(0.3) * scale;
            let corners = [4, 3, 2, 6][case % 4];
            let light = light(&mut rng, corners, at, [0.2, 0.9][turn % 2] * scale);
            let lines: Vec<_> = (0..12)
                .map(|_| chord(&mut rng, &light, Some(0.4)))
                .collect();
            let first = u32::try_from(rng.index(mesh.triangles.len() - 8)).unwrap();
            let exclude = if case % 6 == 5 {
                first..first + 8
            } else {
                NONE
            };
            let (got, is_dense) = see(&best, (point, &light), &lines, &exclude);
            let (same, _) = see(&plain, (point, &light), &lines, &exclude);
            dense += is_dense;
            for (i, line) in lines.iter().enumerate() {
                assert_eq!(got.line(i), same.line(i), "case {case}, {turn}");
                let want = past_all(&mesh, point, line, &exclude);
                crossed += want.len();
                asked += 1;
                let (got, want) = (ends(got.line(i)), ends(&want));
                assert_eq!(
                    got.len(),
                    want.len(),
                    "case {case}, {turn}: {got:?} {want:?}"
                );
                for (a, b) in got.iter().zip(&want) {
                    assert!(
                        (a - b).abs() <= 1e-9,
                        "case {case}, {turn}: {got:?} {want:?}"
                    );
                }
            }
        }
    }
    assert!(dense > 120 && crossed > 2000, "{dense} {crossed} {asked}");
}

//! The scenes `colonnade`: a hall with arcades of fluted columns, arches and balusters, open to a
//! light above.

use super::mesh::{Mesh, Random};
use super::{Files, facing_down, light_text, line_text, main_file, main_files};
use linelit_elementary::{cos, exp, sin};
use std::f64::consts::{PI, TAU};

/// The distance between columns.
const BAY: f64 = 2.0;
/// The number of columns on each side of each storey.
const COLUMNS: u32 = 11;
/// Half the width of the hall between the rows of columns.
const HALF: f64 = 2.2;
/// The height of a storey.
const STOREY: f64 = 4.0;

/// Returns the files of a scene: a hall two storeys high, along x, in three variants, each with its
/// light.
pub(super) fn colonnade() -> Files {
    // Write a PLY file for each material.
    let mut geometry = String::new();
    let mut meshes = Files::new();
    for (name, reflectance, mesh) in parts() {
        let [r, g, b] = reflectance;
        geometry.push_str(&format!(
            "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\nShape \"plymesh\" \"string filename\" [ \"{name}\" ]\nAttributeEnd\n"
        ));
        meshes.push((name.to_owned(), mesh.ply()));
    }
    // Make the variants with a small and a large light.
    let light = |half, radiance| light_text(radiance, &facing_down([0.0, 9.5, 0.0], half));
    let lights = [
        light([0.5, 0.25], [1920.0, 1840.0, 1700.0]),
        light([6.0, 2.0], [20.0, 19.2, 17.7]),
    ];
    let mut files = main_files(
        "colonnade",
        "Arcades around a hall that is open to the sky; meshes made by a generator.",
        "LookAt -8.6 1.7 0.5  0 1.7 -0.5  0 1 0\nCamera \"perspective\" \"float fov\" [ 52 ]",
        geometry,
        lights,
    );
    // Make the variant with a linear light.
    files.extend(meshes);
    files.push(main_file(
        "colonnade",
        "line",
        "Arcades around a hall, under a long linear light; meshes made by a generator.",
        "LookAt -8.6 1.3 0.4  0 1.1 -0.3  0 1 0\nCamera \"perspective\" \"float fov\" [ 52 ]",
        &line_text([24.0, 21.0, 16.0], [[-6.0, 3.6, 0.3], [9.0, 3.6, -0.2]]),
    ));
    files
}

/// Returns the number of triangles of all meshes of the hall.
#[cfg(test)]
pub(super) fn triangle_count() -> usize {
    parts()
        .iter()
        .map(|(_, _, mesh)| mesh.triangles.len())
        .sum()
}

/// Returns the meshes of the hall, each with the name of its file and its reflectance.
fn parts() -> [(&'static str, [f64; 3], Mesh); 3] {
    [
        ("colonnade-stone.ply", [0.72, 0.68, 0.6], stone()),
        ("colonnade-walls.ply", [0.55, 0.5, 0.45], walls()),
        ("colonnade-pots.ply", [0.6, 0.25, 0.15], pots()),
    ]
}

/// Returns the x coordinate of column `k`, which is its position along the hall.
fn column_x(k: u32) -> f64 {
    BAY * (f64::from(k) - 0.5 * f64::from(COLUMNS - 1))
}

/// Returns the columns, arches and balustrades of both storeys.
fn stone() -> Mesh {
    let mut mesh = Mesh::default();
    for storey in 0..2u32 {
        let floor = STOREY * f64::from(storey);
        for side in [-1.0, 1.0] {
            for k in 0..COLUMNS {
                column(&mut mesh, [column_x(k), floor, side * HALF]);
                if k + 1 < COLUMNS {
                    arch(&mut mesh, column_x(k), floor + 2.5, side * HALF);
                    balustrade(&mut mesh, column_x(k), floor + STOREY, side * HALF);
                }
            }
        }
    }
    mesh
}

/// Adds a fluted column between two slabs, 2.5 high, whose base is centred at `foot`.
fn column(mesh: &mut Mesh, foot: [f64; 3]) {
    // Make the shaft, which tapers, has flutes, and widens at both ends.
    let radius = |v: f64, angle: f64| {
        let flutes = 0.012 * cos(12.0 * angle);
        let taper = 0.2 - 0.03 * v;
        let ends = 0.08 * exp(-(v * 30.0)) + 0.09 * exp(-((1.0 - v) * 24.0));
        taper + flutes * (v * (1.0 - v) * 4.0).min(1.0) + ends
    };
    mesh.surface([24, 44], true, |v, u| {
        let angle = TAU * u;
        let r = radius(v, angle);
        [
            foot[0] + r * cos(angle),
            foot[1] + 0.12 + 2.26 * v,
            foot[2] + r * sin(angle),
        ]
    });
    // Make the slabs of the base and the capital.
    let slab = |mesh: &mut Mesh, y: f64| {
        mesh.cuboid(
            [foot[0] - 0.3, foot[1] + y, foot[2] - 0.3],
            [foot[0] + 0.3, foot[1] + y + 0.12, foot[2] + 0.3],
            0.0,
        );
    };
    slab(mesh, 0.0);
    slab(mesh, 2.38);
}

/// Adds a half-round arch with a moulding from the column at (x, y, z) to the next one along x, and
/// the wall above the arch.
fn arch(mesh: &mut Mesh, x: f64, y: f64, z: f64) {
    // Make the arch, a tube with a wavy cross-section along a half circle.
    let centre = x + 0.5 * BAY;
    let inner = 0.5 * BAY - 0.3;
    mesh.surface([24, 20], true, |v, u| {
        let angle = PI * v;
        let turn = TAU * u;
        let r = inner + 0.1 + (0.1 + 0.02 * cos(5.0 * turn)) * cos(turn);
        [
            centre - r * cos(angle),
            y + r * sin(angle),
            z + 0.22 * sin(turn),
        ]
    });
    // Make the wall between the half circle and a horizontal line.
    mesh.surface([24, 1], false, |v, u| {
        let angle = PI * v;
        let (c, s) = (cos(angle), sin(angle));
        let edge = [centre - (inner + 0.2) * c, y + (inner + 0.2) * s];
        let top = [centre - 0.5 * BAY * c.signum() * c.abs().min(1.0), y + 1.38];
        [
            edge[0] + (top[0] - edge[0]) * u,
            edge[1] + (top[1] - edge[1]) * u,
            z,
        ]
    });
}

/// Adds a balustrade, one bay wide, from (x, y, z) along x: balusters between a base and a rail.
fn balustrade(mesh: &mut Mesh, x: f64, y: f64, z: f64) {
    for k in 0..6u32 {
        let c = x + BAY * (f64::from(k) + 0.5) / 6.0;
        mesh.surface([12, 12], true, |v, u| {
            let r = 0.05 + 0.03 * sin(TAU * 1.5 * v);
            [
                c + r * cos(TAU * u),
                y + 0.05 + 0.6 * v,
                z + r * sin(TAU * u),
            ]
        });
    }
    mesh.cuboid([x, y - 0.1, z - 0.12], [x + BAY, y + 0.05, z + 0.12], 0.0);
    mesh.cuboid([x, y + 0.65, z - 0.1], [x + BAY, y + 0.73, z + 0.1], 0.0);
}

/// Returns the floor, the outer walls, and the floors of the galleries behind the columns.
fn walls() -> Mesh {
    let mut mesh = Mesh::default();
    let (long, wide, high) = (
        0.5 * BAY * f64::from(COLUMNS - 1) + 1.0,
        HALF + 2.0,
        2.0 * STOREY,
    );
    // Make the floor.
    mesh.surface([40, 20], false, |v, u| {
        [long * (2.0 * v - 1.0), 0.0, wide * (2.0 * u - 1.0)]
    });
    // Make the long walls with the galleries, and the walls at both ends.
    for side in [-1.0, 1.0] {
        mesh.surface([12, 40], false, |v, u| {
            [long * (2.0 * u - 1.0), high * v, side * wide]
        });
        mesh.cuboid(
            [
                -long,
                STOREY - 0.12,
                if side < 0.0 { -wide } else { HALF - 0.25 },
            ],
            [
                long,
                STOREY - 0.1,
                if side < 0.0 { 0.25 - HALF } else { wide },
            ],
            0.0,
        );
    }
    for end in [-1.0, 1.0] {
        mesh.surface([12, 20], false, |v, u| {
            [end * long, high * v, wide * (2.0 * u - 1.0)]
        });
    }
    mesh
}

/// Returns the pots along the hall, with plants of many leaves.
fn pots() -> Mesh {
    let mut mesh = Mesh::default();
    let mut random = Random::new(1991);
    for k in 0..8u32 {
        let side = if k % 2 == 0 { -1.0 } else { 1.0 };
        let foot = [column_x(k + 1) + 1.0, 0.0, side * 1.3];
        mesh.surface([16, 24], true, |v, u| {
            let r = 0.18 + 0.12 * v + 0.03 * sin(PI * v * 3.0);
            [
                foot[0] + r * cos(TAU * u),
                0.5 * v,
                foot[2] + r * sin(TAU * u),
            ]
        });
        for _ in 0..900 {
            leaf(&mut mesh, &mut random, foot);
        }
    }
    mesh
}

/// Adds a bent leaf of four triangles at a random position above and around `foot`, with a random
/// direction and size.
fn leaf(mesh: &mut Mesh, random: &mut Random, foot: [f64; 3]) {
    let angle = random.between(0.0, TAU);
    let (out, up) = (random.between(0.05, 0.55), random.between(0.5, 1.5));
    let root = [foot[0] + out * cos(angle), up, foot[2] + out * sin(angle)];
    let (length, width, drop) = (
        random.between(0.1, 0.25),
        random.between(0.01, 0.03),
        random.between(-0.1, 0.1),
    );
    mesh.surface([2, 1], false, |v, u| {
        let along = length * v;
        let bend = drop * v * v;
        let across = width * (2.0 * u - 1.0) * (1.0 - 0.9 * v * v);
        [
            root[0] + along * cos(angle) - across * sin(angle),
            root[1] + bend,
            root[2] + along * sin(angle) + across * cos(angle),
        ]
    });
}

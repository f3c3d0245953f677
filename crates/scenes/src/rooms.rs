//! The scenes `cornell-box`, `grid-planes` (crossed grids of bars over a plane) and `triangle-soup`
//! (small triangles in a box).

use super::mesh::{Mesh, Random};
use super::{Files, diffuse, facing_down, facing_up, light_text, line_text, main_file, main_files};
use linelit_elementary::sin_cos;

/// The reflectance of the white walls.
const WHITE: [f64; 3] = [0.725, 0.71, 0.68];
/// The reflectance of the left wall.
const RED: [f64; 3] = [0.63, 0.065, 0.05];
/// The reflectance of the right wall.
const GREEN: [f64; 3] = [0.14, 0.45, 0.091];

/// The camera of the rooms. It is off the axis of symmetry, so that no ray through the centre of a
/// pixel runs along an edge of the room.
pub(super) const BOX_CAMERA: &str =
    "LookAt 0.031 1.017 -4.4  0.013 1.007 0  0 1 0\nCamera \"perspective\" \"float fov\" [ 33 ]";

/// Returns, as pbrt text, the walls of a room with x and z from −1 to 1 and y from 0 to 2, which is
/// open to the camera. Floor, ceiling and back wall are white, and the side walls red and green.
pub(super) fn walls() -> String {
    let mut white = Mesh::polygon(&facing_up([-1.0; 2], [1.0; 2], 0.0));
    white.fan(&facing_down([0.0, 2.0, 0.0], [1.0, 1.0]));
    white.fan(&[
        [-1.0, 0.0, 1.0],
        [-1.0, 2.0, 1.0],
        [1.0, 2.0, 1.0],
        [1.0, 0.0, 1.0],
    ]);
    let red = Mesh::polygon(&[
        [-1.0, 0.0, -1.0],
        [-1.0, 2.0, -1.0],
        [-1.0, 2.0, 1.0],
        [-1.0, 0.0, 1.0],
    ]);
    let green = Mesh::polygon(&[
        [1.0, 0.0, -1.0],
        [1.0, 0.0, 1.0],
        [1.0, 2.0, 1.0],
        [1.0, 2.0, -1.0],
    ]);
    diffuse(WHITE, &white) + &diffuse(RED, &red) + &diffuse(GREEN, &green)
}

/// Returns the files of a scene: a room with two blocks and a light just below the ceiling, in
/// three variants.
pub(super) fn cornell_box() -> Files {
    // Make the variants with a small and a large light.
    let mut blocks = Mesh::default();
    blocks.cuboid([0.05, 0.0, -0.65], [0.65, 0.6, -0.05], 0.29);
    blocks.cuboid([-0.65, 0.0, -0.05], [-0.05, 1.2, 0.55], -0.33);
    let geometry = walls() + &diffuse(WHITE, &blocks);
    let light = |half, radiance| light_text(radiance, &facing_down([0.0, 1.98, 0.0], [half; 2]));
    let lights = [
        light(0.05, [800.0, 680.0, 430.0]),
        light(0.4, [12.5, 10.6, 6.7]),
    ];
    let about = "Two blocks in a room.";
    let mut files = main_files("cornell-box", about, BOX_CAMERA, geometry, lights);
    // Make the variant with a linear light.
    let strength = [2.6, 2.2, 1.4];
    let ends = [[-0.55, 1.95, 0.1], [0.55, 1.95, 0.1]];
    let line = line_text(strength, ends);
    let about = "Two blocks in a room, under a linear light.";
    files.push(main_file("cornell-box", "line", about, BOX_CAMERA, &line));
    files
}

/// Returns the files of a scene: two crossed grids of bars over a plane.
pub(super) fn grid_planes() -> Files {
    let floor = Mesh::polygon(&facing_up([-4.0; 2], [4.0; 2], 0.0));
    let mut bars = Mesh::default();
    for (height, count, turn) in [(0.7, 16u32, 0.35), (1.1, 16, -0.2)] {
        grid(&mut bars, height, count, turn);
    }
    let geometry = diffuse([0.7, 0.7, 0.7], &floor) + &diffuse([0.35, 0.45, 0.6], &bars);
    let camera =
        "LookAt 0.9 2.6 -6.2  0 0.55 -0.4  0 1 0\nCamera \"perspective\" \"float fov\" [ 38 ]";
    let about = "Crossed grids of bars over a plane.";
    let light = |half, radiance| light_text(radiance, &facing_down([0.0, 3.0, 0.0], [half; 2]));
    let lights = [light(0.1, [640.0; 3]), light(0.8, [10.0; 3])];
    main_files("grid-planes", about, camera, geometry, lights)
}

/// Adds `2 × count` bars with a square cross-section over a square with sides of 2.4, turned about
/// the vertical axis.
fn grid(mesh: &mut Mesh, height: f64, count: u32, turn: f64) {
    let (side, thick) = (1.2, 0.02);
    let first = mesh.points.len();
    for k in 0..count {
        let c = side * (2.0 * (f64::from(k) + 0.5) / f64::from(count) - 1.0);
        mesh.cuboid(
            [c - thick, height, -side],
            [c + thick, height + 2.0 * thick, side],
            0.0,
        );
        let above = height + 2.0 * thick;
        mesh.cuboid(
            [-side, above, c - thick],
            [side, above + 2.0 * thick, c + thick],
            0.0,
        );
    }
    let (sin, cos) = sin_cos(turn);
    for p in &mut mesh.points[first..] {
        *p = [cos * p[0] + sin * p[2], p[1], cos * p[2] - sin * p[0]];
    }
}

/// Returns the files of a scene: a thousand small triangles that float in a room, under a
/// triangular light.
pub(super) fn triangle_soup() -> Files {
    // Make triangles around random centres.
    let mut random = Random::new(2016);
    let mut soup = Mesh::default();
    for _ in 0..1000 {
        let centre = [
            random.between(-0.85, 0.85),
            random.between(0.25, 1.6),
            random.between(-0.85, 0.85),
        ];
        let corner = |random: &mut Random| centre.map(|c| c + random.between(-0.06, 0.06));
        let corners = [
            corner(&mut random),
            corner(&mut random),
            corner(&mut random),
        ];
        soup.fan(&corners);
    }
    let geometry = walls() + &diffuse([0.6, 0.6, 0.6], &soup);
    // Make the variants with a small and a large light.
    let about = "A thousand disjoint triangles in a room, under a triangular light.";
    let light = |s: f64, radiance| {
        let at = |x: f64, z: f64| [s * x, 1.98, s * z];
        light_text(radiance, &[at(-0.9, -0.6), at(0.95, -0.5), at(-0.1, 1.0)])
    };
    let lights = [
        light(0.09, [605.0, 540.0, 420.0]),
        light(0.7, [10.0, 8.9, 6.9]),
    ];
    main_files("triangle-soup", about, BOX_CAMERA, geometry, lights)
}

//! Tests of lights that are part of the mesh or lie in it: their own triangles do not hide them
//! when rounding moves these in front, and a room whose triangles are all lights has no gaps.

use linelit::geometry::{DMat3, DVec3};
use linelit::{Estimator, Light, Measure, Scene};

fn turned() -> DMat3 {
    DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(-0.3)
}

/// The corners of the six faces of a box, inwards.
fn faces(low: DVec3, high: DVec3) -> [[DVec3; 4]; 6] {
    let corner = |bits: usize| {
        let pick = |k: usize| if bits >> k & 1 == 0 { low[k] } else { high[k] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ]
    .map(|quad| quad.map(corner))
}

/// A room with boxes in it, one of which goes through the floor; turned, and rounded to `f32`. Two
/// triangles for each face, with the numbers 2k and 2k + 1.
fn room() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let boxes = [
        (DVec3::ZERO, DVec3::new(3.0, 4.0, 2.5), false),
        (DVec3::new(0.7, 0.9, -0.2), DVec3::new(1.3, 1.4, 0.8), true),
        (DVec3::new(1.6, 2.2, 1.1), DVec3::new(2.3, 2.9, 1.7), true),
    ];
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (low, high, is_solid) in boxes {
        for mut face in faces(low, high) {
            if is_solid {
                face.reverse();
            }
            let first = u32::try_from(positions.len()).unwrap();
            positions.extend(face.map(|p| (turned() * p).as_vec3().to_array()));
            triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|k| first + k)));
        }
    }
    (positions, triangles)
}

/// In a closed room whose triangles are all lights, the visible parts of all lights together fill
/// all directions: to 1e-9 with the default margins, and to 1e-7 with margins of a millionth.
#[test]
fn a_room_of_lights_closes_by_default() {
    let (positions, triangles) = room();
    let mut room = Scene::builder(&positions, &triangles).method(Estimator::exact());
    for triangle in &triangles {
        let corners = triangle.map(|k| positions[k as usize]);
        let light = Light::polygon(&corners, [1.0; 3]).unwrap();
        room = room.light(light);
    }
    let room = room.build().unwrap();
    let mut worst = 0.0_f64;
    for k in 0..200 {
        // Points above the boxes and between the walls, and normals all around.
        let at = |step: f64| (0.5 + step * f64::from(k)).fract();
        let local = DVec3::new(
            0.1 + 2.8 * at(0.618),
            0.1 + 3.8 * at(0.7549),
            1.8 + 0.6 * at(0.5698),
        );
        let (s, c) = (2.4 * f64::from(k)).sin_cos();
        let normal = DVec3::new(s, c, 1.5 * at(0.3) - 0.7);
        let seen = room
            .irradiance(turned() * local, turned() * normal)
            .unwrap()[0];
        worst = worst.max((seen / std::f64::consts::PI - 1.0).abs());
    }
    assert!(worst < 1e-9, "{worst:e}");
}

/// A lamp in the plane of a slanted ceiling, whose corners rounding moved in front of it or behind
/// it: all of it is seen, whether the ceiling is one triangle or many, and whether the lamp's own
/// triangles are in the mesh, in one piece of it or in two.
#[test]
fn a_lamp_in_a_ceiling_is_not_hidden_by_rounding() {
    // Scenes around the origin, large ceilings, and scenes away from it: f32 rounds each by what a
    // margin of a millionth of the two metres to the lamp still covers.
    for (size, away, shifts) in [
        (3.0, 0.0, 50),
        (10.0, 0.0, 20),
        (16.0, 0.0, 20),
        (3.0, 8.0, 20),
    ] {
        for shift in 0..shifts {
            in_a_ceiling(size, away, shift);
        }
    }
}

/// A lamp in a ceiling that reaches as far as `size`, in a scene that is moved by `away` along all
/// axes.
fn in_a_ceiling(size: f64, away: f64, shift: u32) {
    // Make a lamp in the plane of the ceiling, with exact corners.
    let moved = DVec3::splat(away);
    let in_plane = |x: f64, y: f64| moved + turned() * DVec3::new(x, y, 2.0);
    let by = 0.013 * f64::from(shift);
    let corners = [(-0.5, -0.4), (0.5, -0.4), (0.5, 0.4), (-0.5, 0.4)];
    let lamp = corners.map(|(x, y)| in_plane(x + by, y).to_array());
    let lamp = Light::polygon(&lamp, [1.0; 3]).unwrap();
    // Make ceilings with rounded corners: of one square, of many, of the lamp's own triangles, and
    // of squares between these two.
    let grid = |count: u32, size: f64| -> Vec<[[f32; 3]; 3]> {
        let at = |i: u32, j: u32| {
            let [x, y] = [i, j].map(|k| size * (2.0 * f64::from(k) / f64::from(count) - 1.0));
            in_plane(x + by, y).as_vec3().to_array()
        };
        let cell = |k: u32| {
            let (i, j) = (k % count, k / count);
            [
                [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
            ]
        };
        (0..count * count).flat_map(cell).collect()
    };
    let own = corners.map(|(x, y)| in_plane(x + by, y).as_vec3().to_array());
    let own = [[own[0], own[1], own[2]], [own[0], own[2], own[3]]];
    let parted = [&own[..1], &grid(3, size), &own[1..]].concat();
    for mesh in [grid(1, size), grid(40, size), own.to_vec(), parted] {
        let positions = mesh.as_flattened();
        let triangles: Vec<[u32; 3]> = (0..u32::try_from(mesh.len()).unwrap())
            .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
            .collect();
        // All of the lamp must be visible.
        let scene = Scene::builder(positions, &triangles).light(lamp.clone());
        let scene = scene.build().unwrap();
        for point in [[0.3, 0.2, 0.0], [-0.5, 0.9, 1.0], [1.7, 0.1, 0.5]] {
            let point = moved + turned() * DVec3::from(point);
            let seen = scene.visible_fraction(point, 0, Measure::Area).unwrap();
            assert!(
                (seen - 1.0).abs() < 1e-12,
                "{size} {away} {shift} {} {seen}",
                mesh.len()
            );
        }
    }
}

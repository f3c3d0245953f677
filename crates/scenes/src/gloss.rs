//! Glossy scenes for estimators that combine points and lines (Salesin and Jarosz 2019): a quad
//! that floats in a box, occluders on glossy strips, monoliths, and plates under lights of several
//! sizes. The figures in the comments are those of the paper.

use super::mesh::Mesh;
use super::rooms::{BOX_CAMERA, walls};
use super::{Files, diffuse, facing_down, facing_up, light_text};
use linelit_elementary::sin_cos;

/// Returns the name and the contents of the main file of a scene that has a single variant. `size`
/// is the resolution, and `world` the pbrt text after `WorldBegin`.
pub(super) fn scene(
    name: &str,
    about: &str,
    camera: &str,
    size: [u32; 2],
    world: &str,
) -> (String, Vec<u8>) {
    let [width, height] = size;
    let text = format!(
        "# linelit: {name}. {about}\n{camera}\n\
         Sampler \"independent\" \"integer pixelsamples\" [ 16 ]\n\
         PixelFilter \"box\" \"float xradius\" [ 0.5 ] \"float yradius\" [ 0.5 ]\n\
         Film \"image\" \"integer xresolution\" [ {width} ] \"integer yresolution\" [ {height} ] \"string filename\" [ \"{name}.exr\" ]\n\
         WorldBegin\n{world}WorldEnd\n"
    );
    (format!("{name}.pbrt"), text.into_bytes())
}

/// Returns a black polygon that emits, as pbrt text.
fn light(radiance: [f64; 3], corners: &[[f64; 3]]) -> String {
    format!(
        "AttributeBegin\nMaterial \"matte\" \"rgb Kd\" [ 0 0 0 ]\n{}\nAttributeEnd\n",
        light_text(radiance, corners)
    )
}

/// Returns a mesh with pbrt's plastic, as pbrt text: a diffuse base under microfacets of Trowbridge
/// and Reitz with the roughness α.
pub(super) fn plastic(kd: [f64; 3], ks: f64, alpha: f64, mesh: &Mesh) -> String {
    let [r, g, b] = kd;
    format!(
        "AttributeBegin\nMaterial \"plastic\" \"rgb Kd\" [ {r} {g} {b} ] \"rgb Ks\" [ {ks} {ks} {ks} ] \"float roughness\" [ {alpha} ] \"bool remaproughness\" [ \"false\" ]\n{}\nAttributeEnd\n",
        mesh.text()
    )
}

/// Returns the files of the scene of figure 5: a quad that floats below a quad light whose edges
/// are parallel to the edges of the quad.
pub(super) fn floating_quad() -> Files {
    let quad = Mesh::polygon(&facing_down([0.0, 1.0, 0.0], [0.35, 0.35]));
    let mut world = walls();
    world += &diffuse([0.5, 0.5, 0.5], &quad);
    world += &light(
        [12.5, 10.6, 6.7],
        &facing_down([0.0, 1.98, 0.0], [0.4, 0.4]),
    );
    let about = "A quad afloat beneath a quad light in a box.";
    vec![scene(
        "floating-quad",
        about,
        BOX_CAMERA,
        [256, 256],
        &world,
    )]
}

/// The roughness α of the strips from left to right.
const STRIPS: [f64; 5] = [0.5, 0.25, 0.12, 0.06, 0.03];

/// Returns the files of the scene of figures 6 and 7: five strips from rough to glossy, an occluder
/// on each of them, and a light behind.
pub(super) fn strips() -> Files {
    let mut world = String::new();
    for (k, alpha) in (0u8..).zip(STRIPS) {
        let left = f64::from(k) - 2.5;
        let strip = Mesh::polygon(&facing_up([left + 0.02, -2.5], [left + 0.98, 2.6], 0.0));
        // Use one lobe only: choosing between two is a step function of the random numbers, which
        // would change the order of convergence.
        world += &plastic([0.0; 3], 0.6, alpha, &strip);
        let (x, y) = (left + 0.5, 0.42);
        let (sin, cos) = sin_cos(0.3 + 0.17 * f64::from(k));
        let corner = |a: f64, b: f64| [x + cos * a - sin * b, y + sin * a + cos * b, 0.35];
        // Turn the occluder so that none of its edges is parallel to an edge of the light.
        let post = Mesh::polygon(&[
            corner(-0.15, -0.36),
            corner(-0.15, 0.36),
            corner(0.15, 0.36),
            corner(0.15, -0.36),
        ]);
        world += &diffuse([0.55, 0.4, 0.25], &post);
    }
    // Add the light, which faces the camera (−z).
    let corners = [
        [-2.0, 0.5, 2.4],
        [-2.0, 1.5, 2.4],
        [2.0, 1.5, 2.4],
        [2.0, 0.5, 2.4],
    ];
    world += &light([6.0, 6.0, 6.0], &corners);
    let camera =
        "LookAt 0.03 2.1 -4.6  0.01 0.25 0.1  0 1 0\nCamera \"perspective\" \"float fov\" [ 32 ]";
    let about = "Occluders on five strips, rough on the left and glossy on the right.";
    vec![scene("strips", about, camera, [320, 200], &world)]
}

/// Returns the files of the scene of figure 1: slabs on a glossy floor before a wide light. The
/// first edge of the light is horizontal and the edges of the slabs are vertical, so that lines
/// along the first cross the latter.
pub(super) fn monoliths() -> Files {
    let floor = Mesh::polygon(&facing_up([-4.0, -3.0], [4.0, 3.2], 0.0));
    // Make slabs of different heights and turns.
    let mut slabs = Mesh::default();
    for (k, (x, z, height, turn)) in [
        (-1.6, 0.3, 1.5, 0.4),
        (-0.7, 0.9, 1.1, -0.2),
        (0.2, 0.1, 1.9, 0.15),
        (1.0, 0.8, 1.3, -0.5),
        (1.8, -0.1, 0.9, 0.3),
    ]
    .into_iter()
    .enumerate()
    {
        let wide = if k % 2 == 0 { 0.28 } else { 0.2 };
        slabs.cuboid(
            [x - wide, 0.0, z - 0.05],
            [x + wide, height, z + 0.05],
            turn,
        );
    }
    // Write them with the light and the camera.
    let mut world = plastic([0.3, 0.3, 0.32], 0.5, 0.05, &floor);
    world += &plastic([0.05, 0.05, 0.06], 0.4, 0.1, &slabs);
    let corners = [
        [-2.2, 2.3, 2.3],
        [2.2, 2.3, 2.3],
        [2.2, 0.9, 2.6],
        [-2.2, 0.9, 2.6],
    ];
    world += &light([5.0, 4.8, 4.4], &corners);
    let camera =
        "LookAt 0.33 1.7 -5.2  0.11 0.62 0.2  0 1 0\nCamera \"perspective\" \"float fov\" [ 36 ]";
    let about = "Slabs on a glossy floor before a wide light.";
    vec![scene("monoliths", about, camera, [320, 200], &world)]
}

/// Returns the files of the scene of figure 10, after Veach: four plates from glossy to rough,
/// which are tilted so that each mirrors the lights to the camera, and bars between the plates and
/// the lights.
pub(super) fn plates() -> Files {
    let mut world = String::new();
    // Add the plates by height, depth, tilt and roughness α.
    let tilts: [(f64, f64, f64, f64); 4] = [
        (0.5, 1.0, 0.555, 0.01),
        (0.3, 0.45, 0.434, 0.04),
        (0.12, -0.1, 0.341, 0.1),
        (0.0, -0.65, 0.264, 0.25),
    ];
    for (y, z, tilt, alpha) in tilts {
        let (sin, cos) = sin_cos(tilt);
        let at = |x: f64, s: f64| [x, y + 0.22 * s * sin, z + 0.22 * s * cos];
        let plate = [at(-2.0, -1.0), at(-2.0, 1.0), at(2.0, 1.0), at(2.0, -1.0)];
        world += &plastic([0.07, 0.09, 0.13], 0.9, alpha, &Mesh::polygon(&plate));
    }
    // Add the floor with a wall, and the bars.
    let mut floor = Mesh::polygon(&facing_up([-5.0, -5.0], [5.0, 5.0], -0.15));
    floor.fan(&[
        [-5.0, -0.15, 3.2],
        [-5.0, 4.0, 3.2],
        [5.0, 4.0, 3.2],
        [5.0, -0.15, 3.2],
    ]);
    world += &diffuse([0.4, 0.4, 0.4], &floor);
    let mut bars = Mesh::default();
    for k in 0..9u8 {
        let x = 0.45 * f64::from(k) - 1.8;
        bars.cuboid([x - 0.03, 1.35, 0.2], [x + 0.03, 1.41, 1.3], 0.0);
    }
    world += &diffuse([0.3, 0.3, 0.3], &bars);
    // Add the lights by position, size and radiance; they are tilted towards the plates.
    for (x, half, power) in [
        (-1.5, 0.04, 500.0),
        (-0.5, 0.1, 80.0),
        (0.5, 0.22, 16.5),
        (1.5, 0.4, 5.0),
    ] {
        let (y, z) = (2.3, 1.6);
        let corners = [
            [x - half, y - 0.6 * half, z + 0.8 * half],
            [x - half, y + 0.6 * half, z - 0.8 * half],
            [x + half, y + 0.6 * half, z - 0.8 * half],
            [x + half, y - 0.6 * half, z + 0.8 * half],
        ];
        world += &light([power; 3], &corners);
    }
    let camera =
        "LookAt 0.02 1.5 -6.1  0.01 0.85 0  0 1 0\nCamera \"perspective\" \"float fov\" [ 36 ]";
    let about = "Plates from glossy to rough under lights of four sizes, with bars between.";
    vec![scene("plates", about, camera, [320, 200], &world)]
}

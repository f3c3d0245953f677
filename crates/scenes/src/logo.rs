//! The scene `logo`: the letters L I T, extruded, stand on a glossy plane.

use super::mesh::Mesh;
use super::{Files, diffuse, facing_up, light_text, main_files, phong};

/// The boxes of which the letters consist, by their ranges of x and y.
const STROKES: [[f64; 4]; 5] = [
    [-1.5, -1.2, 0.0, 1.4],  // L: stem
    [-1.2, -0.55, 0.0, 0.3], // L: foot
    [-0.25, 0.05, 0.0, 1.4], // I
    [0.75, 1.05, 0.0, 1.1],  // T: stem
    [0.35, 1.45, 1.1, 1.4],  // T: bar
];

/// The exponent of the Phong lobe. It is so large that the orders of convergence of stratified
/// points and lines are near the orders that Billen and Dutré report for their logo, whose exponent
/// is large but not reported.
const EXPONENT: f64 = 50_000.0;

/// Returns the files of a scene: the letters on a glossy plane, and a light behind them; the plane
/// mirrors both to the camera.
pub(super) fn logo() -> Files {
    let floor = Mesh::polygon(&facing_up([-6.0; 2], [6.0; 2], 0.0));
    let mut letters = Mesh::default();
    for [x0, x1, y0, y1] in STROKES {
        letters.cuboid([x0, y0, -0.15], [x1, y1, 0.15], 0.0);
    }
    let geometry =
        phong([0.1, 0.1, 0.12], 0.6, EXPONENT, &floor) + &diffuse([0.75, 0.35, 0.1], &letters);
    let camera =
        "LookAt 0 2.6 -5.2  0 0.4 -0.4  0 1 0\nCamera \"perspective\" \"float fov\" [ 36 ]";
    // Make the lights, which face down and towards the camera.
    let light = |[a, b]: [f64; 2], radiance| {
        let at = |x: f64, v: f64| [x, 2.3 + 0.6 * v, 2.4 - 0.8 * v];
        light_text(radiance, &[at(-a, -b), at(-a, b), at(a, b), at(a, -b)])
    };
    let lights = [
        light([0.8, 0.4], [30.0, 28.1, 24.4]),
        light([3.0, 1.4], [2.3, 2.15, 1.85]),
    ];
    let about = "Letters on a glossy plane (Phong, an extension of linelit).";
    main_files("logo", about, camera, geometry, lights)
}

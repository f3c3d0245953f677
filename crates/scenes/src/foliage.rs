//! The scene `foliage`: a tree of copies of one twig, whose leaves are cut out by an alpha mask.

use super::mesh::{Mesh, rounded};
use super::text::emitter;
use super::window::tga;
use super::{Files, diffuse, facing_down, facing_up, gloss, light_text};
use linelit_elementary::{sin, sin_cos};
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

/// The number of pixels of the leaf's image, across and down.
const LEAF: [u16; 2] = [32, 64];

/// The number of leaves of a twig, each of two triangles.
const LEAVES: u32 = 24;

/// The number of twigs of the tree.
const TWIGS: u32 = 240;

/// Returns the files of a scene: a tree on a lawn under a square light.
pub(super) fn foliage() -> Files {
    // Make the lawn, a wall behind it, and the trunk.
    let mut lawn = Mesh::polygon(&facing_up([-6.0, -6.0], [6.0, 6.0], 0.0));
    lawn.fan(&[
        [-6.0, 0.0, -3.0],
        [6.0, 0.0, -3.0],
        [6.0, 6.0, -3.0],
        [-6.0, 6.0, -3.0],
    ]);
    let trunk = Mesh::block([-0.06, 0.0, -0.06], [0.06, 1.5, 0.06], 0.3);
    let mut world = diffuse([0.55, 0.55, 0.5], &lawn);
    world += &diffuse([0.25, 0.18, 0.12], &trunk);
    // Define the twig with its mask, and place its copies.
    world += "Texture \"leaf\" \"float\" \"imagemap\" \"string filename\" \"leaf.tga\" \
        \"string encoding\" \"linear\" \"string wrap\" \"clamp\"\n";
    world += &twig();
    world += &twigs();
    // Add the light and the camera.
    let light = light_text(
        [40.0, 38.0, 34.0],
        &facing_down([2.0, 5.0, 2.0], [0.5, 0.5]),
    );
    world += &emitter(&light);
    let about = "A tree of copies of one twig, its leaves cut out by an alpha.";
    let camera =
        "LookAt 0.5 1.5 6.5  0.1 1.2 0  0 1 0\nCamera \"perspective\" \"float fov\" [ 36 ]";
    let main = gloss::scene("foliage", about, camera, [256, 256], &world);
    vec![main, ("leaf.tga".to_owned(), tga(LEAF, leaf))]
}

/// Returns the alpha, as a grey, of the pixel in column `i` and row `j` of the leaf's image, with
/// the tip at row 0: two arcs that meet in points, and a stalk.
fn leaf(i: u16, j: u16) -> [u8; 3] {
    let [width, height] = LEAF.map(f64::from);
    let (x, y) = (
        (f64::from(i) + 0.5) / width * 2.0 - 1.0,
        (f64::from(j) + 0.5) / height,
    );
    let half = (0.92 * sin(PI * (y / 0.85).min(1.0)).max(0.0)).max(0.08);
    // Take the distance from the edge in pixels. The grey of the last pixel moves the cut at one
    // half to the edge.
    let inside = (half - x.abs()) * width / 2.0 + 0.5;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 0 to 255"
    )]
    let value = (255.0 * inside.clamp(0.0, 1.0)).round() as u8;
    [value; 3]
}

/// Returns the object `twig`: leaves around a stem along y, as pbrt text.
fn twig() -> String {
    let (mut points, mut uvs, mut indices) = (String::new(), String::new(), String::new());
    for k in 0..LEAVES {
        let t = f64::from(k) / f64::from(LEAVES);
        let (sin, cos) = sin_cos(f64::from(k) * GOLDEN);
        // Point a leaf outwards and upwards, with its flat side up.
        let (out, up, side) = ([cos * 0.8, 0.6, sin * 0.8], 0.45 * t, [-sin, 0.0, cos]);
        for [across, along] in [[-1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 1.0]] {
            let at = [0, 1, 2].map(|a| 0.2 * along * out[a] + 0.05 * across * side[a]);
            points += &triple([at[0], at[1] + up, at[2]]);
            let _ = write!(uvs, " {} {along}", f64::midpoint(across, 1.0));
        }
        for corner in [0, 1, 2, 0, 2, 3] {
            let _ = write!(indices, " {}", 4 * k + corner);
        }
    }
    format!(
        "ObjectBegin \"twig\"\n\
         Material \"diffuse\" \"rgb reflectance\" [ 0.25 0.45 0.15 ]\n\
         Shape \"trianglemesh\" \"integer indices\" [{indices} ]\n\"point3 P\" [{points} ]\n\
         \"point2 uv\" [{uvs} ]\n\"texture alpha\" \"leaf\" \"float alphacutoff\" 0.5\nObjectEnd\n"
    )
}

/// The golden angle, in radians. Leaves and twigs that follow each other at this angle around a
/// stem are spread uniformly over the circle, for any number of them.
const GOLDEN: f64 = 0.381_966_011_250_105 * TAU;

/// Returns the instances of the twig, which point outwards from the centre of the crown, as pbrt
/// text.
fn twigs() -> String {
    let mut text = String::new();
    for k in 0..TWIGS {
        // Spread the directions of the twigs over a sphere without its lower part, by the golden
        // angle.
        let height = 1.0 - 1.7 * (f64::from(k) + 0.5) / f64::from(TWIGS);
        let (sin, cos) = sin_cos(f64::from(k) * GOLDEN);
        let ring = (1.0 - height * height).sqrt();
        let y = [ring * cos, height, ring * sin];
        let x = [-sin, 0.0, cos];
        // Complete the axes by x × y, so that the map does not mirror.
        let z = [
            x[1] * y[2] - x[2] * y[1],
            x[2] * y[0] - x[0] * y[2],
            x[0] * y[1] - x[1] * y[0],
        ];
        // Write the twig at some distance from the centre.
        let depth = 0.35 + 0.4 * f64::from(k * 7 % 11) / 10.0;
        let at = [depth * y[0], 1.75 + depth * y[1], depth * y[2]];
        text += "AttributeBegin ConcatTransform [";
        for (column, last) in [(x, 0), (y, 0), (z, 0), (at, 1)] {
            let _ = write!(text, "{} {last}", triple(column));
        }
        text += " ] ObjectInstance \"twig\" AttributeEnd\n";
    }
    text
}

/// Formats three coordinates as text.
fn triple(of: [f64; 3]) -> String {
    let [x, y, z] = of.map(rounded);
    format!(" {x} {y} {z}")
}

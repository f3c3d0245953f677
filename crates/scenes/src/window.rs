//! The scene `window`: a window with a view, behind blinds, which is a textured light.

use super::mesh::Mesh;
use super::rooms::{BOX_CAMERA, walls};
use super::{Files, diffuse, gloss};

/// The number of pixels of the view, across and down.
const VIEW: [u16; 2] = [64, 48];

/// Returns the files of a scene: the room of the Cornell box, lit through a window in its left
/// wall.
pub(super) fn window() -> Files {
    let mut blinds = Mesh::default();
    for k in 0..4u8 {
        let y = 1.32 + 0.11 * f64::from(k);
        blinds.cuboid([-0.93, y, -0.75], [-0.86, y + 0.012, 0.75], 0.0);
    }
    let block = Mesh::block([0.05, 0.0, -0.45], [0.65, 0.6, 0.15], 0.29);
    let mut world = walls();
    world += &diffuse([0.7, 0.7, 0.65], &blinds);
    world += &gloss::plastic([0.3, 0.32, 0.35], 0.5, 0.15, &block);
    // Add the light, whose first edge is horizontal like the blinds.
    world += "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n\
        AreaLightSource \"diffuse\" \"string filename\" [ \"window.tga\" ] \"float scale\" [ 170 ]\n\
        Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ]\n\
        \"point3 P\" [ -0.98 1.7 -0.7  -0.98 1.7 0.7  -0.98 0.7 0.7  -0.98 0.7 -0.7 ]\n\
        \"point2 uv\" [ 0 1  1 1  1 0  0 0 ]\nAttributeEnd\n";
    let about = "A window with a view, behind blinds.";
    let main = gloss::scene("window", about, BOX_CAMERA, [256, 256], &world);
    vec![main, ("window.tga".to_owned(), tga(VIEW, view))]
}

/// Returns the colour of the pixel in column `i` and row `j` of the view, with row 0 at the top: a
/// low sun in a dusky sky over dark hills, and a frame with a cross of bars. The sun is a hundredth
/// of the image, and more than half of its light.
fn view(i: u16, j: u16) -> [u8; 3] {
    let [width, height] = VIEW;
    let (x, y) = (i32::from(i), i32::from(j));
    let [w, h] = [i32::from(width), i32::from(height)];
    let hills = h - 14 - (x - 20) * (x - 44) / 90;
    let (dx, dy) = (x - 44, y - 29);
    let from_sun = dx * dx + dy * dy;
    let is_frame = x < 2 || y < 2 || x >= w - 2 || y >= h - 2;
    if is_frame || (x - w / 2).abs() < 2 || (y - h / 2).abs() < 2 {
        [4, 4, 4]
    } else if from_sun <= 10 {
        [255, 244, 214]
    } else if y > hills {
        [8, 11, 7]
    } else {
        let low = u8::try_from(y.clamp(0, 40)).unwrap_or(0);
        let glow = u8::try_from(900 / (from_sun + 12)).unwrap_or(0);
        [10 + low / 2 + glow, 16 + low / 3 + glow / 2, 34 - low / 4]
    }
}

/// Returns the bytes of an uncompressed TGA file with 24 bits for each pixel, the top row first.
pub(super) fn tga([width, height]: [u16; 2], pixel: impl Fn(u16, u16) -> [u8; 3]) -> Vec<u8> {
    let mut out = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    out.extend(width.to_le_bytes());
    out.extend(height.to_le_bytes());
    out.extend([24, 0x20]);
    for j in 0..height {
        for i in 0..width {
            let [r, g, b] = pixel(i, j);
            out.extend([b, g, r]);
        }
    }
    out
}

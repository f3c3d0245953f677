//! The scenes `luminaires-2` and `luminaires-32`, after the rooms of Shirley and Wang, and
//! `shining-ball`.

use crate::mesh::{Mesh, Random};
use crate::rooms::{BOX_CAMERA, walls};
use crate::text::{diffuse, emitter, facing_up, light_text};

/// The filter and the film of the scenes, up to the beginning of the world.
const HEAD: &str = "PixelFilter \"box\" \"float xradius\" [ 0.5 ] \"float yradius\" [ 0.5 ]\nFilm \"rgb\" \"integer xresolution\" [ 128 ] \"integer yresolution\" [ 128 ]\nWorldBegin\n";

/// Returns the corners of a triangle that faces down, about a centre. `flip` turns it by half a
/// turn.
fn triangle([x, y, z]: [f64; 3], size: f64, flip: bool) -> [[f64; 3]; 3] {
    let s = if flip { -size } else { size };
    [
        [x - 0.5 * s, y, z - 0.4 * s],
        [x + 0.5 * s, y, z - 0.4 * s],
        [x, y, z + 0.6 * s],
    ]
}

/// Returns a luminaire of a warm colour, as pbrt text.
fn luminaire(radiance: f64, corners: &[[f64; 3]]) -> String {
    let colour = [radiance, 0.92 * radiance, 0.75 * radiance];
    emitter(&light_text(colour, corners))
}

/// Returns the text of the room of Shirley and Wang, with 2 or 32 triangular luminaires on the
/// ceiling over a ball and a block. The 32 luminaires have different radiance.
pub(crate) fn room(count: u32) -> String {
    let block = diffuse(
        [0.6; 3],
        &Mesh::block([0.15, 0.0, -0.5], [0.65, 0.7, 0.0], 0.3),
    );
    let mut text = format!("{BOX_CAMERA}\n{HEAD}{}{block}", walls());
    text.push_str("AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0.7 0.7 0.7 ]\nTranslate -0.35 0.5 0.1\nShape \"sphere\" \"float radius\" [ 0.45 ]\nAttributeEnd\n");
    if count <= 2 {
        text.push_str(&luminaire(9.0, &triangle([-0.45, 1.98, 0.0], 0.75, false)));
        text.push_str(&luminaire(9.0, &triangle([0.45, 1.98, 0.0], 0.75, true)));
        return text;
    }
    let mut random = Random::new(1991);
    for k in 0..count {
        let (i, j) = (f64::from(k % 8), f64::from(k / 8));
        let centre = [0.22 * (i - 3.5), 1.98, 0.4 * (j - 1.5)];
        let radiance = random.between(2.0, 20.0);
        text.push_str(&luminaire(radiance, &triangle(centre, 0.14, k % 2 == 1)));
    }
    text
}

/// Returns the text of a scene: a floor and a block next to a spherical light.
pub(crate) fn shining_ball() -> String {
    let floor = Mesh::polygon(&facing_up([-3.0; 2], [3.0; 2], 0.0));
    let block = Mesh::block([0.6, 0.0, -0.9], [0.9, 1.1, 0.3], 0.3);
    let camera = "LookAt 0 3.2 -4.2  0 0.3 0  0 1 0\nCamera \"perspective\" \"float fov\" [ 40 ]";
    let mut text = format!(
        "{camera}\n{HEAD}{}{}",
        diffuse([0.7; 3], &floor),
        diffuse([0.6; 3], &block)
    );
    text.push_str("AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nTranslate -0.4 0.65 0\nAreaLightSource \"diffuse\" \"rgb L\" [ 6 5.5 4.5 ]\nShape \"sphere\" \"float radius\" [ 0.6 ]\nAttributeEnd\n");
    text
}

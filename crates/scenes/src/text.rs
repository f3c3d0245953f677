//! Pieces of pbrt-v4 text that the scenes are put together from.

use crate::Files;
use crate::mesh::Mesh;
use std::fmt::Write as _;

/// The size of a scene's light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightSize {
    Small,
    Large,
}

impl LightSize {
    pub(crate) const BOTH: [Self; 2] = [Self::Small, Self::Large];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Small => "small",
            Self::Large => "large",
        }
    }

    pub(crate) const fn pick<T: Copy>(self, small: T, large: T) -> T {
        match self {
            Self::Small => small,
            Self::Large => large,
        }
    }
}

/// A main file for each size of light: camera, `Include` of the geometry, light.
pub(crate) fn main_files(
    name: &str,
    about: &str,
    camera: &str,
    light: impl Fn(LightSize) -> String,
) -> Files {
    let file = |size: LightSize| main_file(name, size.name(), about, camera, &light(size));
    LightSize::BOTH.map(file).to_vec()
}

/// The main file of a scene with one kind of light.
pub(crate) fn main_file(
    name: &str,
    kind: &str,
    about: &str,
    camera: &str,
    light: &str,
) -> (String, Vec<u8>) {
    let mut text = String::new();
    let _ = writeln!(text, "# linelit: {name}, {kind} light. {about}");
    let _ = writeln!(text, "{camera}");
    let _ = writeln!(
        text,
        "Sampler \"independent\" \"integer pixelsamples\" [ 16 ]"
    );
    let _ = writeln!(
        text,
        "PixelFilter \"box\" \"float xradius\" [ 0.5 ] \"float yradius\" [ 0.5 ]"
    );
    let _ = writeln!(
        text,
        "Film \"rgb\" \"integer xresolution\" [ 512 ] \"integer yresolution\" [ 512 ] \"string filename\" [ \"{name}-{kind}.exr\" ]"
    );
    let _ = writeln!(text, "WorldBegin\nInclude \"{name}.geometry.pbrt\"");
    let _ = writeln!(
        text,
        "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]"
    );
    let _ = writeln!(text, "{light}\nAttributeEnd");
    (format!("{name}-{kind}.pbrt"), text.into_bytes())
}

/// A linear light between two points, of the given radiance times radius.
pub(crate) fn line_text(strength: [f64; 3], [a, b]: [[f64; 3]; 2]) -> String {
    let [r, g, bl] = strength;
    let at = |p: [f64; 3]| format!("[ {} {} {} ]", p[0], p[1], p[2]);
    format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [ {r} {g} {bl} ]\nShape \"line\" \"point3 p0\" {} \"point3 p1\" {}",
        at(a),
        at(b)
    )
}

/// An area light of the given radiance over the corners of a convex polygon, as a fan.
pub(crate) fn light_text(radiance: [f64; 3], corners: &[[f64; 3]]) -> String {
    let mut mesh = Mesh::default();
    mesh.fan(corners);
    let [r, g, b] = radiance;
    format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [ {r} {g} {b} ]\n{}",
        mesh.text()
    )
}

/// A diffuse mesh.
pub(crate) fn diffuse(reflectance: [f64; 3], mesh: &Mesh) -> String {
    let [r, g, b] = reflectance;
    format!(
        "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\n{}\nAttributeEnd\n",
        mesh.text()
    )
}

/// A mesh with a Phong lobe over a diffuse reflectance: linelit's own material.
pub(crate) fn phong(reflectance: [f64; 3], specular: f64, exponent: f64, mesh: &Mesh) -> String {
    let [r, g, b] = reflectance;
    format!(
        "AttributeBegin\nMaterial \"phong\" \"rgb Kd\" [ {r} {g} {b} ] \"rgb Ks\" [ {specular} {specular} {specular} ] \"float exponent\" [ {exponent} ]\n{}\nAttributeEnd\n",
        mesh.text()
    )
}

/// A rectangle in a horizontal plane that faces down: half sizes x and z about a centre.
pub(crate) fn facing_down(centre: [f64; 3], half: [f64; 2]) -> [[f64; 3]; 4] {
    let [x, y, z] = centre;
    let [a, b] = half;
    [
        [x - a, y, z - b],
        [x + a, y, z - b],
        [x + a, y, z + b],
        [x - a, y, z + b],
    ]
}

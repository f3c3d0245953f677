//! The pieces of pbrt-v4 text of which the scenes consist: main files, lights and surfaces.

use crate::Files;
use crate::mesh::Mesh;

/// Returns the files of a scene with two variants, a small and a large light: a main file for each,
/// and the geometry that both include.
pub(crate) fn main_files(
    name: &str,
    about: &str,
    camera: &str,
    geometry: String,
    lights: [String; 2],
) -> Files {
    let [small, large] = lights;
    vec![
        main_file(name, "small", about, camera, &small),
        main_file(name, "large", about, camera, &large),
        (format!("{name}.geometry.pbrt"), geometry.into_bytes()),
    ]
}

/// Returns the main file of one variant of a scene, whose geometry is in a file of its own.
pub(crate) fn main_file(
    name: &str,
    kind: &str,
    about: &str,
    camera: &str,
    light: &str,
) -> (String, Vec<u8>) {
    let text = format!(
        "# linelit: {name}, {kind} light. {about}\n{camera}\n\
         Sampler \"independent\" \"integer pixelsamples\" [ 16 ]\n\
         PixelFilter \"box\" \"float xradius\" [ 0.5 ] \"float yradius\" [ 0.5 ]\n\
         Film \"rgb\" \"integer xresolution\" [ 512 ] \"integer yresolution\" [ 512 ] \"string filename\" [ \"{name}-{kind}.exr\" ]\n\
         WorldBegin\nInclude \"{name}.geometry.pbrt\"\n{}",
        emitter(light)
    );
    (format!("{name}-{kind}.pbrt"), text.into_bytes())
}

/// Returns the pbrt text of the shape `light` (itself pbrt text) with a black material.
pub(crate) fn emitter(light: &str) -> String {
    format!(
        "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n{light}\nAttributeEnd\n"
    )
}

/// Returns the pbrt text of a linear light between two points; `strength` is radiance times radius.
pub(crate) fn line_text(strength: [f64; 3], [a, b]: [[f64; 3]; 2]) -> String {
    let [r, g, bl] = strength;
    let at = |p: [f64; 3]| format!("[ {} {} {} ]", p[0], p[1], p[2]);
    format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [ {r} {g} {bl} ]\nShape \"line\" \"point3 p0\" {} \"point3 p1\" {}",
        at(a),
        at(b)
    )
}

/// Returns the pbrt text of an area light over a convex polygon, as a fan of triangles.
pub(crate) fn light_text(radiance: [f64; 3], corners: &[[f64; 3]]) -> String {
    let [r, g, b] = radiance;
    format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [ {r} {g} {b} ]\n{}",
        Mesh::polygon(corners).text()
    )
}

/// Returns the pbrt text of a diffuse mesh.
pub(crate) fn diffuse(reflectance: [f64; 3], mesh: &Mesh) -> String {
    let [r, g, b] = reflectance;
    format!(
        "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\n{}\nAttributeEnd\n",
        mesh.text()
    )
}

/// Returns the text of a mesh with a diffuse reflectance and a Phong lobe, linelit's own material.
pub(crate) fn phong(reflectance: [f64; 3], specular: f64, exponent: f64, mesh: &Mesh) -> String {
    let [r, g, b] = reflectance;
    format!(
        "AttributeBegin\nMaterial \"phong\" \"rgb Kd\" [ {r} {g} {b} ] \"rgb Ks\" [ {specular} {specular} {specular} ] \"float exponent\" [ {exponent} ]\n{}\nAttributeEnd\n",
        mesh.text()
    )
}

/// Returns the corners of a horizontal rectangle that faces up, between two corners in x and z.
pub(crate) fn facing_up(low: [f64; 2], high: [f64; 2], y: f64) -> [[f64; 3]; 4] {
    let ([a, b], [c, d]) = (low, high);
    [[a, y, b], [a, y, d], [c, y, d], [c, y, b]]
}

/// Returns the corners of a horizontal rectangle that faces down, with the half sizes in x and z
/// about a centre.
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

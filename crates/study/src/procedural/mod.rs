//! The built-in scenes, made by generators: no data of others, and the same bytes every time.
//!
//! The small ones are kept in `scenes/` as pbrt-v4 text (a test holds them to their generators);
//! the colonnade is written on first use.

mod colonnade;
mod gloss;
mod logo;
pub mod luminaires;
mod mesh;
mod rooms;
mod window;

use anyhow::{Result, ensure};
use linelit_film::write_atomically;
use mesh::Mesh;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A scene as files: names and contents.
pub type Files = Vec<(String, Vec<u8>)>;

/// The size of a scene's light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LightSize {
    Small,
    Large,
}

impl LightSize {
    const BOTH: [Self; 2] = [Self::Small, Self::Large];

    const fn name(self) -> &'static str {
        match self {
            Self::Small => "small",
            Self::Large => "large",
        }
    }

    const fn pick<T: Copy>(self, small: T, large: T) -> T {
        match self {
            Self::Small => small,
            Self::Large => large,
        }
    }
}

/// The files of the scenes that are kept in the repository.
#[must_use]
pub fn kept() -> Files {
    let mut files = Files::new();
    files.extend(rooms::cornell_box());
    files.extend(rooms::grid_planes());
    files.extend(rooms::triangle_soup());
    files.extend(logo::logo());
    files.extend(gloss::floating_quad());
    files.extend(gloss::strips());
    files.extend(gloss::monoliths());
    files.extend(gloss::plates());
    files.extend(window::window());
    files
}

/// Writes the generated scene of this name (`colonnade-small` or `colonnade-large`) into a folder,
/// unless it is there, and returns the path of its main file.
///
/// # Errors
/// If the folder cannot be written.
pub fn generate(name: &str, dir: &Path) -> Result<PathBuf> {
    let main = dir.join(format!("{name}.pbrt"));
    let stamp = dir.join(format!("colonnade-{}.stamp", colonnade::VERSION));
    if stamp.is_file() && main.is_file() {
        return Ok(main);
    }
    for (file, bytes) in colonnade::colonnade() {
        write_atomically(&dir.join(file), &bytes)?;
    }
    write_atomically(&stamp, b"")?;
    ensure!(main.is_file(), "no generated scene `{name}`");
    Ok(main)
}

/// A main file for each size of light: camera, `Include` of the geometry, light.
fn main_files(name: &str, about: &str, camera: &str, light: impl Fn(LightSize) -> String) -> Files {
    let file = |size: LightSize| main_file(name, size.name(), about, camera, &light(size));
    LightSize::BOTH.map(file).to_vec()
}

/// The main file of a scene with one kind of light.
fn main_file(name: &str, kind: &str, about: &str, camera: &str, light: &str) -> (String, Vec<u8>) {
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
fn line_text(strength: [f64; 3], [a, b]: [[f64; 3]; 2]) -> String {
    let [r, g, bl] = strength;
    let at = |p: [f64; 3]| format!("[ {} {} {} ]", p[0], p[1], p[2]);
    format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [ {r} {g} {bl} ]\nShape \"line\" \"point3 p0\" {} \"point3 p1\" {}",
        at(a),
        at(b)
    )
}

/// An area light of the given radiance over the corners of a convex polygon, as a fan.
fn light_text(radiance: [f64; 3], corners: &[[f64; 3]]) -> String {
    let mut mesh = Mesh::default();
    mesh.fan(corners);
    let [r, g, b] = radiance;
    format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [ {r} {g} {b} ]\n{}",
        mesh.text()
    )
}

/// A diffuse mesh.
fn diffuse(reflectance: [f64; 3], mesh: &Mesh) -> String {
    let [r, g, b] = reflectance;
    format!(
        "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\n{}\nAttributeEnd\n",
        mesh.text()
    )
}

/// A mesh with a Phong lobe over a diffuse reflectance: linelit's own material.
fn phong(reflectance: [f64; 3], specular: f64, exponent: f64, mesh: &Mesh) -> String {
    let [r, g, b] = reflectance;
    format!(
        "AttributeBegin\nMaterial \"phong\" \"rgb Kd\" [ {r} {g} {b} ] \"rgb Ks\" [ {specular} {specular} {specular} ] \"float exponent\" [ {exponent} ]\n{}\nAttributeEnd\n",
        mesh.text()
    )
}

/// A rectangle in a horizontal plane that faces down: half sizes x and z about a centre.
fn facing_down(centre: [f64; 3], half: [f64; 2]) -> [[f64; 3]; 4] {
    let [x, y, z] = centre;
    let [a, b] = half;
    [
        [x - a, y, z - b],
        [x + a, y, z - b],
        [x + a, y, z + b],
        [x - a, y, z + b],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The repository's scenes are what the generators make.
    #[test]
    fn kept_scenes_are_up_to_date() {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        for (name, bytes) in kept() {
            let path = dir.join(&name);
            let found = std::fs::read(&path).unwrap_or_default();
            assert!(
                found == bytes,
                "{name} differs: run `cargo run -p linelit-study --example write_scenes`"
            );
        }
    }

    #[test]
    fn colonnade_has_about_a_quarter_of_a_million_triangles() {
        let count = colonnade::triangle_count();
        assert!((220_000..280_000).contains(&count), "{count}");
    }
}

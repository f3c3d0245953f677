//! Helpers of the integration tests.

use linelit_formats::{LoadOptions, Loaded, Root};
use linelit_geometry::DVec3;
use linelit_lights::{AreaLight, Light, LinearLight};
use linelit_scene::SceneDescription;
use std::path::Path;

/// Loads pbrt text that must load; it may name files of the system's temporary folder.
pub(crate) fn load(text: &str) -> Loaded {
    let options = LoadOptions {
        root: Root::Anywhere,
        ..LoadOptions::default()
    };
    match linelit_formats::from_pbrt_str(text, "test.pbrt", &options) {
        Ok(loaded) => loaded,
        Err(error) => panic!("{error}"),
    }
}

/// Loads the inside of a world.
pub(crate) fn world(text: &str) -> SceneDescription {
    load(&format!("Camera \"perspective\"\nWorldBegin\n{text}")).scene
}

pub(crate) fn area(scene: &SceneDescription, k: usize) -> &AreaLight {
    match &*scene.lights[k].light {
        Light::Area(light) => light,
        other => panic!("{other:?} is no area light"),
    }
}

pub(crate) fn line(scene: &SceneDescription, k: usize) -> &LinearLight {
    match &*scene.lights[k].light {
        Light::Linear(light) => light,
        other => panic!("{other:?} is no linear light"),
    }
}

/// Writes a picture of bytes.
pub(crate) fn write_tga(path: &Path, size: [u32; 2], rgb: &[[u8; 3]]) {
    std::fs::write(path, linelit_testkit::pictures::tga(size, rgb)).unwrap();
}

/// Equal to within `f32` rounding of coordinates of about one.
pub(crate) fn assert_near(got: DVec3, want: DVec3) {
    let error = (got - want).abs().max_element();
    assert!(
        error <= 2.0 * f64::from(f32::EPSILON),
        "{got} is not {want}"
    );
}

/// Bytes as the text of a data URI.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |chunk: &[u8]| {
        let word = chunk.iter().fold(0_u32, |w, b| (w << 8) | u32::from(*b));
        let word = word << (8 * (3 - chunk.len()));
        let digit = |k: usize| char::from(DIGITS[(word >> (18 - 6 * k)) as usize & 63]);
        let text: String = (0..=chunk.len()).map(digit).collect();
        format!("{text:=<4}")
    };
    bytes.chunks(3).map(digits).collect()
}

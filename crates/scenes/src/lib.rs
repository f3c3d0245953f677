#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod built_in;
mod colonnade;
mod foliage;
mod gloss;
#[cfg(feature = "load")]
mod library;
mod logo;
mod luminaires;
mod mesh;
mod papers;
mod rooms;
mod spheres;
mod text;
#[cfg(feature = "load")]
mod visibility;
mod window;

pub use built_in::BuiltIn;
#[cfg(feature = "load")]
pub use library::{Library, SceneLocation};
#[cfg(feature = "load")]
pub use visibility::{VisibilityScene, stratified_lines};

use text::{diffuse, facing_down, facing_up, light_text, line_text, main_file, main_files, phong};

/// The files of a scene: their names and contents.
pub type Files = Vec<(String, Vec<u8>)>;

/// Generates the files of the scenes that are stored in the repository, in the folder `scenes`.
#[must_use]
pub fn kept() -> Files {
    let scenes = [
        rooms::cornell_box(),
        rooms::grid_planes(),
        rooms::triangle_soup(),
        logo::logo(),
        gloss::floating_quad(),
        gloss::strips(),
        gloss::monoliths(),
        gloss::plates(),
        window::window(),
        foliage::foliage(),
    ];
    scenes.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The scenes in the repository are the same as the generators make.
    #[test]
    fn kept_scenes_are_up_to_date() {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        for (name, bytes) in kept() {
            let path = dir.join(&name);
            let found = std::fs::read(&path).unwrap_or_default();
            assert!(
                found == bytes,
                "{name} differs: run `cargo run -p linelit-scenes --example write_scenes`"
            );
        }
    }

    /// The generator of each scene makes its main file, and all files that this includes.
    #[test]
    fn built_in_scenes_have_their_files() {
        for scene in BuiltIn::ALL {
            let files = scene.files();
            let named = |name: &str| files.iter().find(|(n, _)| n == name);
            let (_, main) = named(&scene.main_file()).expect(scene.name);
            let main = String::from_utf8_lossy(main);
            for word in main.split("Include \"").skip(1) {
                let name = word.split('"').next().unwrap();
                assert!(named(name).is_some(), "{}: {name}", scene.name);
            }
            assert_eq!(BuiltIn::find(scene.name).unwrap().name, scene.name);
        }
        for size in ["1e3", "1e4", "1e5", "1e6"] {
            let name = format!("spheres-{size}");
            assert_eq!(BuiltIn::find(&name).unwrap().name, name);
        }
        assert_eq!(BuiltIn::find("colonnade").unwrap().name, "colonnade-large");
        assert!(BuiltIn::find("").is_none() && BuiltIn::find("no").is_none());
    }

    #[test]
    fn colonnade_has_about_a_quarter_of_a_million_triangles() {
        let count = colonnade::triangle_count();
        assert!((220_000..280_000).contains(&count), "{count}");
    }
}

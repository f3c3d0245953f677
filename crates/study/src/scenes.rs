//! Finding scenes: files, and the built-in ones by name.

use crate::cli::ReadArgs;
use crate::output::note;
use crate::procedural;
use anyhow::{Context, Result, bail};
use linelit_scene::{Loaded, Scene};
use std::path::{Path, PathBuf};

/// Scenes that are made by a generator on first use rather than kept in the repository.
const GENERATED: [&str; 3] = ["colonnade-small", "colonnade-large", "colonnade-line"];

/// The built-in scenes.
pub const BUILT_IN: [&str; 17] = [
    "cornell-box-small",
    "cornell-box-large",
    "cornell-box-line",
    "grid-planes-small",
    "grid-planes-large",
    "triangle-soup-small",
    "triangle-soup-large",
    "logo-small",
    "logo-large",
    "colonnade-small",
    "colonnade-large",
    "floating-quad",
    "strips",
    "monoliths",
    "plates",
    "window",
    "colonnade-line",
];

/// The file of a scene: a path that exists, or the name of a built-in scene (`cornell-box` is
/// short for `cornell-box-large`).
///
/// # Errors
/// If there is neither, or the generator cannot write.
pub fn locate(name: &str) -> Result<PathBuf> {
    let path = Path::new(name);
    if path.is_file() {
        return Ok(path.to_owned());
    }
    let full = if BUILT_IN.contains(&name) {
        name.to_owned()
    } else {
        format!("{name}-large")
    };
    if !BUILT_IN.contains(&full.as_str()) {
        bail!(
            "no scene `{name}`: neither a file nor one of the built-in scenes {}",
            BUILT_IN.join(", ")
        );
    }
    if GENERATED.contains(&full.as_str()) {
        let dir = generated_dir();
        return procedural::generate(&full, &dir)
            .with_context(|| format!("generating `{full}` in {}", dir.display()));
    }
    let path = scenes_dir().join(format!("{full}.pbrt"));
    if path.is_file() {
        Ok(path)
    } else {
        bail!(
            "the built-in scene `{full}` is missing: {} does not exist",
            path.display()
        )
    }
}

/// `scenes/` of the workspace.
fn scenes_dir() -> PathBuf {
    workspace().join("scenes")
}

/// Where generated scenes are kept: beside what cargo builds.
fn generated_dir() -> PathBuf {
    workspace().join("target").join("scenes")
}

/// The workspace: where the current folder or one above it has `scenes/`, else where the tool was
/// built.
fn workspace() -> PathBuf {
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let here = std::env::current_dir().unwrap_or_default();
    here.ancestors()
        .find(|d| d.join("scenes/cornell-box-large.pbrt").is_file())
        .map_or(built, Path::to_owned)
}

/// Loads a scene; warnings go to standard error.
///
/// # Errors
/// If the scene cannot be found or read.
pub fn load(name: &str, read: &ReadArgs) -> Result<Loaded> {
    let loaded = Scene::load(locate(name)?, &read.options())?;
    for warning in &loaded.warnings {
        note(format_args!("{warning}"));
    }
    Ok(loaded)
}

/// Loads a scene, and gives one without lights a square beside the camera, which is said.
///
/// # Errors
/// If the scene cannot be found or read, or has no lights and nothing to be lit.
pub fn load_lit(name: &str, read: &ReadArgs) -> Result<Loaded> {
    let mut loaded = load(name, read)?;
    if loaded.scene.lights.is_empty() {
        if !loaded.scene.add_framing_light() {
            bail!("`{name}` has no lights, and nothing that one could stand beside");
        }
        note(format_args!(
            "note: `{name}` has no lights: it is lit by a square beside the camera, which is not \
             in the file"
        ));
    }
    Ok(loaded)
}

/// A short name for tables: the stem of the scene's file.
#[must_use]
pub fn short_name(name: &str) -> String {
    let stem = Path::new(name)
        .file_stem()
        .map_or(name.into(), |s| s.to_string_lossy());
    stem.into_owned()
}

//! Finding and reading scenes: files, and the built-in ones by name.
#![allow(
    clippy::disallowed_methods,
    reason = "scenes are looked for from the working folder upwards"
)]

use crate::{BUILT_IN, colonnade};
use anyhow::{Context, Result, bail, ensure};
use linelit_film::write_atomically;
use linelit_formats::{LoadOptions, Loaded};
use std::fmt;
use std::path::{Path, PathBuf};

/// Scenes that are made by a generator on first use rather than kept in the repository.
const GENERATED: [&str; 3] = ["colonnade-small", "colonnade-large", "colonnade-line"];

/// How scenes are read, and who is told what is strange about them.
#[derive(Clone, Debug)]
pub struct Library {
    /// How files are read.
    pub options: LoadOptions,
    /// Called with each warning, and with each remark that begins with `note:`.
    pub note: fn(fmt::Arguments<'_>),
}

impl Default for Library {
    /// Lenient ([`LoadOptions::default`]) and silent.
    fn default() -> Self {
        Self {
            options: LoadOptions::default(),
            note: |_| {},
        }
    }
}

impl Library {
    /// Loads the scene that [`locate`] finds.
    ///
    /// # Errors
    /// If the scene cannot be found or read.
    pub fn load(&self, name: &str) -> Result<Loaded> {
        let loaded = linelit_formats::load(locate(name)?, &self.options)?;
        for warning in &loaded.warnings {
            (self.note)(format_args!("{warning}"));
        }
        Ok(loaded)
    }

    /// Loads a scene, and gives one without lights a square beside the camera, which is noted.
    ///
    /// # Errors
    /// If the scene cannot be found or read, or has no lights and nothing to be lit.
    pub fn load_lit(&self, name: &str) -> Result<Loaded> {
        let mut loaded = self.load(name)?;
        if loaded.scene.lights.is_empty() {
            if !linelit_formats::add_framing_light(&mut loaded.scene) {
                bail!("`{name}` has no lights, and nothing that one could stand beside");
            }
            (self.note)(format_args!(
                "note: `{name}` has no lights: it is lit by a square beside the camera, which is \
                 not in the file"
            ));
        }
        Ok(loaded)
    }
}

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
        if path.exists() {
            bail!("cannot read the scene `{name}`: it is not a regular file");
        }
        bail!(
            "no scene `{name}`: neither a file nor one of the built-in scenes {}",
            BUILT_IN.join(", ")
        );
    }
    if GENERATED.contains(&full.as_str()) {
        let dir = generated_dir();
        return generate(&full, &dir)
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

/// Writes the generated scene of this name (`colonnade-small` or `colonnade-large`) into a folder,
/// unless it is there, and returns the path of its main file.
fn generate(name: &str, dir: &Path) -> Result<PathBuf> {
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

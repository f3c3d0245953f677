//! Loading a scene from a file.

use crate::assembly::describe;
use crate::error::{ErrorKind, Result, SceneError, Warning};
use crate::pbrt;
use crate::scene::Scene;
use crate::source::Source;
use std::path::Path;

/// How to load.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Warnings become errors.
    pub strict: bool,
    /// More triangles than this, instances expanded, are an error.
    pub max_triangles: usize,
}

impl Default for LoadOptions {
    /// Lenient, at most 32 million triangles (about 1.5 GiB with the renderer's structures).
    fn default() -> Self {
        Self {
            strict: false,
            max_triangles: 32 << 20,
        }
    }
}

/// A scene and what was strange about its files.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// In the order of the files; the same message only once.
    pub warnings: Vec<Warning>,
}

impl Scene {
    /// Loads a scene; the extension of the file says its format: `.pbrt`.
    ///
    /// # Errors
    /// Whatever is wrong with the file or the files that it names, with its place; when
    /// [`LoadOptions::strict`] also what is merely not supported.
    pub fn load(path: impl AsRef<Path>, options: &LoadOptions) -> Result<Loaded> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        if !extension.eq_ignore_ascii_case("pbrt") {
            let message = format!("cannot tell the format of `{name}`");
            return Err(SceneError::new(ErrorKind::Unsupported, message)
                .in_file(&name)
                .help("scenes end in .pbrt"));
        }
        let bytes = std::fs::read(path).map_err(|e| {
            let message = format!("cannot read the scene: {}", describe(&e));
            SceneError::new(ErrorKind::Io, message).in_file(&name)
        })?;
        pbrt::load(Source::new(name, bytes), Some(path), options)
    }

    /// Reads pbrt text from memory. Files that it names are looked up in the working folder;
    /// `name` is what messages call the text.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_pbrt_str(text: &str, name: &str, options: &LoadOptions) -> Result<Loaded> {
        Self::from_pbrt_bytes(text.as_bytes(), name, options)
    }

    /// As [`Scene::from_pbrt_str`], from bytes that need not be UTF-8.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_pbrt_bytes(bytes: &[u8], name: &str, options: &LoadOptions) -> Result<Loaded> {
        pbrt::load(Source::new(name, bytes.to_vec()), None, options)
    }
}

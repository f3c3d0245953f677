//! Loading a scene from a file.

use crate::diagnostics::{ErrorKind, Result, SceneError, Source, Warning, read as read_file};
#[cfg(feature = "gltf")]
use crate::gltf;
use crate::{obj, pbrt, ply};
use linelit_scene::Scene;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How to load.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Warnings become errors.
    pub strict: bool,
    /// More triangles than this, instances expanded, are an error.
    pub max_triangles: usize,
    /// Files with more bytes than this, the scene's own or those it names, are an error; so are
    /// folders, pipes and devices.
    pub max_file_bytes: u64,
    /// Where the files that the scene names must lie.
    pub root: Root,
}

/// Where the files that a scene names must lie, links followed: a scene from elsewhere shall not
/// read what it was not shipped with.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Root {
    /// In the folder of the scene's file and below; for a scene in memory, in the working folder.
    #[default]
    SceneFolder,
    /// In this folder and below.
    Folder(PathBuf),
    /// Anywhere.
    Anywhere,
}

impl Default for LoadOptions {
    /// Lenient, at most 32 million triangles (some 3 GB with the renderer's structures), files of
    /// at most 4 GiB, in the scene's folder and below.
    fn default() -> Self {
        Self {
            strict: false,
            max_triangles: 32 << 20,
            max_file_bytes: 4 << 30,
            root: Root::SceneFolder,
        }
    }
}

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// pbrt text, versions 3 and 4.
    Pbrt,
    /// Wavefront OBJ with its material library.
    Obj,
    /// A single PLY mesh.
    Ply,
    /// glTF 2.0, as JSON or binary; needs the feature `gltf`.
    Gltf,
}

impl Format {
    /// The format of files with this extension (without the dot, in any case).
    ///
    /// ```
    /// assert_eq!(linelit_formats::Format::from_extension("OBJ"), Some(linelit_formats::Format::Obj));
    /// ```
    pub fn from_extension(extension: &str) -> Option<Self> {
        match extension.to_ascii_lowercase().as_str() {
            "pbrt" => Some(Self::Pbrt),
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "gltf" | "glb" => Some(Self::Gltf),
            _ => None,
        }
    }

    fn read(
        self,
        source: Arc<Source>,
        path: Option<&Path>,
        options: &LoadOptions,
    ) -> Result<Loaded> {
        match self {
            Self::Pbrt => pbrt::load(source, path, options),
            Self::Obj => obj::load(source, path, options),
            Self::Ply => ply::load(&source, path, options),
            #[cfg(feature = "gltf")]
            Self::Gltf => gltf::load(&source, path, options),
            #[cfg(not(feature = "gltf"))]
            Self::Gltf => {
                let message = "this program was built without its glTF reader";
                Err(SceneError::new(ErrorKind::Unsupported, message)
                    .in_file(source.name())
                    .help("build it with the feature `gltf` of linelit-formats"))
            }
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

/// Loads a scene; the extension of the file says its format: `.pbrt`, `.obj`, `.ply`, `.gltf`
/// or `.glb`.
///
/// # Errors
/// Whatever is wrong with the file or the files that it names, with its place; when
/// [`LoadOptions::strict`] also what is merely not supported.
pub fn load(path: impl AsRef<Path>, options: &LoadOptions) -> Result<Loaded> {
    let path = path.as_ref();
    let name = path.display().to_string();
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let Some(format) = Format::from_extension(extension) else {
        let message = format!("cannot tell the format of `{name}`");
        return Err(SceneError::new(ErrorKind::Unsupported, message)
            .in_file(&name)
            .help("scenes end in .pbrt, .obj, .ply, .gltf or .glb"));
    };
    let bytes = read_file(path, options.max_file_bytes).map_err(|refusal| {
        let message = format!("cannot read the scene: {}", refusal.message);
        SceneError::new(refusal.kind, message).in_file(&name)
    })?;
    format.read(Source::new(name, bytes), Some(path), options)
}

/// Reads a scene of a known format from memory. Files that it names are looked up in the
/// working folder; `name` is what messages call the bytes.
///
/// # Errors
/// As [`load`].
pub fn from_bytes(
    format: Format,
    bytes: &[u8],
    name: &str,
    options: &LoadOptions,
) -> Result<Loaded> {
    format.read(Source::new(name, bytes.to_vec()), None, options)
}

/// Reads pbrt text from memory. Files that it names are looked up in the working folder;
/// `name` is what messages call the text.
///
/// # Errors
/// As [`load`].
pub fn from_pbrt_str(text: &str, name: &str, options: &LoadOptions) -> Result<Loaded> {
    from_bytes(Format::Pbrt, text.as_bytes(), name, options)
}

//! [`load`] and [`from_bytes`], which read a scene in any format.

#[cfg(feature = "gltf")]
use crate::gltf;
use crate::obj;
use linelit_assembly::{ErrorKind, LoadOptions, Loaded, Result, SceneError, Source, ply};
use linelit_pbrt as pbrt;
use std::path::Path;
use std::sync::Arc;

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The text format of pbrt, versions 3 and 4.
    Pbrt,
    /// Wavefront OBJ with its material libraries.
    Obj,
    /// A single mesh in PLY.
    Ply,
    /// glTF 2.0, as JSON or binary. It needs the feature `gltf`.
    Gltf,
}

impl Format {
    /// Returns the format of files with this extension (without the dot, in any case).
    ///
    /// ```
    /// use linelit_formats::Format;
    ///
    /// assert_eq!(Format::from_extension("OBJ"), Some(Format::Obj));
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

    /// Reads a scene of this format.
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
                let error = source.whole().error(ErrorKind::Unsupported, message, "");
                Err(error.help("build it with the feature `gltf` of linelit-formats"))
            }
        }
    }
}

/// Loads a scene from a file. The extension decides the format: `.pbrt`, `.obj`, `.ply`, `.gltf` or
/// `.glb`.
///
/// # Errors
/// The first error in the file or the files that it names, with its position. With
/// [`LoadOptions::strict`], features that are not supported are errors, too; otherwise they are
/// warnings.
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
    let source = Source::open(path, options)?;
    let own = path.file_name().unwrap_or_default().to_string_lossy();
    options.watch.tell(&own, source.bytes());
    format.read(source, Some(path), options)
}

/// Reads a scene of a known format from memory. Files that it names are looked up in the working
/// directory, or in [`Root::Memory`](linelit_assembly::Root::Memory). `name` is the name of the
/// bytes in messages.
///
/// # Errors
/// The same as for [`load`].
pub fn from_bytes(
    format: Format,
    bytes: &[u8],
    name: &str,
    options: &LoadOptions,
) -> Result<Loaded> {
    options.watch.tell(name, bytes);
    format.read(Source::new(name, bytes.to_vec()), None, options)
}

//! [`LoadOptions`], the options for loading a scene, and [`Loaded`], the result.

use crate::diagnostics::{Result, Warning};
use linelit_geometry::DVec3;
use linelit_scene::SceneDescription;
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// The options for loading a scene.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Whether warnings are errors.
    pub strict: bool,
    /// The largest number of triangles; more are an error. Each instance of an object is a copy,
    /// whose triangles count.
    pub max_triangles: usize,
    /// The largest number of bytes of the scene's file and of each file that it names; a longer
    /// file is an error. Folders, pipes and devices are errors, too.
    pub max_file_bytes: u64,
    /// The folder in which the files that the scene names have to be.
    pub root: Root,
    /// The callback for the files that are read.
    pub watch: Watch,
    /// The point of the world relative to which vertices are stored. By default it is zero, or the
    /// centre of the scene's bounding box if that is [far away](linelit_geometry::origin_of_box).
    pub origin: Option<DVec3>,
}

/// A callback that receives the name and the bytes of each file of a scene when it is read. By it a
/// program can find out later whether a scene has changed, or store the files. By default there is
/// no callback.
///
/// The scene's own file comes first, with its name without a folder. Then come the files that it
/// names, by the names in the scene, each as often as it is read. With these names in
/// [`Root::Memory`], the scene can be read again without any file.
#[derive(Clone, Default)]
pub struct Watch(Option<Arc<Told>>);

/// The type of the callback.
type Told = dyn Fn(&str, &[u8]) + Send + Sync;

impl Watch {
    /// Makes a callback of a function of name and bytes.
    pub fn new(told: impl Fn(&str, &[u8]) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(told)))
    }

    /// Calls the callback for a file. Readers call it for the scene's own file; for other files
    /// `Assembly` does.
    pub fn tell(&self, name: &str, bytes: &[u8]) {
        if let Some(told) = &self.0 {
            told(name, bytes);
        }
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let who = if self.0.is_some() {
            "someone"
        } else {
            "nobody"
        };
        write!(f, "Watch({who})")
    }
}

/// Where the files that a scene names have to be, after symbolic links are followed. A scene from
/// another source should not read files that do not belong to it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Root {
    /// The files have to be in the folder of the scene's file or below it; for a scene in memory,
    /// the working directory.
    #[default]
    SceneFolder,
    /// The files have to be in this folder or below it.
    Folder(PathBuf),
    /// The files may be anywhere.
    Anywhere,
    /// The files are in memory: only these files exist, by their names in the scene.
    Memory(Arc<BTreeMap<String, Vec<u8>>>),
}

impl Default for LoadOptions {
    /// Options by which warnings are no errors, with at most 32 million triangles (some 3 GB with
    /// the renderer's structures) and files of at most 4 GiB, in the scene's folder or below it.
    fn default() -> Self {
        Self {
            strict: false,
            max_triangles: 32 << 20,
            max_file_bytes: 4 << 30,
            root: Root::SceneFolder,
            watch: Watch::default(),
            origin: None,
        }
    }
}

/// A scene, with the warnings about its files.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: SceneDescription,
    /// Whether the file has lights, including black ones and lights that were left out.
    pub has_lights: bool,
    /// The warnings in the order of the files, with each message only once.
    pub warnings: Vec<Warning>,
}

/// Reads a scene with `read`, and reads it a second time with another origin if that is better for
/// the precision of its vertices, which are rounded relative to the origin as they are read. All
/// readers of whole scenes call it.
///
/// # Errors
/// The errors of `read`.
pub fn about_its_middle(
    options: &LoadOptions,
    read: impl Fn(&LoadOptions) -> Result<Loaded>,
) -> Result<Loaded> {
    if options.origin.is_some() {
        return read(options);
    }
    // Read it about zero. Warnings that are due to rounding may not come again with a better
    // origin, so that they must not be errors yet.
    let lenient = LoadOptions {
        strict: false,
        ..options.clone()
    };
    let found = match read(&lenient) {
        Ok(found) => found,
        Err(_) if options.strict => return read(options),
        Err(error) => return Err(error),
    };
    let origin = found.scene.better_origin();
    if origin.is_none() && (found.warnings.is_empty() || !options.strict) {
        return Ok(found);
    }
    // Read it again about its middle, or strictly. Both scenes at once would take twice the memory.
    drop(found);
    read(&LoadOptions {
        origin,
        ..options.clone()
    })
}

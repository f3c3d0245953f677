//! How to load, and what comes of it.

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
    /// Warnings become errors.
    pub strict: bool,
    /// More triangles than this are an error. What is placed many times is copied, and each copy
    /// counts.
    pub max_triangles: usize,
    /// Files with more bytes than this, the scene's own or those it names, are an error; so are
    /// folders, pipes and devices.
    pub max_file_bytes: u64,
    /// The folder in which the files that the scene names must lie.
    pub root: Root,
    /// The callback for the files that are read.
    pub watch: Watch,
    /// The point of the world relative to which vertices are stored; if there is none, zero, or the
    /// scene's middle where that is [far away](linelit_geometry::origin_of_box).
    pub origin: Option<DVec3>,
}

/// A callback that gets each file of a scene, with its bytes, when it is read: to know later
/// whether it is the same scene, or to keep the files. By default there is none.
///
/// The scene's own file comes first, by its name without a folder; then those that it names, as the
/// scene writes them, each as often as it is read. With these names in [`Root::Memory`] the scene
/// is read again without any file.
#[derive(Clone, Default)]
pub struct Watch(Option<Arc<Told>>);

type Told = dyn Fn(&str, &[u8]) + Send + Sync;

impl Watch {
    /// Calls this with name and bytes.
    pub fn new(told: impl Fn(&str, &[u8]) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(told)))
    }

    /// Tells of a file: for who reads the scene's own.
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

/// The root in which the files that a scene names must lie, links followed: a scene from elsewhere
/// shall not read what it was not shipped with.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Root {
    /// The folder of the scene's file and below; for a scene in memory, the working folder.
    #[default]
    SceneFolder,
    /// This folder and below.
    Folder(PathBuf),
    /// Anywhere.
    Anywhere,
    /// Nowhere on a disk: only these, by their names as the scene writes them.
    Memory(Arc<BTreeMap<String, Vec<u8>>>),
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
            watch: Watch::default(),
            origin: None,
        }
    }
}

/// A scene and what was strange about its files.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: SceneDescription,
    /// Whether the file has lights, dark ones and those that are left out included.
    pub has_lights: bool,
    /// The warnings in the order of the files; the same message only once.
    pub warnings: Vec<Warning>,
}

/// Reads a scene, and once more where its origin is to be another, for its vertices are rounded as
/// they are read: what all readers of whole scenes do.
///
/// # Errors
/// Those of `read`.
pub fn about_its_middle(
    options: &LoadOptions,
    read: impl Fn(&LoadOptions) -> Result<Loaded>,
) -> Result<Loaded> {
    if options.origin.is_some() {
        return read(options);
    }
    // What is wrong by rounding alone is not wrong the second time.
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
    // Both would take twice the memory.
    drop(found);
    read(&LoadOptions {
        origin,
        ..options.clone()
    })
}

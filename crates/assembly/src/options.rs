//! How to load, and what comes of it.

use crate::diagnostics::Warning;
use linelit_scene::Scene;
use std::collections::BTreeMap;
use std::path::PathBuf;
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

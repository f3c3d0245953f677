//! Temporary folders for tests that write files.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "makes folders, and a test without one ends"
)]

use std::fs;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// A folder in the system's temporary folder, which is deleted with its contents on drop.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// Creates a folder of this process; the name distinguishes it from the folders of other tests.
    ///
    /// # Panics
    /// If the system cannot create it.
    #[must_use]
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("linelit-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// Returns the names of the files and folders in this folder, sorted.
    ///
    /// # Panics
    /// If the folder does not exist, or a name is not UTF-8.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }
}

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // If it cannot be deleted, it is left to the system.
        let _ = fs::remove_dir_all(&self.0);
    }
}

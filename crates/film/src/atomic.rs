//! Files that are either whole or absent.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::FilmError;

static SERIAL: AtomicU64 = AtomicU64::new(0);

/// Writes `bytes` to `path` through a temporary name in the same folder, then renames.
///
/// A reader sees the old file or the whole new one, never a part; on failure the temporary file is
/// removed and an older file of that name stays as it was. Missing parent folders are created.
///
/// # Errors
/// [`FilmError::Io`] with the path and the step that failed.
///
/// ```
/// let folder = std::env::temp_dir().join(format!("linelit-doc-{}", std::process::id()));
/// linelit_film::write_atomically(&folder.join("note.txt"), b"whole")?;
/// assert_eq!(std::fs::read(folder.join("note.txt")).unwrap(), b"whole");
/// # std::fs::remove_dir_all(&folder).unwrap();
/// # Ok::<(), linelit_film::FilmError>(())
/// ```
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), FilmError> {
    let Some(name) = path.file_name() else {
        let reason = io::Error::new(io::ErrorKind::InvalidInput, "the path names no file");
        return Err(FilmError::io(path, "write", reason));
    };
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(|e| FilmError::io(folder, "create the folder", e))?;
    let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
    let mut temporary_name = std::ffi::OsString::from(".");
    temporary_name.push(name);
    temporary_name.push(format!(".{}-{serial}.tmp", process::id()));
    let temporary = folder.join(temporary_name);
    let guard = RemoveOnDrop(Some(temporary.clone()));
    let write = |mut file: File| -> io::Result<()> {
        file.write_all(bytes)?;
        file.sync_data()
    };
    OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&temporary)
        .and_then(write)
        .map_err(|e| FilmError::io(path, "write", e))?;
    fs::rename(&temporary, path)
        .map_err(|e| FilmError::io(path, "rename the temporary file to", e))?;
    guard.disarm();
    Ok(())
}

struct RemoveOnDrop(Option<PathBuf>);

impl RemoveOnDrop {
    fn disarm(mut self) {
        self.0 = None;
    }
}

impl Drop for RemoveOnDrop {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            // Nothing more can be done about a temporary file that refuses to go.
            let _ = fs::remove_file(path);
        }
    }
}

/// The bytes of a regular file; opening a pipe would wait, and a device has no end.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, FilmError> {
    let found = fs::metadata(path).map_err(|e| FilmError::io(path, "read", e))?;
    if !found.is_file() {
        let reason = io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file");
        return Err(FilmError::io(path, "read", reason));
    }
    fs::read(path).map_err(|e| FilmError::io(path, "read", e))
}

//! Durable files: a file is either complete or absent, and it is on the disk when a function says
//! that it was written.
#![allow(clippy::disallowed_methods, reason = "a plan is a folder of files")]

use crate::PlanError;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// The number of temporary files that this process has created, which makes their names different.
static SERIAL: AtomicU64 = AtomicU64::new(0);

/// Tests whether files can be written to a folder.
pub(crate) fn check_writable(folder: &Path) -> Result<(), PlanError> {
    let (path, _) = temporary(folder, "try")?;
    fs::remove_file(&path).map_err(PlanError::io(&path, "remove"))
}

/// Creates a file whose name no other process uses. The name begins with a dot and ends in `.tmp`.
fn temporary(folder: &Path, of: &str) -> Result<(PathBuf, File), PlanError> {
    loop {
        let (process, serial) = (std::process::id(), SERIAL.fetch_add(1, Ordering::Relaxed));
        let path = folder.join(format!(".{of}.{process}-{serial}.tmp"));
        let mut options = OpenOptions::new();
        match options.write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((path, file)),
            // A process on another machine has the same number, or an earlier process had it.
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(PlanError::io(&path, "create")(e)),
        }
    }
}

/// Writes the pieces one after the other to a temporary file in the same folder, flushes it to the
/// disk, and renames it. Readers of `path` see either the previous contents or all of the new ones.
pub(crate) fn write(path: &Path, pieces: &[&[u8]]) -> Result<(), PlanError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (temporary, file) = temporary(folder, &name)?;
    let written = fill(file, pieces).map_err(PlanError::io(path, "write"));
    let renamed = written.and_then(|()| {
        let step = "rename the temporary file to";
        fs::rename(&temporary, path).map_err(PlanError::io(path, step))
    });
    if let Err(e) = renamed {
        // If the temporary file cannot be removed, it stays.
        let _ = fs::remove_file(&temporary);
        return Err(e);
    }
    sync_folder(folder).map_err(PlanError::io(folder, "flush the folder"))
}

/// Writes pieces to a file, and flushes it to the disk.
fn fill(mut file: File, pieces: &[&[u8]]) -> io::Result<()> {
    for piece in pieces {
        file.write_all(piece)?;
    }
    file.sync_all()
}

/// Flushes the names in a folder to the disk, where the system can.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    let unknown = [io::ErrorKind::InvalidInput, io::ErrorKind::Unsupported];
    match File::open(folder)?.sync_all() {
        // Some network file systems do not support it.
        Err(e) if unknown.contains(&e.kind()) => Ok(()),
        other => other,
    }
}

/// Returns the bytes of a file, or `None` if there is no such file.
pub(crate) fn read(path: &Path) -> Result<Option<Vec<u8>>, PlanError> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(PlanError::io(path, "read")(e)),
    }
}

/// Creates a folder and the folders above it.
pub(crate) fn make_folder(path: &Path) -> Result<(), PlanError> {
    fs::create_dir_all(path).map_err(PlanError::io(path, "create the folder"))
}

/// Returns the names in a folder; none if the folder does not exist.
pub(crate) fn names(folder: &Path) -> Result<Vec<String>, PlanError> {
    let failed = || PlanError::io(folder, "list the folder");
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(failed()(e)),
    };
    let name = |entry: io::Result<fs::DirEntry>| {
        let name = entry.map_err(failed())?.file_name();
        Ok(name.to_string_lossy().into_owned())
    };
    entries.map(name).collect()
}

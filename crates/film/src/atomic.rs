//! The writing of files so that a reader finds either a whole file or none: a file is written under
//! a temporary name and renamed.
#![allow(clippy::disallowed_methods, reason = "pictures are files")]

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::FilmError;

/// The number of temporary files that this process has opened, which makes their names different.
static SERIAL: AtomicU64 = AtomicU64::new(0);

/// The largest number of symbolic links that are followed in a row, the same as in Linux.
const MOST_LINKS: usize = 40;

/// Writes `bytes` to a temporary file in the same folder as `path`, and renames it to `path`.
///
/// A reader sees the old file or the whole new one, never a part. If writing fails, the temporary
/// file is removed and an older file at `path` does not change. Missing parent folders are created.
/// If `path` is a symbolic link, the file that it leads to is replaced, and the link stays. The new
/// file gets the permissions of the older one, and is on the disk when the function returns.
/// Temporary files for this path that were left by a process that was killed are removed.
///
/// # Errors
/// [`FilmError::Io`] with the path and the step that failed; also when the older file is read-only
/// or not a regular file.
///
/// ```
/// let folder = std::env::temp_dir().join(format!("linelit-doc-{}", std::process::id()));
/// linelit_film::write_atomically(&folder.join("note.txt"), b"whole")?;
/// assert_eq!(std::fs::read(folder.join("note.txt")).unwrap(), b"whole");
/// # std::fs::remove_dir_all(&folder).unwrap();
/// # Ok::<(), linelit_film::FilmError>(())
/// ```
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), FilmError> {
    write_atomically_by(path, |mut file| file.write_all(bytes))
}

/// Writes a file as [`write_atomically`] does, with the contents that `write` writes piece by
/// piece. The file is not buffered, so that `write` should use a buffer.
///
/// # Errors
/// The same as for [`write_atomically`].
pub fn write_atomically_by(
    path: &Path,
    write: impl FnOnce(&File) -> io::Result<()>,
) -> Result<(), FilmError> {
    let destination = Destination::find(path)?;
    let (file, temporary) = destination.temporary()?;
    let written = write(&file)
        .and_then(|()| destination.older_permissions(&file))
        .and_then(|()| file.sync_all());
    written.map_err(|e| FilmError::io(path, "write", e))?;
    fs::rename(&temporary.0, &destination.file)
        .map_err(|e| FilmError::io(path, "rename the temporary file to", e))?;
    // Flush the folder, too: it has the new name, but perhaps not on the disk yet.
    sync_folder(&destination.folder)
        .map_err(|e| FilmError::io(&destination.folder, "flush the folder", e))
}

/// Checks whether [`write_atomically`] could write to `path`, by opening a temporary file and
/// removing it; missing parent folders are created. Call it before long work whose result is to be
/// written there.
///
/// # Errors
/// The same as for [`write_atomically`].
///
/// ```
/// let file = std::env::temp_dir().join(format!("linelit-doc-try-{}", std::process::id()));
/// linelit_film::check_writable(&file)?;
/// assert!(!file.exists());
/// // There is no folder below a file.
/// std::fs::write(&file, "text").unwrap();
/// assert!(linelit_film::check_writable(&file.join("picture.exr")).is_err());
/// # std::fs::remove_file(&file).unwrap();
/// # Ok::<(), linelit_film::FilmError>(())
/// ```
pub fn check_writable(path: &Path) -> Result<(), FilmError> {
    Destination::find(path)?.temporary().map(drop)
}

/// The path of a file that is to be written, after symbolic links.
struct Destination<'a> {
    /// The path that the caller gave.
    asked: &'a Path,
    /// The path of the file after all symbolic links.
    file: PathBuf,
    /// The folder of the file.
    folder: PathBuf,
    /// The name of the file in its folder.
    name: OsString,
    /// The permissions of the older file at this path; `None` if there is no older file.
    older: Option<fs::Permissions>,
}

impl<'a> Destination<'a> {
    /// Follows links, creates missing folders, and checks an older file.
    fn find(asked: &'a Path) -> Result<Self, FilmError> {
        let file = behind_links(asked).map_err(|e| FilmError::io(asked, "write", e))?;
        let Some(name) = file.file_name().map(OsStr::to_owned) else {
            let reason = io::Error::new(io::ErrorKind::InvalidInput, "the path names no file");
            return Err(FilmError::io(asked, "write", reason));
        };
        let folder = folder_of(&file).to_owned();
        fs::create_dir_all(&folder).map_err(|e| FilmError::io(&folder, "create the folder", e))?;
        let older = older(&file).map_err(|e| FilmError::io(asked, "write", e))?;
        Ok(Self {
            asked,
            file,
            folder,
            name,
            older,
        })
    }

    /// Opens a temporary file with a unique name in the folder of the destination.
    fn temporary(&self) -> Result<(File, RemoveOnDrop), FilmError> {
        self.sweep();
        loop {
            let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
            let mut name = self.prefix();
            name.push(format!("{}-{serial}.tmp", process::id()));
            let path = self.folder.join(name);
            let mut options = OpenOptions::new();
            match options.write(true).create_new(true).open(&path) {
                Ok(file) => {
                    // Lock the file while it is written, so that other processes do not remove it.
                    // On another machine they cannot find out whether this process is alive. If
                    // the file system has no locks, they go by the process alone.
                    let _ = file.try_lock();
                    return Ok((file, RemoveOnDrop(path)));
                }
                // Try another name: a killed process with the same number has left this file.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(FilmError::io(self.asked, "write", e)),
            }
        }
    }

    /// Returns the prefix of the names of temporary files for this file.
    fn prefix(&self) -> OsString {
        let mut prefix = OsString::from(".");
        prefix.push(&self.name);
        prefix.push(".");
        prefix
    }

    /// Removes temporary files for this file whose processes do not exist any more.
    fn sweep(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else {
            return;
        };
        let prefix = self.prefix();
        for entry in entries.flatten() {
            let name = entry.file_name();
            let writer = writer_of(name.as_encoded_bytes(), prefix.as_encoded_bytes());
            if writer.is_some_and(is_dead) && is_unlocked(&entry.path()) {
                // A file that cannot be removed does no harm.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    /// Gives a new file the permissions of the older file that it replaces, if there is one.
    fn older_permissions(&self, file: &File) -> io::Result<()> {
        match &self.older {
            Some(permissions) => file.set_permissions(permissions.clone()),
            None => Ok(()),
        }
    }
}

/// Returns the permissions of the file that is to be replaced, if there is one; an error if it must
/// not be replaced.
fn older(file: &Path) -> io::Result<Option<fs::Permissions>> {
    let metadata = match fs::metadata(file) {
        Ok(metadata) => metadata,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(e),
    };
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !metadata.is_file() {
        let reason = "it is not a regular file";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
    }
    // Refuse to replace a read-only file. Renaming would succeed, as it needs rights to the folder
    // only, and root may write to any file; but the file was made read-only to protect it.
    if metadata.permissions().readonly() {
        let reason = "the file is read-only";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, reason));
    }
    OpenOptions::new().write(true).open(file)?;
    Ok(Some(metadata.permissions()))
}

/// Returns the path after all symbolic links, whether or not a file exists there.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::symlink_metadata(&target) {
            Ok(metadata) if metadata.is_symlink() => {
                target = folder_of(&target).join(fs::read_link(&target)?);
            }
            _ => return Ok(target),
        }
    }
    let reason = "too many symbolic links";
    Err(io::Error::new(io::ErrorKind::InvalidInput, reason))
}

/// Returns the folder of a file.
fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Returns the number of the process that wrote a temporary file, from the file's name, which is
/// the prefix and `PID-SERIAL.tmp`.
fn writer_of(name: &[u8], prefix: &[u8]) -> Option<u32> {
    let rest = name.strip_prefix(prefix)?.strip_suffix(b".tmp")?;
    let (process, serial) = std::str::from_utf8(rest).ok()?.split_once('-')?;
    serial.parse::<u64>().ok()?;
    process.parse().ok()
}

/// Returns whether no process with this number exists. The result is false where the system has no
/// `/proc`, from which this is known.
fn is_dead(process: u32) -> bool {
    let processes = Path::new("/proc");
    processes.join("self").exists() && !processes.join(process.to_string()).exists()
}

/// Returns whether no process has locked a file.
fn is_unlocked(file: &Path) -> bool {
    File::open(file).is_ok_and(|file| file.try_lock().is_ok())
}

/// Flushes the names in a folder to the disk, where the system supports it.
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

/// A temporary file, which is removed at the end unless it was renamed.
struct RemoveOnDrop(PathBuf);

impl Drop for RemoveOnDrop {
    fn drop(&mut self) {
        // If the file cannot be removed, it has to stay.
        let _ = fs::remove_file(&self.0);
    }
}

/// Reads a regular file. Pipes and devices are refused, as opening a pipe would wait and a device
/// may have no end.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, FilmError> {
    let found = fs::metadata(path).map_err(|e| FilmError::io(path, "read", e))?;
    if !found.is_file() {
        let reason = io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file");
        return Err(FilmError::io(path, "read", reason));
    }
    fs::read(path).map_err(|e| FilmError::io(path, "read", e))
}

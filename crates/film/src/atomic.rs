//! Files that are either whole or absent.
#![allow(clippy::disallowed_methods, reason = "pictures are files")]

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::FilmError;

static SERIAL: AtomicU64 = AtomicU64::new(0);

/// Symbolic links that are followed in a row, as many as Linux follows.
const MOST_LINKS: usize = 40;

/// Writes `bytes` to `path` through a temporary name in the same folder, then renames.
///
/// A reader sees the old file or the whole new one, never a part; on failure the temporary file is
/// removed and an older file of that name stays as it was. Missing parent folders are created. A
/// symbolic link is followed: the file it leads to is replaced, the link stays. The new file gets
/// the older one's permissions, and is on the disk when the function returns. What an earlier
/// process that was killed has left of its temporary files for this name is removed.
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

/// Does as [`write_atomically`] with what `write` writes piece by piece: give it a buffer.
///
/// # Errors
/// Those of [`write_atomically`].
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
    // Now the name is in the folder, but the folder not yet on the disk.
    sync_folder(&destination.folder)
        .map_err(|e| FilmError::io(&destination.folder, "flush the folder", e))
}

/// Tries whether [`write_atomically`] could write to `path`, and leaves nothing behind but missing
/// parent folders: to be asked before the work whose result goes there.
///
/// # Errors
/// Those of [`write_atomically`].
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

/// Path of a file to be written, behind symbolic links.
struct Destination<'a> {
    /// The name that was asked for.
    asked: &'a Path,
    /// The file behind all symbolic links.
    file: PathBuf,
    /// The folder it is in.
    folder: PathBuf,
    /// The name within the folder.
    name: OsString,
    /// The permissions of the file that is there.
    older: Option<fs::Permissions>,
}

impl<'a> Destination<'a> {
    /// Follows links, makes missing folders and looks at the file that is there.
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

    /// Opens a file of a name of its own beside the place.
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
                    // Others see by the lock that the file is being written, even from another
                    // machine, which cannot ask whether the process lives. Without locks on this
                    // file system the process has to do.
                    let _ = file.try_lock();
                    return Ok((file, RemoveOnDrop(path)));
                }
                // Left by a killed process that had our number.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(FilmError::io(self.asked, "write", e)),
            }
        }
    }

    /// Prefix of the temporary names for this file.
    fn prefix(&self) -> OsString {
        let mut prefix = OsString::from(".");
        prefix.push(&self.name);
        prefix.push(".");
        prefix
    }

    /// Removes temporary files for this file whose processes are dead.
    fn sweep(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else {
            return;
        };
        let prefix = self.prefix();
        for entry in entries.flatten() {
            let name = entry.file_name();
            let writer = writer_of(name.as_encoded_bytes(), prefix.as_encoded_bytes());
            if writer.is_some_and(is_dead) && is_unlocked(&entry.path()) {
                // What refuses to go does no harm.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    /// Gives a new file the permissions of the one it replaces.
    fn older_permissions(&self, file: &File) -> io::Result<()> {
        match &self.older {
            Some(permissions) => file.set_permissions(permissions.clone()),
            None => Ok(()),
        }
    }
}

/// The permissions of the file that is to be replaced, if there is one and it may be.
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
    // Renaming asks for rights to the folder only; root may write to any file. Who has taken the
    // right to write away did not mean the file to be replaced.
    if metadata.permissions().readonly() {
        let reason = "the file is read-only";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, reason));
    }
    OpenOptions::new().write(true).open(file)?;
    Ok(Some(metadata.permissions()))
}

/// The path behind symbolic links, whether anything is there or not.
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

fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// The process that wrote a temporary file, by its name: prefix, `PID-SERIAL.tmp`.
fn writer_of(name: &[u8], prefix: &[u8]) -> Option<u32> {
    let rest = name.strip_prefix(prefix)?.strip_suffix(b".tmp")?;
    let (process, serial) = std::str::from_utf8(rest).ok()?.split_once('-')?;
    serial.parse::<u64>().ok()?;
    process.parse().ok()
}

/// Whether the system says that there is no such process; not where it says nothing (no `/proc`).
fn is_dead(process: u32) -> bool {
    let processes = Path::new("/proc");
    processes.join("self").exists() && !processes.join(process.to_string()).exists()
}

fn is_unlocked(file: &Path) -> bool {
    File::open(file).is_ok_and(|file| file.try_lock().is_ok())
}

/// Writes the names in a folder to the disk, where the system can.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    let unknown = [io::ErrorKind::InvalidInput, io::ErrorKind::Unsupported];
    match File::open(folder)?.sync_all() {
        // Some file systems of networks do not know it.
        Err(e) if unknown.contains(&e.kind()) => Ok(()),
        other => other,
    }
}

/// A file that goes unless it was renamed.
struct RemoveOnDrop(PathBuf);

impl Drop for RemoveOnDrop {
    fn drop(&mut self) {
        // Nothing more can be done about a temporary file that refuses to go.
        let _ = fs::remove_file(&self.0);
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

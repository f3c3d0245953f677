//! The folder of a study: one process writes it at a time, and what is in it is of one study.

use crate::output::note;
use anyhow::{Context, Result, bail};
use linelit_film::{check_writable, write_atomically};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read as _, Write as _};
use std::path::{Component, Path, PathBuf};

/// Locked, with the number of the process, while a study runs.
const LOCK: &str = ".linelit-lock";
/// The files that the last study wrote, a name a line.
const LIST: &str = ".linelit-files";
/// The plan of a study that is not finished.
const PLAN: &str = ".linelit-plan";
/// The subfolder of an unfinished study; a finished one from before stays beside it.
const UNFINISHED: &str = "unfinished";

/// A folder that is ours until this value is dropped or the process ends, however it ends.
///
/// Files are kept until [`OutputFolder::finish`] writes them all at once: an earlier study stays
/// whole until the new one is.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    files: BTreeMap<String, Vec<u8>>,
    /// The temporary folder that is deleted when the files of a whole study are written.
    temporary: Option<PathBuf>,
    /// Whether the files are those of an unfinished study.
    unfinished: bool,
    /// Held for its drop, which comes after the folder's own.
    _lock: Option<Lock>,
    /// The folder, if it was made for this study: it goes if that fails.
    _made: Option<RemoveEmpty>,
}

impl OutputFolder {
    /// Makes the folder if there is none, locks it, and tries whether files can be written.
    ///
    /// # Errors
    /// If that fails, or another process holds the folder.
    pub fn open(path: &Path) -> Result<Self> {
        let made = (!path.exists()).then(|| RemoveEmpty(path.to_owned()));
        let failed = || format!("creating the folder {}", path.display());
        fs::create_dir_all(path).with_context(failed)?;
        let lock = Lock::acquire(&path.join(LOCK), |holder| {
            format!(
                "process {holder} is writing to the folder {}: wait for it, or choose another with \
                 --out",
                path.display()
            )
        })?;
        check_writable(&path.join("report.html"))?;
        Ok(Self {
            path: path.to_owned(),
            files: BTreeMap::new(),
            temporary: None,
            unfinished: false,
            _lock: lock,
            _made: made,
        })
    }

    /// Path of a file of the study.
    #[must_use]
    pub fn path_of(&self, name: &str) -> PathBuf {
        self.path.join(self.name_of(name))
    }

    /// Name of a file of the study within the folder.
    fn name_of(&self, name: &str) -> String {
        if self.unfinished {
            format!("{UNFINISHED}/{name}")
        } else {
            name.to_owned()
        }
    }

    /// A folder for what is done so far of the study, which goes when its files are written; what
    /// an interrupted one left there stays, unless one is to begin `fresh`.
    pub fn temporary(&mut self, fresh: bool) -> Result<PathBuf> {
        let path = self.path.join(PLAN);
        if fresh {
            remove_all(&path)?;
        }
        self.temporary = Some(path.clone());
        Ok(path)
    }

    /// Marks the study as unfinished: its files go to `unfinished/` until a whole one is written.
    /// Parts done so far stay for those who continue, and so does a whole study from before.
    pub const fn set_unfinished(&mut self) {
        self.unfinished = true;
    }

    /// Adds a file; `name` may be below a folder of its own, as `plots/a.svg`.
    pub fn add(&mut self, name: &str, bytes: impl Into<Vec<u8>>) {
        self.files.insert(self.name_of(name), bytes.into());
    }

    /// Writes all files, each whole or not at all, and removes those of the study before this one
    /// that have no successor.
    pub fn finish(self) -> Result<()> {
        let earlier = self.listed();
        // Should the process end between two files, the next study knows of them all.
        let names = || self.files.keys().map(String::as_str);
        let all: BTreeSet<&str> = names().chain(earlier.iter().map(String::as_str)).collect();
        self.list(&all)?;
        for (name, bytes) in &self.files {
            write_atomically(&self.path.join(name), bytes)?;
        }
        let stays = |name: &str| {
            self.files.contains_key(name)
                || self.unfinished && !Path::new(name).starts_with(UNFINISHED)
        };
        for name in all.iter().filter(|name| !stays(name)) {
            self.remove(name)?;
        }
        self.list(&all.iter().copied().filter(|name| stays(name)).collect())?;
        if let Some(path) = self.temporary.as_ref().filter(|_| !self.unfinished) {
            remove_all(path)?;
        }
        Ok(())
    }

    fn list(&self, names: &BTreeSet<&str>) -> Result<()> {
        let text: String = names.iter().map(|name| format!("{name}\n")).collect();
        write_atomically(&self.path.join(LIST), text.as_bytes())?;
        Ok(())
    }

    /// Names of the files that the study before this one wrote.
    fn listed(&self) -> BTreeSet<String> {
        let text = fs::read_to_string(self.path.join(LIST)).unwrap_or_default();
        let below = |name: &&str| {
            let mut parts = Path::new(name).components();
            !name.is_empty() && parts.all(|part| matches!(part, Component::Normal(_)))
        };
        text.lines().filter(below).map(str::to_owned).collect()
    }

    fn remove(&self, name: &str) -> Result<()> {
        let path = self.path.join(name);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(e).with_context(|| format!("removing {}", path.display()));
            }
            _ => {}
        }
        let above = path.ancestors().skip(1);
        for folder in above.take_while(|folder| **folder != *self.path) {
            // Fails, as it should, while anything is left in it.
            let _ = fs::remove_dir(folder);
        }
        Ok(())
    }
}

/// Removes a folder with all that is in it, if it is there.
pub(crate) fn remove_all(path: &Path) -> Result<()> {
    match fs::remove_dir_all(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            Err(e).with_context(|| format!("removing {}", path.display()))
        }
        _ => Ok(()),
    }
}

/// A folder that goes if it is empty.
#[derive(Debug)]
struct RemoveEmpty(PathBuf);

impl Drop for RemoveEmpty {
    fn drop(&mut self) {
        // Fails, as it should, while anything is in it.
        let _ = fs::remove_dir(&self.0);
    }
}

/// A locked file, removed when dropped.
#[derive(Debug)]
pub(crate) struct Lock {
    path: PathBuf,
    _file: File,
}

impl Lock {
    /// A lock by a file of this path; none where the file system has no locks, which is said. If
    /// another process holds it, `refusal` says so, of the process's number.
    pub(crate) fn acquire(path: &Path, refusal: impl Fn(&str) -> String) -> Result<Option<Self>> {
        let failed = || format!("opening {}", path.display());
        loop {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false);
            let mut file = options.open(path).with_context(failed)?;
            match file.try_lock() {
                Ok(()) if !is_at(&file, path) => continue,
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut holder = String::new();
                    let _ = file.read_to_string(&mut holder);
                    bail!(refusal(holder.trim()));
                }
                Err(TryLockError::Error(e)) => {
                    note(format_args!(
                        "note: {} cannot be locked ({e}): let no other process write there",
                        path.display()
                    ));
                    return Ok(None);
                }
            }
            file.set_len(0).with_context(failed)?;
            write!(file, "{}", std::process::id()).with_context(failed)?;
            return Ok(Some(Self {
                path: path.to_owned(),
                _file: file,
            }));
        }
    }
}

/// Whether the file that was locked is still the one of that name: who held it before may have
/// removed it.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    match (file.metadata(), fs::metadata(path)) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

impl Drop for Lock {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn write(path: &Path, files: &[&str]) {
        let mut folder = OutputFolder::open(path).unwrap();
        for file in files {
            folder.add(file, *file);
        }
        folder.finish().unwrap();
    }

    #[test]
    fn a_study_replaces_the_one_before_and_nothing_else() {
        let path = std::env::temp_dir().join(format!("linelit-folder-{}", std::process::id()));
        write(&path, &["report.html", "plots/a.svg", "old/b.svg"]);
        fs::write(path.join("plots/mine.txt"), "notes").unwrap();
        write(&path, &["report.html", "plots/c.svg"]);
        assert_eq!(names(&path), [LIST, "plots", "report.html"]);
        assert_eq!(names(&path.join("plots")), ["c.svg", "mine.txt"]);

        // A list that leads elsewhere is not followed.
        let outside = path.with_extension("outside");
        fs::write(&outside, "kept").unwrap();
        let up = format!("../{}\n", outside.file_name().unwrap().display());
        fs::write(path.join(LIST), format!("{up}{}\n", outside.display())).unwrap();
        write(&path, &["report.html"]);
        assert_eq!(fs::read(&outside).unwrap(), b"kept");
        fs::remove_file(outside).unwrap();
        fs::remove_dir_all(path).unwrap();
    }
}

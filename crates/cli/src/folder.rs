//! The output folder of a study. One process writes to it at a time, and it contains the files of
//! only one study.

use crate::output::note;
use anyhow::{Context, Result, bail};
use linelit_film::{check_writable, write_atomically};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read as _, Write as _};
use std::path::{Component, Path, PathBuf};

/// A file that is locked while a study runs, with the number of the process.
const LOCK: &str = ".linelit-lock";
/// The list of the files that the last study wrote, one name per line.
const LIST: &str = ".linelit-files";
/// The subfolder with the plan of a study that is not finished.
const PLAN: &str = ".linelit-plan";
/// The subfolder for the files of an unfinished study. The files of an earlier, finished study stay
/// where they are.
const UNFINISHED: &str = "unfinished";

/// An output folder that is locked until this value is dropped or the process ends, however it
/// ends.
///
/// Files are collected in memory until [`OutputFolder::finish`] writes all of them, so that an
/// earlier study stays complete until the new one is.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    files: BTreeMap<String, Vec<u8>>,
    /// The temporary folder that is deleted when the files of a complete study are written.
    temporary: Option<PathBuf>,
    /// Whether the files belong to an unfinished study.
    unfinished: bool,
    /// The lock, which is released after the folder was finished.
    _lock: Option<Lock>,
    /// The folder, if it was created for this study: it is removed if it stays empty.
    _made: Option<RemoveEmpty>,
}

impl OutputFolder {
    /// Creates the folder if it does not exist, locks it, and tests whether files can be written to
    /// it.
    ///
    /// # Errors
    /// If this fails, or another process has locked the folder.
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

    /// Returns the path of a file of the study.
    #[must_use]
    pub fn path_of(&self, name: &str) -> PathBuf {
        self.path.join(self.name_of(name))
    }

    /// Returns the name of a file of the study, relative to the folder.
    fn name_of(&self, name: &str) -> String {
        if self.unfinished {
            format!("{UNFINISHED}/{name}")
        } else {
            name.to_owned()
        }
    }

    /// Returns a folder for the intermediate results of the study, which is deleted when its files
    /// are written. Results that an interrupted study left there are kept, unless `fresh`.
    pub fn temporary(&mut self, fresh: bool) -> Result<PathBuf> {
        let path = self.path.join(PLAN);
        if fresh {
            remove_all(&path)?;
        }
        self.temporary = Some(path.clone());
        Ok(path)
    }

    /// Marks the study as unfinished: its files go to `unfinished/` until a complete study is
    /// written. Intermediate results are kept so that the study can be continued, and so is a
    /// complete study from before.
    pub const fn set_unfinished(&mut self) {
        self.unfinished = true;
    }

    /// Adds a file. Its name may contain folders, as in `plots/a.svg`.
    pub fn add(&mut self, name: &str, bytes: impl Into<Vec<u8>>) {
        self.files.insert(self.name_of(name), bytes.into());
    }

    /// Writes all files, each atomically, and removes the files of the previous study that the new
    /// one does not have.
    pub fn finish(self) -> Result<()> {
        let earlier = self.listed();
        // List old and new files first: if the process ends between two files, the next study knows
        // all of them.
        let names = || self.files.keys().map(String::as_str);
        let all: BTreeSet<&str> = names().chain(earlier.iter().map(String::as_str)).collect();
        self.list(&all)?;
        // Write the new files.
        for (name, bytes) in &self.files {
            write_atomically(&self.path.join(name), bytes)?;
        }
        // Remove the old ones, and list what remains.
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

    /// Writes the list of files.
    fn list(&self, names: &BTreeSet<&str>) -> Result<()> {
        let text: String = names.iter().map(|name| format!("{name}\n")).collect();
        write_atomically(&self.path.join(LIST), text.as_bytes())?;
        Ok(())
    }

    /// Returns the names of the files that the previous study wrote. Names that lead out of the
    /// folder are ignored.
    fn listed(&self) -> BTreeSet<String> {
        let text = fs::read_to_string(self.path.join(LIST)).unwrap_or_default();
        let below = |name: &&str| {
            let mut parts = Path::new(name).components();
            !name.is_empty() && parts.all(|part| matches!(part, Component::Normal(_)))
        };
        text.lines().filter(below).map(str::to_owned).collect()
    }

    /// Removes a file, and the folders above it that become empty.
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
            // This fails, as it should, while the folder is not empty.
            let _ = fs::remove_dir(folder);
        }
        Ok(())
    }
}

/// Removes a folder with its contents, if it exists.
pub(crate) fn remove_all(path: &Path) -> Result<()> {
    match fs::remove_dir_all(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            Err(e).with_context(|| format!("removing {}", path.display()))
        }
        _ => Ok(()),
    }
}

/// A folder that is removed on drop if it is empty.
#[derive(Debug)]
struct RemoveEmpty(PathBuf);

impl Drop for RemoveEmpty {
    fn drop(&mut self) {
        // This fails, as it should, while the folder is not empty.
        let _ = fs::remove_dir(&self.0);
    }
}

/// A locked file, which is removed on drop.
#[derive(Debug)]
pub(crate) struct Lock {
    path: PathBuf,
    _file: File,
}

impl Lock {
    /// Locks a file of this path. The result is `None`, with a note to the user, where the file
    /// system has no locks. If another process holds the lock, the error is what `refusal` makes of
    /// its process number.
    pub(crate) fn acquire(path: &Path, refusal: impl Fn(&str) -> String) -> Result<Option<Self>> {
        let failed = || format!("opening {}", path.display());
        loop {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false);
            let mut file = options.open(path).with_context(failed)?;
            // Lock the file, and start again if its previous holder has removed it in the meantime.
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
            // Write our process number, for the messages of others.
            file.set_len(0).with_context(failed)?;
            write!(file, "{}", std::process::id()).with_context(failed)?;
            return Ok(Some(Self {
                path: path.to_owned(),
                _file: file,
            }));
        }
    }
}

/// Returns whether the locked file still has this path: the previous holder may have removed it
/// before the lock succeeded.
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

        // Names in the list that lead out of the folder are ignored.
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

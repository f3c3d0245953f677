//! Who has a unit in hand: so that two processes seldom compute the same.
//!
//! A lease is a file that only one of several processes can create. Its holder touches it now and
//! again; one that was not touched for a while, or whose process this machine knows to be dead, is
//! anyone's, by a rename that only one of several can do. Time is the file system's own, read from
//! the stamp of a file just made: clocks of machines differ. Should two hold the same unit all the
//! same, as slow networks allow, both write the same part: waste, and no harm.
#![allow(clippy::disallowed_methods, reason = "leases are files")]

use crate::durable::{self, own_name};
use crate::{PlanError, folder::Folder};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

/// The leases of a plan, and those of them that this process holds.
#[derive(Debug)]
pub(crate) struct Leases {
    folder: PathBuf,
    /// A lease not touched for so long is lost.
    pub(crate) age: Duration,
    process: String,
    held: Mutex<BTreeMap<u32, String>>,
}

/// The answer to who wants a unit.
#[derive(Debug)]
pub(crate) enum Claim<'a> {
    /// It is in hand now.
    Ours(Held<'a>),
    /// Another process, or thread, has it.
    Theirs,
}

/// A unit in hand, until this is dropped.
#[derive(Debug)]
pub(crate) struct Held<'a> {
    leases: &'a Leases,
    number: u32,
    /// Whether another process had it before and is gone.
    pub(crate) taken_over: bool,
}

/// How a lease that stands looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    Absent,
    Fresh,
    Lost,
}

impl Leases {
    pub(crate) fn new(folder: &Folder, age: Duration) -> Self {
        Self {
            folder: folder.leases(),
            age,
            process: this_process(),
            held: Mutex::default(),
        }
    }

    fn path(&self, number: u32) -> PathBuf {
        self.folder.join(format!("{number:08}"))
    }

    /// The units that have a lease, whatever its age.
    pub(crate) fn listed(&self) -> Result<Vec<u32>, PlanError> {
        let names = durable::names(&self.folder)?;
        Ok(names.iter().filter_map(|name| name.parse().ok()).collect())
    }

    fn held(&self) -> MutexGuard<'_, BTreeMap<u32, String>> {
        // A panic of another thread leaves the map as good as it was.
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a unit in hand, if nobody has it.
    pub(crate) fn claim(&self, number: u32) -> Result<Claim<'_>, PlanError> {
        let path = self.path(number);
        let mut taken_over = false;
        loop {
            let mut options = OpenOptions::new();
            match options.write(true).create_new(true).open(&path) {
                Ok(mut file) => {
                    let text = format!(
                        "{} {}\n",
                        self.process,
                        own_name(Path::new(""), "").display()
                    );
                    if let Err(e) = file.write_all(text.as_bytes()) {
                        // The disk is full, perhaps: nobody shall wait for this one.
                        let _ = fs::remove_file(&path);
                        return Err(PlanError::io(&path, "write")(e));
                    }
                    self.held().insert(number, text);
                    return Ok(Claim::Ours(Held {
                        leases: self,
                        number,
                        taken_over,
                    }));
                }
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists && !taken_over => {}
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => return Ok(Claim::Theirs),
                Err(e) => return Err(PlanError::io(&path, "create")(e)),
            }
            match self.standing(number)? {
                Standing::Fresh => return Ok(Claim::Theirs),
                Standing::Absent => {}
                Standing::Lost => {
                    // Of several who see it, one can rename it.
                    let away = own_name(&self.folder, "lost");
                    match fs::rename(&path, &away) {
                        Ok(()) => durable::remove(&away)?,
                        Err(e) if e.kind() == io::ErrorKind::NotFound => {}
                        Err(e) => return Err(PlanError::io(&path, "rename")(e)),
                    }
                    taken_over = true;
                }
            }
        }
    }

    /// What the lease of a unit says.
    pub(crate) fn standing(&self, number: u32) -> Result<Standing, PlanError> {
        let path = self.path(number);
        let Some(text) = durable::read(&path)? else {
            return Ok(Standing::Absent);
        };
        if is_dead(&String::from_utf8_lossy(&text), &self.process) {
            return Ok(Standing::Lost);
        }
        let touched = match stamp(&path) {
            Ok(touched) => touched,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Standing::Absent),
            Err(e) => return Err(PlanError::io(&path, "look at")(e)),
        };
        let now = self.now()?;
        // A stamp ahead of the present is that of a lease just touched.
        let age = now.duration_since(touched).unwrap_or_default();
        Ok(if age < self.age {
            Standing::Fresh
        } else {
            Standing::Lost
        })
    }

    /// The present, by the clock of the file system.
    pub(crate) fn now(&self) -> Result<SystemTime, PlanError> {
        let (path, mut file) = durable::temporary(&self.folder, "now")?;
        let stamped = file.write_all(b"now").and_then(|()| {
            drop(file);
            stamp(&path)
        });
        durable::remove(&path)?;
        stamped.map_err(PlanError::io(&path, "look at"))
    }

    /// Touches what is held, again and again, until it is said that all is done.
    pub(crate) fn keep(&self, done: &Mutex<bool>, wake: &Condvar) {
        let mut is_done = done.lock().unwrap_or_else(PoisonError::into_inner);
        while !*is_done {
            let waited = wake.wait_timeout(is_done, self.age / 4);
            is_done = waited.unwrap_or_else(PoisonError::into_inner).0;
            for (number, text) in &*self.held() {
                let mut options = OpenOptions::new();
                // Written, not stamped: the stamp is then the file system's, not this machine's.
                // What fails here makes others take the unit: waste.
                if let Ok(mut file) = options.write(true).open(self.path(*number)) {
                    let _ = file.write_all(text.as_bytes());
                }
            }
        }
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        let Some(text) = self.leases.held().remove(&self.number) else {
            return;
        };
        let path = self.leases.path(self.number);
        // It may have become another's.
        if fs::read(&path).is_ok_and(|there| there == text.as_bytes()) {
            // One that refuses to go grows old.
            let _ = fs::remove_file(path);
        }
    }
}

/// When a file was written last.
pub(crate) fn stamp(path: &Path) -> io::Result<SystemTime> {
    File::open(path)?.metadata()?.modified()
}

/// Removes what killed processes have left in the middle of writing: temporary files that are older
/// than a lease may be.
pub(crate) fn sweep(folder: &Path, leases: &Leases) -> Result<(), PlanError> {
    let names = durable::names(folder)?.into_iter();
    let left: Vec<String> = names.filter(|n| n.ends_with(durable::TEMPORARY)).collect();
    if left.is_empty() {
        return Ok(());
    }
    let now = leases.now()?;
    for path in left.iter().map(|name| folder.join(name)) {
        let age = stamp(&path).map(|then| now.duration_since(then).unwrap_or_default());
        if age.is_ok_and(|age| age >= leases.age) {
            durable::remove(&path)?;
        }
    }
    Ok(())
}

/// What tells this process from all others: the machine since it was started, the names that
/// processes have for each other, the number and the start of this one. Where the system does not
/// say so, the number alone, which [`is_dead`] does not judge by.
fn this_process() -> String {
    let boot = fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    let space = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    let number = std::process::id();
    let start = started(number).unwrap_or_default();
    format!("{} {} {number} {start}", boot.trim(), space.display())
}

/// When a process of this machine started, in ticks.
fn started(process: u32) -> Option<String> {
    let text = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name in brackets may hold anything.
    let (_, rest) = text.rsplit_once(')')?;
    let start = rest.split_ascii_whitespace().nth(19)?;
    Some(start.to_owned())
}

/// Whether the process that wrote a lease is one of this machine, and is no more.
fn is_dead(lease: &str, this: &str) -> bool {
    let fields = |text: &str| -> Option<[String; 4]> {
        let words: Vec<String> = text.split(' ').map(str::to_owned).collect();
        words.get(..4)?.to_vec().try_into().ok()
    };
    let (Some(theirs), Some(ours)) = (fields(lease), fields(this)) else {
        return false;
    };
    let known = ours.iter().all(|field| !field.is_empty());
    let [_, _, number, start] = &theirs;
    let here = theirs[..2] == ours[..2];
    let running = number.parse().ok().and_then(started);
    known && here && running.as_ref() != Some(start)
}

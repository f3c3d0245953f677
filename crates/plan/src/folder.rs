//! The folder of a plan: it holds the plan itself and one file, the part, for each finished unit.

use crate::durable::{self, make_folder, names, read};
use crate::part::{self, Digest, digest, hex};
use crate::{Plan, PlanError};
use std::path::{Path, PathBuf};

/// The units that a plan still lacks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Missing {
    /// The units without a part.
    pub absent: Vec<u32>,
    /// The units whose part is broken, each with a description of what is wrong with its part.
    pub broken: Vec<(u32, String)>,
}

impl Missing {
    /// Returns whether no unit is missing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.absent.is_empty() && self.broken.is_empty()
    }

    /// Returns the number of missing units.
    #[must_use]
    pub fn len(&self) -> usize {
        self.absent.len() + self.broken.len()
    }
}

/// The name of the file in a plan's folder that holds the plan.
const PLAN: &str = "plan.json";
/// The name of the subfolder of a plan's folder that holds the parts.
const PARTS: &str = "parts";

/// The folder of a plan: `plan.json`, and the results of finished units in `parts/`.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    plan: Plan,
    digest: Digest,
}

impl Folder {
    /// Creates the folder of a plan. If it exists and has the same plan, it is opened, and finished
    /// units stay.
    ///
    /// # Errors
    /// If the folder holds another plan (the error states the differences) or other files, or
    /// cannot be written.
    pub fn create(path: &Path, plan: &Plan) -> Result<Self, PlanError> {
        // Refuse a folder with another plan or other files. Two plans are the same if their texts
        // are, so that no value has to survive being written and read.
        let (text, digest) = plan.text()?;
        let file = path.join(PLAN);
        let there = read(&file)?;
        match &there {
            Some(there) if there == text.as_bytes() => {}
            Some(there) => {
                return Err(PlanError::Another {
                    path: path.to_owned(),
                    differs: Self::of(path, there)?.plan.difference(plan),
                });
            }
            None => refuse_others(path)?,
        }
        // Write the plan.
        make_folder(&path.join(PARTS))?;
        if there.is_none() {
            durable::write(&file, &[text.as_bytes()])?;
        }
        Ok(Self {
            path: path.to_owned(),
            plan: plan.clone(),
            digest,
        })
    }

    /// Opens the folder of a plan.
    ///
    /// # Errors
    /// If there is no plan, or its text is not the one that was written.
    pub fn open(path: &Path) -> Result<Self, PlanError> {
        let Some(bytes) = read(&path.join(PLAN))? else {
            return Err(PlanError::Refused(format!(
                "{} is no folder of a plan: it has no {PLAN}",
                path.display()
            )));
        };
        Self::of(path, &bytes)
    }

    /// Opens a folder whose plan has this text.
    fn of(path: &Path, bytes: &[u8]) -> Result<Self, PlanError> {
        let file = path.join(PLAN);
        let text = str::from_utf8(bytes).map_err(|e| PlanError::broken(&file, e.to_string()))?;
        let (plan, digest) = Plan::read(text, &file)?;
        Ok(Self {
            path: path.to_owned(),
            plan,
            digest,
        })
    }

    /// Returns the plan.
    #[must_use]
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Returns the path of the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the plan's digest in hexadecimal digits.
    #[must_use]
    pub fn hash(&self) -> String {
        hex(&self.digest)
    }

    /// Checks that the plan was made by this program.
    ///
    /// # Errors
    /// [`PlanError::Refused`], which states both versions.
    pub fn check_program(&self, program: &str) -> Result<(), PlanError> {
        if self.plan.program == program {
            return Ok(());
        }
        Err(PlanError::Refused(format!(
            "{} is a plan of `{}`, this is `{program}`, whose numbers may differ: run it by that \
             program, or make the plan anew",
            self.path.display(),
            self.plan.program
        )))
    }

    /// Returns the number of units.
    #[must_use]
    pub fn units(&self) -> u32 {
        u32::try_from(self.plan.units.len()).unwrap_or(u32::MAX)
    }

    /// Returns the path of the folder of parts.
    fn parts(&self) -> PathBuf {
        self.path.join(PARTS)
    }

    /// Returns the path of a unit's part.
    #[must_use]
    pub fn part_path(&self, number: u32) -> PathBuf {
        self.parts().join(part_name(number))
    }

    /// Returns the digest of a unit, which covers the plan, the unit's number, name and work.
    fn unit_digest(&self, number: u32) -> Digest {
        let unit = self.plan.units.get(number as usize);
        let (name, work) = unit.map_or(("", ""), |u| (&u.name, &u.work));
        let number = number.to_le_bytes();
        digest(&[
            &self.digest,
            &number,
            name.as_bytes(),
            &[0],
            work.as_bytes(),
        ])
    }

    /// Returns the result that was computed for a unit, or `None` if there is none.
    ///
    /// # Errors
    /// [`PlanError::Broken`] if the file belongs to another unit or is incomplete, and
    /// [`PlanError::Io`] if it cannot be read.
    pub fn part(&self, number: u32) -> Result<Option<Vec<u8>>, PlanError> {
        let path = self.part_path(number);
        let Some(bytes) = read(&path)? else {
            return Ok(None);
        };
        let payload = part::payload(bytes, &self.digest, &self.unit_digest(number));
        payload
            .map(Some)
            .map_err(|reason| PlanError::broken(&path, reason))
    }

    /// Writes a part, replacing an existing one. The part is on the disk when this function
    /// returns.
    pub(crate) fn write_part(&self, number: u32, payload: &[u8]) -> Result<(), PlanError> {
        let (header, checksum) = part::frame(&self.digest, &self.unit_digest(number), payload);
        durable::write(&self.part_path(number), &[&header, payload, &checksum])
    }

    /// Reads all parts in the order of their numbers, and calls `each` with every one until a part
    /// is missing. After that, the other parts are read and checked, but `each` is not called with
    /// them. The result lists the missing units.
    ///
    /// # Errors
    /// If a file cannot be read, or `each` fails.
    pub fn read_all(
        &self,
        mut each: impl FnMut(u32, Vec<u8>) -> Result<(), PlanError>,
    ) -> Result<Missing, PlanError> {
        let mut missing = Missing::default();
        for number in 0..self.units() {
            match self.part(number) {
                Ok(Some(payload)) if missing.is_empty() => each(number, payload)?,
                Ok(Some(_)) => {}
                Ok(None) => missing.absent.push(number),
                Err(PlanError::Broken { path, reason }) => {
                    missing
                        .broken
                        .push((number, format!("{}: {reason}", path.display())));
                }
                Err(e) => return Err(e),
            }
        }
        Ok(missing)
    }

    /// Tests whether parts can be written.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(crate) fn check_writable(&self) -> Result<(), PlanError> {
        // A copy of the folder may lack its empty subfolders.
        make_folder(&self.parts())?;
        durable::check_writable(&self.parts())
    }

    /// Returns the indices of the units that have a part; the parts are not read.
    pub(crate) fn done(&self) -> Result<Vec<u32>, PlanError> {
        let names = names(&self.parts())?.into_iter();
        let numbers = names.filter_map(|name| part_number(&name));
        Ok(numbers.filter(|n| *n < self.units()).collect())
    }
}

/// Returns the name of a part.
fn part_name(number: u32) -> String {
    format!("{number:08}.part")
}

/// Returns the index of the unit whose part has this file name; `None` if no part has such a name.
fn part_number(name: &str) -> Option<u32> {
    let number = name.strip_suffix(".part")?.parse().ok()?;
    (part_name(number) == name).then_some(number)
}

/// Checks that a folder for a new plan contains no other files.
fn refuse_others(path: &Path) -> Result<(), PlanError> {
    let begun = format!(".{PLAN}.");
    for name in names(path)? {
        if name != PARTS && !name.starts_with(&begun) {
            return Err(PlanError::Refused(format!(
                "{} holds `{name}`, and is no folder of a plan: choose another",
                path.display()
            )));
        }
    }
    Ok(())
}

//! The folder of a plan.

use crate::durable::{self, make_folder, names, read};
use crate::part::{self, Digest, digest, hex};
use crate::{Plan, PlanError};
use std::path::{Path, PathBuf};

/// The units that a plan still lacks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Missing {
    /// Units without a part.
    pub absent: Vec<u32>,
    /// Units whose part is broken, and what is wrong with it.
    pub broken: Vec<(u32, String)>,
}

impl Missing {
    /// Whether nothing is missing.
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

/// Names within the folder.
const PLAN: &str = "plan.json";
const PARTS: &str = "parts";

/// The folder of a plan: `plan.json`, and what is done in `parts/`.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    plan: Plan,
    digest: Digest,
}

impl Folder {
    /// Makes the folder of a plan. If it is there with the same plan, it is opened: what is done in
    /// it stays.
    ///
    /// # Errors
    /// If the folder holds another plan, which is said with what differs, or anything else; or
    /// cannot be written.
    pub fn create(path: &Path, plan: &Plan) -> Result<Self, PlanError> {
        let (text, digest) = plan.text()?;
        let file = path.join(PLAN);
        let there = read(&file)?;
        match &there {
            // A plan is its text: nothing has to survive being written and read.
            Some(there) if there == text.as_bytes() => {}
            Some(there) => {
                return Err(PlanError::Another {
                    path: path.to_owned(),
                    differs: Self::of(path, there)?.plan.difference(plan),
                });
            }
            None => refuse_others(path)?,
        }
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
    /// If there is none, or its text is not what was written.
    pub fn open(path: &Path) -> Result<Self, PlanError> {
        let Some(bytes) = read(&path.join(PLAN))? else {
            return Err(PlanError::Refused(format!(
                "{} is no folder of a plan: it has no {PLAN}",
                path.display()
            )));
        };
        Self::of(path, &bytes)
    }

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

    /// The plan.
    #[must_use]
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The plan's digest, in hexadecimal digits.
    #[must_use]
    pub fn hash(&self) -> String {
        hex(&self.digest)
    }

    /// That this is the program that made the plan.
    ///
    /// # Errors
    /// [`PlanError::Refused`], which says both versions.
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

    /// The number of units.
    #[must_use]
    pub fn units(&self) -> u32 {
        u32::try_from(self.plan.units.len()).unwrap_or(u32::MAX)
    }

    fn parts(&self) -> PathBuf {
        self.path.join(PARTS)
    }

    /// The file of a unit's part.
    #[must_use]
    pub fn part_path(&self, number: u32) -> PathBuf {
        self.parts().join(part_name(number))
    }

    /// The digest of a unit: of its number and all that is said of it.
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

    /// Returns the result computed for a unit; `None` if there is none.
    ///
    /// # Errors
    /// [`PlanError::Broken`] if the file is not that of this unit or not whole, and if it cannot be
    /// read.
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

    /// Writes a part: on the disk when this returns, in place of what was there.
    pub(crate) fn write_part(&self, number: u32, payload: &[u8]) -> Result<(), PlanError> {
        let (header, checksum) = part::frame(&self.digest, &self.unit_digest(number), payload);
        durable::write(&self.part_path(number), &[&header, payload, &checksum])
    }

    /// Reads all parts in the order of their numbers, one at a time, and hands them on as long as
    /// none is missing; says which are.
    ///
    /// # Errors
    /// If a file cannot be read, and what `each` fails with.
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

    /// Tries whether parts can be written.
    ///
    /// # Errors
    /// If not.
    pub(crate) fn check_writable(&self) -> Result<(), PlanError> {
        // Copied without its empty folders, perhaps.
        make_folder(&self.parts())?;
        durable::check_writable(&self.parts())
    }

    /// The numbers of the units that have a part, which is not read.
    pub(crate) fn done(&self) -> Result<Vec<u32>, PlanError> {
        let names = names(&self.parts())?.into_iter();
        let numbers = names.filter_map(|name| part_number(&name));
        Ok(numbers.filter(|n| *n < self.units()).collect())
    }
}

/// The name of a part.
fn part_name(number: u32) -> String {
    format!("{number:08}.part")
}

/// The number in the name of a part.
fn part_number(name: &str) -> Option<u32> {
    let number = name.strip_suffix(".part")?.parse().ok()?;
    (part_name(number) == name).then_some(number)
}

/// Checks that a folder for a plan holds nothing else.
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

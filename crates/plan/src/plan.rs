//! Plans and their text in `plan.json`, which ends with a digest of itself.

use crate::PlanError;
use crate::part::{Digest, digest, hex};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

/// The version of the format of `plan.json`.
const FORMAT: u32 = 2;

/// The text that precedes the digest at the end of the file.
const SEAL: &str = "\n\"sha256\": \"";

/// Work to be done, with everything that its result depends on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// The program and its version; another version may compute other bits.
    pub program: String,
    /// The kind of computation, such as `render`.
    pub kind: String,
    /// The settings of the computation as JSON, including all defaults.
    #[serde(with = "raw")]
    pub settings: String,
    /// The files that the work reads.
    pub inputs: Vec<Input>,
    /// The units of work. Other types refer to a unit by its index in this list.
    pub units: Vec<Unit>,
}

/// A unit of work, which one process computes as a whole. If the process is killed, the work on the
/// unit is lost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// The name of the unit in messages.
    pub name: String,
    /// An estimate of the unit's cost, in seconds of one thread.
    pub cost: f64,
    /// The earlier units whose parts this unit reads (`Task::part`).
    #[serde(default)]
    pub needs: Range<u32>,
    /// The settings of the unit as JSON.
    #[serde(with = "raw")]
    pub work: String,
}

impl Unit {
    /// Creates a unit that needs no other.
    #[must_use]
    pub fn new(name: impl Into<String>, cost: f64, work: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            cost,
            needs: 0..0,
            work: work.into(),
        }
    }
}

/// An input of the work, such as a scene, with all files that it was read from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The name by which the input is found.
    pub name: String,
    /// The files of the input, in the order in which they were first read.
    pub files: Vec<InputFile>,
}

/// A file of an input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputFile {
    /// The name of the file, as the file that refers to it writes it.
    pub name: String,
    /// The length of the file in bytes.
    pub bytes: u64,
    /// The digest of the file, [`hash`](crate::hash()).
    pub sha256: String,
}

impl InputFile {
    /// Returns the name, length and digest of a file.
    #[must_use]
    pub fn of(name: impl Into<String>, bytes: &[u8]) -> Self {
        Self {
            name: name.into(),
            bytes: bytes.len() as u64,
            sha256: crate::hash(bytes),
        }
    }
}

impl Input {
    /// Checks that the files that were `found` now are the same as when the plan was made.
    ///
    /// # Errors
    /// [`PlanError::Refused`], which names all files that differ.
    pub fn check(&self, found: &[InputFile]) -> Result<(), PlanError> {
        // Look up the beginning of a file's digest.
        let find = |files: &[InputFile], name: &str| {
            let same = files.iter().find(|f| f.name == name);
            same.map(|f| f.sha256[..f.sha256.len().min(12)].to_owned())
        };
        // Compare the files of either side with the other's.
        let mut differs = Vec::new();
        for file in self.files.iter().chain(found) {
            let text = match (find(&self.files, &file.name), find(found, &file.name)) {
                (Some(a), Some(b)) if a == b => continue,
                (Some(a), Some(b)) => format!("`{}` was {a}, is {b}", file.name),
                (Some(_), None) => format!("`{}` is read no more", file.name),
                (None, _) => format!("`{}` was not read then", file.name),
            };
            if !differs.contains(&text) {
                differs.push(text);
            }
        }
        if differs.is_empty() {
            return Ok(());
        }
        Err(PlanError::Refused(format!(
            "`{}` has changed since the plan was made: {}",
            self.name,
            differs.join("; ")
        )))
    }
}

/// Serializes JSON text within JSON without changing it.
mod raw {
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer, ser::Error as _};
    use serde_json::value::RawValue;

    pub(super) fn serialize<S: Serializer>(text: &str, to: S) -> Result<S::Ok, S::Error> {
        let raw: &RawValue = serde_json::from_str(text)
            .map_err(|e| S::Error::custom(format!("`{text}` is no JSON: {e}")))?;
        raw.serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<String, D::Error> {
        Ok(Box::<RawValue>::deserialize(from)?.get().to_owned())
    }
}

impl Plan {
    /// Returns the text of the plan, and its digest.
    pub(crate) fn text(&self) -> Result<(String, Digest), PlanError> {
        self.check()?;
        let refused = |e: serde_json::Error| PlanError::Refused(format!("a plan's text: {e}"));
        // Write the fields after the format's version.
        let fields = serde_json::to_string(self).map_err(refused)?;
        let mut text = format!(
            "{{\"linelit_plan\":{FORMAT},{},",
            &fields[1..fields.len() - 1]
        );
        // Append the digest of this text.
        let seal = digest(&[text.as_bytes()]);
        text += &format!("{SEAL}{}\"}}\n", hex(&seal));
        Ok((text, seal))
    }

    /// Checks that the plan is valid; an error means that the caller made a mistake.
    fn check(&self) -> Result<(), PlanError> {
        let refused = |text: String| Err(PlanError::Refused(text));
        if u32::try_from(self.units.len()).is_err() {
            return refused(format!("{} units, too many to number", self.units.len()));
        }
        for (unit, number) in self.units.iter().zip(0_u32..) {
            let name = &unit.name;
            if !(unit.cost >= 0.0 && unit.cost.is_finite()) {
                return refused(format!("unit {name} costs {}", unit.cost));
            }
            if !unit.needs.is_empty() && unit.needs.end > number {
                return refused(format!("unit {name} needs others that come later"));
            }
        }
        Ok(())
    }

    /// Reads the text of a plan, and verifies the digest at its end.
    pub(crate) fn read(text: &str, path: &Path) -> Result<(Self, Digest), PlanError> {
        let broken = |reason: String| PlanError::broken(path, reason);
        let Some((content, end)) = text.rsplit_once(SEAL) else {
            return Err(broken("it does not end as a plan does".to_owned()));
        };
        let seal = digest(&[content.as_bytes()]);
        if end.strip_suffix("\"}\n") != Some(&hex(&seal)) {
            let reason = "its text is not the one that was written: make the plan anew";
            return Err(broken(reason.to_owned()));
        }
        let plan: Self = serde_json::from_str(text).map_err(|e| broken(e.to_string()))?;
        plan.check()?;
        Ok((plan, seal))
    }

    /// Returns the differences between two plans whose texts differ, in words.
    pub(crate) fn difference(&self, other: &Self) -> String {
        let mut words = Vec::new();
        // Compare who made them, and with which settings.
        for (what, a, b) in [
            ("program", &self.program, &other.program),
            ("kind", &self.kind, &other.kind),
        ] {
            if a != b {
                words.push(format!("{what} `{a}`, not `{b}`"));
            }
        }
        if self.settings != other.settings {
            words.push(settings_difference(&self.settings, &other.settings));
        }
        // Compare the files that they read.
        for (a, b) in self.inputs.iter().zip(&other.inputs) {
            if a.name != b.name {
                words.push(format!("input `{}`, not `{}`", a.name, b.name));
            } else {
                words.extend(a.check(&b.files).err().map(|e| e.to_string()));
            }
        }
        // Compare how many files and units they have, and name the first other unit.
        for (what, a, b) in [
            ("inputs", self.inputs.len(), other.inputs.len()),
            ("units", self.units.len(), other.units.len()),
        ] {
            if a != b {
                words.push(format!("{a} {what}, not {b}"));
            }
        }
        let mut units = self.units.iter().zip(&other.units);
        if let Some((unit, _)) = units.find(|(a, b)| a != b) {
            words.push(format!("the unit `{}` and perhaps others", unit.name));
        }
        if words.is_empty() {
            words.push("how it is written".to_owned());
        }
        words.join("; ")
    }
}

/// Returns the keys whose values differ, with both values.
fn settings_difference(a: &str, b: &str) -> String {
    let object =
        |text: &str| -> BTreeMap<String, Value> { serde_json::from_str(text).unwrap_or_default() };
    let (a, b) = (object(a), object(b));
    let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let shown = |value: Option<&Value>| value.map_or("nothing".into(), ToString::to_string);
    let differ = keys.into_iter().filter(|key| a.get(*key) != b.get(*key));
    let words = differ.map(|k| format!("{k} {}, not {}", shown(a.get(k)), shown(b.get(k))));
    format!("settings: {}", words.collect::<Vec<_>>().join(", "))
}

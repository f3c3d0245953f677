//! A plan for tests: its units are cheap, and the bits of their sum depend on the order of
//! addition.

use linelit_plan::{BoxError, Folder, Missing, Plan, Task, Unit};
use std::path::{Path, PathBuf};

/// A folder's path for a test.
pub(crate) fn path(name: &str) -> PathBuf {
    let process = std::process::id();
    let path = std::env::temp_dir().join(format!("linelit-plan-{name}-{process}"));
    let _ = std::fs::remove_dir_all(&path);
    path
}

/// Returns a plan with this many units.
pub(crate) fn plan(units: u32) -> Plan {
    let unit = |k: u32| {
        let cost = f64::from(k * 7919 % 13) + 1.0;
        Unit::new(format!("unit {k}"), cost, format!("{{\"k\": {k}}}"))
    };
    Plan {
        program: "toy 1".into(),
        kind: "toy".into(),
        settings: "{\"seed\": 7}".into(),
        inputs: Vec::new(),
        units: (0..units).map(unit).collect(),
    }
}

/// Creates the folder of such a plan.
pub(crate) fn folder(path: &Path, units: u32) -> Folder {
    Folder::create(path, &plan(units)).unwrap()
}

/// Returns the number of a unit, chosen such that sums are rounded.
pub(crate) fn value(number: u32) -> f64 {
    (f64::from(number) + 0.1).sqrt().recip()
}

/// Computes the part of a unit.
pub(crate) fn work(task: &Task<'_>) -> Result<Vec<u8>, BoxError> {
    Ok(value(task.number()).to_le_bytes().to_vec())
}

/// Returns the sum of all units, or the missing units.
pub(crate) fn merged(folder: &Folder) -> Result<u64, Missing> {
    let mut sum = 0.0;
    let each = |_, part: Vec<u8>| {
        sum += f64::from_le_bytes(part.try_into().unwrap());
        Ok(())
    };
    let missing = folder.read_all(each).unwrap();
    if missing.is_empty() {
        Ok(sum.to_bits())
    } else {
        Err(missing)
    }
}

/// Returns the sum of this many units, without any folder.
pub(crate) fn expected(units: u32) -> u64 {
    (0..units).fold(0.0, |sum, k| sum + value(k)).to_bits()
}

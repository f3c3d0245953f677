//! Scenes of plans: read, and held to what they were when the plan was made.

use crate::args::ReadArgs;
use anyhow::{Context as _, Result};
use linelit_formats::{Loaded, Watch};
use linelit_plan::{Folder, Input, InputFile};
use linelit_scenes::{Library, Place};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A scene that a plan is made for.
#[derive(Debug)]
pub struct Planned {
    /// The scene.
    pub loaded: Loaded,
    /// What the plan says of it; its name leads there from any working folder of this machine.
    pub input: Input,
    /// Its files by their digests, if they are to be packed.
    pub packed: BTreeMap<String, Vec<u8>>,
}

/// The files that were read, each once, in their order; and their bytes, if they are kept.
type Seen = Arc<Mutex<(Vec<InputFile>, BTreeMap<String, Vec<u8>>)>>;

/// A library that notes what it reads.
fn watching(read: &ReadArgs, keep: bool) -> (Library, Seen) {
    let seen = Seen::default();
    let told = Arc::clone(&seen);
    let mut library = read.library();
    library.options.watch = Watch::new(move |name, bytes| {
        let mut seen = told.lock().unwrap_or_else(PoisonError::into_inner);
        if seen.0.iter().all(|file| file.name != name) {
            let file = InputFile::of(name, bytes);
            if keep {
                seen.1.insert(file.sha256.clone(), bytes.to_vec());
            }
            seen.0.push(file);
        }
    });
    (library, seen)
}

/// Reads a scene for a plan.
///
/// # Errors
/// If the scene cannot be found or read.
pub fn plan(name: &str, read: &ReadArgs, pack: bool) -> Result<Planned> {
    let (library, seen) = watching(read, pack);
    let loaded = library.load_lit(name)?;
    let whole = match Place::find(name)? {
        Place::File(path) => std::path::absolute(&path)
            .with_context(|| format!("finding the whole path of {name}"))?
            .display()
            .to_string(),
        Place::BuiltIn(scene) => scene.name.to_owned(),
    };
    let (files, packed) = std::mem::take(&mut *seen.lock().unwrap_or_else(PoisonError::into_inner));
    let input = Input {
        name: whole,
        packed: pack,
        files,
    };
    Ok(Planned {
        loaded,
        input,
        packed,
    })
}

/// Reads a scene of a plan again, from the plan's folder if it is packed there.
///
/// # Errors
/// If it cannot be found or read, or has changed.
pub fn open(folder: &Folder, input: &Input, read: &ReadArgs) -> Result<Loaded> {
    if !input.packed {
        let (library, seen) = watching(read, false);
        let loaded = library.load_lit(&input.name);
        let loaded = loaded.with_context(|| {
            let name = &input.name;
            format!("reading {name}, which the plan was made for (--pack keeps scenes in the plan)")
        })?;
        input.check(&seen.lock().unwrap_or_else(PoisonError::into_inner).0)?;
        return Ok(loaded);
    }
    let mut files = BTreeMap::new();
    for file in &input.files {
        files.insert(file.name.clone(), folder.file(&file.sha256)?);
    }
    let main = input.files.first().map_or("", |file| file.name.as_str());
    let library = read.library();
    library.lit(library.load_from(files, main)?, &input.name)
}

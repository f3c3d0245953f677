//! Scenes of plans: read, and held to what they were when the plan was made.

use crate::args::ReadArgs;
use anyhow::{Context as _, Result, bail};
use linelit_formats::{Loaded, Watch};
use linelit_plan::{Folder, Input, InputFile, Plan, Unit};
use linelit_scene::Scene;
use linelit_scenes::{Library, Place};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A plan, and the files to be kept in its folder, by their digests.
pub type Packed = (Plan, BTreeMap<String, Vec<u8>>);

/// Files in the order in which they were read first, and the bytes of those that are kept.
type Files = (Vec<InputFile>, BTreeMap<String, Vec<u8>>);

/// Scenes that a plan is made for, and what was read for them.
#[derive(Debug)]
pub struct Sources<'a> {
    read: &'a ReadArgs,
    pack: bool,
    found: Mutex<Found>,
}

/// The inputs that were read: scenes by the names in the request, and files to be packed.
#[derive(Debug, Default)]
struct Found {
    inputs: BTreeMap<String, Input>,
    packed: BTreeMap<String, Vec<u8>>,
}

impl<'a> Sources<'a> {
    /// No scenes yet; their files are kept for the plan if it is to `pack` them.
    #[must_use]
    pub fn new(read: &'a ReadArgs, pack: bool) -> Self {
        Self {
            read,
            pack,
            found: Mutex::default(),
        }
    }

    /// Reads a scene for a study, which measures lights of its own.
    ///
    /// # Errors
    /// As [`Sources::load`], and if the scene has no light.
    pub fn load_to_measure(&self, name: &str) -> Result<Scene> {
        self.load_by(name, |_, loaded| match loaded.scene.lights.is_empty() {
            true => bail!("`{name}` has no lights, and a study measures those of the file"),
            false => Ok(loaded),
        })
    }

    /// Reads a scene; one without lights gets a square beside the camera.
    pub fn load(&self, name: &str) -> Result<Scene> {
        self.load_by(name, |library, loaded| library.lit(loaded, name))
    }

    fn load_by(
        &self,
        name: &str,
        lit: impl Fn(&Library, Loaded) -> Result<Loaded>,
    ) -> Result<Scene> {
        self.read_by(name, |library| Ok(lit(library, library.load(name)?)?.scene))
    }

    /// Reads anything by a library that watches which files are read.
    ///
    /// # Errors
    /// Those of reading it.
    pub fn read_by<T>(&self, name: &str, read: impl Fn(&Library) -> Result<T>) -> Result<T> {
        let seen: Arc<Mutex<Files>> = Arc::default();
        let (told, pack) = (Arc::clone(&seen), self.pack);
        let mut library = self.read.library();
        library.options.watch = Watch::new(move |name, bytes| {
            let mut seen = locked(&told);
            if seen.0.iter().all(|file| file.name != name) {
                let file = InputFile::of(name, bytes);
                if pack {
                    seen.1.insert(file.sha256.clone(), bytes.to_vec());
                }
                seen.0.push(file);
            }
        });
        let read = read(&library)?;
        let (files, packed) = std::mem::take(&mut *locked(&seen));
        let input = Input {
            name: whole_path(name)?,
            packed: self.pack,
            files,
        };
        let mut found = locked(&self.found);
        found.inputs.insert(name.to_owned(), input);
        found.packed.extend(packed);
        Ok(read)
    }

    /// The plan of units of a `kind` on scenes that were read, and the files that it keeps.
    pub fn plan(
        &self,
        kind: &str,
        settings: &impl Serialize,
        scenes: &[String],
        units: Vec<Unit>,
    ) -> Result<Packed> {
        let mut found = locked(&self.found);
        let input = |name: &String| {
            let input = found.inputs.get(name).cloned();
            input.with_context(|| format!("{name} was not read"))
        };
        let plan = Plan {
            program: program(),
            kind: kind.to_owned(),
            settings: serde_json::to_string_pretty(settings)?,
            inputs: scenes.iter().map(input).collect::<Result<_>>()?,
            units,
        };
        Ok((plan, std::mem::take(&mut found.packed)))
    }
}

/// The version of the program, and its commit, that plans are held to.
#[must_use]
pub fn program() -> String {
    let (version, commit) = (linelit_study::version(), linelit_study::tables::commit());
    format!("linelit {version} ({commit})")
}

/// The name of a scene that leads there from any working folder of this machine.
pub fn whole_path(name: &str) -> Result<String> {
    Ok(match Place::find(name)? {
        Place::File(path) => std::path::absolute(&path)
            .with_context(|| format!("finding the whole path of {name}"))?
            .display()
            .to_string(),
        Place::BuiltIn(_) => name.to_owned(),
    })
}

/// Reads a scene of a plan again, by its number, from the plan's folder if it is packed there.
///
/// # Errors
/// If it cannot be found or read, or has changed.
pub fn open(folder: &Folder, number: usize, read: &ReadArgs) -> Result<Scene> {
    open_by(folder, number, read, |library, name, packed| {
        let loaded = match packed {
            Some((files, main)) => library.load_from(files, main)?,
            None => library.load(name)?,
        };
        Ok(library.lit(loaded, name)?.scene)
    })
}

/// Files of a plan by their names, and the name of the first.
pub type InPlan<'a> = (BTreeMap<String, Vec<u8>>, &'a str);

/// Reads anything of a plan again, by its number: `again` gets its name, and its files if they are
/// packed there.
///
/// # Errors
/// If it cannot be found or read, or has changed.
pub fn open_by<T>(
    folder: &Folder,
    number: usize,
    read: &ReadArgs,
    again: impl Fn(&Library, &str, Option<InPlan<'_>>) -> Result<T>,
) -> Result<T> {
    let input = folder.plan().inputs.get(number);
    let input = input.context("the plan does not say what its scenes are")?;
    let name = &input.name;
    if !input.packed {
        let sources = Sources::new(read, false);
        let found = sources.read_by(name, |library| again(library, name, None));
        let found = found.with_context(|| {
            format!("reading {name}, which the plan was made for (--pack keeps scenes in the plan)")
        })?;
        input.check(&locked(&sources.found).inputs[name].files)?;
        return Ok(found);
    }
    let mut files = BTreeMap::new();
    for file in &input.files {
        files.insert(file.name.clone(), folder.file(&file.sha256)?);
    }
    let main = input.files.first().map_or("", |file| file.name.as_str());
    again(&read.library(), name, Some((files, main)))
}

/// The value of a mutex, whether or not a thread that held it panicked.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

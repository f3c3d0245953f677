//! Scenes of plans. All files that a scene is read from are recorded, so that a plan is only run on
//! the same files as it was made for.

use crate::args::ReadArgs;
use anyhow::{Context as _, Result, bail};
use linelit_formats::{Loaded, Watch};
use linelit_plan::{Folder, Input, InputFile, Plan, Unit};
use linelit_scene::SceneDescription;
use linelit_scenes::{Library, SceneLocation};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The scenes that a plan is made for, by their names on the command line, with the files that were
/// read.
#[derive(Debug)]
pub struct Sources<'a> {
    read: &'a ReadArgs,
    inputs: Mutex<BTreeMap<String, Input>>,
}

impl<'a> Sources<'a> {
    /// Creates an empty collection.
    #[must_use]
    pub fn new(read: &'a ReadArgs) -> Self {
        Self {
            read,
            inputs: Mutex::default(),
        }
    }

    /// Reads a scene for a study, which needs lights in the file.
    ///
    /// # Errors
    /// As [`Sources::load`], and if the scene has no light.
    pub fn load_to_measure(&self, name: &str) -> Result<SceneDescription> {
        self.load_by(name, |_, loaded| match loaded.scene.lights.is_empty() {
            true => bail!("`{name}` has no lights, and a study measures those of the file"),
            false => Ok(loaded),
        })
    }

    /// Reads a scene. A scene without lights gets a square light next to the camera.
    pub fn load(&self, name: &str) -> Result<SceneDescription> {
        self.load_by(name, |library, loaded| library.lit(loaded, name))
    }

    /// Reads a scene, and returns what `lit` makes of it: `lit` may add a light, or refuse a scene
    /// without lights.
    fn load_by(
        &self,
        name: &str,
        lit: impl Fn(&Library, Loaded) -> Result<Loaded>,
    ) -> Result<SceneDescription> {
        self.read_by(name, |library| Ok(lit(library, library.load(name)?)?.scene))
    }

    /// Reads anything by a library, and records which files are read.
    ///
    /// # Errors
    /// If `read` fails, or the path of the input cannot be found.
    pub fn read_by<T>(&self, name: &str, read: impl Fn(&Library) -> Result<T>) -> Result<T> {
        // Record files in the order in which they are read first.
        let seen: Arc<Mutex<Vec<InputFile>>> = Arc::default();
        let told = Arc::clone(&seen);
        let mut library = self.read.library();
        library.options.watch = Watch::new(move |name, bytes| {
            let mut seen = locked(&told);
            if seen.iter().all(|file| file.name != name) {
                seen.push(InputFile::of(name, bytes));
            }
        });
        let read = read(&library)?;
        // Store them under the name of the scene.
        let input = Input {
            name: whole_path(name)?,
            files: std::mem::take(&mut *locked(&seen)),
        };
        locked(&self.inputs).insert(name.to_owned(), input);
        Ok(read)
    }

    /// Creates a plan of units of a `kind`, on scenes that were read.
    pub fn plan(
        &self,
        kind: &str,
        settings: &impl Serialize,
        scenes: &[String],
        units: Vec<Unit>,
    ) -> Result<Plan> {
        let inputs = locked(&self.inputs);
        let input = |name: &String| {
            let input = inputs.get(name).cloned();
            input.with_context(|| format!("{name} was not read"))
        };
        Ok(Plan {
            program: program(),
            kind: kind.to_owned(),
            settings: serde_json::to_string_pretty(settings)?,
            inputs: scenes.iter().map(input).collect::<Result<_>>()?,
            units,
        })
    }
}

/// Returns the version and commit of the program. A plan can only be run by the program that made
/// it.
#[must_use]
pub fn program() -> String {
    let (version, commit) = (linelit_study::version(), linelit_study::tables::commit());
    format!("linelit {version} ({commit})")
}

/// Returns the name of a scene such that it is valid in any working folder of this machine.
pub fn whole_path(name: &str) -> Result<String> {
    Ok(match SceneLocation::find(name)? {
        SceneLocation::File(path) => std::path::absolute(&path)
            .with_context(|| format!("finding the whole path of {name}"))?
            .display()
            .to_string(),
        SceneLocation::BuiltIn(_) => name.to_owned(),
    })
}

/// Reads a scene of a plan again, given by its index among the plan's inputs.
///
/// # Errors
/// If the input cannot be found or read, or has changed since the plan was made.
pub fn open(folder: &Folder, number: usize, read: &ReadArgs) -> Result<SceneDescription> {
    open_by(folder, number, read, |library, name| {
        Ok(library.lit(library.load(name)?, name)?.scene)
    })
}

/// Reads an input of a plan again, given by its index. `again` is called with a reader of scenes
/// and the input's name.
///
/// # Errors
/// If the input cannot be found or read, or has changed since the plan was made.
pub fn open_by<T>(
    folder: &Folder,
    number: usize,
    read: &ReadArgs,
    again: impl Fn(&Library, &str) -> Result<T>,
) -> Result<T> {
    let input = folder.plan().inputs.get(number);
    let input = input.context("the plan does not say what its scenes are")?;
    let name = &input.name;
    let sources = Sources::new(read);
    let found = sources.read_by(name, |library| again(library, name));
    let found = found.with_context(|| format!("reading {name}, which the plan was made for"))?;
    input.check(&locked(&sources.inputs)[name].files)?;
    Ok(found)
}

/// Locks a mutex, whether or not a thread that held it panicked.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

//! Finding and reading scenes: files, and the built-in ones by name.
#![allow(clippy::disallowed_methods, reason = "scenes are files, too")]

use crate::BuiltIn;
use anyhow::{Result, bail};
use linelit_formats::{Format, LoadOptions, Loaded, Root};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fmt, fs, io};

/// The way in which scenes are read, and the receiver of warnings about them.
#[derive(Clone, Debug)]
pub struct Library {
    /// The options for reading files.
    pub options: LoadOptions,
    /// Called with each warning, and with each remark that begins with `note:`.
    pub note: fn(fmt::Arguments<'_>),
}

impl Default for Library {
    /// Lenient ([`LoadOptions::default`]) and silent.
    fn default() -> Self {
        Self {
            options: LoadOptions::default(),
            note: |_| {},
        }
    }
}

impl Library {
    /// Loads the scene that [`Place::find`] finds. One that is built in is made in memory, and
    /// touches no file.
    ///
    /// # Errors
    /// If the scene cannot be found or read.
    pub fn load(&self, name: &str) -> Result<Loaded> {
        match Place::find(name)? {
            Place::File(path) => Ok(self.noted(linelit_formats::load(path, &self.options)?)),
            Place::BuiltIn(scene) => {
                self.load_from(BTreeMap::from_iter(scene.files()), &scene.main_file())
            }
        }
    }

    /// Reads the scene in one of these files, which holds all that it names by the names that it
    /// writes; nothing else is read.
    ///
    /// # Errors
    /// If the file is none of these, or no scene.
    pub fn load_from(&self, files: BTreeMap<String, Vec<u8>>, main: &str) -> Result<Loaded> {
        let ending = Path::new(main).extension().and_then(|e| e.to_str());
        let (Some(format), Some(bytes)) = (
            ending.and_then(Format::from_extension),
            files.get(main).cloned(),
        ) else {
            bail!("`{main}` is no scene among the files in memory");
        };
        let options = LoadOptions {
            root: Root::Memory(Arc::new(files)),
            ..self.options.clone()
        };
        let loaded = linelit_formats::from_bytes(format, &bytes, main, &options)?;
        Ok(self.noted(loaded))
    }

    /// Says what was strange about a scene's files.
    fn noted(&self, loaded: Loaded) -> Loaded {
        for warning in &loaded.warnings {
            (self.note)(format_args!("{warning}"));
        }
        loaded
    }

    /// Loads a scene, and gives one whose file has no lights a square next to the camera, which is
    /// noted. Where the lights of a file are dark, it stays dark.
    ///
    /// # Errors
    /// If the scene cannot be found or read, or has no lights and nothing to be lit.
    pub fn load_lit(&self, name: &str) -> Result<Loaded> {
        self.lit(self.load(name)?, name)
    }

    /// A scene, with a square next to the camera if its file has no lights, which is noted.
    ///
    /// # Errors
    /// If it has no lights and nothing to be lit.
    pub fn lit(&self, mut loaded: Loaded, name: &str) -> Result<Loaded> {
        if !loaded.has_lights {
            if !linelit_formats::add_framing_light(&mut loaded.scene) {
                bail!("`{name}` has no lights, and nothing that one could stand beside");
            }
            (self.note)(format_args!(
                "note: `{name}` has no lights: it is lit by a square beside the camera, which is \
                 not in the file"
            ));
        }
        Ok(loaded)
    }
}

/// The location of a scene.
#[derive(Clone, Debug)]
pub enum Place {
    /// The scene is in this file, which exists.
    File(PathBuf),
    /// The scene is built into this program.
    BuiltIn(BuiltIn),
}

impl Place {
    /// The place of a scene by a path that exists, or the name of a built-in scene (`cornell-box`
    /// is short for `cornell-box-large`).
    ///
    /// # Errors
    /// If there is neither.
    pub fn find(name: &str) -> Result<Self> {
        let path = Path::new(name);
        if path.is_file() {
            return Ok(Self::File(path.to_owned()));
        }
        if let Some(scene) = BuiltIn::find(name) {
            return Ok(Self::BuiltIn(scene));
        }
        if path.exists() {
            bail!("cannot read the scene `{name}`: it is not a regular file");
        }
        if let Some(near) = Self::nearest(name) {
            bail!("no scene `{name}`: neither a file nor a built-in scene; did you mean `{near}`?");
        }
        let names: Vec<&str> = BuiltIn::ALL.iter().map(|scene| scene.name).collect();
        bail!(
            "no scene `{name}`: neither a file nor one of the built-in scenes {}",
            names.join(", ")
        )
    }

    /// Returns the name of a built-in scene that a misspelt name probably means.
    #[must_use]
    pub fn nearest(name: &str) -> Option<&'static str> {
        let short = |scene: &BuiltIn| scene.name.strip_suffix("-large");
        let all = BuiltIn::ALL.iter();
        let known = all.flat_map(|scene| [Some(scene.name), short(scene)]);
        linelit_formats::nearest(name, known.flatten())
    }

    /// The bytes of a file that the scene names.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        match self {
            Self::File(scene) => fs::read(scene.with_file_name(name)),
            Self::BuiltIn(scene) => {
                let mut files = scene.files().into_iter();
                let found = files.find(|(known, _)| known == name);
                let (_, bytes) = found.ok_or(io::ErrorKind::NotFound)?;
                Ok(bytes)
            }
        }
    }
}

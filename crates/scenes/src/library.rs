//! [`Library`], which finds and reads scenes: files by their paths, and built-in scenes by their
//! names.
#![allow(clippy::disallowed_methods, reason = "scenes are files, too")]

use crate::BuiltIn;
use anyhow::{Result, bail};
use linelit_formats::{Format, LoadOptions, Loaded, Root};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fmt, fs, io};

/// A reader of scenes, with its options and a function that receives warnings.
#[derive(Clone, Debug)]
pub struct Library {
    /// The options for reading files.
    pub options: LoadOptions,
    /// The function that is called with each warning about a scene, and with notes, which begin
    /// with `note:`.
    pub note: fn(fmt::Arguments<'_>),
}

impl Default for Library {
    /// Creates a library with [`LoadOptions::default`], which ignores warnings.
    fn default() -> Self {
        Self {
            options: LoadOptions::default(),
            note: |_| {},
        }
    }
}

impl Library {
    /// Loads the scene that [`SceneLocation::find`] finds by this name. A built-in scene is made in
    /// memory, and no file is opened.
    ///
    /// # Errors
    /// The scene cannot be found or read.
    pub fn load(&self, name: &str) -> Result<Loaded> {
        match SceneLocation::find(name)? {
            SceneLocation::File(path) => {
                Ok(self.noted(linelit_formats::load(path, &self.options)?))
            }
            SceneLocation::BuiltIn(scene) => {
                self.load_from(BTreeMap::from_iter(scene.files()), &scene.main_file())
            }
        }
    }

    /// Reads a scene from files in memory. `main` is the name of its main file, and all files that
    /// the scene names have to be among `files` by these names; no other file is read.
    ///
    /// # Errors
    /// The main file is not among the files, or is not a valid scene.
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

    /// Passes the warnings about a scene on.
    fn noted(&self, loaded: Loaded) -> Loaded {
        for warning in &loaded.warnings {
            (self.note)(format_args!("{warning}"));
        }
        loaded
    }

    /// Loads a scene and, if its file has no lights, adds a square light next to the camera, with a
    /// note. A scene whose lights are black stays black.
    ///
    /// # Errors
    /// The scene cannot be found or read, or has no lights and no shapes.
    pub fn load_lit(&self, name: &str) -> Result<Loaded> {
        self.lit(self.load(name)?, name)
    }

    /// Adds a square light next to the camera, with a note, to a scene whose file has no lights.
    ///
    /// # Errors
    /// The scene has no lights and no shapes.
    pub fn lit(&self, mut loaded: Loaded, name: &str) -> Result<Loaded> {
        if !loaded.has_lights {
            if !linelit_formats::add_framing_light(&mut loaded.scene) {
                bail!(
                    "`{name}` has no lights, and no surface next to which a lamp could be placed"
                );
            }
            (self.note)(format_args!(
                "note: `{name}` has no lights: it is lit by a square lamp next to the camera, which is \
                 not in the file"
            ));
        }
        Ok(loaded)
    }
}

/// The location of a scene.
#[derive(Clone, Debug)]
pub enum SceneLocation {
    /// The scene is in this file, which exists.
    File(PathBuf),
    /// The scene is built into this program.
    BuiltIn(BuiltIn),
}

impl SceneLocation {
    /// Finds a scene by the path of a file, or by the name of a built-in scene (`cornell-box` means
    /// `cornell-box-large`).
    ///
    /// # Errors
    /// There is neither such a file nor such a scene.
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

    /// Returns the name of the built-in scene that a misspelt name probably means; `None` if no
    /// name is similar.
    #[must_use]
    pub fn nearest(name: &str) -> Option<&'static str> {
        let short = |scene: &BuiltIn| scene.name.strip_suffix("-large");
        let all = BuiltIn::ALL.iter();
        let known = all.flat_map(|scene| [Some(scene.name), short(scene)]);
        linelit_formats::nearest(name, known.flatten())
    }

    /// Returns the bytes of a file that the scene at this location names.
    ///
    /// # Errors
    /// The file cannot be read.
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

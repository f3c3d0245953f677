//! The errors of reading and writing picture files.

use std::io;
use std::path::{Path, PathBuf};

/// The error for a file whose bytes do not follow its format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not a readable {format} file: expected {expected}, found {found}")]
pub struct FormatError {
    /// The format as which the file was read: `OpenEXR` or `PFM`.
    pub format: &'static str,
    /// The contents that the format requires at the position of the error.
    pub expected: String,
    /// The contents that were found there.
    pub found: String,
    /// Whether the error is that the file, which may be valid, needs more memory than is allowed.
    pub too_large: bool,
}

impl FormatError {
    /// Creates an error with the expected and the found contents.
    pub(crate) fn new(
        format: &'static str,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self {
            format,
            expected: expected.into(),
            found: found.into(),
            too_large: false,
        }
    }

    /// Returns the error for a picture that takes more bytes of memory than `limit`.
    pub(crate) fn too_large(
        format: &'static str,
        [width, height]: [u32; 2],
        needed: impl std::fmt::Display,
        limit: usize,
    ) -> Self {
        Self {
            format,
            expected: format!("a picture that takes at most {limit} bytes"),
            found: format!("{width} × {height} pixels that take {needed}"),
            too_large: true,
        }
    }
}

/// The errors of functions for files. The message begins with the path of the file, if there is
/// one.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// The operating system reported an error.
    #[error("{}: cannot {action}: {reason}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The action that failed, such as `read`, `write` or `rename`.
        action: &'static str,
        /// The system's reason. It is a part of the message and therefore not the `source()`, which
        /// programs would print after the message.
        reason: io::Error,
    },
    /// The file is malformed or truncated.
    #[error("{}: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The expected and the found contents; a part of the message.
        reason: FormatError,
    },
    /// The file has no layer of the requested name, or no layer that is clearly its picture.
    #[error("{}: expected {}, found {}", path.display(), layer(wanted.as_deref()), list(available))]
    MissingLayer {
        /// The file.
        path: PathBuf,
        /// The requested name, if there was one.
        wanted: Option<String>,
        /// The names of the layers in the file.
        available: Vec<String>,
    },
    /// A picture has another size than is required.
    #[error("expected {} × {} pixels, found {} × {}", expected[0], expected[1], found[0], found[1])]
    Size {
        /// The required width and height.
        expected: [u32; 2],
        /// The width and height of the picture.
        found: [u32; 2],
    },
    /// A picture cannot be stored: it has no pixels or too many, or a channel of a wrong length.
    #[error("cannot store the picture: {0}")]
    Invalid(String),
}

/// Returns the description of the layer that is expected in a file, for messages.
pub(crate) fn layer(wanted: Option<&str>) -> String {
    match wanted {
        Some(name) => format!("a layer named `{name}`"),
        None => "colour or luminance in the unnamed layer, or colour in a single one".to_owned(),
    }
}

/// Returns a list of names for messages.
pub(crate) fn list(names: &[String]) -> String {
    let quoted: Vec<String> = names
        .iter()
        .map(|name| {
            if name.is_empty() {
                "the unnamed layer".to_owned()
            } else {
                format!("`{name}`")
            }
        })
        .collect();
    if quoted.is_empty() {
        "none".to_owned()
    } else {
        quoted.join(", ")
    }
}

impl FilmError {
    /// Returns the error of an action of the system.
    pub(crate) fn io(path: &Path, action: &'static str, reason: io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            action,
            reason,
        }
    }

    /// Returns the error of a malformed file.
    pub(crate) fn format(path: &Path, reason: FormatError) -> Self {
        Self::Format {
            path: path.to_owned(),
            reason,
        }
    }
}

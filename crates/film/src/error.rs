//! What can go wrong with a picture on disk.

use std::io;
use std::path::{Path, PathBuf};

/// A file's bytes are not what its format asks for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not a readable {format} file: expected {expected}, found {found}")]
pub struct FormatError {
    /// The format that was tried: `OpenEXR`, `PFM`.
    pub format: &'static str,
    /// Contents that the format asks for at the position that failed.
    pub expected: String,
    /// Contents found there instead.
    pub found: String,
    /// Whether the file may be whole, but asks for more memory than is allowed.
    pub too_large: bool,
}

impl FormatError {
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

    /// A picture that takes more bytes of memory than allowed.
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

/// Every error of this crate; the message always begins with the file's path if there is one.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// The operating system refused.
    #[error("{}: cannot {action}: {reason}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The action that failed: `read`, `write`, `rename`.
        action: &'static str,
        /// The system's reason: part of the message, and hence no `source()`, which programs
        /// print behind it.
        reason: io::Error,
    },
    /// The file is malformed or truncated.
    #[error("{}: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Expected and found contents; part of the message.
        reason: FormatError,
    },
    /// The file has no layer of that name, or none that is its picture by itself.
    #[error("{}: expected {}, found {}", path.display(), layer(wanted.as_deref()), list(available))]
    MissingLayer {
        /// The file.
        path: PathBuf,
        /// The name asked for, if one was.
        wanted: Option<String>,
        /// The names in the file.
        available: Vec<String>,
    },
    /// Two things that must have one size do not.
    #[error("expected {} × {} pixels, found {} × {}", expected[0], expected[1], found[0], found[1])]
    Size {
        /// Width and height asked for.
        expected: [u32; 2],
        /// Width and height that came.
        found: [u32; 2],
    },
    /// A picture that cannot be stored: no pixels, too many, or a channel of the wrong length.
    #[error("cannot store the picture: {0}")]
    Invalid(String),
}

/// Returns the description of the layer that is expected in a file.
pub(crate) fn layer(wanted: Option<&str>) -> String {
    match wanted {
        Some(name) => format!("a layer named `{name}`"),
        None => "colour or luminance in the unnamed layer, or colour in a single one".to_owned(),
    }
}

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
    pub(crate) fn io(path: &Path, action: &'static str, reason: io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            action,
            reason,
        }
    }

    pub(crate) fn format(path: &Path, reason: FormatError) -> Self {
        Self::Format {
            path: path.to_owned(),
            reason,
        }
    }
}

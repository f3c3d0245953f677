//! Errors and warnings about files, with their positions and advice.

mod error;
mod source;
mod suggest;

pub use error::{ErrorKind, Result, SceneError, Warning, Warnings};
pub(crate) use source::Files;
pub use source::{Location, Source, Span};
pub use suggest::{nearest, shorten};

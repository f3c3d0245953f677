//! What is wrong with a file, where, and what to do about it.

mod error;
mod source;
mod suggest;

pub use error::{ErrorKind, Result, SceneError, Warning, Warnings};
pub(crate) use source::Files;
pub use source::{Location, Source, Span};
pub use suggest::{nearest, shorten};

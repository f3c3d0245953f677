//! What is wrong with a file, where, and what to do about it.

mod error;
mod source;
mod suggest;

pub use error::{ErrorKind, SceneError, Warning};
pub(crate) use error::{Result, Warnings};
pub(crate) use source::{Files, Refusal, Source, Span, read};
pub(crate) use suggest::nearest;

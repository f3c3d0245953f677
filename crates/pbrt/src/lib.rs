//! A reader of pbrt text, versions 3 and 4.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod color;
mod reader;
mod tessellate;

pub use reader::{from_pbrt_str, load};

// What public signatures name, so that one dependency is enough.
pub use {linelit_assembly as assembly, linelit_scene as scene};

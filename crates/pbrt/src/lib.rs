//! A reader of scene files in pbrt's text format, versions 3 and 4.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod color;
mod reader;
mod tessellate;

pub use reader::{from_pbrt_str, load};

// Public signatures name types of these crates, so that users need only one dependency.
pub use {linelit_assembly as assembly, linelit_scene as scene};

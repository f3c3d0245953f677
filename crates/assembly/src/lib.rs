//! The parts that all readers of scene files share: errors that point at their position in a file,
//! limits on memory and time, the loading of images, and the reader of PLY meshes.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod assembly;
mod diagnostics;
mod framing;
mod gzip;
pub mod ies;
mod options;
pub mod ply;
mod polygon;

pub use assembly::{Assembly, Holes, Opened};
pub use diagnostics::{
    ErrorKind, Location, Result, SceneError, Source, Span, Warning, Warnings, nearest, shorten,
};
pub use framing::add_framing_light;
pub use options::{LoadOptions, Loaded, Root, Watch, about_its_middle};
pub use polygon::triangulate;

// Public signatures name types of these crates, so that users need only one dependency.
pub use {
    linelit_film as film, linelit_geometry as geometry, linelit_lights as lights,
    linelit_scene as scene,
};

//! What the readers of scene files share: errors that point at the place, limits, and meshes.
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

// What public signatures name, so that one dependency is enough.
pub use {
    linelit_film as film, linelit_geometry as geometry, linelit_lights as lights,
    linelit_scene as scene,
};

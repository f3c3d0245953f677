//! Readers of scene files in all formats: pbrt text, OBJ, PLY and glTF.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

#[cfg(feature = "gltf")]
mod gltf;
mod load;
pub mod obj;

pub use linelit_assembly::{
    ErrorKind, LoadOptions, Loaded, Root, SceneError, Warning, Watch, add_framing_light, nearest,
};
pub use linelit_pbrt::from_pbrt_str;
pub use load::{Format, from_bytes, load};

// Public signatures name types of these crates, so that users need only one dependency.
pub use {linelit_assembly as assembly, linelit_scene as scene};

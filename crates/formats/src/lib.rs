#![doc = include_str!("../README.md")]

mod assembly;
mod color;
mod diagnostics;
mod export;
mod framing;
#[cfg(feature = "gltf")]
mod gltf;
mod gzip;
mod load;
mod monotone;
mod obj;
mod pbrt;
mod ply;
mod polygon;
mod tessellate;

pub use diagnostics::{ErrorKind, SceneError, Warning};
pub use export::{ExportOptions, nearest_in_pbrt_v4, write_pbrt};
pub use framing::add_framing_light;
pub use load::{Format, LoadOptions, Loaded, Root, from_bytes, from_pbrt_str, load};

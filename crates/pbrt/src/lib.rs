#![doc = include_str!("../README.md")]

mod color;
mod export;
mod reader;
mod tessellate;

pub use export::{ExportOptions, nearest_in_pbrt_v4, write_pbrt};
pub use reader::{from_pbrt_str, load};

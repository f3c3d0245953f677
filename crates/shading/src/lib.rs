#![doc = include_str!("../README.md")]

pub mod bsdf;
pub mod cylinder;
mod exact;
pub mod horizon;
pub mod point_line;
pub mod polygon;
pub mod ribbon;
pub mod solid_angle;
mod span;
mod special;

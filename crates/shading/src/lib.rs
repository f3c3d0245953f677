//! This crate integrates reflected light in closed form, along lines and over polygons.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

pub mod batch;
pub mod cylinder;
pub mod elliptic_cone;
mod exact;
mod fan;
mod fast_lobe;
mod fast_path;
mod gauss;
pub mod horizon;
mod lambert;
mod lobe;
pub mod ltc;
pub mod phong;
pub mod phong_polygon;
pub mod polygon;
pub mod quadrature;
pub mod ribbon;
pub mod solid_angle;
mod span;
mod special;
pub mod spherical_gaussian;
mod triangle_sum;

// The geometry types appear in public signatures: with this export a caller needs one dependency.
pub use linelit_geometry as geometry;

#![doc = include_str!("../README.md")]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

pub mod batch;
pub mod cosine_lobe;
pub mod cylinder;
mod exact;
mod fan;
mod gauss;
pub mod horizon;
mod lobe;
pub mod ltc;
mod ltc_table;
mod ordinary;
mod ordinary_lobe;
pub mod phong;
pub mod phong_polygon;
pub mod point_line;
pub mod polygon;
pub mod quadrature;
pub mod ribbon;
mod simd;
pub mod solid_angle;
mod span;
mod special;
pub mod spherical_gaussian;

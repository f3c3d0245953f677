//! View factors: the fraction of the radiation that leaves one surface, uniformly and diffusely,
//! and reaches another surface without being blocked.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod covered;
mod cubature;
mod facets;
pub mod files;
mod hull;
mod layers;
mod outline;
mod pair;
mod partners;
mod patches;
mod point;
mod rounded;
mod rows;
mod sight;
mod tree;
mod unobstructed;
mod view;

pub use facets::{FacetError, Facets, Sides};
pub use pair::Estimate;
pub use point::{Memory, Row};
pub use rows::{Matrix, Plan, SparseRow};
pub use sight::PairOutcome;

// What public signatures name, so that one dependency is enough.
pub use linelit_geometry as geometry;

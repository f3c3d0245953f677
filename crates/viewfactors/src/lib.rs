//! View factors: which share of what leaves a surface reaches another, past any obstruction.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod cubature;
mod facets;
mod pair;
mod point;
mod rows;
mod unobstructed;

pub use facets::{FacetError, Facets, Sides};
pub use pair::{Estimate, Settled};
pub use point::{Memory, Row};
pub use rows::{Plan, SparseRow};

// What public signatures name, so that one dependency is enough.
pub use linelit_geometry as geometry;

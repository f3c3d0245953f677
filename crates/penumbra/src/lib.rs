//! The visible part of a light as a polygon with holes, by exact decisions.
//!
#![doc = include_str!("../README.md")]
//!
//! # How the boundary is found
//!
//! For each edge of a triangle and of the light, the question is next to which parts of it the
//! visible region is. For an edge with its own triangle on the left, these are the parts whose
//! right side is on the light and under no other triangle. They are intervals of the edge. Edges
//! that triangles of a mesh share drop out by themselves: the right of one triangle's edge is under
//! the other triangle.
//!
//! For surfaces that are known by their silhouettes, the number of layers over a point is not
//! known, but only how many more there are than over other points that edges connect with it. One
//! point of all these has to be tested by the caller ([`Outline::boundary`]).
//!
//! # Why degenerate input is no special case
//!
//! Every decision is that of exact arithmetic on the images' `f64` coordinates (`orient`), made for
//! the edge moved to its right by an infinitesimal. So the parts of all edges fit together as the
//! boundary of a set does, even if triangles touch, coincide or overlap; where two triangles have
//! edges on the same line, the one that comes first has the shared part. Only lengths are rounded:
//! the point where two edges cross is computed once for both, to the bit (`clip`).

#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![forbid(unsafe_code)]

mod bins;
mod boundary;
mod clip;
mod disk;
mod grids;
mod orient;

pub use boundary::{BoundaryEdge, Occluded, Outline, Penumbra};
pub use disk::{DiskEdge, PartOnDisk};
pub use orient::Point;

#[cfg(test)]
mod tests;

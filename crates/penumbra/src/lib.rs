//! The visible part of a light as a polygon with holes, by exact decisions.
//!
#![doc = include_str!("../README.md")]
//!
//! # How the boundary is found
//!
//! Each edge of a triangle and of the light is asked which parts of it the visible region lies
//! right next to. For an edge with its own triangle on the left, these are the parts whose
//! right-hand side is on the light and under no other triangle. Both are intervals of the edge.
//! Edges that triangles of a mesh share drop out by themselves: what is right of one is under the
//! other.
//!
//! Of surfaces that are known by their silhouettes, it is not known how many layers lie over a
//! place, but how many more than over another that edges connect with it. One place of all those
//! has to be looked at ([`Outline::boundary`]).
//!
//! # Why degenerate input is no special case
//!
//! Every decision is that of exact arithmetic on the images' `f64` coordinates (`orient`), taken
//! for the edge moved to its right by an infinitesimal. So the parts of all edges fit together as
//! the boundary of a set does, whatever touches, coincides or overlaps; where two triangles end in
//! the same line, the one that comes first has the edge. Only lengths are rounded: the point where
//! two edges cross is computed once for both, to the bit (`clip`).

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

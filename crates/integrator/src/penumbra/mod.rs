//! Penumbrae without noise: the visible part of a light as a polygon.
//!
//! Seen from a shading point, a polygonal light past triangles is a polygon with holes: the light
//! minus the union of the triangles' images on its plane. The light of such a region is a sum over
//! its boundary, so all that is to be found is the boundary, and nothing needs to be sampled: each
//! edge of an image and of the light is asked which parts of it the region lies right next to.
//!
//! For an edge with its own triangle on the left, these are the parts whose right-hand side is on
//! the light and under no other triangle. Both are intervals of the edge. Edges that triangles of
//! a mesh share drop out by themselves: what is right of one is under the other.
//!
//! # Why degenerate input is no special case
//!
//! Every decision is that of exact arithmetic on the images' `f64` coordinates ([`orient`]), taken
//! for the edge moved to its right by an infinitesimal. So the parts of all edges fit together as
//! the boundary of a set does, whatever touches, coincides or overlaps; where two triangles end in
//! the same line, the one that comes first has the edge. Only lengths are rounded: the point where
//! two edges cross is computed once for both, to the bit ([`clip`]).

mod bins;
mod boundary;
mod clip;
mod orient;

pub(crate) use boundary::{Penumbra, Piece};
pub(crate) use orient::Point;

#[cfg(test)]
mod tests;

//! This module holds the techniques that sample points of convex polygons.

pub(crate) mod area;
pub(crate) mod fan;
pub(crate) mod proxy;
pub(crate) mod quadrilateral;
pub(crate) mod region;
pub(crate) mod solid_angle;
pub(crate) mod spherical_triangle;
pub(crate) mod transformed;

//! The geometry of line-sampled direct illumination: frames, segments, convex polygons, shadow
//! triangles and interval sets.
//!
//! A *line sample* is a segment on a light. The triangle between it and the shading point is its
//! *shadow triangle*; whatever cuts the shadow triangle blocks a part of the line. This crate
//! parametrises the lines of a light ([`ParallelLines`]), finds the part that one occluding
//! triangle blocks ([`ShadowTriangle`]), and stores the parts that stay visible ([`intervals`]).
//!
//! Everything is computed in `f64`. Nothing here does I/O, allocates except where the documentation
//! says so, or fails on degenerate input: the result is an empty set or `None` then. Lengths are in
//! scene units, angles in radians. Constructors take vectors of any library ([`Vector3`]).
//!
//! ```
//! use linelit_geometry::{
//!     ConvexPolygon, DVec3, ParallelLines, ShadowTriangle,
//!     intervals::{IntervalSet, VisibleSet},
//! };
//!
//! // A unit square light two units above the shading point, and the line through its middle.
//! let light = ConvexPolygon::parallelogram(
//!     DVec3::new(-0.5, -0.5, 2.0),
//!     DVec3::X,
//!     DVec3::Y,
//! )
//! .unwrap();
//! let lines = ParallelLines::new(&light, 0.0);
//! let (a, b) = lines.range();
//! let line = lines.segment(0.5 * (a + b)).unwrap();
//!
//! // A triangle halfway up hides the part of the line with x > 0.
//! let occluder = [
//!     DVec3::new(0.0, -1.0, 1.0),
//!     DVec3::new(3.0, 0.0, 1.0),
//!     DVec3::new(0.0, 1.0, 1.0),
//! ];
//! let shadow = ShadowTriangle::new(DVec3::ZERO, &line).unwrap();
//! let blocked = shadow.blocked_by(&occluder).unwrap();
//! let mut visible = IntervalSet::full();
//! visible.clip(blocked.lo, blocked.hi);
//! assert!((visible.measure() - 0.5).abs() < 1e-15);
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
// Clippy does not look into macros, and would not see the exception for the thread-local of `stop`.
#![cfg_attr(not(test), warn(clippy::disallowed_types))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod close_lines;
pub mod double;
mod elliptic_cone;
pub mod finite;
mod frame;
pub mod intervals;
mod parallel_lines;
mod plane_frame;
mod polygon;
pub mod predicates;
mod segment;
mod shadow;
mod single;
pub mod stop;
mod triangle;
mod vector;

pub use close_lines::CloseLines;
pub use elliptic_cone::EllipticCone;
pub use frame::Frame;
pub use glam;
pub use glam::{DMat3, DMat4, DVec2, DVec3};
pub use parallel_lines::ParallelLines;
pub use plane_frame::PlaneFrame;
pub use polygon::{ConvexPolygon, MAX_VERTICES, PolygonError};
pub use segment::Segment;
pub use shadow::{Chord, Margins, ShadowCoords, ShadowTriangle};
pub use single::{Rounding, origin_of_box};
pub use triangle::Triangle;
pub use vector::{Vector3, vector};

/// Makes the README's example a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

//! Ray and line visibility over triangles: how much of a light a shading point sees.
//!
//! [`Occluders`] holds the triangles of a scene under a hierarchy of boxes, eight to a node, and
//! answers
//!
//! - rays: [`Occluders::closest_hit`] and [`Occluders::any_hit`], watertight; for many from one
//!   point [`Occluders::closest_hits`] and [`Occluders::any_hits`];
//! - *shafts*: with **one** walk of the hierarchy, [`Occluders::shaft`] finds all triangles between
//!   a shading point and a polygonal or linear light. The [`Shaft`] then returns the visible
//!   intervals of all line samples of the point at once ([`Shaft::visible`]), says whether single
//!   points of the light are visible ([`Shaft::point_visible`]), and beforehand whether occluders
//!   hide none, some or all of the light ([`Shaft::class`]).
//!
//! With a [`Filter`], as of an [`AlphaMask`], triangles have holes, for rays and lines
//! ([`Occluders::with_holes`]).
//!
//! Renderers that have a hierarchy of their own can go on using it: [`SpaceBetween`] says which of
//! its boxes may hold triangles between a point and a light, and [`Occluders::from_triangles`]
//! takes the triangles that are found there.
//!
//! # How a shaft works
//!
//! In the light's projective frame, a position has coordinates (P, Q, W) that are linear in it. W
//! is zero at the shading point and one on the light, and (P/W, Q/W) is the point of the light's
//! plane that the position hides from the shading point. Boxes and triangles outside the shaft are
//! rejected in `f32`, with a margin for every rounding; the triangles that may be inside are
//! projected once, in `f64`, to the plane of the light. There, lines of one direction are numbers
//! u, and a triangle hides an interval whose ends are linear in u; eight lines are evaluated at a
//! time. Half of a closed mesh's triangles suffice, since those that face the other way hide the
//! same.
//!
//! Shafts with more than a few hundred triangles are *dense*: their lines walk the hierarchy again,
//! a few at a time, from front to back, and skip what is hidden already. Fine meshes are not tested
//! triangle by triangle there. What they hide of a line lies between the crossings of the line with
//! their silhouettes, and the number of crossings does not grow as a mesh of the same shape is made
//! finer. What they hide of a whole light lies between their silhouettes
//! ([`MeshesInFront::silhouettes`]).
//!
//! # Accuracy
//!
//! Interval ends are computed in `f64` throughout; `f32` only rejects what cannot change a result.
//! The ends agree with a brute-force oracle ([`brute::visible`]) to 1e-9 of the line, typically to
//! 1e-12, and the tests check this. A line through a closed surface is hidden wholly: two triangles
//! evaluate the edge that they share by the same expression, with identical results. Geometry
//! within the query's [`Margins`](linelit_geometry::Margins) of the shading point or of the light
//! hides nothing; the margins may be zero.
//!
//! Kernels exist for AVX-512, AVX2 and plain Rust and are chosen at run time ([`InstructionSet`]).
//! Intervals, hits, classes and work [`Counters`] are bit-identical on all of them. There are no
//! kernels for NEON: those processors run the plain ones.
//!
//! # Example
//!
//! ```
//! use linelit_visibility::geometry::{DVec3, Segment};
//! use linelit_visibility::{Occluders, Scratch, ShaftClass, ShaftQuery, VisibleLines};
//!
//! // A triangle halfway up hides the part of the light with x > 0.
//! let positions = [[0.0, -1.0, 1.0], [3.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
//! let occluders = Occluders::build(&positions, &[[0, 1, 2]]);
//!
//! // A unit square light two units above the shading point, and a line across it.
//! let corner = DVec3::new(-0.5, -0.5, 2.0);
//! let light = [
//!     corner,
//!     corner + DVec3::X,
//!     corner + DVec3::X + DVec3::Y,
//!     corner + DVec3::Y,
//! ];
//! let line = Segment::new(DVec3::new(-0.5, 0.0, 2.0), DVec3::new(0.5, 0.0, 2.0));
//!
//! let mut scratch = Scratch::new();
//! let mut shaft = occluders.shaft(ShaftQuery::new(DVec3::ZERO, &light), &mut scratch);
//! assert_eq!(shaft.class(), ShaftClass::Partial);
//!
//! let mut visible = VisibleLines::new();
//! shaft.visible(&[line], &mut visible);
//! assert_eq!(visible.line(0).len(), 1);
//! assert!((visible.fraction(0) - 0.5).abs() < 1e-12);
//! ```
//!
//! The [guide](https://github.com/linelit/linelit/blob/HEAD/docs/guide.md)
//! leads from one integral to a study of a scene.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod between;
pub mod brute;
mod build;
mod bvh;
mod closed_mesh;
mod counters;
mod holes;
mod lanes;
mod lines;
mod node;
mod occluders;
mod pool;
mod rays;
mod rounded;
mod scratch;
mod shaft;
mod silhouettes;
mod surfaces;
mod walk;

pub use between::SpaceBetween;
pub use build::{BuildOptions, Builder};
pub use counters::Counters;
pub use holes::alpha::{AlphaCutoff, AlphaError, AlphaLookup, AlphaMask, AlphaTexels, AlphaWrap};
pub use holes::filter::{AnyFilter, Filter, SharedFilter};
pub use linelit_simd::InstructionSet;
pub use lines::VisibleLines;
pub use occluders::Occluders;
pub use rays::fan::{FAN, Fan};
pub use rays::ray::{Hit, Ray};
pub use scratch::Scratch;
pub use shaft::frame::LightCorners;
pub use shaft::in_front::{FrontWithoutMeshes, MeshesInFront, TrianglesInFront};
pub use shaft::plane::LightPlane;
pub use shaft::{Shaft, ShaftClass, ShaftQuery};
pub use silhouettes::outline::Silhouette;

// What public signatures name, so that one dependency is enough.
pub use linelit_geometry as geometry;

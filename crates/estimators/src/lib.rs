//! This crate has every estimator of direct light, for your own shading points, reflections, lights
//! and triangles. Begin at [`estimate()`], which takes a [`Query`].
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod choose;
mod counters;
mod draw;
mod estimate;
mod estimator;
mod explain;
mod hybrid;
mod integrand;
mod known;
mod light;
mod method;
mod noises;
mod occlusion;
mod options;
mod pilot_lines;
mod point;
mod query;
mod reference;
mod rest;
pub mod streams;
mod technique;
mod text;
mod view;
mod visible;
mod visible_disk;
mod visible_region;

pub use counters::{PlanCounters, SegmentCounters, WorkCounters};
pub use estimate::{Buffers, estimate};
pub use estimator::{Estimator, MOST_TECHNIQUES, Optimal, Part, Smoothing, Weights};
pub use light::{LightSource, OcclusionStats};
pub use linelit_lights::{EmissionTexture, NoTexture};
pub use method::Weighted;
pub use method::{
    Closed, KnownIntegrand, KnownKind, KnownOver, LightKind, Method, MethodFacts, Rest,
    ShaftAnswer, VisibilityBy,
};
pub use occlusion::OcclusionProbe;
pub use options::ParseEstimatorError;
pub use point::{SURFACE_OFFSET, ShadingPoint};
pub use query::{MOST_SAMPLES, Query};
pub use reference::brute_force;
pub use streams::{RandomNumbers, Stream};
pub use technique::{ExactOptions, Integration, LinearHeuristic, LinearOptions};
pub use technique::{LineBy, LineControl, LineDirection, Lines, Pieces};
pub use technique::{PointBy, PointDensity, Points, Technique};
pub use visible_disk::{VisibleDisk, is_clear};
pub use visible_region::{Measure, VisibleRegion};

// What queries are made of, so that one dependency is enough.
pub use {
    linelit_bsdf as bsdf, linelit_geometry as geometry, linelit_lights as lights,
    linelit_samplers as samplers, linelit_visibility as visibility,
};

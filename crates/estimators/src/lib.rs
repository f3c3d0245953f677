#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod buffers;
mod closed_form;
mod combination;
mod control;
mod counters;
mod direction;
mod estimate;
mod estimator;
mod light;
mod line_sum;
mod linear;
mod method;
mod occlusion;
mod pilot_lines;
mod point;
mod point_block;
mod point_sum;
mod query;
mod reference;
mod round;
mod seen_disk;
mod strategy;
pub mod streams;
mod techniques;
mod text;
mod transformed;

pub use buffers::{Buffers, SampleBuffers};
pub use counters::{PlanCounters, SegmentCounters};
pub use estimate::estimate;
pub use estimator::{Estimator, MOST_TECHNIQUES, Optimal, Part, Smoothing, Weights};
pub use light::{EmissionTexture, LightSource, NoTexture};
pub use method::{Closed, Cosines, Known, LightKind, Method};
pub use occlusion::{OcclusionProbe, OcclusionStats};
pub use point::ShadingPoint;
pub use query::{Queries, Query};
pub use reference::brute_force;
pub use streams::{RandomNumbers, Stream};
pub use techniques::integrals::exact::ExactOptions;
pub use techniques::lines::{LineControl, LineDirection, Lines, Pieces};
pub use techniques::points::Points;
pub use techniques::points::linear::{LinearHeuristic, LinearOptions};
pub use techniques::{Integration, LineBy, PointBy, Technique};
pub use text::ParseEstimatorError;

// What queries are made of, so that one dependency is enough.
pub use {
    linelit_bsdf as bsdf, linelit_geometry as geometry, linelit_lights as lights,
    linelit_samplers as samplers, linelit_visibility as visibility,
};

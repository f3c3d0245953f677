#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod buffers;
mod closed_form;
mod combination;
mod counters;
mod estimate;
mod estimator;
mod exact;
mod light;
mod line_sum;
mod linear;
mod occlusion;
mod point;
mod point_sum;
mod query;
mod reference;
mod round;
mod strategy;
pub mod streams;
mod text;

pub use buffers::Buffers;
pub use counters::{PlanCounters, SegmentCounters};
pub use estimate::estimate;
pub use estimator::{
    Estimator, ExactOptions, Integration, LineBy, LineDirection, LinearHeuristic, LinearOptions,
    Lines, MOST_TECHNIQUES, Optimal, Part, Pieces, PointBy, Points, Smoothing, Technique, Weights,
};
pub use light::{EmissionTexture, LightSource, NoTexture};
pub use occlusion::{OcclusionProbe, OcclusionStats};
pub use point::ShadingPoint;
pub use query::{Queries, Query};
pub use reference::brute_force;
pub use streams::{RandomNumbers, Stream};
pub use text::{ESTIMATOR_NAMES, ParseEstimatorError};

//! This crate renders pictures of direct light: it has the camera rays, the surfaces that they
//! meet, and the loop over the pixels. Begin at [`Renderer`].
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod methods;
mod picture;
mod plan;
mod point;
mod probe;
mod renderer;
mod settings;
mod workspace;
mod world;

pub use linelit_direct::{Counts, LightChoice, Luminaire, Luminaires};
pub use linelit_estimators::{
    Estimator, OcclusionStats, ParseEstimatorError, PlanCounters, SURFACE_OFFSET, SegmentCounters,
};
pub use methods::PairMethods;
pub use picture::Window;
pub use plan::Plan;
pub use point::ShadingPoint;
pub use renderer::Renderer;
pub use settings::{Settings, Spheres};
pub use workspace::Workspace;

// The crates whose types occur in public signatures, so that one dependency is enough.
pub use {
    linelit_bsdf as bsdf, linelit_direct as direct, linelit_estimators as estimators,
    linelit_geometry as geometry, linelit_lights as lights, linelit_samplers as samplers,
    linelit_scene as scene, linelit_visibility as visibility,
};

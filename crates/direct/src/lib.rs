//! This crate computes the direct light at one point of a scene, from all its lights or from some
//! that are chosen at random. Begin at [`Illumination`].
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod choice;
mod illumination;
mod luminaire;
mod luminaires;
mod needs;
mod own_triangles;
mod probe;
mod settings;
mod visible;
mod workspace;

pub use illumination::Illumination;
pub use luminaire::{Luminaire, Texture};
pub use luminaires::Luminaires;
pub use needs::{needs_occlusion, needs_shafts};
pub use probe::{PROBES, points_on, probe};
pub use settings::{LightChoice, SampleNames, Settings};
pub use visible::Unknown;
pub use workspace::{Counts, Workspace};

// The crates whose types occur in public signatures, so that one dependency is enough.
pub use {
    linelit_bsdf as bsdf, linelit_estimators as estimators, linelit_geometry as geometry,
    linelit_lights as lights, linelit_samplers as samplers, linelit_visibility as visibility,
};

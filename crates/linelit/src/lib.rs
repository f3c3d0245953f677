//! Direct illumination with exact visibility: line samples, point samples and closed forms.
//!
#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod builder;
mod error;
mod one_call;
mod scene_lights;

pub use builder::SceneBuilder;
pub use error::Error;
pub use linelit_estimators::{Estimator, Measure};
pub use linelit_lights::Light;
pub use one_call::{Rings, Scene};

#[doc(inline)]
#[cfg(feature = "pbrt")]
pub use linelit_assembly as assembly;
#[doc(inline)]
pub use linelit_bsdf as bsdf;
#[doc(inline)]
pub use linelit_direct as direct;
#[doc(inline)]
pub use linelit_estimators as estimators;
#[doc(inline)]
#[cfg(feature = "render")]
pub use linelit_film as film;
#[doc(inline)]
#[cfg(feature = "formats")]
pub use linelit_formats as formats;
#[doc(inline)]
pub use linelit_geometry as geometry;
#[doc(inline)]
#[cfg(feature = "render")]
pub use linelit_integrator as integrator;
#[doc(inline)]
pub use linelit_lights as lights;
#[doc(inline)]
pub use linelit_mis as mis;
#[doc(inline)]
#[cfg(feature = "pbrt")]
pub use linelit_pbrt as pbrt;
#[doc(inline)]
pub use linelit_penumbra as penumbra;
#[doc(inline)]
pub use linelit_samplers as samplers;
#[doc(inline)]
#[cfg(any(feature = "render", feature = "pbrt"))]
pub use linelit_scene as scene;
#[doc(inline)]
pub use linelit_selection as selection;
#[doc(inline)]
pub use linelit_shading as shading;
#[doc(inline)]
pub use linelit_simd as simd;
#[doc(inline)]
#[cfg(feature = "study")]
pub use linelit_study as study;
#[doc(inline)]
#[cfg(feature = "viewfactors")]
pub use linelit_viewfactors as viewfactors;
#[doc(inline)]
pub use linelit_visibility as visibility;

/// The example of the project's page, run as a test.
#[cfg(all(doctest, feature = "formats", feature = "render"))]
#[doc = include_str!("../pages/project")]
struct Project;

/// The blocks of the guide, run as tests.
#[cfg(all(doctest, feature = "formats", feature = "render"))]
#[doc = include_str!("../pages/guide")]
struct Guide;

#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

#[cfg(feature = "pbrt")]
pub use linelit_assembly as assembly;
pub use linelit_bsdf as bsdf;
pub use linelit_estimators as estimators;
#[cfg(feature = "render")]
pub use linelit_film as film;
#[cfg(feature = "formats")]
pub use linelit_formats as formats;
pub use linelit_geometry as geometry;
#[cfg(feature = "render")]
pub use linelit_integrator as integrator;
pub use linelit_lights as lights;
pub use linelit_mis as mis;
#[cfg(feature = "pbrt")]
pub use linelit_pbrt as pbrt;
pub use linelit_penumbra as penumbra;
pub use linelit_samplers as samplers;
#[cfg(any(feature = "render", feature = "pbrt"))]
pub use linelit_scene as scene;
pub use linelit_selection as selection;
pub use linelit_shading as shading;
pub use linelit_simd as simd;
#[cfg(feature = "study")]
pub use linelit_study as study;
pub use linelit_visibility as visibility;

/// The example of the project's page, run as a test.
#[cfg(all(doctest, feature = "formats", feature = "render"))]
#[doc = include_str!("../pages/project")]
struct Project;

/// The blocks of the guide, run as tests.
#[cfg(all(doctest, feature = "formats", feature = "render"))]
#[doc = include_str!("../pages/guide")]
struct Guide;

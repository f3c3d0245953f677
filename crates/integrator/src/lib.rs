//! Pictures of scenes in direct light: from a pixel to a shading point, and which lights it asks.
//!
//! How the light of one light is estimated is `linelit-estimators`'. What a scene or a shading
//! point does not need is dropped by the [`Plan`] and counted.
//!
//! ```
//! use linelit_integrator::{Renderer, Settings, Workspace};
//! use linelit_formats::LoadOptions;
//!
//! let text = r#"
//!     LookAt 0 -4 3  0 0 0  0 0 1
//!     Camera "perspective" "float fov" [ 40 ]
//!     WorldBegin
//!     Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
//!         "point3 P" [ -1 -1 0   1 -1 0   1 1 0   -1 1 0 ]
//!     AttributeBegin
//!         AreaLightSource "diffuse" "rgb L" [ 10 10 10 ]
//!         Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
//!             "point3 P" [ -.2 -.2 2   -.2 .2 2   .2 .2 2   .2 -.2 2 ]
//!     AttributeEnd
//! "#;
//! let scene = linelit_formats::from_pbrt_str(text, "room.pbrt", &LoadOptions::default())?.scene;
//! let renderer = Renderer::new(&scene);
//! let mut workspace = Workspace::new();
//! let centre = [scene.film.width / 2, scene.film.height / 2];
//! let samples = 4096;
//! let points = Settings { estimator: "point-area".parse()?, samples, ..Settings::default() };
//! let lines = Settings { estimator: "line-analytic".parse()?, samples: 4, ..Settings::default() };
//! let points = renderer.pixel(&points, centre, &mut workspace);
//! let lines = renderer.pixel(&lines, centre, &mut workspace);
//! assert!(lines.x > 0.05 && (points - lines).length() < 0.01 * lines.length());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod methods;
mod plan;
mod point;
mod probe;
mod renderer;
mod selection;
mod settings;
mod workspace;

pub use linelit_estimators::{
    Estimator, OcclusionStats, ParseEstimatorError, PlanCounters, SegmentCounters,
};
pub use methods::PairMethods;
pub use plan::{Plan, PlannedLight, PlannedTexture};
pub use point::{SURFACE_OFFSET, ShadingPoint};
pub use renderer::Renderer;
pub use selection::LightChoice;
pub use settings::{Settings, Spheres};
pub use workspace::{Counts, Workspace};

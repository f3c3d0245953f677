//! Direct light at a shading point, by points, by lines and in closed form.
//!
//! The estimators are thin: `lights` turns random numbers into samples, `visibility` says what of
//! them is seen, `shading` integrates. What a scene or a shading point does not need is dropped by
//! the [`Plan`] and counted.
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
//! let points = Settings { estimator: "point-area".parse()?, samples: 4096, ..Settings::default() };
//! let lines = Settings { estimator: "line-analytic".parse()?, samples: 4, ..Settings::default() };
//! let (points, lines) =
//!     (renderer.pixel(&points, centre, &mut workspace), renderer.pixel(&lines, centre, &mut workspace));
//! assert!(lines.x > 0.05 && (points - lines).length() < 0.01 * lines.length());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod closed_form;
mod curved;
mod estimator;
mod exact;
mod hybrid;
mod linear;
mod lines;
pub mod mix;
mod options;
mod oracle;
mod pair;
mod plan;
mod point;
mod points;
mod renderer;
mod selection;
mod shaft_points;
mod workspace;

pub use curved::Spheres;
pub use estimator::{ESTIMATOR_NAMES, Estimator, LineOptions, ParseEstimatorError};
pub use exact::ExactOptions;
pub use linear::{LinearHeuristic, LinearOptions};
pub use plan::{Crowd, Plan, PlanCounters, PlannedLight};
pub use point::{SURFACE_OFFSET, ShadingPoint};
pub use renderer::{Renderer, Settings};
pub use selection::LightChoice;
pub use shaft_points::ShaftPoints;
pub use workspace::{Counts, SegmentCounters, Workspace};

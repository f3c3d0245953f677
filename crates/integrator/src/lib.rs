//! Direct light at a shading point, by points, by lines and in closed form.
//!
//! The estimators are thin: `lights` turns random numbers into samples, `visibility` says what of
//! them is seen, `shading` integrates. What a scene or a shading point does not need is dropped by
//! the [`Plan`] and counted.

mod closed_form;
mod estimator;
mod lines;
mod oracle;
mod plan;
mod point;
mod points;
mod renderer;
mod workspace;

pub use estimator::{ESTIMATOR_NAMES, Estimator, LineOptions, ParseEstimatorError};
pub use plan::{Plan, PlanCounters, PlannedLight};
pub use point::{SURFACE_OFFSET, ShadingPoint};
pub use renderer::{Renderer, Settings};
pub use workspace::{Counts, SegmentCounters, Workspace};

//! Plots as SVG text: error and efficiency over samples, and error over time.
//!
//! The SVG is generated without a plotting library, as axes, error bars and a legend take only a
//! few hundred lines. Each estimator has a fixed colour, which depends on the reader's light or
//! dark theme, and every mark shows its numbers on hovering. Equal data give equal text.

mod axis;
mod convergence;
mod palette;
mod svg;

pub use axis::scientific;
pub(crate) use axis::{seconds, short, signed};
pub use convergence::{ConvergencePlot, PlotPoint, Series};
pub(crate) use convergence::{efficiency_over_samples, error_over_samples, error_over_time};
pub use palette::Palette;

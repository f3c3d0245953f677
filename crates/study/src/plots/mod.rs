//! Plots as SVG text: error and efficiency over samples, and error over time.
//!
//! The drawings are written by hand: log–log axes, error bars and a legend need a few hundred
//! lines, and keep a plotting library out of the build. Colours are fixed for each estimator and
//! change with the reader's light or dark theme; every mark tells its numbers on hovering. Equal
//! data give equal text.

mod axis;
mod convergence;
mod palette;
mod svg;

pub use axis::scientific;
pub(crate) use axis::{seconds, short, signed};
pub use convergence::{ConvergencePlot, PlotPoint, Series};
pub(crate) use convergence::{efficiency_over_samples, error_over_samples, error_over_time};
pub use palette::Palette;

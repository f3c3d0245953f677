//! One line of a light, or a visible part of it, in the measure that points on it are drawn by.

use crate::linear::{ArcPoint, LineView, ProjectedLine};

/// A line, or a visible part of it, in either measure.
#[derive(Clone, Copy)]
#[allow(
    clippy::large_enum_variant,
    reason = "lives on the stack of one function"
)]
pub(crate) enum Thin {
    Solid(LineView<f64>),
    Projected(ProjectedLine<f64>),
}

impl Thin {
    pub(crate) fn measure(&self) -> f64 {
        match self {
            Self::Solid(v) => v.solid_angle(),
            Self::Projected(p) => p.projected_solid_angle(),
        }
    }

    pub(crate) fn view(&self) -> &LineView<f64> {
        match self {
            Self::Solid(v) => v,
            Self::Projected(p) => p.view(),
        }
    }

    pub(crate) fn sample(&self, xi: f64) -> ArcPoint<f64> {
        match self {
            Self::Solid(v) => v.sample_solid_angle(xi),
            Self::Projected(p) => p.sample(xi),
        }
    }

    pub(crate) fn invert(&self, lambda: f64) -> f64 {
        match self {
            Self::Solid(v) => v.invert_solid_angle(lambda),
            Self::Projected(p) => p.invert(lambda),
        }
    }
}

//! What the techniques of a combination draw from: the part of a light above the horizon, a polygon
//! or a round light as the shading point sees it.

use super::smooth::Bordered;
use crate::round::{RoundSource, RoundView};
use crate::techniques::lines::{DrawLines, LineFamily};
use crate::techniques::points::{DrawPoints, LightPoint, PointSource, Polygon};
use crate::{EmissionTexture, Lines, PointBy};
use linelit_bsdf::TransformedCosines;
use linelit_geometry::{ConvexPolygon, DVec3, Segment, intervals::Interval};
use linelit_lights::LineSample;
use std::fmt::Debug;

pub(super) trait Domain {
    /// The light's surface, on which points lie.
    type Surface: Bordered;
    /// What draws points of it.
    type Points: DrawPoints<Self::Surface> + Clone + Debug;
    /// What draws lines on it.
    type Lines: DrawLines<Self::Surface> + Clone + Debug;

    /// Points of a technique.
    fn points(&self, by: PointBy) -> Self::Points;

    /// Lines of a technique in a direction that is a fraction of a half turn; `None` of a light
    /// without lines: points by solid angle then.
    fn lines(&self, lines: &Lines, fraction: f64) -> Option<Self::Lines>;
}

impl<'t, T: EmissionTexture> Domain for Polygon<'t, T> {
    type Surface = ConvexPolygon;
    type Points = PointSource<'t>;
    type Lines = LineFamily<'t>;

    fn points(&self, by: PointBy) -> PointSource<'t> {
        PointSource::new(by, self)
    }

    fn lines(&self, lines: &Lines, fraction: f64) -> Option<LineFamily<'t>> {
        Some(LineFamily::new(lines, self, fraction))
    }
}

/// A round light, and who looks at it. It has no lines: those of techniques are points by solid
/// angle there.
pub(super) struct RoundPart {
    pub view: RoundView,
    /// The shading normal.
    pub normal: DVec3,
    /// What the point reflects, if that is known and a technique asks for it.
    pub cosines: Option<TransformedCosines>,
}

impl Domain for RoundPart {
    type Surface = RoundView;
    type Points = RoundSource;
    type Lines = NoLines;

    fn points(&self, by: PointBy) -> RoundSource {
        RoundSource {
            points: self.view.points(by, self.normal, self.cosines.as_ref()),
            view: self.view,
        }
    }

    fn lines(&self, _: &Lines, _: f64) -> Option<NoLines> {
        None
    }
}

/// The lines of lights that have none: there is no value.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NoLines {}

impl<S> DrawLines<S> for NoLines {
    fn direction(&self) -> DVec3 {
        match *self {}
    }

    fn sample(&self, _: f64) -> LineSample {
        match *self {}
    }

    fn point(&self, _: &LineSample, _: &[Interval], _: f64, _: DVec3, _: &S) -> (LightPoint, f64) {
        match *self {}
    }

    fn through(&self, _: DVec3) -> Segment {
        match *self {}
    }

    fn density(&self, _: &LightPoint, _: &[Interval]) -> f64 {
        match *self {}
    }
}

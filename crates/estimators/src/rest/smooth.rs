//! Weights without steps: densities of points smoothed at the borders of the light and of its
//! visible parts (Salesin & Jarosz 2019, section 4.3).

use crate::view::LightView;
use crate::{Smoothing, Weights};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{LightPoint, Surface};
use linelit_mis::smoothing;

/// The hidden share of a line that is smoothed with a fixed width, at least. Ends of visible
/// parts are good to some 1e-12, and what rounding hides at the end of one line may be visible on
/// the line through the same point that another technique asks for: weights would no longer sum to
/// one.
const LEAST_GAP: f64 = 1e-9;

/// The smoothing of weights on a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smooth<'a> {
    kind: Smoothing,
    width: f64,
    /// The part of the light above the horizons.
    part: Surface<'a>,
    x: DVec3,
}

impl<'a> Smooth<'a> {
    /// `None` where weights are not smoothed.
    pub(super) fn new(weights: Weights, view: &LightView<'_>, part: Surface<'a>) -> Option<Self> {
        let Weights::Smooth(kind) = weights else {
            return None;
        };
        let outline = view.disk().map(|disk| disk.radius);
        Some(Self {
            kind,
            width: outline.unwrap_or_else(|| part.half_width()),
            part,
            x: view.at.position,
        })
    }

    /// The factor for the borders of the light: eq. 23 with all edges in place of u and v.
    pub(super) fn border(&self, point: DVec3) -> f64 {
        let edge = |distance: f64| smoothing::edge(distance, self.width);
        self.part.border(point, self.x, edge)
    }

    /// The smoothing factor of points at the ends of visible parts, along one line direction.
    pub(super) fn factor(&self, at: &LightPoint, line: &Segment, parts: &[Interval]) -> f64 {
        let (t, length) = (parameter(line, at.point), line.length());
        let Some(k) = piece_of(t, parts) else {
            return 1.0;
        };
        let part = parts[k];
        let before = k.checked_sub(1).map_or(0.0, |j| parts[j].hi);
        let after = parts.get(k + 1).map_or(1.0, |p| p.lo);
        let gap = |hidden: f64| match self.kind {
            Smoothing::Fixed if hidden > LEAST_GAP => f64::INFINITY,
            _ => hidden * length,
        };
        let (lo, hi) = (part.lo * length, part.hi * length);
        let gaps = (gap(part.lo - before), gap(after - part.hi));
        smoothing::visible_interval(t * length, lo, hi, gaps.0, gaps.1, self.width)
    }

    /// The lines across those of a direction, one through each point; of lights without lines none.
    pub(super) fn across(
        &self,
        direction: DVec3,
        points: impl Iterator<Item = DVec3>,
        out: &mut Vec<Segment>,
    ) {
        out.clear();
        self.part.lines_across(direction, points, out);
    }
}

/// The parameter in [0, 1] of a point on a line.
pub(super) fn parameter(line: &Segment, point: DVec3) -> f64 {
    let along = line.vector();
    let square = along.length_squared();
    if square > 0.0 {
        ((point - line.p0).dot(along) / square).clamp(0.0, 1.0)
    } else {
        0.5
    }
}

/// The visible part that holds a parameter, whose rounding may have put it beyond an end.
pub(super) fn piece_of(t: f64, parts: &[Interval]) -> Option<usize> {
    let slack = 16.0 * f64::EPSILON;
    parts
        .iter()
        .position(|part| t >= part.lo - slack && t <= part.hi + slack)
}

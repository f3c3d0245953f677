//! Weights without steps are computed here: the densities of points are smoothed at the borders of
//! the light and of its visible parts (Salesin & Jarosz 2019, section 4.3).

use crate::view::LightView;
use crate::{Smoothing, Weights};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{LightPoint, Surface};
use linelit_mis::smoothing;

/// The shortest hidden piece, as a fraction of a line, that is smoothed with a fixed width. Ends of
/// visible parts are good to some 1e-12. What rounding hides at the end of one line may be visible
/// on the line through the same point that belongs to another technique; weights would then no
/// longer add up to one.
const LEAST_GAP: f64 = 1e-9;

/// The smoothing of the densities of points on a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smooth<'a> {
    kind: Smoothing,
    width: f64,
    /// The part of the light above the horizons.
    part: Surface<'a>,
    x: DVec3,
}

impl<'a> Smooth<'a> {
    /// Sets up the smoothing; `None` if the weights are not smoothed.
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

    /// The factor for the borders of the light: eq. 23 with all edges instead of u and v.
    pub(super) fn border(&self, point: DVec3) -> f64 {
        let edge = |distance: f64| smoothing::edge(distance, self.width);
        self.part.border(point, self.x, edge)
    }

    /// The factor for the ends of visible parts, along one direction of lines.
    pub(super) fn factor(&self, at: &LightPoint, line: &Segment, parts: &[Interval]) -> f64 {
        // Find the visible part that the point is on, and how much is hidden before and after it.
        let (t, length) = (parameter(line, at.point), line.length());
        let Some(k) = piece_of(t, parts) else {
            return 1.0;
        };
        let part = parts[k];
        let before = k.checked_sub(1).map_or(0.0, |j| parts[j].hi);
        let after = parts.get(k + 1).map_or(1.0, |p| p.lo);
        // The length of a hidden piece limits the width of smoothing, unless the width is fixed.
        let gap = |hidden: f64| match self.kind {
            Smoothing::Fixed if hidden > LEAST_GAP => f64::INFINITY,
            _ => hidden * length,
        };
        let (lo, hi) = (part.lo * length, part.hi * length);
        let gaps = (gap(part.lo - before), gap(after - part.hi));
        smoothing::visible_interval(t * length, lo, hi, gaps.0, gaps.1, self.width)
    }

    /// Finds lines across a direction, one through each point; none on lights without lines.
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

/// The index of the visible part that contains a parameter; the parameter may be beyond an end by
/// its rounding.
pub(super) fn piece_of(t: f64, parts: &[Interval]) -> Option<usize> {
    let slack = 16.0 * f64::EPSILON;
    parts
        .iter()
        .position(|part| t >= part.lo - slack && t <= part.hi + slack)
}

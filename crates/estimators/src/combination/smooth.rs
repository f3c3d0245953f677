//! Weights without steps: densities of points smoothed at the borders of the light and of its
//! visible parts (Salesin & Jarosz 2019, section 4.3).

use super::prepared::{PreparedTechnique, Source};
use super::{Combination, CombinationBuffers};
use crate::light::Shape;
use crate::round::RoundView;
use crate::techniques::lines::{DrawLines, through};
use crate::techniques::points::LightPoint;
use crate::{EmissionTexture, Smoothing, Weights};
use linelit_bsdf::Reflection;
use linelit_elementary::{atan2, sin};
use linelit_geometry::{ConvexPolygon, DVec2, DVec3, ParallelLines, Segment, intervals::Interval};
use linelit_lights::CylinderView;
use linelit_mis::smoothing;
use std::f64::consts::FRAC_PI_2;

/// What is hidden of a line, as a share of it, to be smoothed with a fixed width. Ends of visible
/// parts are good to some 1e-12, and what rounding hides at the end of one line may be visible on
/// the line through the same point that another technique asks for: weights would no longer sum to
/// one.
const LEAST_GAP: f64 = 1e-9;

/// A light's surface as combinations know it: its borders, and where shadow rays end.
pub(crate) trait Bordered: Shape + Copy {
    /// Half the smaller extent.
    fn half_width(&self) -> f64;

    /// The factor for the borders: eq. 23 with all edges in place of u and v.
    fn border(&self, point: DVec3, width: f64) -> f64;

    /// The lines across those of a direction: through a point, each.
    fn across(&self, direction: DVec3) -> impl Fn(DVec3) -> Segment;

    /// Where a shadow ray towards a point ends.
    fn target(&self, at: &LightPoint) -> DVec3 {
        at.point
    }
}

impl Bordered for ConvexPolygon {
    /// Along and across the first edge.
    fn half_width(&self) -> f64 {
        let frame = self.plane_frame();
        let corners = self.vertices().iter().map(|v| frame.to_plane(*v));
        let (low, high) = corners.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        0.5 * (high - low).min_element()
    }

    fn border(&self, point: DVec3, width: f64) -> f64 {
        let vertices = self.vertices();
        let next = vertices.iter().cycle().skip(1);
        let factor = |(a, b): (&DVec3, &DVec3)| {
            let inwards = self.normal().cross((*b - *a).normalize_or_zero());
            smoothing::edge(inwards.dot(point - *a), width)
        };
        vertices.iter().zip(next).map(factor).product()
    }

    fn across(&self, direction: DVec3) -> impl Fn(DVec3) -> Segment {
        let along = self.plane_frame().axes;
        let angle = atan2(along.y.dot(direction), along.x.dot(direction)) + FRAC_PI_2;
        let across = ParallelLines::new(self, angle);
        move |point| through(&across, point)
    }
}

impl Bordered for RoundView {
    fn half_width(&self) -> f64 {
        self.disk.radius
    }

    fn border(&self, point: DVec3, width: f64) -> f64 {
        smoothing::edge(self.disk.radius - point.distance(self.disk.center), width)
    }

    fn across(&self, direction: DVec3) -> impl Fn(DVec3) -> Segment {
        let (view, across) = (*self, self.disk.normal.cross(direction));
        move |point| view.chord(point, across)
    }

    fn target(&self, at: &LightPoint) -> DVec3 {
        self.lifted(at).point
    }
}

impl Bordered for CylinderView {
    fn half_width(&self) -> f64 {
        let cylinder = self.cylinder();
        (0.5 * cylinder.axis.length()).min(cylinder.radius * sin(self.half_turn()))
    }

    fn border(&self, point: DVec3, width: f64) -> f64 {
        let cylinder = self.cylinder();
        let from = [cylinder.axis.p0, cylinder.axis.p1].map(|end| point - end);
        let along = cylinder.axis.direction();
        let around = cylinder.radius * (self.half_turn() - self.azimuth(point).abs());
        let distances = [along.dot(from[0]), -along.dot(from[1]), around];
        distances
            .map(|d| smoothing::edge(d, width))
            .iter()
            .product()
    }

    fn across(&self, _: DVec3) -> impl Fn(DVec3) -> Segment {
        move |point| self.across(point)
    }
}

/// What smoothing needs to know of the light.
pub(super) struct Smooth<S> {
    kind: Smoothing,
    width: f64,
    light: S,
}

impl<S: Bordered> Smooth<S> {
    /// `None` where weights are not smoothed.
    pub(super) fn new(weights: Weights, light: &S) -> Option<Self> {
        let Weights::Smooth(kind) = weights else {
            return None;
        };
        Some(Self {
            kind,
            width: light.half_width(),
            light: *light,
        })
    }

    /// The factor for the borders of the light.
    pub(super) fn border(&self, point: DVec3) -> f64 {
        self.light.border(point, self.width)
    }
}

impl<R: Reflection, T: EmissionTexture, S: Bordered> Combination<'_, '_, R, T, S> {
    /// Where all lines have one direction, smooths along the other, too: one more line through each
    /// sample.
    pub(super) fn smooth_across<P, L: DrawLines<S>>(
        &mut self,
        buffers: &mut CombinationBuffers<P, L>,
    ) {
        let CombinationBuffers {
            techniques,
            segments,
            samples,
            ..
        } = buffers;
        let lines = |s: &PreparedTechnique<P, L>| match &s.source {
            Source::Lines(lines, _) => Some(lines.direction()),
            Source::Points(_) => None,
        };
        let mut directions = techniques.iter().filter_map(lines);
        let (Some(smooth), Some(first), None) =
            (&self.smoothing, directions.next(), directions.next())
        else {
            return;
        };
        let across = smooth.light.across(first);
        segments.clear();
        segments.extend(samples.iter().map(|s| across(s.at.point)));
        self.visibility.visible(segments, &mut self.buffers.visible);
        self.buffers.plan.density_lines += segments.len() as u64;
        for (i, sample) in samples.iter_mut().enumerate() {
            sample.smooth *=
                self.smooth_factor(&sample.at, &segments[i], self.buffers.visible.line(i));
        }
    }

    /// The smoothing factor of points at the ends of visible parts, along one line direction: 1
    /// unless asked for.
    pub(super) fn smooth_factor(&self, at: &LightPoint, line: &Segment, parts: &[Interval]) -> f64 {
        let Some(Smooth { kind, width, .. }) = &self.smoothing else {
            return 1.0;
        };
        let (t, length) = (parameter(line, at.point), line.length());
        let Some(k) = piece_of(t, parts) else {
            return 1.0;
        };
        let part = parts[k];
        let before = k.checked_sub(1).map_or(0.0, |j| parts[j].hi);
        let after = parts.get(k + 1).map_or(1.0, |p| p.lo);
        let gap = |hidden: f64| match kind {
            Smoothing::Fixed if hidden > LEAST_GAP => f64::INFINITY,
            _ => hidden * length,
        };
        let (lo, hi) = (part.lo * length, part.hi * length);
        let gaps = (gap(part.lo - before), gap(after - part.hi));
        smoothing::visible_interval(t * length, lo, hi, gaps.0, gaps.1, *width)
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

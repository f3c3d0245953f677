//! This module samples lines along the side of a cylinder, and points on their visible parts.

use super::along::Along;
use super::cylinder::Slice;
use crate::line::by_length::is_visible;
use crate::{ChordMeasure, Cylinder, CylinderView, sample_linear};
use crate::{LineSample, Offset, Pdf, Pieces, PointSample, PointTechnique, SolidAngle};
use core::f64::consts::{PI, TAU};
use linelit_elementary::{acos, asin, atan2, hypot, sin, sin_cos};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{DVec3, Segment};

/// The number of pieces on which the density of a line's angle is linear.
const PIECES: usize = 12;
/// The ends of the pieces as angles of incidence, measured from the midpoint of the range and in
/// units of half of the range. They are closer together towards the rim, where the distance of a
/// line behaves as the square root of its distance from the rim.
const ENDS: [f64; PIECES + 1] = [
    -1.0, -0.974, -0.887, -0.735, -0.526, -0.274, 0.0, 0.274, 0.526, 0.735, 0.887, 0.974, 1.0,
];

/// The smallest density on a piece, as a fraction of the mean, where a horizon cuts the strip: the
/// part above the horizon may be smaller than a piece.
const LEAST: f64 = 0.05;

/// Lines along the axis on the strip of a cylinder that faces a shading point and is above its
/// horizons, and points on the visible parts of these lines.
///
/// **Formula**: a line is drawn by the angle α between it and the axis, as seen from the shading
/// point ([`CylinderView`]). The angle is uniform, or its density is interpolated linearly between
/// thirteen values of the line's length, or of the solid angle or projected solid angle of the
/// strip per dα. Points are uniform in the same measure on the visible parts. The density that is
/// returned is the interpolated one.
///
/// **Units**: offsets are Rφ, lengths around the cylinder from the line nearest to the shading
/// point. Densities of offsets are in 1/m; densities of points, joint densities of line and point,
/// are in 1/sr. **Domain**: any shading point outside the infinite cylinder. Elsewhere, and where
/// no part is above the horizons, all densities are zero. **Accuracy**: where no horizon cuts the
/// strip, the largest density of points by solid angle is within 1 % of the smallest, and within 20
/// % from steeply beyond an end.
///
/// **Source**: lines and their joint densities for polygons are in Billen & Dutré 2016, section 4,
/// and Salesin & Jarosz 2019, eqs. 12–19.
///
/// ```
/// use linelit_lights::geometry::{DVec3, Segment, intervals::Interval};
/// use linelit_lights::{ChordMeasure, Cylinder, CylinderLines};
/// let axis = Segment::new(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// let tube = Cylinder { axis, radius: 0.5 };
/// let lines = CylinderLines::new(&tube, DVec3::ZERO, &[DVec3::Z], ChordMeasure::SolidAngle);
/// // Half way is the nearest.
/// let line = lines.sample(0.5);
/// assert!((line.segment.p0.z - 1.5).abs() < 1e-15 && line.offset.abs() < 1e-15);
/// let visible = [Interval::new(0.0, 0.25), Interval::new(0.5, 1.0)];
/// let sample = lines.point(&line, &visible, 0.5);
/// let again = lines.joint_pdf(sample.point, &visible);
/// assert!((sample.pdf.value() / again.value() - 1.0).abs() < 1e-13);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CylinderLines {
    /// The view; `None` where no line can be drawn.
    view: Option<CylinderView>,
    along: Along,
    /// The horizons that cut the strip: the heights of both ends of the axis above a horizon, and
    /// what is added in the directions towards the shading point and across.
    cuts: [[f64; 4]; 2],
    cut_count: usize,
    /// The number of pieces; one if the density is constant.
    count: usize,
    /// The angles α at the ends of the pieces, and the densities there.
    angles: [f64; PIECES + 1],
    density: [f64; PIECES + 1],
    pieces: Pieces,
}

impl CylinderLines {
    /// Sets up the lines for the shading point `x` and the unit normals of its horizons. Normals
    /// after the second are ignored.
    #[must_use]
    pub fn new(cylinder: &Cylinder, x: DVec3, horizons: &[DVec3], measure: ChordMeasure) -> Self {
        match CylinderView::new(cylinder, x) {
            Some(view) => Self::of(&view, horizons, measure),
            None => Self::nothing(x, horizons, measure),
        }
    }

    /// Sets up the technique for a cylinder of which no line can be drawn: every density is 0.
    fn nothing(x: DVec3, horizons: &[DVec3], measure: ChordMeasure) -> Self {
        let normal = horizons.first().copied().unwrap_or(DVec3::Z);
        Self {
            view: None,
            along: Along { x, normal, measure },
            cuts: [[0.0; 4]; 2],
            cut_count: 0,
            count: 1,
            angles: [0.0; PIECES + 1],
            density: [0.0; PIECES + 1],
            pieces: Pieces::default(),
        }
    }

    /// Sets up the lines of a view.
    #[must_use]
    pub fn of(view: &CylinderView, horizons: &[DVec3], measure: ChordMeasure) -> Self {
        let mut out = Self::nothing(view.x, horizons, measure);
        let axis = view.cylinder.axis.relative_to(view.x);
        let half = view.half_turn();
        let (mut low, mut high) = (-half, half);
        // Restrict the azimuths by each horizon that cuts the strip.
        for (k, n) in horizons.iter().enumerate().take(2) {
            let [a, b] = [0, 1].map(|k| n.dot(view.axes[k]) * view.cylinder.radius);
            let [h0, h1] = [axis.p0, axis.p1].map(|p| n.dot(p));
            let rise = hypot(a, b);
            if h0.min(h1) >= rise || horizons[..k].contains(n) {
                continue;
            }
            out.cuts[out.cut_count] = [h0, h1, a, b];
            out.cut_count += 1;
            let Some((from, to)) = above(h0.max(h1), a, b, half) else {
                return out;
            };
            (low, high) = (low.max(from), high.min(to));
        }
        if low < high {
            out.view = Some(*view);
            out.spread(view, low, high);
        }
        out
    }

    /// Sets up the density of angles between two azimuths.
    fn spread(&mut self, view: &CylinderView, low: f64, high: f64) {
        // Convert the azimuths to α and to the angle of incidence, φ + α.
        let rim = view.half_angle();
        let ends = [low, high].map(|turn| {
            let (s, c) = sin_cos(turn);
            let alpha = view.angle_of(&view.at_azimuth(s, c));
            (alpha.clamp(-rim, rim), turn + alpha)
        });
        let measure = self.along.measure;
        let is_whole = self.cut_count == 0;
        // A constant density needs one piece; otherwise tabulate the measure at the ends of pieces.
        if measure == ChordMeasure::Uniform || (is_whole && measure == ChordMeasure::Length) {
            self.count = 1;
            self.density = [1.0; PIECES + 1];
        } else {
            self.count = PIECES;
            let [middle, half] = [1.0, -1.0].map(|sign| 0.5 * (ends[1].1 + sign * ends[0].1));
            let is_even = is_whole && measure == ChordMeasure::SolidAngle;
            for (k, end) in ENDS.iter().enumerate() {
                if is_even && k > PIECES / 2 {
                    self.angles[k] = -self.angles[PIECES - k];
                    self.density[k] = self.density[PIECES - k];
                    continue;
                }
                let sine = sin(middle + half * end);
                self.angles[k] = asin(view.k * sine);
                self.density[k] = self.line_measure(view, &view.at_incidence(sine).0);
            }
            if !is_whole {
                let mean = self.density.iter().sum::<f64>() / (PIECES + 1) as f64;
                let least = if mean > 0.0 { LEAST * mean } else { 1.0 };
                self.density = self.density.map(|d| d + least);
            }
        }
        (self.angles[0], self.angles[self.count]) = (ends[0].0, ends[1].0);
        let (angles, density) = (self.angles, self.density);
        let weight = |k| (angles[k + 1] - angles[k]) * 0.5 * (density[k] + density[k + 1]);
        self.pieces = Pieces::new((0..self.count).map(weight));
        if !self.pieces.is_usable() {
            self.view = None;
        }
    }

    /// Returns the measure of the part of a line above the horizons, per dα.
    fn line_measure(&self, view: &CylinderView, slice: &Slice) -> f64 {
        let Some([from, to]) = self.extent(slice) else {
            return 0.0;
        };
        match self.along.measure {
            ChordMeasure::Uniform | ChordMeasure::Length => to - from,
            ChordMeasure::SolidAngle => view.solid_angle(slice, [from, to]),
            ChordMeasure::Projected => {
                let line = view.line(slice).piece(from, to);
                let measure = self.along.thin(&line).map_or(0.0, |thin| thin.measure());
                measure * slice.distance
            }
        }
    }

    /// Returns the part of a line above the horizons.
    fn part_above(&self, view: &CylinderView, slice: &Slice) -> Option<Segment> {
        let whole = view.line(slice);
        if self.cut_count == 0 {
            return Some(whole);
        }
        let [from, to] = self.extent(slice)?;
        Some(whole.piece(from, to))
    }

    /// Returns the ends of the part of a line above the horizons, as fractions of the cylinder.
    fn extent(&self, slice: &Slice) -> Option<[f64; 2]> {
        let [mut from, mut to] = [0.0_f64, 1.0_f64];
        for [h0, h1, a, b] in &self.cuts[..self.cut_count] {
            let turn = a * slice.cos + b * slice.sin;
            let (g0, g1) = (h0 + turn, h1 + turn);
            if g0 <= 0.0 && g1 <= 0.0 {
                return None;
            }
            if g0 < 0.0 {
                from = from.max(g0 / (g0 - g1));
            } else if g1 < 0.0 {
                to = to.min(g0 / (g0 - g1));
            }
        }
        (from < to).then_some([from, to])
    }

    /// Returns the unit direction of the lines; zero where there are no lines.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        self.view.map_or(DVec3::ZERO, |view| view.axes[2])
    }

    /// Returns the line through a point of the cylinder. It has no length where no part of it is
    /// above the horizons, and for points outside the visible strip.
    #[must_use]
    pub fn through(&self, point: DVec3) -> Segment {
        let line = self.view.and_then(|view| {
            let (slice, _) = view.locate(point)?;
            self.part_above(&view, &slice)
        });
        line.unwrap_or_default()
    }

    /// Returns the height of the shading point above the plane that touches the cylinder in a line.
    #[must_use]
    pub fn height(&self, line: &LineSample) -> f64 {
        self.view
            .map_or(0.0, |view| slice_at(&view, line.offset).height)
    }

    /// Samples a line from one random number in [0, 1), and returns it with the density of its
    /// offset. The density is 0 where no line can be sampled: skip the sample. A line of which no
    /// part is above the horizons has no length, but keeps its density.
    #[must_use]
    pub fn sample(&self, u: f64) -> LineSample {
        let Some(view) = &self.view else {
            return LineSample::none(0.0);
        };
        let (piece, place) = self.pieces.pick(u);
        let place = sample_linear(place, self.density[piece], self.density[piece + 1]);
        let width = self.angles[piece + 1] - self.angles[piece];
        let (slice, cosine) = view.at_angle(self.angles[piece] + width * place);
        let density = self.angle_density(piece, place) * cosine / slice.distance;
        LineSample {
            segment: self.part_above(view, &slice).unwrap_or_default(),
            offset: view.cylinder.radius * atan2(slice.sin, slice.cos),
            pdf: Pdf::new(density),
        }
    }

    /// Returns the density of the angle, per radian, at a position in a piece.
    fn angle_density(&self, piece: usize, place: f64) -> f64 {
        let [a, b] = [self.density[piece], self.density[piece + 1]];
        (a + (b - a) * place) / self.pieces.total()
    }

    /// Returns the piece that contains a line's angle, and the position in it; `None` outside the
    /// range.
    fn piece_of(&self, view: &CylinderView, slice: &Slice) -> Option<(usize, f64)> {
        let alpha = view.angle_of(slice);
        let [first, last] = [self.angles[0], self.angles[self.count]];
        let slack = 64.0 * f64::EPSILON * (last - first);
        if !(alpha >= first - slack && alpha <= last + slack) {
            return None;
        }
        let inner = &self.angles[1..self.count];
        let piece = inner.iter().take_while(|end| **end <= alpha).count();
        let (from, to) = (self.angles[piece], self.angles[piece + 1]);
        Some((piece, fraction((alpha - from) / (to - from))))
    }

    /// Returns the density in 1/m with which [`CylinderLines::sample`] gives the line at an offset
    /// Rφ from the nearest line; 0 outside the range.
    #[must_use]
    pub fn offset_pdf(&self, offset: f64) -> Pdf<Offset> {
        let Some(view) = &self.view else {
            return Pdf::ZERO;
        };
        let slice = slice_at(view, offset);
        if !(slice.height > 0.0 && offset.abs() < PI * view.cylinder.radius) {
            return Pdf::ZERO;
        }
        let density = self.piece_of(view, &slice).map_or(0.0, |(piece, place)| {
            self.angle_density(piece, place) * slice.height / (slice.distance * slice.distance)
        });
        Pdf::new(density)
    }

    /// Returns the random number in [0, 1) from which [`CylinderLines::sample`] gives the line at
    /// an offset; `None` where its density is zero.
    #[must_use]
    pub fn invert_offset(&self, offset: f64) -> Option<f64> {
        let view = self.view.as_ref()?;
        self.offset_pdf(offset)
            .is_positive()
            .then(|| self.number_of(view, &slice_at(view, offset)))?
    }

    /// Returns the random number of a line; `None` outside the range.
    fn number_of(&self, view: &CylinderView, slice: &Slice) -> Option<f64> {
        let (piece, place) = self.piece_of(view, slice)?;
        let [a, b] = [self.density[piece], self.density[piece + 1]];
        let below = place * (2.0 * a + (b - a) * place) / (a + b);
        Some(self.pieces.unpick(piece, below))
    }

    /// Samples a point of the visible part of a line from one random number in [0, 1), and returns
    /// it with the joint density of line and point. `visible` holds disjoint ascending intervals of
    /// the line's parameter. The density is 0 where no part is visible.
    #[must_use]
    pub fn point(
        &self,
        line: &LineSample,
        visible: &[Interval],
        xi: f64,
    ) -> PointSample<SolidAngle> {
        let segment = &line.segment;
        let found = self
            .view
            .and_then(|view| Some((view, self.along.place(segment, visible, xi)?)));
        let Some((view, (t, total))) = found else {
            return PointSample::none(segment.p0);
        };
        let (point, slice) = (segment.at(t), slice_at(&view, line.offset));
        let angle = line.pdf.value() * slice.distance * slice.distance / slice.height;
        PointSample::at(point, self.joint(point, &slice, angle, total))
    }

    /// Returns the joint density with which [`CylinderLines::sample`] gives the line through a
    /// point of the cylinder, and [`CylinderLines::point`] the point on it; `visible` holds the
    /// visible intervals of that line. The density is 0 where the point is hidden, below a horizon
    /// or outside the visible strip.
    #[must_use]
    pub fn joint_pdf(&self, point: DVec3, visible: &[Interval]) -> Pdf<SolidAngle> {
        let Some((view, slice, line, t)) = self.line_at(point) else {
            return Pdf::ZERO;
        };
        let Some((piece, place)) = self
            .piece_of(&view, &slice)
            .filter(|_| is_visible(t, visible))
        else {
            return Pdf::ZERO;
        };
        let total = self.along.visible_measure(&line, visible);
        self.joint(point, &slice, self.angle_density(piece, place), total)
    }

    /// Returns the part above the horizons of the line through a point, and the point's parameter
    /// there.
    fn line_at(&self, point: DVec3) -> Option<(CylinderView, Slice, Segment, f64)> {
        let view = self.view?;
        let (slice, place) = view.locate(point)?;
        let [from, to] = self.extent(&slice)?;
        let t = (place - from) / (to - from);
        let length = view.cylinder.axis.length() * (to - from);
        let slack = 64.0 * f64::EPSILON * (1.0 + point.abs().max_element() / length);
        let line = view.line(&slice).piece(from, to);
        (t >= -slack && t <= 1.0 + slack).then(|| (view, slice, line, fraction(t)))
    }

    /// Returns the joint density at a point of a line whose angle has the density `angle`: a strip
    /// dα has dΩ = D²/d³ dα dz.
    fn joint(&self, point: DVec3, slice: &Slice, angle: f64, visible: f64) -> Pdf<SolidAngle> {
        let to = point - self.along.x;
        let (d, near) = (to.length(), slice.distance);
        let density = match self.along.measure {
            ChordMeasure::Uniform | ChordMeasure::Length => d / near * (d / near) * d / visible,
            ChordMeasure::SolidAngle => 2.0 / (near * visible),
            ChordMeasure::Projected => 2.0 * self.along.normal.dot(to) / (d * near * visible),
        };
        Pdf::new(angle * density)
    }
}

/// Returns the line at an offset.
fn slice_at(view: &CylinderView, offset: f64) -> Slice {
    let (s, c) = sin_cos(offset / view.cylinder.radius);
    view.at_azimuth(s, c)
}

/// Returns the smallest and the largest azimuth within ±`half` at which `c + a cos φ + b sin φ` is
/// positive; `None` if it is positive nowhere.
fn above(c: f64, a: f64, b: f64, half: f64) -> Option<(f64, f64)> {
    let rise = hypot(a, b);
    if c >= rise {
        return Some((-half, half));
    }
    if c <= -rise {
        return None;
    }
    // The expression is c + rise · cos(φ − middle): find its zeros within the range.
    let (middle, width) = (atan2(b, a), acos(-c / rise));
    let within = |turn: f64| {
        let turn = turn - TAU * (turn / TAU).round();
        (turn.abs() < half).then_some(turn)
    };
    let is_above = |turn: f64| {
        let (s, c0) = sin_cos(turn);
        c + a * c0 + b * s > 0.0
    };
    let from = if is_above(-half) {
        -half
    } else {
        within(middle - width)?
    };
    let to = if is_above(half) {
        half
    } else {
        within(middle + width)?
    };
    Some((from, to))
}

/// Points are drawn without regard to occluders: the first random number chooses the line, and the
/// second the point on it.
impl PointTechnique for CylinderLines {
    type Measure = SolidAngle;

    fn sample(&self, [across, along]: [f64; 2]) -> PointSample<SolidAngle> {
        self.point(&self.sample(across), &[Interval::UNIT], along)
    }

    fn pdf(&self, point: DVec3) -> Pdf<SolidAngle> {
        self.joint_pdf(point, &[Interval::UNIT])
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        if !PointTechnique::pdf(self, point).is_positive() {
            return None;
        }
        let (view, slice, line, t) = self.line_at(point)?;
        let along = self.along.below(&line, t)?;
        Some([self.number_of(&view, &slice)?, below_one(along)])
    }
}

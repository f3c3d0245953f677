//! This module samples parallel lines of a polygon, with offsets that are uniform or in proportion
//! to the length of the line (Billen & Dutré 2016, §4 and §5.1).

use crate::LineTechnique;
use crate::density::{Area, Length, Offset, Pdf};
use crate::pieces::sample_linear;
use crate::samples::{LineSample, PointSample};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines};

/// The density of the offsets of lines (Billen & Dutré 2016, §5.1.2, Fig. 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OffsetDensity {
    /// Constant over the range [a, b]: `1/(b − a)`.
    Uniform,
    /// Proportional to the length of the line: `l(u)/A`, the marginal of a density that is uniform
    /// by area.
    Length,
}

/// A technique that samples parallel lines on a convex polygon.
///
/// **Accuracy**: the CDF is linear (uniform) or piecewise quadratic (by length) in the offset. The
/// latter is inverted piece by piece by `s = ξ(l₀ + l₁)/(l₀ + √((1−ξ) l₀² + ξ l₁²))`, which has no
/// cancellation. Round trips are accurate to a few ε of the range, divided by the density relative
/// to its mean.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{LineSampler, LineTechnique, OffsetDensity};
/// let light = ConvexPolygon::triangle(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap();
/// // Lines along the first edge: their length shrinks from 1 to 0, so that half of them lie
/// // below 1 − √½.
/// let sampler = LineSampler::new(&light, 0.0, OffsetDensity::Length);
/// let line = sampler.sample(0.5);
/// assert!((line.offset - (1.0 - 0.5f64.sqrt())).abs() < 1e-15);
/// assert!((line.pdf.value() - 2.0 * line.segment.length()).abs() < 1e-14);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct LineSampler {
    lines: ParallelLines,
    density: OffsetDensity,
    /// The area below each knot.
    cumulative: [f64; ConvexPolygon::CAPACITY],
}

impl LineSampler {
    /// Sets up lines at `angle_rad` from the polygon's first edge, counter-clockwise about its
    /// normal.
    #[must_use]
    pub fn new(polygon: &ConvexPolygon, angle_rad: f64, density: OffsetDensity) -> Self {
        // The value is large: it is built where it is stored.
        let mut out = Self {
            lines: ParallelLines::new(polygon, angle_rad),
            density,
            cumulative: [0.0; ConvexPolygon::CAPACITY],
        };
        for k in 1..out.lines.knots().len() {
            let (w, l0, l1) = out.piece(k);
            out.cumulative[k] = out.cumulative[k - 1] + 0.5 * w * (l0 + l1);
        }
        out
    }

    /// Returns the width of the piece below knot `k`, and the lengths of the lines at its ends.
    fn piece(&self, k: usize) -> (f64, f64, f64) {
        let (u, lo, hi) = (self.lines.knots(), self.lines.lower(), self.lines.upper());
        let length = |k: usize| (hi[k] - lo[k]).max(0.0);
        (u[k] - u[k - 1], length(k - 1), length(k))
    }

    /// Returns the area of the polygon.
    fn area(&self) -> f64 {
        self.cumulative[self.lines.knots().len() - 1]
    }

    /// Inverts the CDF of offsets by length.
    fn by_length(&self, u: f64) -> f64 {
        let knots = self.lines.knots();
        let target = u * self.area();
        let last = knots.len() - 1;
        let Some(k) = (1..=last).find(|&k| target < self.cumulative[k] || k == last) else {
            return knots[0];
        };
        let (w, l0, l1) = self.piece(k);
        let whole = self.cumulative[k] - self.cumulative[k - 1];
        if whole <= 0.0 {
            return knots[k - 1];
        }
        let xi = fraction((target - self.cumulative[k - 1]) / whole);
        at_most(knots[k - 1] + w * sample_linear(xi, l0, l1), knots[k])
    }

    /// Returns the joint density of an offset and a uniform point on the visible length.
    fn joint(offset: Pdf<Offset>, visible_length: f64) -> Pdf<Area> {
        offset.joint(Pdf::<Length>::new(1.0 / visible_length))
    }
}

impl LineTechnique for LineSampler {
    type Measure = Area;

    fn lines(&self) -> &ParallelLines {
        &self.lines
    }

    fn sample(&self, u: f64) -> LineSample {
        let (a, b) = self.lines.range();
        let u = fraction(u);
        let offset = match self.density {
            OffsetDensity::Uniform => at_most(a + u * (b - a), b),
            OffsetDensity::Length => self.by_length(u),
        };
        let Some(ends) = self.lines.extent(offset) else {
            return LineSample::none(offset);
        };
        LineSample {
            segment: self.lines.segment_between(offset, ends),
            offset,
            pdf: Pdf::new(match self.density {
                OffsetDensity::Uniform => 1.0 / (b - a),
                OffsetDensity::Length => (ends.1 - ends.0) / self.area(),
            }),
        }
    }

    fn pdf(&self, offset: f64) -> Pdf<Offset> {
        let (a, b) = self.lines.range();
        match self.density {
            OffsetDensity::Uniform if (a..=b).contains(&offset) => Pdf::new(1.0 / (b - a)),
            OffsetDensity::Uniform => Pdf::ZERO,
            OffsetDensity::Length => Pdf::new(self.lines.length(offset) / self.area()),
        }
    }

    fn invert(&self, offset: f64) -> Option<f64> {
        let (a, b) = self.lines.range();
        if !(a..=b).contains(&offset) || !self.pdf(offset).is_positive() {
            return None;
        }
        let u = match self.density {
            OffsetDensity::Uniform => (offset - a) / (b - a),
            OffsetDensity::Length => {
                let knots = self.lines.knots();
                let last = knots.len() - 1;
                let k = (1..last).find(|&k| offset < knots[k]).unwrap_or(last);
                let (w, l0, l1) = self.piece(k);
                let d = offset - knots[k - 1];
                let below = d * (l0 + 0.5 * (l1 - l0) * (d / w));
                (self.cumulative[k - 1] + below) / self.area()
            }
        };
        Some(below_one(u))
    }

    fn point(&self, line: &LineSample, visible: &[Interval], xi: f64) -> PointSample<Area> {
        let (t, total) = Width::Even.place(visible, xi);
        if total > 0.0 {
            let pdf = Self::joint(line.pdf, line.segment.length() * total);
            PointSample::at(line.segment.at(t), pdf)
        } else {
            PointSample::none(line.segment.p0)
        }
    }

    fn joint_pdf(&self, point: DVec3, visible: &[Interval]) -> Pdf<Area> {
        match locate(&self.lines, point) {
            Some((u, t)) if is_visible(t, visible) => {
                Self::joint(self.pdf(u), self.lines.length(u) * measure(visible))
            }
            _ => Pdf::ZERO,
        }
    }

    fn invert_point(&self, point: DVec3, visible: &[Interval]) -> Option<[f64; 2]> {
        let (u, t) = locate(&self.lines, point).filter(|(_, t)| is_visible(*t, visible))?;
        let below: f64 = visible
            .iter()
            .map(within)
            .map(|i| (t.min(i.hi) - i.lo).max(0.0))
            .sum();
        Some([self.invert(u)?, below_one(below / measure(visible))])
    }
}

/// The width of the strip that a line represents, as a function of the position along the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Width {
    /// The full width everywhere, as between parallel lines.
    #[default]
    Even,
    /// A width that grows from zero at the beginning of the line to the full width at its end, as
    /// between lines that all begin in one point ([`AreaSampler::line`](crate::AreaSampler::line)).
    Growing,
}

impl Width {
    /// Returns a parameter t in [0, 1] on the visible part of a line, uniform in the area of its
    /// strip, for one random number. Also returns ∫ w dt over the visible part, where w is the
    /// strip's width as a fraction of the full width.
    #[inline]
    #[must_use]
    pub fn place(self, visible: &[Interval], xi: f64) -> (f64, f64) {
        match (self, visible) {
            (Self::Even, [part]) => {
                let part = within(part);
                let total = part.length();
                (at_most(part.lo + fraction(xi) * total, part.hi), total)
            }
            (Self::Even, _) => among(visible.iter().map(within), fraction(xi)),
            (Self::Growing, _) => {
                let parts = visible.iter().map(within);
                let squares = parts.map(|part| Interval::new(part.lo * part.lo, part.hi * part.hi));
                let (square, total) = among(squares, fraction(xi));
                (square.sqrt(), 0.5 * total)
            }
        }
    }
}

/// Returns the offset and the line parameter of a point of the light; `None` outside the light.
/// Both are clamped within the rounding of the coordinates (64 ε).
pub(crate) fn locate(lines: &ParallelLines, point: DVec3) -> Option<(f64, f64)> {
    let (u, v) = lines.coordinates(point);
    let (a, b) = lines.range();
    let slack = 64.0 * f64::EPSILON * (b - a + point.abs().max_element());
    if !(u >= a - slack && u <= b + slack && slack < f64::INFINITY) {
        return None;
    }
    let u = u.clamp(a, b);
    let (lo, hi) = lines.extent(u)?;
    if !(v >= lo - slack && v <= hi + slack) {
        return None;
    }
    let t = if hi > lo {
        fraction((v - lo) / (hi - lo))
    } else {
        0.5
    };
    Some((u, t))
}

/// Whether the parameter is in one of the intervals, up to the rounding of their ends.
pub(crate) fn is_visible(t: f64, visible: &[Interval]) -> bool {
    let slack = 16.0 * f64::EPSILON;
    visible
        .iter()
        .any(|i| t >= i.lo - slack && t <= i.hi + slack)
}

/// Returns the part of an interval that is in [0, 1]; empty if there is none.
#[inline(always)]
pub(crate) fn within(part: &Interval) -> Interval {
    let (lo, hi) = (fraction(part.lo), fraction(part.hi));
    Interval::new(lo, if hi > lo { hi } else { lo })
}

/// Returns the total length of the intervals.
fn measure(visible: &[Interval]) -> f64 {
    visible.iter().map(|part| within(part).length()).sum()
}

/// Returns the smaller of two numbers; `most` must not be NaN, `x` may be.
#[inline(always)]
fn at_most(x: f64, most: f64) -> f64 {
    if x < most { x } else { most }
}

/// Returns the position below which the fraction `xi` of the intervals' length lies, and that
/// length.
fn among(visible: impl Iterator<Item = Interval> + Clone, xi: f64) -> (f64, f64) {
    let total = visible.clone().map(|part| part.length()).sum();
    let (mut rest, mut t) = (xi * total, 0.0);
    for part in visible {
        t = at_most(part.lo + rest, part.hi);
        if rest < part.length() {
            break;
        }
        rest -= part.length();
    }
    (t, total)
}

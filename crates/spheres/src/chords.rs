//! Parallel lines across a disk: chords, and points on what is visible of them.

use crate::along::{Along, holds};
use core::f64::consts::PI;
use linelit_elementary::{atan2, hypot, sin, sin_cos};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{DVec3, Frame, Segment, predicates};
use linelit_lights::sample_linear;
use linelit_lights::{Disk, LineSample, Pdf, Pieces, PointSample, PointTechnique, SolidAngle};

/// The measure of chords and of points on them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChordMeasure {
    /// Offsets uniform between the first chord and the last, points uniform in length.
    Uniform,
    /// Offsets in proportion to length, points uniform in length: uniform in area.
    Length,
    /// Offsets in proportion to solid angle, points uniform in solid angle.
    SolidAngle,
    /// The same by projected solid angle, over the first of the horizons.
    Projected,
}

/// Pieces on which the density of the offset's angle is linear.
const PIECES: usize = 16;
/// The angle of a piece.
const STEP: f64 = PI / PIECES as f64;
/// Sines of whole steps.
const SINES: [f64; PIECES / 2 + 1] = [
    0.0,
    0.195_090_322_016_128_25,
    0.382_683_432_365_089_8,
    0.555_570_233_019_602_2,
    core::f64::consts::FRAC_1_SQRT_2,
    0.831_469_612_302_545_2,
    0.923_879_532_511_286_7,
    0.980_785_280_403_230_4,
    1.0,
];

/// Parallel chords of the part of a disk above the horizons of a shading point, and points on their
/// visible parts.
///
/// **Formula**: the offset across the chords is `u = m + h sin φ` between the least, m − h, and the
/// largest of that part; φ is drawn by the linear interpolation between sixteenths of a half turn
/// of `μ(u) cos φ`, μ the measure of the chord: its length, or `z/(2d)` times its (projected) solid
/// angle per radius, with z the height of the shading point over the disk's plane and d its
/// distance from the chord's line. Points are uniform in that measure on what is visible. The
/// density is that of what is drawn.
///
/// **Units**: densities of offsets in 1/m, of points in 1/sr, the joint one of chord and point.
/// **Domain**: any shading point off the disk's plane; in it, and where nothing is above the
/// horizons, all densities are zero. **Accuracy**: unoccluded, the density of offsets is within 2 %
/// of what it stands for in the middle half; at the ends, where that goes to zero, it is larger.
///
/// **Source**: lines and their joint densities are those of Billen & Dutré 2016, section 4, and
/// Salesin & Jarosz 2019, eqs. 12–19, for polygons.
///
/// ```
/// use linelit_spheres::geometry::{DVec3, intervals::Interval};
/// use linelit_spheres::lights::Disk;
/// use linelit_spheres::{ChordMeasure, DiskChords};
/// let disk = Disk { center: DVec3::Z, normal: -DVec3::Z, radius: 0.5 };
/// let chords = DiskChords::new(&disk, 0.3, DVec3::ZERO, &[DVec3::Z], ChordMeasure::SolidAngle);
/// let chord = chords.sample(0.5);
/// // Half way, the chord is a diameter.
/// assert!((chord.segment.length() - 1.0).abs() < 1e-14);
/// let visible = [Interval::new(0.0, 0.25), Interval::new(0.5, 1.0)];
/// let sample = chords.point(&chord, &visible, 0.5);
/// let again = chords.joint_pdf(sample.point, &visible);
/// assert!((sample.pdf.value() / again.value() - 1.0).abs() < 1e-13);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct DiskChords {
    disk: Disk,
    /// The shading point, and the measure along chords.
    along: Along,
    /// Along the chords, and across.
    axes: [DVec3; 2],
    /// The height of the shading point over the plane.
    z: f64,
    /// Horizons that cut the disk: a, b, c of what is above, `a v + b u + c ≥ 0`.
    cuts: [[f64; 3]; 2],
    cut_count: usize,
    /// The middle of the offsets and half their range.
    middle: f64,
    half: f64,
    /// μ cos φ at the ends of the pieces.
    density: [f64; PIECES + 1],
    pieces: Pieces,
}

impl DiskChords {
    /// Chords at `angle_rad` from a fixed direction of the disk's plane, counter-clockwise about
    /// its normal, for the shading point `x` with the unit normals of its horizons, of which those
    /// after the second count for nothing.
    #[must_use]
    pub fn new(
        disk: &Disk,
        angle_rad: f64,
        x: DVec3,
        horizons: &[DVec3],
        measure: ChordMeasure,
    ) -> Self {
        let frame = Frame::from_normal(disk.normal);
        let (s, c) = sin_cos(angle_rad);
        let axes = [frame.x * c + frame.y * s, frame.y * c - frame.x * s];
        let to = disk.center - x;
        let along = Along {
            x,
            normal: horizons.first().copied().unwrap_or(disk.normal),
            measure,
        };
        let mut out = Self {
            disk: *disk,
            along,
            axes,
            z: predicates::dot(to, disk.normal).abs(),
            cuts: [[0.0; 3]; 2],
            cut_count: 0,
            middle: 0.0,
            half: 0.0,
            density: [0.0; PIECES + 1],
            pieces: Pieces::new(core::iter::empty()),
        };
        let r = disk.radius;
        for n in horizons.iter().take(2) {
            let [a, b] = axes.map(|axis| n.dot(axis));
            let height = n.dot(to);
            let rise = r * hypot(a, b);
            if height + rise <= 0.0 {
                return out;
            }
            if height < rise {
                out.cuts[out.cut_count] = [a, b, height];
                out.cut_count += 1;
            }
        }
        let (low, high) = out.range_of_offsets();
        if !(high > low && out.z > 0.0 && (high - low).is_finite()) {
            return out;
        }
        (out.middle, out.half) = (0.5 * (low + high), 0.5 * (high - low));
        for k in 1..PIECES {
            let steps = k.abs_diff(PIECES / 2);
            let sine = SINES[steps];
            let sine = if k < PIECES / 2 { -sine } else { sine };
            out.density[k] =
                out.chord_measure(out.middle + out.half * sine) * SINES[PIECES / 2 - steps];
        }
        let density = out.density;
        out.pieces = Pieces::new((0..PIECES).map(|k| 0.5 * (density[k] + density[k + 1])));
        out
    }

    fn cuts(&self) -> &[[f64; 3]] {
        &self.cuts[..self.cut_count]
    }

    /// The least and the largest offset of the part of the disk above the horizons: of the disk
    /// itself, where a horizon cuts its rim, or where horizons cut each other.
    fn range_of_offsets(&self) -> (f64, f64) {
        let r = self.disk.radius;
        if self.cut_count == 0 {
            return (-r, r);
        }
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        let mut reach = |v: f64, u: f64, but: usize, other: usize| {
            let above = |(k, [a, b, c]): (usize, &[f64; 3])| {
                k == but || k == other || a * v + b * u + c >= 0.0
            };
            if self.cuts().iter().enumerate().all(above) {
                range = (range.0.min(u), range.1.max(u));
            }
        };
        reach(0.0, -r, usize::MAX, usize::MAX);
        reach(0.0, r, usize::MAX, usize::MAX);
        for (k, [a, b, c]) in self.cuts().iter().enumerate() {
            let slope = hypot(*a, *b);
            let (a, b, c) = (a / slope, b / slope, c / slope);
            let side = ((r - c) * (r + c)).max(0.0).sqrt();
            reach(-c * a - side * b, -c * b + side * a, k, k);
            reach(-c * a + side * b, -c * b - side * a, k, k);
        }
        if let [[a, b, c], [d, e, f]] = self.cuts() {
            let determinant = a * e - b * d;
            let (v, u) = ((b * f - c * e) / determinant, (c * d - a * f) / determinant);
            if hypot(v, u) < r {
                reach(v, u, 0, 1);
            }
        }
        (range.0.max(-r), range.1.min(r))
    }

    /// Where the chord at an offset begins and ends; `None` where nothing of it is above the
    /// horizons.
    fn extent(&self, offset: f64) -> Option<[f64; 2]> {
        let r = self.disk.radius;
        let half = ((r - offset) * (r + offset)).sqrt();
        let mut ends = [-half, half];
        for [a, b, c] in self.cuts() {
            let rest = b * offset + c;
            if *a > 0.0 {
                ends[0] = ends[0].max(-rest / a);
            } else if *a < 0.0 {
                ends[1] = ends[1].min(-rest / a);
            } else if rest < 0.0 {
                return None;
            }
        }
        (ends[1] > ends[0]).then_some(ends)
    }

    fn segment(&self, offset: f64, [from, to]: [f64; 2]) -> Segment {
        let [along, across] = self.axes;
        let middle = self.disk.center + across * offset;
        Segment::new(middle + along * from, middle + along * to)
    }

    fn chord_measure(&self, offset: f64) -> f64 {
        let Some(ends) = self.extent(offset) else {
            return 0.0;
        };
        match self.along.measure {
            ChordMeasure::Uniform | ChordMeasure::Length => ends[1] - ends[0],
            ChordMeasure::SolidAngle | ChordMeasure::Projected => self
                .along
                .thin(&self.segment(offset, ends))
                .map_or(0.0, |thin| thin.measure() * self.z / thin.distance()),
        }
    }

    /// Offset and place of a point, kept in the range against rounding; `None` beside the disk.
    fn locate(&self, point: DVec3) -> Option<[f64; 2]> {
        let out = point - self.disk.center;
        let [v, u] = self.axes.map(|axis| axis.dot(out));
        let slack = 64.0 * f64::EPSILON * (self.disk.radius + point.abs().max_element());
        let inside = (u - self.middle).abs() <= self.half + slack && slack < f64::INFINITY;
        let kept = u.clamp(self.middle - self.half, self.middle + self.half);
        inside.then_some([kept, v])
    }

    /// The unit direction of the chords.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        self.axes[0]
    }

    /// The chord through a point of the disk: without length where nothing of it is above the
    /// horizons, and beside the disk.
    #[must_use]
    pub fn through(&self, point: DVec3) -> Segment {
        let chord = self.locate(point).and_then(|[offset, _]| {
            let ends = self.extent(offset)?;
            Some(self.segment(offset, ends))
        });
        chord.unwrap_or_default()
    }

    /// A chord from one random number in [0, 1), with the density of its offset. Density 0 where
    /// nothing can be sampled: skip it.
    #[must_use]
    pub fn sample(&self, u: f64) -> LineSample {
        let sine = if self.along.measure == ChordMeasure::Uniform {
            2.0 * fraction(u) - 1.0
        } else {
            let (piece, place) = self.pieces.pick(u);
            let place = sample_linear(place, self.density[piece], self.density[piece + 1]);
            #[allow(clippy::cast_precision_loss, reason = "few pieces")]
            let angle = (piece as f64 + place - 0.5 * PIECES as f64) * STEP;
            sin(angle)
        };
        let offset = self.middle + self.half * sine;
        match self.extent(offset) {
            Some(ends) => LineSample {
                segment: self.segment(offset, ends),
                offset,
                pdf: self.offset_pdf(offset),
            },
            None => LineSample {
                segment: Segment::default(),
                offset,
                pdf: Pdf::ZERO,
            },
        }
    }

    /// The density in 1/m with which [`DiskChords::sample`] gives the chord at an offset from the
    /// centre; 0 beyond the range.
    #[must_use]
    pub fn offset_pdf(&self, offset: f64) -> Pdf<linelit_lights::Offset> {
        let sine = (offset - self.middle) / self.half;
        if !(self.pieces.is_usable() && sine.abs() <= 1.0) {
            return Pdf::ZERO;
        }
        if self.along.measure == ChordMeasure::Uniform {
            return Pdf::new(0.5 / self.half);
        }
        let cosine = ((1.0 - sine) * (1.0 + sine)).sqrt();
        let (piece, place) = place_of(sine, cosine);
        let ends = [piece, piece + 1].map(|k| match sine < 0.0 {
            true => self.density[k],
            false => self.density[PIECES - k],
        });
        let density = ends[0] + (ends[1] - ends[0]) * place;
        Pdf::new(density / (self.pieces.total() * STEP * self.half * cosine))
    }

    /// The random number in [0, 1) from which [`DiskChords::sample`] gives the chord at an offset;
    /// `None` where its density is zero.
    #[must_use]
    pub fn invert_offset(&self, offset: f64) -> Option<f64> {
        if !self.offset_pdf(offset).is_positive() {
            return None;
        }
        let sine = (offset - self.middle) / self.half;
        if self.along.measure == ChordMeasure::Uniform {
            return Some(below_one(0.5 * (sine + 1.0)));
        }
        let cosine = ((1.0 - sine) * (1.0 + sine)).sqrt();
        let (piece, place) = place_of(sine, cosine);
        let (piece, place) = match sine < 0.0 {
            true => (piece, place),
            false => (PIECES - 1 - piece, 1.0 - place),
        };
        let [a, b] = [self.density[piece], self.density[piece + 1]];
        let below = place * (2.0 * a + (b - a) * place) / (a + b);
        Some(self.pieces.unpick(piece, below))
    }

    /// A point of what is visible of a chord, from one random number in [0, 1), with the joint
    /// density of chord and point; `visible` holds disjoint ascending intervals of the chord's
    /// parameter. Density 0 where nothing is visible.
    #[must_use]
    pub fn point(
        &self,
        chord: &LineSample,
        visible: &[Interval],
        xi: f64,
    ) -> PointSample<SolidAngle> {
        let line = &chord.segment;
        let Some((t, total)) = self.along.place(line, visible, xi) else {
            return PointSample::none(line.p0);
        };
        let point = line.at(t);
        PointSample::at(point, self.joint(point, line, chord.pdf.value(), total))
    }

    /// The joint density with which [`DiskChords::sample`] gives the chord through a point of the
    /// disk and [`DiskChords::point`] the point; `visible` is what is visible of that chord. 0
    /// where the point is hidden, below a horizon or beside the disk.
    #[must_use]
    pub fn joint_pdf(&self, point: DVec3, visible: &[Interval]) -> Pdf<SolidAngle> {
        let Some((offset, line, t)) = self.chord_at(point) else {
            return Pdf::ZERO;
        };
        if !holds(visible, t) {
            return Pdf::ZERO;
        }
        let total = self.along.visible_measure(&line, visible);
        self.joint(point, &line, self.offset_pdf(offset).value(), total)
    }

    /// The chord through a point, its offset and the point's parameter.
    fn chord_at(&self, point: DVec3) -> Option<(f64, Segment, f64)> {
        let [offset, v] = self.locate(point)?;
        let ends = self.extent(offset)?;
        let t = (v - ends[0]) / (ends[1] - ends[0]);
        let slack = 64.0 * f64::EPSILON * (1.0 + point.abs().max_element() / (ends[1] - ends[0]));
        let inside = t >= -slack && t <= 1.0 + slack;
        inside.then(|| (offset, self.segment(offset, ends), fraction(t)))
    }

    /// The joint density at a point of a chord whose offset has the density `offset`.
    fn joint(&self, point: DVec3, line: &Segment, offset: f64, visible: f64) -> Pdf<SolidAngle> {
        let to = point - self.along.x;
        let r = to.length();
        let density = match self.along.measure {
            ChordMeasure::Uniform | ChordMeasure::Length => r * r * r / (self.z * visible),
            ChordMeasure::SolidAngle | ChordMeasure::Projected => {
                let Some(whole) = self.along.thin(line) else {
                    return Pdf::ZERO;
                };
                let cosine = match self.along.measure {
                    ChordMeasure::Projected => self.along.normal.dot(to) / r,
                    _ => 1.0,
                };
                2.0 * whole.distance() * cosine / (self.z * visible)
            }
        };
        Pdf::new(offset * density)
    }
}

/// The piece, counted from the nearer end, that the angle of a sine and cosine falls into, and the
/// place in it.
fn place_of(sine: f64, cosine: f64) -> (usize, f64) {
    let steps = atan2(cosine, sine.abs()) / STEP;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and half the pieces"
    )]
    let piece = (steps as usize).min(PIECES / 2 - 1);
    #[allow(clippy::cast_precision_loss, reason = "few pieces")]
    let place = steps - piece as f64;
    (piece, place)
}

/// With nothing in between: the first random number chooses the chord, the second the point.
impl PointTechnique for DiskChords {
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
        let (offset, line, t) = self.chord_at(point)?;
        let along = self.along.below(&line, t)?;
        Some([self.invert_offset(offset)?, below_one(along)])
    }
}

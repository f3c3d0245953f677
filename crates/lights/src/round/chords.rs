//! This module samples points of a disk by projected solid angle: it draws a chord, and a point on
//! it.

use super::along::Along;
use crate::ChordMeasure;
use crate::linear::ThinLine;
use crate::{Disk, Pdf, Pieces, PointSample, PointTechnique, SolidAngle, sample_linear};
use core::f64::consts::PI;
use linelit_elementary::{atan2, hypot, sin, sin_cos};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{DVec3, Frame, Segment, predicates};

/// The number of pieces on which the density of the offset's angle is linear.
const PIECES: usize = 16;
/// The angle of one piece of the half turn, in radians.
const STEP: f64 = PI / PIECES as f64;
/// The sines of the multiples of [`STEP`] up to a quarter turn.
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

/// A technique that samples the part of a disk above the horizons of a shading point, by projected
/// solid angle: it draws a chord of a given direction, and a point on it that is uniform in
/// projected solid angle.
///
/// **Formula**: the offset of the chord is `u = m + h sin φ` between the smallest, m − h, and the
/// largest offset of that part. The angle φ has the density `μ(u) cos φ`, linearly interpolated
/// between sixteenths of a half turn. Here μ is `z/d` times the projected solid angle of the chord
/// per radius, z is the height of the shading point above the disk's plane, and d its distance from
/// the chord's line. The density that is returned is the interpolated one.
///
/// **Units**: densities in 1/sr. **Domain**: any shading point outside the disk's plane. In the
/// plane, and where no part of the disk is above the horizons, all densities are zero.
/// **Accuracy**: in the middle half the interpolated density of offsets is within 2 % of the exact
/// one; at the ends, where the exact density goes to zero, the difference is larger.
///
/// **Source**: lines and their joint densities for polygons are in Billen & Dutré 2016, section 4,
/// and Salesin & Jarosz 2019, eqs. 12–19.
///
/// ```
/// use linelit_lights::geometry::DVec3;
/// use linelit_lights::{Disk, DiskChords, PointTechnique};
/// let disk = Disk { center: DVec3::Z, normal: -DVec3::Z, radius: 0.5 };
/// let points = DiskChords::new(&disk, 0.3, DVec3::ZERO, &[DVec3::Z]);
/// let sample = points.sample([0.5, 0.25]);
/// assert!((sample.pdf.value() / points.pdf(sample.point).value() - 1.0).abs() < 1e-13);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct DiskChords {
    disk: Disk,
    /// The shading point, and the measure along chords.
    along: Along,
    /// The unit vectors along the chords, and across them.
    axes: [DVec3; 2],
    /// The height of the shading point above the plane.
    z: f64,
    /// The horizons that cut the disk: a, b, c such that `a v + b u + c ≥ 0` above the horizon, for
    /// the point at the offset u across the chords and the position v along them.
    cuts: [[f64; 3]; 2],
    cut_count: usize,
    /// The midpoint of the range of offsets; the next field is half its length.
    middle: f64,
    half: f64,
    /// μ cos φ at the ends of the pieces.
    density: [f64; PIECES + 1],
    pieces: Pieces,
}

impl DiskChords {
    /// Sets the technique up for chords at `angle_rad` from a fixed direction of the disk's plane,
    /// counter-clockwise about its normal, for the shading point `x` and the unit normals of its
    /// horizons. Normals after the second are ignored.
    #[must_use]
    pub fn new(disk: &Disk, angle_rad: f64, x: DVec3, horizons: &[DVec3]) -> Self {
        let frame = Frame::from_normal(disk.normal);
        let (s, c) = sin_cos(angle_rad);
        let axes = [frame.x * c + frame.y * s, frame.y * c - frame.x * s];
        let to = disk.center - x;
        let along = Along {
            x,
            normal: horizons.first().copied().unwrap_or(disk.normal),
            measure: ChordMeasure::Projected,
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
        // Collect the horizons that cut the disk.
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
        // Tabulate μ cos φ at the ends of the pieces.
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

    /// Returns the smallest and the largest offset of the part of the disk above the horizons. An
    /// extreme offset is reached at the disk's own extremes, where a horizon cuts its rim, or where
    /// the horizons meet.
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
        // Try the extremes of the disk.
        reach(0.0, -r, usize::MAX, usize::MAX);
        reach(0.0, r, usize::MAX, usize::MAX);
        // Try the points where each horizon cuts the rim.
        for (k, [a, b, c]) in self.cuts().iter().enumerate() {
            let slope = hypot(*a, *b);
            let (a, b, c) = (a / slope, b / slope, c / slope);
            let side = ((r - c) * (r + c)).max(0.0).sqrt();
            reach(-c * a - side * b, -c * b + side * a, k, k);
            reach(-c * a + side * b, -c * b - side * a, k, k);
        }
        // Try the point where the horizons meet.
        if let [[a, b, c], [d, e, f]] = self.cuts() {
            let determinant = a * e - b * d;
            let (v, u) = ((b * f - c * e) / determinant, (c * d - a * f) / determinant);
            if hypot(v, u) < r {
                reach(v, u, 0, 1);
            }
        }
        (range.0.max(-r), range.1.min(r))
    }

    /// Returns the ends of the chord at an offset; `None` where no part of it is above the
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

    /// Returns the part of the chord at an offset between two ends.
    fn segment(&self, offset: f64, [from, to]: [f64; 2]) -> Segment {
        let [along, across] = self.axes;
        let middle = self.disk.center + across * offset;
        Segment::new(middle + along * from, middle + along * to)
    }

    /// Returns the measure μ of the chord at an offset (see [`DiskChords`]).
    fn chord_measure(&self, offset: f64) -> f64 {
        let Some(ends) = self.extent(offset) else {
            return 0.0;
        };
        let line = self.segment(offset, ends);
        let share = |thin: ThinLine| thin.measure() * self.z / thin.view().line_distance();
        self.along.thin(&line).map_or(0.0, share)
    }

    /// Returns the offset of a point, clamped to the range within rounding, and its position along
    /// the chord; `None` outside the disk.
    fn locate(&self, point: DVec3) -> Option<[f64; 2]> {
        let out = point - self.disk.center;
        let [v, u] = self.axes.map(|axis| axis.dot(out));
        let slack = 64.0 * f64::EPSILON * (self.disk.radius + point.abs().max_element());
        let inside = (u - self.middle).abs() <= self.half + slack && slack < f64::INFINITY;
        let kept = u.clamp(self.middle - self.half, self.middle + self.half);
        inside.then_some([kept, v])
    }

    /// Draws an offset from one random number in [0, 1).
    fn sample_offset(&self, u: f64) -> f64 {
        let (piece, place) = self.pieces.pick(u);
        let place = sample_linear(place, self.density[piece], self.density[piece + 1]);
        #[allow(clippy::cast_precision_loss, reason = "few pieces")]
        let angle = (piece as f64 + place - 0.5 * PIECES as f64) * STEP;
        self.middle + self.half * sin(angle)
    }

    /// Returns the density in 1/m of an offset; 0 outside the range.
    fn offset_pdf(&self, offset: f64) -> f64 {
        let sine = (offset - self.middle) / self.half;
        if !(self.pieces.is_usable() && sine.abs() <= 1.0) {
            return 0.0;
        }
        let cosine = ((1.0 - sine) * (1.0 + sine)).sqrt();
        let (piece, place) = place_of(sine, cosine);
        let ends = [piece, piece + 1].map(|k| match sine < 0.0 {
            true => self.density[k],
            false => self.density[PIECES - k],
        });
        let density = ends[0] + (ends[1] - ends[0]) * place;
        density / (self.pieces.total() * STEP * self.half * cosine)
    }

    /// Returns the random number in [0, 1) that gives an offset.
    fn invert_offset(&self, offset: f64) -> f64 {
        let sine = (offset - self.middle) / self.half;
        let cosine = ((1.0 - sine) * (1.0 + sine)).sqrt();
        let (piece, place) = place_of(sine, cosine);
        let (piece, place) = match sine < 0.0 {
            true => (piece, place),
            false => (PIECES - 1 - piece, 1.0 - place),
        };
        let [a, b] = [self.density[piece], self.density[piece + 1]];
        let below = place * (2.0 * a + (b - a) * place) / (a + b);
        self.pieces.unpick(piece, below)
    }

    /// Returns the offset of the chord through a point, the chord, and the point's parameter on it.
    fn chord_at(&self, point: DVec3) -> Option<(f64, Segment, f64)> {
        let [offset, v] = self.locate(point)?;
        let ends = self.extent(offset)?;
        let t = (v - ends[0]) / (ends[1] - ends[0]);
        let slack = 64.0 * f64::EPSILON * (1.0 + point.abs().max_element() / (ends[1] - ends[0]));
        let inside = t >= -slack && t <= 1.0 + slack;
        inside.then(|| (offset, self.segment(offset, ends), fraction(t)))
    }

    /// Returns the density at a point of the chord at an offset.
    fn density(&self, point: DVec3, line: &Segment, offset: f64) -> Pdf<SolidAngle> {
        let to = point - self.along.x;
        let cosine = self.along.normal.dot(to) / to.length();
        let density = self.along.thin(line).map_or(0.0, |whole| {
            2.0 * whole.view().line_distance() * cosine / (self.z * whole.measure())
        });
        Pdf::new(self.offset_pdf(offset) * density)
    }
}

/// Returns the index of the piece, counted from the nearer end of the half turn, that contains the
/// angle with the given sine and cosine, and the position in the piece.
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

/// The first random number chooses the chord, and the second the point on it.
impl PointTechnique for DiskChords {
    type Measure = SolidAngle;

    fn sample(&self, [across, along]: [f64; 2]) -> PointSample<SolidAngle> {
        let offset = self.sample_offset(across);
        let Some(ends) = self.extent(offset) else {
            return PointSample::none(DVec3::ZERO);
        };
        let line = self.segment(offset, ends);
        let Some((t, _)) = self.along.place(&line, &[Interval::UNIT], along) else {
            return PointSample::none(line.p0);
        };
        let point = line.at(t);
        PointSample::at(point, self.density(point, &line, offset))
    }

    fn pdf(&self, point: DVec3) -> Pdf<SolidAngle> {
        let chord = self.chord_at(point);
        chord.map_or(Pdf::ZERO, |(offset, line, _)| {
            self.density(point, &line, offset)
        })
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        if !self.pdf(point).is_positive() {
            return None;
        }
        let (offset, line, t) = self.chord_at(point)?;
        let along = self.along.below(&line, t)?;
        Some([self.invert_offset(offset), below_one(along)])
    }
}

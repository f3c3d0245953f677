//! This module samples lines of a textured parallelogram: offsets by the marginal of the texture,
//! and points in proportion to the texture along the line.
#![allow(
    clippy::disallowed_types,
    clippy::disallowed_macros,
    reason = "tables of a textured light and a direction, built with it"
)]

use crate::LineTechnique;
use crate::density::{Area, Length, Offset, Pdf};
use crate::image::{ImportanceImage, TextureAxis, TexturedSampler, cell, pick, unpick};
use crate::line::by_length::{is_visible, locate, within};
use crate::samples::{LineSample, PointSample};
use linelit_elementary::atan2;
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines, Segment, predicates};

/// A technique that samples parallel lines on a textured parallelogram. Their offsets are in
/// proportion to the integral of the importance image along them, and points on the visible part of
/// a line in proportion to the image.
///
/// **Density** of the offset: constant on strips, each with the exact mass of the image in it. For
/// lines along an edge of the light the strips are the rows or the columns of the image, and the
/// density is its marginal: the estimate of an integrand that is proportional to the image has no
/// variance. For any other direction the true marginal is piecewise linear between the offsets of
/// all corners of pixels. It is replaced by its means over strips that are as wide as the larger
/// offset of a pixel's two edges.
///
/// **Cost**: the set-up for each light and direction stores the strips, and visits a few strips for
/// each pixel. An offset takes one binary search. A point takes two on a line along an edge, and on
/// other lines a walk over the pixels that the line crosses.
///
/// **Accuracy**: round trips are accurate to a few ε divided by the density relative to its mean.
///
/// ```
/// use linelit_lights::geometry::intervals::Interval;
/// use linelit_lights::geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{ImportanceImage, LineTechnique, TextureAxis, TexturedLines};
/// let light = ConvexPolygon::parallelogram(DVec3::ZERO, 2.0 * DVec3::X, DVec3::Y).unwrap();
/// // The upper row is three times as bright as the lower.
/// let image = ImportanceImage::new(2, 2, &[1.0, 1.0, 1.0, 5.0]).unwrap();
/// let lines = TexturedLines::along(&light, &image, TextureAxis::U).unwrap();
/// let line = lines.sample(0.25);
/// assert!((line.offset - 0.5).abs() < 1e-15 && (line.pdf.value() - 1.5).abs() < 1e-15);
/// let point = lines.point(&line, &[Interval::UNIT], 0.99);
/// assert!((point.pdf.value() - 5.0 / (8.0 * 0.5)).abs() < 1e-15);
/// ```
#[derive(Clone, Debug)]
pub struct TexturedLines<'i> {
    lines: ParallelLines,
    texture: TexturedSampler<'i>,
    image: &'i ImportanceImage,
    /// For lines along an edge: which edge, and whether offsets decrease along the texture
    /// coordinate.
    edge: Option<(TextureAxis, bool)>,
    /// The running sums of the masses of equal strips over the range of offsets.
    strips: Vec<f64>,
}

/// The largest number of strips for lines that do not run along an edge.
const MOST_STRIPS: usize = 1 << 13;

/// Lines run along an edge if the sine of the angle between them is below this number.
const PARALLEL: f64 = 1e-12;

impl<'i> TexturedLines<'i> {
    /// Sets up lines at `angle_rad` from the polygon's first edge, counter-clockwise about its
    /// normal. `None` unless the polygon is a parallelogram and the angle is finite.
    #[must_use]
    pub fn new(
        polygon: &ConvexPolygon,
        image: &'i ImportanceImage,
        angle_rad: f64,
    ) -> Option<Self> {
        if !angle_rad.is_finite() {
            return None;
        }
        let texture = TexturedSampler::new(polygon, image)?;
        let (_, a, b) = polygon.as_parallelogram()?;
        let lines = ParallelLines::new(polygon, angle_rad);
        let across = lines.across();
        // Compute by how much the offset grows along each edge, that is over all of u and of v.
        let [du, dv] = [a.dot(across), b.dot(across)];
        let edge = if du.abs() <= PARALLEL * a.length() {
            Some((TextureAxis::U, dv < 0.0))
        } else if dv.abs() <= PARALLEL * b.length() {
            Some((TextureAxis::V, du < 0.0))
        } else {
            None
        };
        let strips = match edge {
            Some((axis, against)) => sums_of_lines(image, axis, against),
            None => sums_of_strips(image, du, dv),
        };
        Some(Self {
            lines,
            texture,
            image,
            edge,
            strips,
        })
    }

    /// Sets up lines along an edge of the light: the first (u) or the last (v).
    #[must_use]
    pub fn along(
        polygon: &ConvexPolygon,
        image: &'i ImportanceImage,
        axis: TextureAxis,
    ) -> Option<Self> {
        let (_, a, b) = polygon.as_parallelogram()?;
        let angle = match axis {
            TextureAxis::U => 0.0,
            TextureAxis::V => {
                let sine = predicates::cross(a, b).dot(polygon.normal());
                atan2(sine, a.dot(b))
            }
        };
        Self::new(polygon, image, angle)
    }

    fn width(&self) -> f64 {
        let (a, b) = self.lines.range();
        b - a
    }

    fn strip_count(&self) -> usize {
        self.strips.len() - 1
    }

    /// Returns the strip of an offset, and the position in it.
    fn strip(&self, offset: f64) -> (usize, f64) {
        cell(
            (offset - self.lines.range().0) / self.width(),
            self.strip_count(),
        )
    }

    /// Returns the density of the offsets in a strip.
    #[allow(clippy::cast_precision_loss, reason = "few strips")]
    fn strip_density(&self, k: usize) -> Pdf<Offset> {
        let count = self.strip_count();
        let mass = self.strips[k + 1] - self.strips[k];
        Pdf::new(mass / self.strips[count] * (count as f64 / self.width()))
    }

    /// Returns the joint density of an offset and a point with the image's `value`.
    fn joint(offset: Pdf<Offset>, value: f64, mass: f64) -> Pdf<Area> {
        offset.joint(Pdf::<Length>::new(value / mass))
    }

    /// Returns the line at an offset in texture coordinates.
    fn track(&self, segment: &Segment, offset: f64) -> Track<'i> {
        let [from, to] = [segment.p0, segment.p1].map(|p| self.texture.coordinates(p));
        let edge = self.edge.map(|(axis, against)| {
            let k = self.strip(offset).0;
            let j = if against {
                self.strip_count() - 1 - k
            } else {
                k
            };
            (axis, j)
        });
        Track {
            image: self.image,
            from,
            to,
            edge,
        }
    }
}

impl LineTechnique for TexturedLines<'_> {
    type Measure = Area;

    fn lines(&self) -> &ParallelLines {
        &self.lines
    }

    #[allow(clippy::cast_precision_loss, reason = "few strips")]
    fn sample(&self, u: f64) -> LineSample {
        let (k, place) = pick(&self.strips, u);
        let (a, b) = self.lines.range();
        let offset = (a + (k as f64 + place) / self.strip_count() as f64 * (b - a)).min(b);
        LineSample {
            segment: self.lines.segment(offset).unwrap_or_default(),
            offset,
            pdf: self.strip_density(k),
        }
    }

    fn pdf(&self, offset: f64) -> Pdf<Offset> {
        let (a, b) = self.lines.range();
        if (a..=b).contains(&offset) {
            self.strip_density(self.strip(offset).0)
        } else {
            Pdf::ZERO
        }
    }

    fn invert(&self, offset: f64) -> Option<f64> {
        self.pdf(offset).is_positive().then(|| {
            let (k, place) = self.strip(offset);
            unpick(&self.strips, k, place)
        })
    }

    fn point(&self, line: &LineSample, visible: &[Interval], xi: f64) -> PointSample<Area> {
        // Sum the image over the visible parts, and find the part that the number falls into.
        let track = self.track(&line.segment, line.offset);
        let total = track.mass(visible);
        let mut rest = fraction(xi) * total;
        let mut t = None;
        for part in visible.iter().map(within) {
            let below = track.below(part.lo);
            let mass = track.below(part.hi) - below;
            if mass > 0.0 {
                t = Some(track.place(below + rest).clamp(part.lo, part.hi));
                if rest < mass {
                    break;
                }
            }
            rest -= mass;
        }
        match t {
            Some(t) if total > 0.0 => {
                let mass = line.segment.length() * total;
                let pdf = Self::joint(line.pdf, track.value(t), mass);
                PointSample::at(line.segment.at(t), pdf)
            }
            _ => PointSample::none(line.segment.p0),
        }
    }

    fn joint_pdf(&self, point: DVec3, visible: &[Interval]) -> Pdf<Area> {
        let Some((u, t)) = locate(&self.lines, point).filter(|(_, t)| is_visible(*t, visible))
        else {
            return Pdf::ZERO;
        };
        let Some(segment) = self.lines.segment(u) else {
            return Pdf::ZERO;
        };
        let track = self.track(&segment, u);
        let mass = segment.length() * track.mass(visible);
        Self::joint(self.pdf(u), track.value(t), mass)
    }

    fn invert_point(&self, point: DVec3, visible: &[Interval]) -> Option<[f64; 2]> {
        let (u, t) = locate(&self.lines, point).filter(|(_, t)| is_visible(*t, visible))?;
        let track = self.track(&self.lines.segment(u)?, u);
        let below: f64 = visible
            .iter()
            .map(within)
            .map(|i| (track.below(t.clamp(i.lo, i.hi)) - track.below(i.lo)).max(0.0))
            .sum();
        let total = track.mass(visible);
        let xi = below_one(below / total);
        (track.value(t) > 0.0 && total > 0.0).then_some([self.invert(u)?, xi])
    }
}

/// Returns the running sums of the rows or columns, in the order of the offsets.
fn sums_of_lines(image: &ImportanceImage, axis: TextureAxis, against: bool) -> Vec<f64> {
    let sums = image.line_sums(axis);
    if !against {
        return sums.to_vec();
    }
    let mut out = vec![0.0];
    let mut sum = 0.0;
    for pair in sums.windows(2).rev() {
        sum += pair[1] - pair[0];
        out.push(sum);
    }
    out
}

/// Returns the running sums of the mass of the image in equal strips over the range of offsets.
/// Offsets grow by `du` and `dv` along the edges of the image. Within a pixel the offset is the sum
/// of two uniform variables, so that its distribution is a trapezoid.
#[allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "few pixels and strips; clamped"
)]
fn sums_of_strips(image: &ImportanceImage, du: f64, dv: f64) -> Vec<f64> {
    let (width, height) = image.size();
    // Choose strips that are as wide as a pixel's longer step.
    let steps = [du / width as f64, dv / height as f64];
    let (long, short) = {
        let [a, b] = steps.map(f64::abs);
        (a.max(b), a.min(b))
    };
    let range = du.abs() + dv.abs();
    let count = ((range / long).ceil() as usize).clamp(1, MOST_STRIPS);
    let strip = range / count as f64;
    let least = du.min(0.0) + dv.min(0.0);
    let mut masses = vec![0.0; count + 1];
    // Distribute the mass of each pixel over the strips that it meets.
    for j in 0..height {
        for i in 0..width {
            let value = image.pixel(i, j);
            if value <= 0.0 {
                continue;
            }
            let corner = i as f64 * steps[0] + j as f64 * steps[1] - least;
            let begin = corner + steps[0].min(0.0) + steps[1].min(0.0);
            let first = ((begin / strip).max(0.0) as usize).min(count - 1);
            let mut below = 0.0;
            for k in first..count {
                let end = (k + 1) as f64 * strip - begin;
                let upto = if k + 1 == count {
                    1.0
                } else {
                    trapezoid(end, long, short)
                };
                masses[k + 1] += value * (upto - below);
                below = upto;
                if end >= long + short {
                    break;
                }
            }
        }
    }
    // Accumulate.
    for k in 0..count {
        masses[k + 1] += masses[k];
    }
    masses
}

/// Returns the CDF of the sum of two variables that are uniform in [0, long] and [0, short].
fn trapezoid(x: f64, long: f64, short: f64) -> f64 {
    let rest = long + short - x;
    if x <= 0.0 {
        0.0
    } else if rest <= 0.0 {
        1.0
    } else if x < short {
        x * (x / short) / (2.0 * long)
    } else if rest < short {
        1.0 - rest * (rest / short) / (2.0 * long)
    } else {
        (x - 0.5 * short) / long
    }
}

/// A line over the image, in texture coordinates.
struct Track<'i> {
    image: &'i ImportanceImage,
    from: [f64; 2],
    to: [f64; 2],
    /// The row or column in which the line lies, if it runs along an edge.
    edge: Option<(TextureAxis, usize)>,
}

impl Track<'_> {
    /// Returns a texture coordinate at a parameter of the line, clamped to [0, 1].
    fn coordinate(&self, axis: TextureAxis, t: f64) -> f64 {
        let i = axis as usize;
        fraction(self.from[i] * (1.0 - t) + self.to[i] * t)
    }

    /// Returns the integral of the image over the line's parameter from 0 to t.
    fn below(&self, t: f64) -> f64 {
        if let Some((axis, j)) = self.edge {
            let sum = |t| self.image.mass_below(axis, j, self.coordinate(axis, t));
            return (sum(t) - sum(0.0)).abs() * self.per_mass(axis);
        }
        let mut sum = 0.0;
        self.walk(|lo, hi, value| {
            sum += value * (hi.min(t) - lo).max(0.0);
            hi < t
        });
        sum
    }

    /// Returns the integral over the parameter for each unit of a row's sum.
    #[allow(clippy::cast_precision_loss, reason = "image sizes are far below 2^53")]
    fn per_mass(&self, axis: TextureAxis) -> f64 {
        let (width, height) = self.image.size();
        let i = axis as usize;
        let pixels = [width, height][i] as f64;
        1.0 / (pixels * (self.to[i] - self.from[i]).abs())
    }

    /// Returns the parameter at which [`Track::below`] reaches `mass`.
    fn place(&self, mass: f64) -> f64 {
        // Along an edge, invert the running sums of the row or column.
        if let Some((axis, j)) = self.edge {
            let i = axis as usize;
            let (from, to) = (self.from[i], self.to[i]);
            let start = self.image.mass_below(axis, j, from.clamp(0.0, 1.0));
            let mass = mass / self.per_mass(axis);
            let target = if to > from {
                start + mass
            } else {
                start - mass
            };
            let x = self.image.place_of_mass(axis, j, target.max(0.0));
            return fraction((x - from) / (to - from));
        }
        // On other lines, walk over the pixels until the mass is used up.
        let mut rest = mass;
        let mut found = 0.0;
        self.walk(|lo, hi, value| {
            let piece = value * (hi - lo);
            if piece > 0.0 {
                found = (lo + rest / value).min(hi);
            }
            let on = rest >= piece;
            rest -= piece;
            on
        });
        found
    }

    /// Returns the value of the image at a parameter.
    fn value(&self, t: f64) -> f64 {
        let (width, height) = self.image.size();
        let [u, v] = [TextureAxis::U, TextureAxis::V].map(|axis| self.coordinate(axis, t));
        let (i, j) = match self.edge {
            Some((TextureAxis::U, j)) => (cell(u, width).0, j),
            Some((TextureAxis::V, i)) => (i, cell(v, height).0),
            None => (cell(u, width).0, cell(v, height).0),
        };
        self.image.pixel(i, j)
    }

    /// Returns the integral of the image over the visible intervals of the parameter.
    fn mass(&self, visible: &[Interval]) -> f64 {
        visible
            .iter()
            .map(within)
            .map(|i| (self.below(i.hi) - self.below(i.lo)).max(0.0))
            .sum()
    }

    /// Visits the pixels that the line crosses, in order, with the range of the parameter in the
    /// pixel and the pixel's value, until `visit` returns false.
    #[allow(clippy::cast_precision_loss, reason = "image sizes are far below 2^53")]
    fn walk(&self, mut visit: impl FnMut(f64, f64, f64) -> bool) {
        let (width, height) = self.image.size();
        let size = [width, height];
        let step = [0, 1].map(|i| self.to[i] - self.from[i]);
        let mut at = [0, 1].map(|i| cell(self.from[i], size[i]).0);
        let mut t = 0.0;
        while t < 1.0 {
            // Find the parameter at the next border in each direction; it is infinite at the
            // image's own.
            let next = [0, 1].map(|i| {
                let forward = step[i] > 0.0;
                let border = at[i] + usize::from(forward);
                if border == 0 || border == size[i] || step[i].abs() <= 0.0 {
                    f64::INFINITY
                } else {
                    ((border as f64 / size[i] as f64 - self.from[i]) / step[i]).max(t)
                }
            });
            // Cross the nearer of the two borders.
            let axis = usize::from(next[1] < next[0]);
            let end = next[axis].min(1.0);
            if !visit(t, end, self.image.pixel(at[0], at[1])) || end >= 1.0 {
                return;
            }
            at[axis] = if step[axis] > 0.0 {
                at[axis] + 1
            } else {
                at[axis] - 1
            };
            t = end;
        }
    }
}

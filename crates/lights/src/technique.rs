//! This module holds the traits that all techniques implement: [`PointTechnique`] for points of a
//! surface, [`LineTechnique`] for lines on a flat light and [`LinearPointTechnique`] for points of
//! a linear light.
//!
//! A technique is one way to sample one light for one shading point, ready for use. Its constructor
//! takes all that it needs except random numbers: the shading point, a normal, an image. Where the
//! technique cannot give a sample, its constructor returns `None`, or its densities are zero. Code
//! that works for any technique is generic over these traits.
//!
//! ```
//! use linelit_lights::geometry::{ConvexPolygon, DVec3};
//! use linelit_lights::{AreaSampler, PointTechnique, SolidAngleSampler};
//!
//! /// Where the technique's random numbers ½, ½ lead, and back.
//! fn middle<T: PointTechnique>(technique: &T) -> Option<[f64; 2]> {
//!     technique.invert(technique.sample([0.5, 0.5]).point)
//! }
//! let quad = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y).unwrap();
//! assert_eq!(middle(&AreaSampler::new(&quad)), Some([0.5, 0.5]));
//! let [u, v] = middle(&SolidAngleSampler::new(&quad, DVec3::ZERO)).unwrap();
//! assert!((u - 0.5).abs() < 1e-15 && (v - 0.5).abs() < 1e-15);
//! ```

#[cfg(doc)]
use crate::density::{Area, SolidAngle};
use crate::density::{Offset, Pdf, SurfaceMeasure, ThinSolidAngle};
use crate::samples::{LineSample, LinearSample, PointColumns, PointSample};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{DVec3, ParallelLines, Segment};

/// A technique that samples points of a surface light with a known density.
///
/// **Laws**, which tests check for every technique: samples follow the density; the density
/// integrates to one over the part of the light that the technique reaches; `sample` of the numbers
/// that `invert` returns gives the same point, to rounding.
pub trait PointTechnique {
    /// The measure of densities: [`Area`] of the light (1/m²), or [`SolidAngle`] at the shading
    /// point (1/sr).
    type Measure: SurfaceMeasure;

    /// Samples a point of the light from two random numbers in [0, 1), and returns it with its
    /// density.
    ///
    /// The point depends continuously on both numbers wherever the light allows it, so that
    /// stratified numbers give stratified points. The density is 0 where no point can be sampled:
    /// skip the sample.
    fn sample(&self, u: [f64; 2]) -> PointSample<Self::Measure>;

    /// Samples points from many pairs of random numbers, in columns of eight. The points are bit
    /// for bit the points that [`PointTechnique::sample`] returns one by one; their number is the
    /// length of the shortest column.
    fn sample_into(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) {
        let [x, y, z] = out.point.map(<[[f64; 8]]>::as_flattened_mut);
        let u = u[0].as_flattened().iter().zip(u[1].as_flattened());
        let points = x.iter_mut().zip(y).zip(z);
        let pdfs = out.pdf.as_flattened_mut();
        for ((u, ((x, y), z)), pdf) in u.zip(points).zip(pdfs) {
            let sample = self.sample([*u.0, *u.1]);
            [*x, *y, *z] = sample.point.to_array();
            *pdf = sample.pdf.value();
        }
    }

    /// Returns the density with which [`PointTechnique::sample`] gives a point of the light.
    ///
    /// The point is assumed to lie on the light, to rounding. The density is 0 where the technique
    /// places no samples.
    fn pdf(&self, point: DVec3) -> Pdf<Self::Measure>;

    /// Returns the two random numbers in [0, 1) from which [`PointTechnique::sample`] gives the
    /// point; `None` where its density is zero, and for points outside the light.
    fn invert(&self, point: DVec3) -> Option<[f64; 2]>;
}

/// A technique that samples parallel lines on a flat light, and points on their visible parts.
///
/// A line is chosen by its offset across the light, with a density per metre ([`Offset`]). The
/// caller then finds which parts of the line are visible, and passes them as intervals of the
/// line's parameter in [0, 1]. A point of these intervals has a joint density in
/// [`LineTechnique::Measure`].
///
/// **Laws**, which tests check for every technique: offsets follow their density, which integrates
/// to one over the range of [`LineTechnique::lines`]; the joint density integrates to one over the
/// visible part of the light, as long as some part of each line is visible; both inverses return
/// the numbers that lead to the sample.
///
/// **Source**: Billen & Dutré 2016, section 4; the joint density: Salesin & Jarosz 2019, eqs.
/// 12–15.
pub trait LineTechnique {
    /// The measure of the densities of points on lines: [`Area`] of the light (1/m²), or
    /// [`SolidAngle`] at the shading point (1/sr).
    type Measure: SurfaceMeasure;

    /// Returns all lines of the technique's direction: the range of offsets, and where each line
    /// begins and ends.
    fn lines(&self) -> &ParallelLines;

    /// Returns the unit direction of the lines; zero where there are no lines.
    fn direction(&self) -> DVec3 {
        self.lines().direction()
    }

    /// Returns the line through a point of the light.
    fn through(&self, point: DVec3) -> Segment {
        through(self.lines(), point)
    }

    /// Samples a line of the light from one random number in [0, 1), and returns it with the
    /// density of its offset in 1/m.
    ///
    /// The density is 0 where no line can be sampled: skip the sample.
    fn sample(&self, u: f64) -> LineSample;

    /// Returns the density in 1/m with which [`LineTechnique::sample`] gives the line at an offset
    /// across the light; 0 for offsets outside the light.
    fn pdf(&self, offset: f64) -> Pdf<Offset>;

    /// Returns the random number in [0, 1) from which [`LineTechnique::sample`] gives the line at
    /// an offset; `None` where its density is zero.
    fn invert(&self, offset: f64) -> Option<f64>;

    /// Samples a point of the visible part of a line from one random number in [0, 1), and returns
    /// it with the joint density of line and point.
    ///
    /// `visible` holds disjoint ascending intervals of the line's parameter in [0, 1], from the
    /// first end of its segment to the second. The density is 0 where no part is visible.
    fn point(&self, line: &LineSample, visible: &[Interval], u: f64) -> PointSample<Self::Measure>;

    /// Returns the joint density with which [`LineTechnique::sample`] gives the line through a
    /// point of the light, and [`LineTechnique::point`] the point on it.
    ///
    /// `visible` holds the visible intervals of that line. The density is 0 where the point is
    /// hidden or outside the light.
    fn joint_pdf(&self, point: DVec3, visible: &[Interval]) -> Pdf<Self::Measure>;

    /// Returns the random numbers of [`LineTechnique::sample`] and of [`LineTechnique::point`] that
    /// give a point of the light; `None` where the joint density is zero.
    fn invert_point(&self, point: DVec3, visible: &[Interval]) -> Option<[f64; 2]>;
}

/// Returns the line, out of a family of parallel lines, through a point of the light.
#[must_use]
pub fn through(lines: &ParallelLines, point: DVec3) -> Segment {
    let (a, b) = lines.range();
    let (offset, _) = lines.coordinates(point);
    lines.segment(offset.clamp(a, b)).unwrap_or_default()
}

/// A technique that samples points of a linear light from one random number.
///
/// A point is given by its position t in [0, 1] along the light; its density is per solid angle
/// times the light's radius, [`ThinSolidAngle`] in m/sr (Peters 2021, §3.1).
///
/// **Laws**: the laws of [`PointTechnique`], along the light.
pub trait LinearPointTechnique {
    /// Samples a point of the light from one random number in [0, 1), and returns it with its
    /// density.
    fn sample(&self, u: f64) -> LinearSample;

    /// Returns the density in m/sr with which [`LinearPointTechnique::sample`] gives the position
    /// `t` of the light; 0 where the technique places no samples.
    fn pdf(&self, t: f64) -> Pdf<ThinSolidAngle>;

    /// Returns the random number in [0, 1) from which [`LinearPointTechnique::sample`] gives the
    /// position `t` of the light; `None` where its density is zero.
    fn invert(&self, t: f64) -> Option<f64>;
}

/// A line technique used as a point technique, with the whole line visible: the first random number
/// chooses the line, and the second a point on all of it.
///
/// `AngularLines::by_projected_solid_angle` so becomes the point technique without variance on a
/// diffuse surface.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{LineSampler, OffsetDensity, PointTechnique, PointsOnLines};
/// let light = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y)?;
/// let points = PointsOnLines(LineSampler::new(&light, 0.0, OffsetDensity::Length));
/// // Lines in proportion to their length give points uniform in the area.
/// assert!((points.sample([0.3, 0.6]).pdf.value() - 1.0).abs() < 1e-12);
/// # Ok::<(), linelit_lights::geometry::PolygonError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PointsOnLines<L>(pub L);

impl<L: LineTechnique> PointTechnique for PointsOnLines<L> {
    type Measure = L::Measure;

    #[inline]
    fn sample(&self, [across, along]: [f64; 2]) -> PointSample<L::Measure> {
        self.0
            .point(&self.0.sample(across), &[Interval::UNIT], along)
    }

    #[inline]
    fn pdf(&self, point: DVec3) -> Pdf<L::Measure> {
        self.0.joint_pdf(point, &[Interval::UNIT])
    }

    #[inline]
    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        self.0.invert_point(point, &[Interval::UNIT])
    }
}

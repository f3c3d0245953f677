//! The two currencies of the crate, as traits: points of a light, and lines on it.
//!
//! A technique is one way to sample one light for one shading point, ready for use: whatever it
//! needs besides random numbers (the shading point, a normal, an image) its constructor has taken,
//! and where it can give no sample its constructor says so, or its densities are zero. Code that
//! works for any technique is generic over [`PointTechnique`] or [`LineTechnique`].
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

/// A way to choose points of a surface light, with its density.
///
/// **Laws**, which tests hold every technique to: samples follow the density; the density
/// integrates to one over the part of the light that the technique reaches; `sample` of what
/// `invert` gives is the same point to rounding.
pub trait PointTechnique {
    /// The measure of densities: [`Area`] of the light (1/m²), or [`SolidAngle`] at the shading
    /// point (1/sr).
    type Measure: SurfaceMeasure;

    /// A point of the light from two random numbers in [0, 1), with its density.
    ///
    /// Continuous in both numbers wherever the light allows, so that stratified numbers give
    /// stratified points. Density 0 where nothing can be sampled: skip it.
    fn sample(&self, u: [f64; 2]) -> PointSample<Self::Measure>;

    /// The points of many pairs of random numbers, eight side by side: those that
    /// [`PointTechnique::sample`] gives one by one, to the bit. As many as all columns hold.
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

    /// The density with which [`PointTechnique::sample`] gives a point of the light.
    ///
    /// The point is taken to lie on the light to rounding; 0 where the technique never goes.
    fn pdf(&self, point: DVec3) -> Pdf<Self::Measure>;

    /// The two random numbers in [0, 1) from which [`PointTechnique::sample`] gives the point;
    /// `None` where its density is zero, and beside the light.
    fn invert(&self, point: DVec3) -> Option<[f64; 2]>;
}

/// A way to choose parallel lines on a flat light, and points on their visible parts.
///
/// A line is chosen by its offset across the light, with a density per metre ([`Offset`]); what is
/// visible of it, asked for elsewhere, comes back as intervals of its parameter in [0, 1]; a point
/// of those has a joint density in [`LineTechnique::Measure`].
///
/// **Laws**, which tests hold every technique to: offsets follow their density, which integrates to
/// one over the range of [`LineTechnique::lines`]; the joint density integrates to one over what is
/// visible, as long as some of each line is; both inverses lead back.
///
/// **Source**: Billen & Dutré 2016, section 4; the joint density: Salesin & Jarosz 2019, eqs.
/// 12–15.
pub trait LineTechnique {
    /// The measure of the densities of points on lines: [`Area`] of the light (1/m²), or
    /// [`SolidAngle`] at the shading point (1/sr).
    type Measure: SurfaceMeasure;

    /// All lines of the technique's direction: offsets, and where each line begins and ends.
    fn lines(&self) -> &ParallelLines;

    /// The unit direction of the lines; zero where there are none.
    fn direction(&self) -> DVec3 {
        self.lines().direction()
    }

    /// The line through a point of the light.
    fn through(&self, point: DVec3) -> Segment {
        through(self.lines(), point)
    }

    /// A line of the light from one random number in [0, 1), with the density of its offset in 1/m.
    ///
    /// Density 0 where nothing can be sampled: skip it.
    fn sample(&self, u: f64) -> LineSample;

    /// The density in 1/m with which [`LineTechnique::sample`] gives the line at an offset across
    /// the light; 0 beside the light.
    fn pdf(&self, offset: f64) -> Pdf<Offset>;

    /// The random number in [0, 1) from which [`LineTechnique::sample`] gives the line at an
    /// offset; `None` where its density is zero.
    fn invert(&self, offset: f64) -> Option<f64>;

    /// A point of what is visible of a line, from one random number in [0, 1), with the joint
    /// density of line and point.
    ///
    /// `visible` holds disjoint ascending intervals of the line's parameter in [0, 1], from its
    /// segment's first end to the second. Density 0 where nothing is visible.
    fn point(&self, line: &LineSample, visible: &[Interval], u: f64) -> PointSample<Self::Measure>;

    /// The joint density with which [`LineTechnique::sample`] gives the line through a point of
    /// the light and [`LineTechnique::point`] the point.
    ///
    /// `visible` is what is visible of that line; 0 where the point is hidden or beside the light.
    fn joint_pdf(&self, point: DVec3, visible: &[Interval]) -> Pdf<Self::Measure>;

    /// The random numbers of [`LineTechnique::sample`] and of [`LineTechnique::point`] that give a
    /// point of the light; `None` where the joint density is zero.
    fn invert_point(&self, point: DVec3, visible: &[Interval]) -> Option<[f64; 2]>;
}

/// The line of a family of parallel lines through a point of the light.
#[must_use]
pub fn through(lines: &ParallelLines, point: DVec3) -> Segment {
    let (a, b) = lines.range();
    let (offset, _) = lines.coordinates(point);
    lines.segment(offset.clamp(a, b)).unwrap_or_default()
}

/// A way to choose points of a linear light, from one random number.
///
/// The third currency, for lights without a surface: a place t in [0, 1] along the light, and the
/// density per solid angle times the light's radius, [`ThinSolidAngle`] in m/sr (Peters 2021,
/// §3.1).
///
/// **Laws**: those of [`PointTechnique`], along the light.
pub trait LinearPointTechnique {
    /// A point of the light from one random number in [0, 1), with its density.
    fn sample(&self, u: f64) -> LinearSample;

    /// The density in m/sr with which [`LinearPointTechnique::sample`] gives the fraction `t` of
    /// the light; 0 where the technique never goes.
    fn pdf(&self, t: f64) -> Pdf<ThinSolidAngle>;

    /// The random number in [0, 1) from which [`LinearPointTechnique::sample`] gives the fraction
    /// `t` of the light; `None` where its density is zero.
    fn invert(&self, t: f64) -> Option<f64>;
}

/// The points that a line technique gives with nothing in between, as a point technique: the first
/// random number chooses the line, the second the point on all of it.
///
/// `AngularLines::by_projected_solid_angle` becomes the technique of no variance on a diffuse
/// surface.
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

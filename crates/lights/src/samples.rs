//! This module holds the samples that techniques return: points and lines of a light, each with the
//! density with which it was drawn.

use crate::density::{Measure, Offset, Pdf, ThinSolidAngle};
use crate::polygon::fan::Vector;
use linelit_geometry::{DVec3, Segment};
use linelit_simd::Simd;

/// A point of a light, and the density with which it was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSample<M: Measure> {
    /// The point, in the coordinates of the light.
    pub point: DVec3,
    /// The density of the point. Zero means that no point can be sampled: skip the sample.
    pub pdf: Pdf<M>,
}

impl<M: Measure> PointSample<M> {
    /// Makes a sample; its density becomes zero where the point has a coordinate that is not
    /// finite.
    #[inline(always)]
    #[must_use]
    pub fn at(point: DVec3, pdf: Pdf<M>) -> Self {
        let pdf = if point.is_finite() { pdf } else { Pdf::ZERO };
        Self { point, pdf }
    }

    /// Makes the sample for degenerate input, with the density 0.
    #[must_use]
    pub fn none(point: DVec3) -> Self {
        Self {
            point,
            pdf: Pdf::ZERO,
        }
    }
}

/// Memory for points of a light in columns of eight, for `PointTechnique::sample_into`.
#[derive(Debug)]
pub struct PointColumns<'a> {
    /// The coordinates x, y and z of the points, in the coordinates of the light.
    pub point: [&'a mut [[f64; 8]]; 3],
    /// The densities of the points. Zero means that no point can be sampled.
    pub pdf: &'a mut [[f64; 8]],
}

impl PointColumns<'_> {
    /// Returns the number of rows of eight points that fit all columns and for which there are
    /// random numbers.
    pub(crate) fn rows(&self, u: [&[[f64; 8]]; 2]) -> usize {
        let room = self.point.iter().map(|column| column.len());
        let room = room.fold(self.pdf.len(), usize::min);
        room.min(u[0].len()).min(u[1].len())
    }

    /// Loads the eight points of a row.
    #[inline(always)]
    pub(crate) fn get<S: Simd>(&self, s: S, row: usize) -> Vector<S> {
        let [x, y, z] = &self.point;
        [s.dload(&x[row]), s.dload(&y[row]), s.dload(&z[row])]
    }

    /// Stores eight points in a row.
    #[inline(always)]
    pub(crate) fn put<S: Simd>(&mut self, s: S, row: usize, [x, y, z]: Vector<S>) {
        let [xs, ys, zs] = &mut self.point;
        s.dstore(x, &mut xs[row]);
        s.dstore(y, &mut ys[row]);
        s.dstore(z, &mut zs[row]);
    }
}

/// A line on a light, and the density with which it was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSample {
    /// The whole line, from one edge of the light to another.
    pub segment: Segment,
    /// The offset u of the line across the light, in scene units (the coordinate of
    /// `ParallelLines`).
    pub offset: f64,
    /// The density of the offset. Zero means that no line can be sampled: skip the sample.
    pub pdf: Pdf<Offset>,
}

impl LineSample {
    /// Makes the sample for degenerate input: a line without length, and the density 0.
    pub(crate) fn none(offset: f64) -> Self {
        Self {
            segment: Segment::default(),
            offset,
            pdf: Pdf::ZERO,
        }
    }
}

/// A point of a linear light, and the density with which it was drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearSample {
    /// The position of the point along the whole light, in [0, 1].
    pub t: f64,
    /// The point relative to the shading point.
    pub offset: DVec3,
    /// The unit direction from the shading point.
    pub direction: DVec3,
    /// The density per solid angle, times the radius of the light.
    pub pdf: Pdf<ThinSolidAngle>,
}

//! This module maps directions to images and back: it says where a direction lies in an image, what
//! a lookup returns there, and what the integrals of lookups are. Environments are sampled in
//! proportion to these integrals.
//!
//! A lookup is a sum of pixels, each multiplied by a kernel about its centre: a tent for
//! interpolation, a box for the nearest pixel. The kernel is a product of one factor along the row
//! and one along the column, and so is the solid angle. The integral of a lookup over a cell of a
//! grid in the image is therefore exact: it is a sum over the pixels that the cell meets, and each
//! term is a product of two closed forms ([`Raster::cells`]).
#![allow(
    clippy::disallowed_types,
    clippy::disallowed_macros,
    reason = "weights of an environment's pixels, made once"
)]

use crate::octahedral::{sphere_to_square, square_to_sphere, wrap_texel};
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use linelit_elementary::{atan2, sin, sin_cos};
use linelit_geometry::DVec3;
use linelit_geometry::finite::below_one;

/// The way in which an image covers the sphere of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyMapping {
    /// Columns run by longitude, from the x axis towards the y axis; rows run by the angle from the
    /// z axis, and the first row is at +z (pbrt-v3's environments).
    Equirectangular,
    /// The equal-area octahedral map of a square
    /// ([`square_to_sphere`](crate::octahedral::square_to_sphere); pbrt-v4's environments).
    EqualArea,
}

/// How an image of directions is evaluated between the centres of its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyFilter {
    /// Values are interpolated linearly along rows and columns (pbrt-v3).
    Linear,
    /// The value is the value of the pixel that the direction lies in (pbrt-v4).
    Nearest,
}

impl SkyMapping {
    /// Returns the position of a unit direction in the image, in [0, 1]².
    fn position(self, w: DVec3) -> [f64; 2] {
        match self {
            Self::EqualArea => sphere_to_square(w),
            Self::Equirectangular => by_angles(w),
        }
    }
}

/// A grid of cells over an image of directions, with an even number of cells along each side. It
/// draws directions in a cell, and finds the cell of a direction.
#[derive(Clone, PartialEq)]
pub(crate) struct Grid {
    mapping: SkyMapping,
    pub(crate) count: usize,
    /// For images by longitude and latitude: sin²(θ/2) at the angle θ from a pole at which each row
    /// begins, from the pole to the equator. Equal differences of it are equal solid angles.
    heights: Vec<f64>,
}

impl Grid {
    /// Makes a grid with `count` cells along each side.
    pub(crate) fn new(mapping: SkyMapping, count: usize) -> Self {
        let height = |k: usize| {
            let sine = sin(FRAC_PI_2 * k as f64 / count as f64);
            sine * sine
        };
        let heights = match mapping {
            SkyMapping::Equirectangular => (0..=count / 2).map(height).collect(),
            SkyMapping::EqualArea => Vec::new(),
        };
        Self {
            mapping,
            count,
            heights,
        }
    }

    /// For a row of an image by longitude and latitude, returns whether the row is on the side of
    /// +z, and the heights (sin²(θ/2) from the pole of this side) at which the row begins and ends.
    fn row(&self, row: usize) -> (bool, f64, f64) {
        let is_north = row < self.count / 2;
        let k = if is_north { row } else { self.count - 1 - row };
        (is_north, self.heights[k], self.heights[k + 1])
    }

    /// Returns the fraction of the sphere that one cell of a row covers.
    pub(crate) fn fraction(&self, row: usize) -> f64 {
        let whole = match self.mapping {
            SkyMapping::EqualArea => 1.0 / self.count as f64,
            SkyMapping::Equirectangular => {
                let (_, start, end) = self.row(row);
                end - start
            }
        };
        whole / self.count as f64
    }

    /// Returns the direction at a position in [0, 1]² within a cell. A position that is uniform in
    /// the square is uniform in the cell's solid angle.
    pub(crate) fn direction(&self, cell: [usize; 2], within: [f64; 2]) -> DVec3 {
        let [x, y] = [0, 1].map(|k| (cell[k] as f64 + within[k]) / self.count as f64);
        if self.mapping == SkyMapping::EqualArea {
            return square_to_sphere([x, y]);
        }
        let (is_north, start, end) = self.row(cell[1]);
        let down = if is_north { within[1] } else { 1.0 - within[1] };
        let height = start + (end - start) * down;
        let sine = 2.0 * (height * (1.0 - height)).max(0.0).sqrt();
        let (s, c) = sin_cos(TAU * x);
        let z = 1.0 - 2.0 * height;
        DVec3::new(sine * c, sine * s, if is_north { z } else { -z })
    }

    /// Returns the column and the row of the cell that contains the unit direction `w`, each with
    /// the position in [0, 1] within the cell. This is the inverse of
    /// [`direction`](Self::direction).
    pub(crate) fn locate(&self, w: DVec3) -> [(usize, f64); 2] {
        let at = self.mapping.position(w);
        let [column, mut row] = at.map(|x| {
            let scaled = below_one(x) * self.count as f64;
            (index(x, self.count), scaled - scaled.floor())
        });
        if self.mapping == SkyMapping::Equirectangular {
            let (is_north, start, end) = self.row(row.0);
            let z = if is_north { w.z } else { -w.z };
            let height = match z > 0.0 {
                true => 0.5 * (w.x * w.x + w.y * w.y) / (1.0 + z),
                false => 0.5 * (1.0 - z),
            };
            let down = (height - start) / (end - start);
            row.1 = below_one(if is_north { down } else { 1.0 - down });
        }
        [column, row]
    }
}

/// The layout of an image of directions: its number of pixels, how they cover the sphere, and how
/// they are filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Raster {
    pub(crate) size: [usize; 2],
    pub(crate) mapping: SkyMapping,
    pub(crate) filter: SkyFilter,
}

impl Raster {
    /// Returns the filtered value in the unit direction `w`; zero where `w` is not finite.
    pub(crate) fn lookup(&self, w: DVec3, pixel: impl Fn(usize) -> DVec3) -> DVec3 {
        if !w.is_finite() {
            return DVec3::ZERO;
        }
        let position = self.mapping.position(w);
        // Return the pixel itself if the image is not interpolated.
        if self.filter == SkyFilter::Nearest {
            let [i, j] = [0, 1].map(|k| index(position[k], self.size[k]));
            return pixel(j * self.size[0] + i);
        }
        // Interpolate between the four pixels about the position.
        let [(i, a), (j, b)] = [0, 1].map(|k| {
            let x = position[k] * self.size[k] as f64 - 0.5;
            #[allow(clippy::cast_possible_truncation, reason = "within the image's size")]
            let first = x.floor() as isize;
            (first, x - x.floor())
        });
        let at = |i: isize, j: isize| pixel(self.texel([i, j]));
        let row = |j: isize| at(i, j) * (1.0 - a) + at(i + 1, j) * a;
        row(j) * (1.0 - b) + row(j + 1) * b
    }

    /// Returns the index of the pixel at a column and a row that may lie one beyond the border,
    /// where the image continues on another side.
    fn texel(&self, [i, j]: [isize; 2]) -> usize {
        let [width, height] = self.size.map(usize::cast_signed);
        let [i, j] = if (0..width).contains(&i) && (0..height).contains(&j) {
            [i, j].map(isize::cast_unsigned)
        } else if self.mapping == SkyMapping::EqualArea {
            wrap_texel([i, j], self.size[0])
        } else {
            // Beyond a pole the sphere continues half a turn away; the row itself serves as well.
            [i.rem_euclid(width), j.clamp(0, height - 1)].map(isize::cast_unsigned)
        };
        j * self.size[0] + i
    }

    /// Calls `each` with every cell of a grid of count × count, where `count` is a power of two,
    /// and with the integral of the lookup over the cell, divided by 4π. The sum over all cells is
    /// the mean of the image.
    ///
    /// **Error**: 10⁻⁸ of each integral.
    pub(crate) fn cells(
        &self,
        count: usize,
        pixel: impl Fn(usize) -> DVec3,
        mut each: impl FnMut([usize; 2], DVec3),
    ) {
        let [columns, rows] = [0, 1].map(|axis| self.weights(axis, count));
        // Reserve sums from the column before the first to the column after the last.
        let mut sums = vec![DVec3::ZERO; self.size[0] + 2];
        for (row, (first, weights)) in rows.iter().enumerate() {
            // The kernels are separable: sum the rows of the image first, then the columns of these
            // sums.
            sums.fill(DVec3::ZERO);
            for (j, weight) in (*first..).zip(weights).filter(|(_, weight)| **weight > 0.0) {
                for (i, sum) in (-1..).zip(&mut sums) {
                    *sum += pixel(self.texel([i, j])) * *weight;
                }
            }
            for (column, (first, weights)) in columns.iter().enumerate() {
                let sums = &sums[(first + 1).cast_unsigned()..];
                let terms = weights.iter().zip(sums).map(|(weight, sum)| *sum * *weight);
                each([column, row], terms.sum());
            }
        }
    }

    /// Returns the mean over all directions of the lookup times a weight. The weight is taken as
    /// constant on each of 1024 × 1024 cells, with its value at the centre of the cell.
    pub(crate) fn weighted(
        &self,
        pixel: impl Fn(usize) -> DVec3,
        weight: impl Fn(DVec3) -> f64,
    ) -> DVec3 {
        const COUNT: usize = 1024;
        let grid = Grid::new(self.mapping, COUNT);
        let mut sum = DVec3::ZERO;
        self.cells(COUNT, pixel, |cell, value| {
            sum += value * weight(grid.direction(cell, [0.5; 2]));
        });
        sum
    }

    /// Returns for each of `count` cells along an axis (0 is along rows) the first pixel that a
    /// lookup in the cell meets, and the weights of this pixel and the next ones: the integral of
    /// each pixel's kernel over the cell, as a fraction of the integral of one over the whole axis.
    fn weights(&self, axis: usize, count: usize) -> Vec<(isize, Vec<f64>)> {
        let size = self.size[axis] as f64;
        // Measure positions in pixels from `shift` on. Between `m` and `m` + 1 a lookup meets pixel
        // m and, if it interpolates, the pixel after it.
        let shift = match self.filter {
            SkyFilter::Linear => 0.5,
            SkyFilter::Nearest => 0.0,
        };
        let cell = |k: usize| {
            let [from, to] = [k, k + 1].map(|k| k as f64 / count as f64 * size - shift);
            let mut weights = vec![0.0];
            let mut m = from.floor();
            #[allow(clippy::cast_possible_truncation, reason = "within the image's size")]
            let first = m as isize;
            // Split the cell at the pixels' borders, and divide each part between pixel m and the
            // next one.
            while m < to {
                let (start, end) = (from.max(m), to.min(m + 1.0));
                let (whole, moment) = self.moments(axis, [start + shift, end + shift]);
                let next = match self.filter {
                    SkyFilter::Linear => moment + whole * (0.5 * (start + end) - m),
                    SkyFilter::Nearest => 0.0,
                };
                // Rounding must not make a weight negative.
                let next = next.max(0.0).min(whole);
                let last = weights.len() - 1;
                weights[last] += whole - next;
                weights.push(next);
                m += 1.0;
            }
            (first, weights)
        };
        (0..count).map(cell).collect()
    }

    /// Returns the integrals of 1 and of the distance from the interval's midpoint over an interval
    /// in pixels, weighted by the solid angle along the axis.
    fn moments(&self, axis: usize, [from, to]: [f64; 2]) -> (f64, f64) {
        let size = self.size[axis] as f64;
        if axis == 0 || self.mapping == SkyMapping::EqualArea {
            return ((to - from) / size, 0.0);
        }
        // Integrate sin θ/2 over the angles from the pole, with s = θ − middle:
        // sin θ = sin(middle) cos s + cos(middle) sin s.
        let [middle, half] = [from + to, to - from].map(|x| FRAC_PI_2 * x / size);
        let (sine, cosine) = sin_cos(middle);
        let (s, c) = sin_cos(half);
        (sine * s, cosine * (s - half * c) * size / PI)
    }
}

/// Returns the index of the cell, out of `count` along a side, at a position in [0, 1].
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "below the number of cells"
)]
fn index(position: f64, count: usize) -> usize {
    (below_one(position) * count as f64) as usize
}

/// Returns the position of a direction in an image by longitude (from x towards y) and by the angle
/// from z, in [0, 1]².
fn by_angles(w: DVec3) -> [f64; 2] {
    let turn = atan2(w.y, w.x) / TAU;
    let turn = if turn < 0.0 { turn + 1.0 } else { turn };
    // Next to the poles the cosine does not determine the angle, but the tangent does.
    let angle = FRAC_PI_2 - atan2(w.z, (w.x * w.x + w.y * w.y).sqrt());
    [turn, angle / PI]
}

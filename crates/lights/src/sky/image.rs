//! This module holds an environment's image, and samples directions in proportion to it.
#![allow(
    clippy::disallowed_types,
    clippy::disallowed_macros,
    reason = "tables of an environment, built with it"
)]

use crate::LightSpace;
use crate::directions::{Grid, Raster, SkyFilter, SkyMapping};
use core::f64::consts::PI;
use core::fmt;
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{DMat3, DVec3};
use std::sync::LazyLock;

/// The reason why pixels cannot be an environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyError {
    /// The number of pixels is not width × height, or there are no pixels.
    Count,
    /// An equal-area map is not square.
    NotSquare,
    /// The pixel with this index is negative, infinite or not a number.
    Pixel(usize),
    /// The transform is not a rotation, with or without a reflection, to 10⁻⁶.
    Transform,
}

impl fmt::Display for SkyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count => f.write_str("the number of pixels is not width times height"),
            Self::NotSquare => f.write_str("an equal-area map is square"),
            Self::Pixel(k) => write!(f, "pixel {k} is negative, infinite or not a number"),
            Self::Transform => f.write_str("the transform of an environment has to be a rotation"),
        }
    }
}

impl core::error::Error for SkyError {}

/// The radiance of a sky as an image, with a hierarchy by which directions are sampled in
/// proportion to it.
///
/// The radiance between the centres of pixels is interpolated, or it is the radiance of the nearest
/// pixel ([`SkyFilter`]). Sampling descends the hierarchy from the whole sphere, and chooses one of
/// four cells at each level, in proportion to the exact integral of the radiance over the cell; at
/// the top levels the choice includes the cosine. One hundredth of the density is uniform.
///
/// The memory is twelve bytes for each pixel, four bytes for each cell of a grid over the image of
/// up to 2048 × 2048 cells, and a third more for the levels above the grid. An image of 16384 ×
/// 8192 pixels takes 1.63 GB.
#[derive(Clone, PartialEq)]
pub struct SkyImage {
    raster: Raster,
    /// The grid of the cells of the finest level.
    grid: Grid,
    pixels: Vec<[f32; 3]>,
    /// The space of the image's directions.
    space: LightSpace,
    scale: DVec3,
    mean: DVec3,
    /// Levels of 1, 4, 16, … cells, row by row. The value of a cell is the integral of the radiance
    /// over it, divided by the solid angle of the mean cell and summed over the channels, as a
    /// fraction of the brightest pixel.
    levels: Vec<Vec<f32>>,
}

impl fmt::Debug for SkyImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.raster.size;
        write!(f, "SkyImage({width} x {height}, {:?})", self.raster.mapping)
    }
}

/// The fraction of the mean over all cells that is added to each cell of the hierarchy, so that a
/// part of the density is uniform.
const UNIFORM: f32 = 0.01;

/// The largest number of levels below the whole sphere: 2048 × 2048 cells.
const DEEPEST: usize = 11;

/// The number of top levels at which the choice includes the cosine.
const BY_COSINE: usize = 5;

impl SkyImage {
    /// Makes a sky of an image of `size` columns and rows, first row first, interpolated between
    /// pixels. The radiance is `scale` times the pixel, and `to_image` rotates directions of the
    /// world to directions of the mapping.
    ///
    /// # Errors
    /// Returns an error where the pixels are not an environment, or the transform is not a
    /// rotation.
    pub fn new(
        mapping: SkyMapping,
        size: [usize; 2],
        pixels: Vec<[f32; 3]>,
        to_image: DMat3,
        scale: DVec3,
    ) -> Result<Self, SkyError> {
        let off = to_image.transpose() * to_image - DMat3::IDENTITY;
        let error = off.to_cols_array().into_iter().map(f64::abs);
        let space = LightSpace::new(to_image.transpose()).ok_or(SkyError::Transform)?;
        if !(error.fold(0.0, f64::max) <= 1e-6) {
            return Err(SkyError::Transform);
        }
        Self::placed(SkyFilter::Linear, mapping, size, pixels, space, scale)
    }

    /// Makes a sky like [`SkyImage::new`], with a filter for the lookup of pixels, and in the space
    /// of a light under any transform.
    ///
    /// # Errors
    /// Returns an error where the pixels are not an environment, or the scale is negative or not
    /// finite.
    pub fn placed(
        filter: SkyFilter,
        mapping: SkyMapping,
        size: [usize; 2],
        pixels: Vec<[f32; 3]>,
        space: LightSpace,
        scale: DVec3,
    ) -> Result<Self, SkyError> {
        // Refuse pixels that are not an image of all directions.
        let [width, height] = size;
        if pixels.is_empty() || width.checked_mul(height) != Some(pixels.len()) {
            return Err(SkyError::Count);
        }
        if mapping == SkyMapping::EqualArea && width != height {
            return Err(SkyError::NotSquare);
        }
        let is_good = |rgb: &[f32; 3]| rgb.iter().all(|v| *v >= 0.0 && v.is_finite());
        if let Some(bad) = pixels.iter().position(|rgb| !is_good(rgb)) {
            return Err(SkyError::Pixel(bad));
        }
        if !(scale.is_finite() && scale.min_element() >= 0.0) {
            return Err(SkyError::Transform);
        }
        let raster = Raster {
            size,
            mapping,
            filter,
        };
        // Choose a grid with about as many cells as there are pixels, and weigh its cells.
        let wanted = (pixels.len() as f64).sqrt();
        let fits = |depth: &usize| (1_u32 << depth) as f64 >= wanted;
        let depth = (3..DEEPEST).find(fits).unwrap_or(DEEPEST);
        let mut image = Self {
            raster,
            grid: Grid::new(mapping, 1 << depth),
            pixels,
            space,
            scale,
            mean: DVec3::ZERO,
            levels: Vec::new(),
        };
        image.build();
        Ok(image)
    }

    /// The mean radiance of all directions.
    #[must_use]
    pub const fn mean(&self) -> DVec3 {
        self.mean
    }

    /// Returns the arguments of [`SkyImage::new`]: the mapping, columns and rows, pixels, the map
    /// from directions of the world to directions of the mapping, and the scale.
    #[must_use]
    pub fn made_of(&self) -> (SkyMapping, [usize; 2], &[[f32; 3]], DMat3, DVec3) {
        let Raster { mapping, size, .. } = self.raster;
        (mapping, size, &self.pixels, self.space.matrix(), self.scale)
    }

    /// Returns the memory of the pixels and the hierarchy in bytes.
    #[must_use]
    pub fn memory(&self) -> usize {
        let levels = self.levels.iter().map(|level| size_of_val(&level[..]));
        size_of_val(&self.pixels[..]) + levels.sum::<usize>()
    }

    /// Returns the radiance from a unit direction of the world.
    #[must_use]
    pub fn radiance(&self, w: DVec3) -> DVec3 {
        self.local_radiance(self.space.to_light(w))
    }

    /// Returns the radiance from a unit direction of the image.
    fn local_radiance(&self, w: DVec3) -> DVec3 {
        self.raster.lookup(w, |k| self.pixel(k))
    }

    /// Returns the solid angle in the image over the solid angle in the world, about a unit
    /// direction of the image.
    fn stretch(&self, w: DVec3) -> f64 {
        self.space.stretch(self.space.to_world(w))
    }

    /// Returns the radiance of a pixel.
    fn pixel(&self, k: usize) -> DVec3 {
        self.scale * DVec3::from(self.pixels[k].map(f64::from))
    }

    /// Returns the irradiance of a surface with the unit normal `n` that sees all of the sky above
    /// it.
    ///
    /// **Error**: 10⁻⁵ of π times the mean radiance of a sky without sharp borders. The radiance is
    /// integrated exactly over 1024 × 1024 cells, and each cell has the cosine of its centre.
    #[must_use]
    pub fn irradiance(&self, n: DVec3) -> DVec3 {
        self.raster.weighted(
            |k| self.pixel(k),
            |w| n.dot(self.space.to_world(w)).max(0.0) / self.stretch(w),
        ) * (4.0 * PI)
    }

    /// Builds the hierarchy over cells of about a pixel, from the integrals of the radiance over
    /// them.
    fn build(&mut self) {
        let count = self.grid.count;
        let all = (0..self.pixels.len()).map(|k| self.pixel(k).element_sum());
        // An image that is all black gets the value zero in each cell, not a quotient of zeros.
        let brightest = all.fold(f64::MIN_POSITIVE, f64::max);
        // Integrate the radiance over each cell of the finest level.
        let number = (count * count) as f64;
        let mut finest = vec![0.0_f32; count * count];
        let (mut mean, mut whole) = (DVec3::ZERO, 0.0);
        #[allow(clippy::cast_possible_truncation, reason = "importance is f32")]
        self.raster.cells(
            count,
            |k| self.pixel(k),
            |[i, j], value| {
                // Estimate the cell's solid angle in the world from the stretch in its middle.
                let shrink = 1.0 / self.stretch(self.grid.direction([i, j], [0.5; 2]));
                (mean, whole) = (
                    mean + value * shrink,
                    whole + self.grid.fraction(j) * shrink,
                );
                finest[j * count + i] = (value.element_sum() * shrink / brightest * number) as f32;
            },
        );
        // Without a stretch the cells cover all directions exactly.
        self.mean = if self.space.is_rigid() {
            mean
        } else {
            mean / whole
        };
        // Add the uniform part, in proportion to the solid angle.
        let floor = f64::from(UNIFORM) * (mean.element_sum() / brightest) * number;
        for (j, row) in finest.chunks_exact_mut(count).enumerate() {
            #[allow(clippy::cast_possible_truncation, reason = "importance is f32")]
            let floor = (floor * self.grid.fraction(j)) as f32;
            row.iter_mut().for_each(|cell| *cell += floor);
        }
        // Sum four cells of each level into a cell of the level above.
        let mut levels = vec![finest];
        let mut count = count;
        while count > 1 {
            count /= 2;
            let below = &levels[levels.len() - 1];
            let cell = |k: usize| {
                let (i, j) = (2 * (k % count), 2 * (k / count));
                let at = |a: usize, b: usize| below[(j + b) * 2 * count + i + a];
                0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
            };
            levels.push((0..count * count).map(cell).collect());
        }
        levels.reverse();
        self.levels = levels;
    }

    /// Descends the hierarchy from the whole sphere to a cell of the finest level. For each axis
    /// and the probability of the first half along it, `second` decides whether the second half is
    /// taken. Returns the cell and its probability, which is zero if all cells are black.
    fn descend(
        &self,
        normal: Option<DVec3>,
        mut second: impl FnMut(usize, f64) -> bool,
    ) -> ([usize; 2], f64) {
        let (mut cell, mut probability) = ([0, 0], 1.0);
        let normal = normal.map(|n| self.space.normal_to_light(n));
        let means = &MEANS[self.raster.mapping as usize];
        for (level, values) in self.levels.iter().enumerate().skip(1) {
            let count = 1 << level;
            let weight = |a: usize, b: usize| {
                let (i, j) = (2 * cell[0] + a, 2 * cell[1] + b);
                let value = f64::from(values[j * count + i]);
                match normal {
                    Some(n) if level <= BY_COSINE => {
                        value * about(n, means[level - 1][j * count + i])
                    }
                    _ => value,
                }
            };
            // Choose a column of the four cells, and then a row.
            let weights = [[weight(0, 0), weight(0, 1)], [weight(1, 0), weight(1, 1)]];
            let columns = weights.map(|[a, b]| a + b);
            let total = columns[0] + columns[1];
            if !(total > 0.0) {
                return (cell, 0.0);
            }
            let right = usize::from(second(0, columns[0] / total));
            let down = usize::from(second(1, weights[right][0] / columns[right]));
            probability *= weights[right][down] / total;
            cell = [2 * cell[0] + right, 2 * cell[1] + down];
        }
        (cell, probability)
    }

    /// Returns the density per solid angle in a cell that is chosen with a given probability.
    fn density(&self, cell: [usize; 2], probability: f64) -> f64 {
        probability / (4.0 * PI * self.grid.fraction(cell[1]))
    }

    /// Returns a direction for two random numbers, and its density per solid angle, which is zero
    /// where no direction can be sampled.
    pub(crate) fn sample(&self, mut u: [f64; 2], normal: Option<DVec3>) -> (DVec3, f64) {
        // At each level take the half that the number falls into, and rescale the number.
        let (cell, probability) = self.descend(normal, |axis, share| {
            let is_second = u[axis] >= share;
            u[axis] = fraction(match is_second {
                true => (u[axis] - share) / (1.0 - share),
                false => u[axis] / share,
            });
            is_second
        });
        let w = self.grid.direction(cell, u);
        let density = self.density(cell, probability) * self.stretch(w);
        (self.space.to_world(w), density)
    }

    /// Returns the density per solid angle with which a direction is drawn.
    pub(crate) fn pdf(&self, w: DVec3, normal: Option<DVec3>) -> f64 {
        let place = self.grid.locate(self.space.to_light(w));
        // The bits of the cell's column and row say which half it is in at each level.
        let mut bits = [self.levels.len() - 1; 2];
        let (cell, probability) = self.descend(normal, |axis, _| {
            bits[axis] -= 1;
            place[axis].0 >> bits[axis] & 1 == 1
        });
        self.density(cell, probability) * self.space.stretch(w)
    }

    /// Returns the random numbers from which a direction is drawn.
    pub(crate) fn invert(&self, w: DVec3, normal: Option<DVec3>) -> Option<[f64; 2]> {
        let place = self.grid.locate(self.space.to_light(w));
        let depth = self.levels.len() - 1;
        let mut bits = [depth; 2];
        // Narrow the interval of each number that leads to the cell.
        let mut from = [(0.0, 1.0); 2];
        let (_, probability) = self.descend(normal, |axis, share| {
            bits[axis] -= 1;
            let is_second = place[axis].0 >> bits[axis] & 1 == 1;
            let (start, length) = &mut from[axis];
            if is_second {
                *start += *length * share;
                *length *= 1.0 - share;
            } else {
                *length *= share;
            }
            is_second
        });
        let number = |axis: usize| {
            let (start, length) = from[axis];
            below_one(start + length * place[axis].1)
        };
        (probability > 0.0).then(|| [number(0), number(1)])
    }
}

/// Returns approximately the mean of max(0, n · w) over the directions w of a cell whose mean
/// direction is `m`; it is positive everywhere.
///
/// The mean of max(0, x) is half the sum of the means of x and |x|. The mean of |x| is about the
/// root of the mean square, which is the square of the mean plus the variance. The variance of w
/// over all axes is 1 − m², and a third of it belongs to each axis.
fn about(n: DVec3, m: DVec3) -> f64 {
    let c = n.dot(m);
    0.5 * (c + (c * c + (1.0 - m.length_squared()) / 3.0).sqrt())
}

/// The mean directions of the cells of the top levels, where the choice includes the cosine, by
/// mapping and from level 1 on.
static MEANS: LazyLock<[Vec<Vec<DVec3>>; 2]> = LazyLock::new(|| {
    [SkyMapping::Equirectangular, SkyMapping::EqualArea].map(|mapping| {
        let fine = Grid::new(mapping, 4 << BY_COSINE);
        let level = |level: usize| {
            let (grid, size) = (Grid::new(mapping, 1 << level), fine.count >> level);
            let mut means = vec![DVec3::ZERO; grid.count * grid.count];
            for k in 0..fine.count * fine.count {
                let [i, j] = [k % fine.count, k / fine.count];
                let part = fine.fraction(j) / grid.fraction(j / size);
                let mean = &mut means[j / size * grid.count + i / size];
                *mean += fine.direction([i, j], [0.5; 2]) * part;
            }
            means
        };
        (1..=BY_COSINE).map(level).collect()
    })
});

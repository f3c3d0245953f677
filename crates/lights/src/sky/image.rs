//! Images of all directions, and directions in proportion to them.
#![allow(
    clippy::disallowed_types,
    clippy::disallowed_macros,
    reason = "tables of an environment, built with it"
)]

use crate::LightSpace;
use crate::octahedral::{sphere_to_square, square_to_sphere};
use crate::profile::interpolate;
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use core::fmt;
use linelit_elementary::{sin, sin_cos};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{DMat3, DVec3};
use std::sync::LazyLock;

/// The way in which an image covers the sphere of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyMapping {
    /// Columns by longitude, from the x axis towards the y axis; rows by the angle from the z axis,
    /// which the first row is at (pbrt-v3's environments).
    Equirectangular,
    /// The equal-area octahedral map of a square ([`square_to_sphere`]; pbrt-v4's environments).
    EqualArea,
}

/// The reason why pixels are no environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyError {
    /// The number of pixels is not width × height, or there are none.
    Count,
    /// An equal-area map that is not square.
    NotSquare,
    /// The pixel of this number is negative, infinite or not a number.
    Pixel(usize),
    /// The transform is no rotation, with or without a reflection, to 10⁻⁶.
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

/// The radiance of a sky as an image, and a hierarchy by which directions are drawn in proportion
/// to it: four bytes for each cell of an equal-area map of up to 2048 × 2048 cells, and a third
/// more for the levels above, beside twelve bytes for each pixel. One of 16384 × 8192 pixels takes
/// 1.63 GB.
///
/// Radiance is interpolated between the centres of pixels. Drawing descends the hierarchy from the
/// whole sphere, at each level into one of four cells; at the top, the choice knows the cosine,
/// too. A hundredth of the density is uniform, so that no direction is missed.
#[derive(Clone, PartialEq)]
pub struct SkyImage {
    size: [usize; 2],
    pixels: Vec<[f32; 3]>,
    mapping: SkyMapping,
    /// The space of the image's directions.
    space: LightSpace,
    scale: DVec3,
    mean: DVec3,
    /// Levels of 1, 4, 16, … cells, row by row: the mean radiance over the channels, as a share of
    /// the brightest pixel's.
    levels: Vec<Vec<f32>>,
}

impl fmt::Debug for SkyImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size;
        write!(f, "SkyImage({width} x {height}, {:?})", self.mapping)
    }
}

/// The share of the mean that each cell gets.
const UNIFORM: f32 = 0.01;

/// The most levels below the whole sphere: 2048 × 2048 cells.
const DEEPEST: usize = 11;

/// The levels at which the choice knows the cosine.
const BY_COSINE: usize = 5;

/// A bound of the angle between the centre of a cell and its points, times 2^level: it is π at
/// level 1, 4.283 at level 8, and tends to 4.297.
const REACH: f64 = 4.31;

impl SkyImage {
    /// An image of `size` columns and rows, first row first, of which `scale` times a pixel is the
    /// radiance; `to_image` turns directions of the world to those of the mapping.
    ///
    /// # Errors
    /// Where the pixels are no environment, or the transform no rotation.
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
        Self::placed(mapping, size, pixels, space, scale)
    }

    /// [`SkyImage::new`] of an image in the space of a light, under any transform.
    ///
    /// # Errors
    /// Where the pixels are no environment, or the scale is negative or not finite.
    pub fn placed(
        mapping: SkyMapping,
        size: [usize; 2],
        pixels: Vec<[f32; 3]>,
        space: LightSpace,
        scale: DVec3,
    ) -> Result<Self, SkyError> {
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
        let mut image = Self {
            size,
            pixels,
            mapping,
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

    /// What [`SkyImage::new`] was given: the mapping, columns and rows, pixels, the map from
    /// directions of the world to those of the mapping, and scale.
    #[must_use]
    pub fn made_of(&self) -> (SkyMapping, [usize; 2], &[[f32; 3]], DMat3, DVec3) {
        let Self { mapping, size, .. } = *self;
        (mapping, size, &self.pixels, self.space.matrix(), self.scale)
    }

    /// Bytes of pixels and hierarchy.
    #[must_use]
    pub fn memory(&self) -> usize {
        let levels = self.levels.iter().map(|level| size_of_val(&level[..]));
        size_of_val(&self.pixels[..]) + levels.sum::<usize>()
    }

    /// The radiance from a unit direction of the world.
    #[must_use]
    pub fn radiance(&self, w: DVec3) -> DVec3 {
        self.local_radiance(self.space.to_light(w))
    }

    fn local_radiance(&self, w: DVec3) -> DVec3 {
        let is_octahedral = self.mapping == SkyMapping::EqualArea;
        let pixel = |k: usize| DVec3::from(self.pixels[k].map(f64::from));
        self.scale * interpolate(self.size, is_octahedral, w, pixel)
    }

    /// The radiance of a pixel.
    fn scaled(&self, pixel: [f32; 3]) -> DVec3 {
        self.scale * DVec3::from(pixel.map(f64::from))
    }

    /// The irradiance of a surface with the unit normal `n` that sees all of the sky above it, by
    /// sums over the finest cells.
    #[must_use]
    pub fn irradiance(&self, n: DVec3) -> DVec3 {
        let count = 1_usize << (self.levels.len() - 1);
        let cells = (0..count * count).map(|k| {
            let w = center(self.levels.len() - 1, k % count, k / count);
            let along = self.space.to_world(w);
            let cosine = n.dot(along);
            if cosine > 0.0 {
                self.local_radiance(w) * (cosine / self.space.stretch(along))
            } else {
                DVec3::ZERO
            }
        });
        cells.sum::<DVec3>() * (4.0 * PI / (count * count) as f64)
    }

    /// Makes the hierarchy: cells of about a pixel, each the mean of four places, or of the pixels
    /// in it where these are so small that places miss some.
    fn build(&mut self) {
        let wanted = (self.pixels.len() as f64).sqrt();
        let mut depth = 3;
        while depth < DEEPEST && ((1_u32 << depth) as f64) < wanted {
            depth += 1;
        }
        let count = 1_usize << depth;
        let all = self
            .pixels
            .iter()
            .map(|rgb| self.scaled(*rgb).element_sum());
        // Black images have no share.
        let brightest = all.fold(f64::MIN_POSITIVE, f64::max);
        let mut finest = self.small_pixels(count, brightest);
        for (k, cell) in finest.iter_mut().enumerate() {
            let corner = [k % count, k / count].map(|c| c as f64);
            let place = |[a, b]: [f64; 2]| {
                let at = [corner[0] + a, corner[1] + b].map(|c| c / count as f64);
                let w = square_to_sphere(at);
                self.local_radiance(w) / self.space.stretch(self.space.to_world(w))
            };
            let places = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
            let mean = places.into_iter().map(place).sum::<DVec3>() * 0.25;
            #[allow(clippy::cast_possible_truncation, reason = "importance is f32")]
            let importance = (mean.element_sum() / brightest) as f32;
            *cell = cell.max(importance);
        }
        #[allow(clippy::cast_possible_truncation, reason = "importance is f32")]
        let floor = UNIFORM * (self.mean.element_sum() / brightest) as f32;
        finest.iter_mut().for_each(|cell| *cell += floor);
        let mut levels = vec![finest];
        for level in (0..depth).rev() {
            let (count, below) = (1_usize << level, &levels[levels.len() - 1]);
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

    /// Of a level of count × count cells, the mean radiance of pixels below a quarter of a cell, as
    /// next to the poles, as a share of the brightest's. Sets the mean of all.
    fn small_pixels(&mut self, count: usize, brightest: f64) -> Vec<f32> {
        let mut cells = vec![0.0_f32; count * count];
        let [width, height] = self.size;
        let is_octahedral = self.mapping == SkyMapping::EqualArea;
        let middle = |k: usize, count: usize| (k as f64 + 0.5) / count as f64;
        let turns: Vec<_> = (0..width)
            .map(|i| sin_cos(TAU * middle(i, width)))
            .collect();
        let mut sum = DVec3::ZERO;
        for (j, row) in self.pixels.chunks_exact(width).enumerate() {
            let (sin_theta, cos_theta) = sin_cos(PI * middle(j, height));
            // The share of the sphere.
            let share = match self.mapping {
                SkyMapping::EqualArea => 1.0 / self.pixels.len() as f64,
                SkyMapping::Equirectangular => {
                    sin_theta * sin(FRAC_PI_2 / height as f64) / width as f64
                }
            };
            let in_cell = share * (count * count) as f64;
            for (i, pixel) in row.iter().enumerate() {
                let radiance = self.scaled(*pixel);
                sum += radiance * share;
                if radiance == DVec3::ZERO || in_cell >= 0.25 {
                    continue;
                }
                let (s, c) = turns[i];
                let at = match is_octahedral {
                    true => [middle(i, width), middle(j, height)],
                    false => sphere_to_square(DVec3::new(sin_theta * c, sin_theta * s, cos_theta)),
                };
                let [x, y] = at.map(|x| index(x, count));
                #[allow(clippy::cast_possible_truncation, reason = "importance is f32")]
                let importance = (radiance.element_sum() / brightest * in_cell) as f32;
                cells[y * count + x] += importance;
            }
        }
        self.mean = sum;
        cells
    }

    /// Descends from the whole sphere to a cell of the finest level: `second` says, of an axis
    /// and the share of the first half along it, whether the second half is taken. Gives the cell
    /// and its probability, zero where there is no cell to take.
    fn descend(
        &self,
        normal: Option<DVec3>,
        mut second: impl FnMut(usize, f64) -> bool,
    ) -> ([usize; 2], f64) {
        let (mut cell, mut probability) = ([0, 0], 1.0);
        let normal = normal.map(|n| self.space.normal_to_light(n));
        for (level, values) in self.levels.iter().enumerate().skip(1) {
            let count = 1 << level;
            let weight = |a: usize, b: usize| {
                let (i, j) = (2 * cell[0] + a, 2 * cell[1] + b);
                let value = f64::from(values[j * count + i]);
                match normal {
                    Some(n) if level <= BY_COSINE => {
                        value * about(n.dot(CENTERS[level][j * count + i]), level)
                    }
                    _ => value,
                }
            };
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

    /// The cells of the finest level along each side.
    fn count(&self) -> f64 {
        (1_u32 << (self.levels.len() - 1)) as f64
    }

    /// The density per solid angle of a cell of some probability.
    fn density(&self, probability: f64) -> f64 {
        probability * self.count() * self.count() / (4.0 * PI)
    }

    /// A direction from two random numbers, and its density per solid angle; zero where there is
    /// none.
    pub(super) fn sample(&self, mut u: [f64; 2], normal: Option<DVec3>) -> (DVec3, f64) {
        let (cell, probability) = self.descend(normal, |axis, share| {
            let is_second = u[axis] >= share;
            u[axis] = fraction(match is_second {
                true => (u[axis] - share) / (1.0 - share),
                false => u[axis] / share,
            });
            is_second
        });
        let at = [0, 1].map(|k| (cell[k] as f64 + u[k]) / self.count());
        let w = self.space.to_world(square_to_sphere(at));
        (w, self.density(probability) * self.space.stretch(w))
    }

    /// The cell of a direction, and the place in it.
    fn place(&self, w: DVec3) -> [(usize, f64); 2] {
        let count = 1 << (self.levels.len() - 1);
        let at = sphere_to_square(self.space.to_light(w));
        at.map(|x| (index(x, count), (below_one(x) * count as f64).fract()))
    }

    /// The density per solid angle with which a direction is drawn.
    pub(super) fn pdf(&self, w: DVec3, normal: Option<DVec3>) -> f64 {
        let place = self.place(w);
        let mut bits = [self.levels.len() - 1; 2];
        let (_, probability) = self.descend(normal, |axis, _| {
            bits[axis] -= 1;
            place[axis].0 >> bits[axis] & 1 == 1
        });
        self.density(probability) * self.space.stretch(w)
    }

    /// The random numbers from which a direction is drawn.
    pub(super) fn invert(&self, w: DVec3, normal: Option<DVec3>) -> Option<[f64; 2]> {
        let place = self.place(w);
        let depth = self.levels.len() - 1;
        let mut bits = [depth; 2];
        // The interval of each number that leads to the cell.
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

/// The cell, of so many along a side, at a place in [0, 1].
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "below the number of cells"
)]
fn index(place: f64, count: usize) -> usize {
    (below_one(place) * count as f64) as usize
}

/// About the mean of max(0, cos) over a cell of a level whose centre has the cosine `c`, positive
/// everywhere.
fn about(c: f64, level: usize) -> f64 {
    let reach = REACH / (1_u32 << level) as f64;
    // The mean square of the distance from the centre is about a quarter of the largest.
    0.5 * (c + (c * c + 0.25 * reach * reach).sqrt())
}

/// The centres of the cells of the levels that are asked for all the time.
static CENTERS: LazyLock<Vec<Vec<DVec3>>> = LazyLock::new(|| {
    let level = |level: usize| {
        let count = 1_usize << level;
        (0..count * count)
            .map(|k| center(level, k % count, k / count))
            .collect()
    };
    (0..=BY_COSINE).map(level).collect()
});

/// The direction of the centre of a cell.
fn center(level: usize, i: usize, j: usize) -> DVec3 {
    let count = (1_u32 << level) as f64;
    square_to_sphere([(i as f64 + 0.5) / count, (j as f64 + 0.5) / count])
}

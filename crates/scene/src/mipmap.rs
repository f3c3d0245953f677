//! Mipmaps: images in smaller and smaller copies, on which a footprint is looked up in a few
//! texels.
//!
//! The pyramid is pbrt's (*Physically Based Rendering*, 3rd edition, §10.4): sizes are powers of
//! two, to which other images are resampled with a Lanczos window of two texels; each level has the
//! means of two by two texels of the finer one, in linear light. Levels from the second on are
//! stored in `f32`, which rounds by 6e-8. The first level is not stored: its texels are the pixels
//! of the image, or are computed from a few of them at each lookup.

use crate::footprint::Footprint;
use crate::image::ImageData;
use crate::texture::{Wrap, wrapped};
use linelit_elementary::{exp, log2, sin_cos};
use linelit_geometry::{DVec2, DVec3};
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{LazyLock, OnceLock};

/// The pyramids of an image, one for each pair of wrap modes, each built when it is first needed.
/// The resampling of images whose sizes are not powers of two depends on the pixels beyond their
/// edges; other images have only the first pyramid.
#[derive(Default)]
pub(crate) struct Pyramids([OnceLock<Box<Pyramid>>; 16]);

impl Clone for Pyramids {
    /// Returns an empty cache, as images are cloned to change their pixels.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Pyramids {
    /// Returns true: any two caches count as equal, as pyramids follow from the pixels of their
    /// images.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Pyramids {
    /// Returns the pyramid for these wrap modes, of the image that this cache belongs to.
    pub(crate) fn of(&self, image: &ImageData, wrap: [Wrap; 2]) -> &Pyramid {
        let index = if is_whole(image) {
            0
        } else {
            4 * wrap[0] as usize + wrap[1] as usize
        };
        self.0[index].get_or_init(|| Box::new(Pyramid::new(image, wrap)))
    }

    /// Returns the size of the pyramids that have been built, in bytes.
    pub(crate) fn memory(&self) -> usize {
        let built = self.0.iter().filter_map(OnceLock::get);
        built.map(|pyramid| pyramid.memory()).sum()
    }
}

/// Returns whether width and height of an image are powers of two.
fn is_whole(image: &ImageData) -> bool {
    image.width().is_power_of_two() && image.height().is_power_of_two()
}

/// The levels of an image. Rows count from the top, as the image's do.
pub(crate) struct Pyramid {
    /// Columns and rows of the first level.
    size: [u32; 2],
    /// The wrap modes of the image that the first level is resampled from; `None` if that level is
    /// the image itself.
    resampled: Option<[Wrap; 2]>,
    /// The levels from the second on.
    coarser: Vec<Level>,
}

/// A stored level of a pyramid.
struct Level {
    size: [u32; 2],
    texels: Texels,
}

/// The texels of a level by rows, with one number for each if the image is grey.
enum Texels {
    Grey(Vec<f32>),
    Colour(Vec<[f32; 3]>),
}

/// The four pixels of a row or a column that a resampled texel is a weighted sum of.
#[derive(Clone, Copy)]
struct Taps {
    pixels: [u32; 4],
    /// The weights, which are zero for pixels beyond a black edge.
    weights: [f64; 4],
}

impl Pyramid {
    /// Builds all levels from the second on.
    fn new(image: &ImageData, wrap: [Wrap; 2]) -> Self {
        let mut pyramid = Self {
            size: [image.width(), image.height()].map(u32::next_power_of_two),
            resampled: (!is_whole(image)).then_some(wrap),
            coarser: Vec::new(),
        };
        let is_grey = image.is_grey();
        while pyramid.top().0 != [1, 1] {
            let level = match pyramid.coarser.last() {
                Some(finer) => finer.halved(),
                None => pyramid.second(image, is_grey),
            };
            pyramid.coarser.push(level);
        }
        pyramid
    }

    /// Returns the size and the index of the coarsest level so far.
    fn top(&self) -> ([u32; 2], usize) {
        let last = self.coarser.last();
        (
            last.map_or(self.size, |level| level.size),
            self.coarser.len(),
        )
    }

    /// Computes the second level from the image, in blocks of columns, so that the memory for
    /// resampled rows does not grow with the image.
    fn second(&self, image: &ImageData, is_grey: bool) -> Level {
        /// The number of columns of a block.
        const BLOCK: u32 = 4096;
        let mut level = Level::sized(self.size, is_grey);
        let [columns, finer] = self.size;
        let mut from = 0;
        while from < columns {
            // Compute the resampling weights of the columns of this block.
            let to = (from + BLOCK).min(columns);
            let mut rows = Rows {
                pyramid: self,
                image,
                columns: from..to,
                across: match self.resampled {
                    Some([wrap, _]) => (from..to)
                        .map(|x| Taps::new(x, [image.width(), columns], wrap))
                        .collect(),
                    None => Vec::new(),
                },
                kept: VecDeque::new(),
            };
            // Average two by two texels of the first level; a single row or column counts twice.
            for y in 0..level.size[1] {
                let top = rows.first_level(2 * y);
                let bottom = rows.first_level((2 * y + 1).min(finer - 1));
                for (x, left) in (from / 2..).zip((0..top.len()).step_by(2)) {
                    let right = (left + 1).min(top.len() - 1);
                    let sum = top[left] + top[right] + bottom[left] + bottom[right];
                    level.set(x, y, 0.25 * sum);
                }
            }
            from = to;
        }
        level
    }

    /// Returns a texel of a level, by column and row within it.
    fn texel(&self, image: &ImageData, level: usize, x: u32, y: u32) -> DVec3 {
        if let Some(level) = level.checked_sub(1).and_then(|k| self.coarser.get(k)) {
            return level.texel(x, y);
        }
        // Take the first level from the image, resampled if its size is not a power of two.
        let Some(wrap) = self.resampled else {
            return image.pixel(x, y);
        };
        let across = Taps::new(x, [image.width(), self.size[0]], wrap[0]);
        let down = Taps::new(y, [image.height(), self.size[1]], wrap[1]);
        let mut sum = DVec3::ZERO;
        for (row, weight) in down.terms() {
            let terms = across.terms().map(|(x, w)| w * image.pixel(x, row));
            sum += weight * terms.sum::<DVec3>();
        }
        sum.max(DVec3::ZERO)
    }

    /// Returns the size of the stored levels in bytes.
    fn memory(&self) -> usize {
        let levels = self.coarser.iter().map(|level| match &level.texels {
            Texels::Grey(texels) => size_of_val(&texels[..]),
            Texels::Colour(texels) => size_of_val(&texels[..]),
        });
        levels.sum()
    }
}

/// Computes rows of the first level, for a block of columns, in ascending order. Neighbouring rows
/// use the same rows of the image, which are cached after resampling across.
struct Rows<'a> {
    pyramid: &'a Pyramid,
    image: &'a ImageData,
    columns: Range<u32>,
    /// The resampling weights of the columns; empty if they are not resampled.
    across: Vec<Taps>,
    /// The latest rows of the image that were resampled across, each with its index in the image.
    kept: VecDeque<(u32, Vec<DVec3>)>,
}

impl Rows<'_> {
    /// Returns a row of the first level.
    fn first_level(&mut self, y: u32) -> Vec<DVec3> {
        let Some([_, wrap]) = self.pyramid.resampled else {
            let columns = self.columns.clone();
            return columns.map(|x| self.image.pixel(x, y)).collect();
        };
        let down = Taps::new(y, [self.image.height(), self.pyramid.size[1]], wrap);
        let mut sum = vec![DVec3::ZERO; self.across.len()];
        for (row, weight) in down.terms() {
            for (sum, value) in sum.iter_mut().zip(self.across(row)) {
                *sum += weight * *value;
            }
        }
        for value in &mut sum {
            *value = value.max(DVec3::ZERO);
        }
        sum
    }

    /// Returns a row of the image, resampled across.
    fn across(&mut self, row: u32) -> &[DVec3] {
        /// The largest number of rows in the cache: two rows of the first level need at most five
        /// rows of the image.
        const KEPT: usize = 5;
        if let Some(k) = self.kept.iter().position(|(kept, _)| *kept == row) {
            return &self.kept[k].1;
        }
        let image = self.image;
        let value = |taps: &Taps| taps.terms().map(|(x, w)| w * image.pixel(x, row)).sum();
        let values = self.across.iter().map(value).collect();
        self.kept.truncate(KEPT - 1);
        self.kept.push_front((row, values));
        &self.kept[0].1
    }
}

impl Taps {
    /// Creates the taps (pixels and their weights) of texel `index` when a row of `from` pixels is
    /// resampled to `to` texels: a Lanczos window of two pixels on either side, sinc(2 x) sinc(x)
    /// with x from −1 to 1 and sinc x = sin(π x)/(π x), with weights that sum to one.
    fn new(index: u32, [from, to]: [u32; 2], wrap: Wrap) -> Self {
        use std::f64::consts::PI;
        // Find the first of four pixels around the centre of the texel.
        let centre = (f64::from(index) + 0.5) * (f64::from(from) / f64::from(to));
        let first = (centre - 1.5).floor();
        // Evaluate the window. From one pixel to the next, π x grows by a quarter turn, so that one
        // sine and cosine serve all four.
        let start = 0.5 * PI * (first + 0.5 - centre);
        let (sin, cos) = sin_cos(start);
        let sines = [sin, cos, -sin, -cos];
        let double = 2.0 * sin * cos;
        let doubles = [double, -double, double, -double];
        let at = [0, 1, 2, 3].map(|k| {
            let x = start + 0.5 * PI * f64::from(k);
            (first + f64::from(k), x)
        });
        let weights = [0, 1, 2, 3].map(|k| {
            let x = at[k].1;
            if x.abs() < 1e-5 {
                1.0
            } else {
                doubles[k] * sines[k] / (2.0 * x * x)
            }
        });
        // Normalise the weights, and wrap pixels beyond the edges.
        let sum: f64 = weights.iter().sum();
        let pixels = at.map(|(pixel, _)| wrapped(wrap, pixel, from));
        Self {
            pixels: pixels.map(|pixel| pixel.unwrap_or(0)),
            weights: [0, 1, 2, 3].map(|k| match pixels[k] {
                Some(_) => weights[k] / sum,
                None => 0.0,
            }),
        }
    }

    /// Returns the pixels, as indices of columns or rows, and their weights.
    fn terms(&self) -> impl Iterator<Item = (u32, f64)> {
        self.pixels.into_iter().zip(self.weights)
    }
}

impl Level {
    /// Creates a black level of half the size of the finer level, but at least one texel across and
    /// down.
    fn sized(finer: [u32; 2], is_grey: bool) -> Self {
        let size = finer.map(|n| (n / 2).max(1));
        let count = size[0] as usize * size[1] as usize;
        let texels = if is_grey {
            Texels::Grey(vec![0.0; count])
        } else {
            Texels::Colour(vec![[0.0; 3]; count])
        };
        Self { size, texels }
    }

    /// Sets a texel.
    fn set(&mut self, x: u32, y: u32, value: DVec3) {
        let index = self.index(x, y);
        // Resampling may overshoot the largest `f32`.
        let value = value.min(DVec3::splat(f64::from(f32::MAX))).as_vec3();
        match &mut self.texels {
            Texels::Grey(texels) => texels[index] = value.x,
            Texels::Colour(texels) => texels[index] = value.to_array(),
        }
    }

    /// Returns the index of a texel by column and row.
    const fn index(&self, x: u32, y: u32) -> usize {
        y as usize * self.size[0] as usize + x as usize
    }

    /// Returns a texel by column and row.
    fn texel(&self, x: u32, y: u32) -> DVec3 {
        let index = self.index(x, y);
        match &self.texels {
            Texels::Grey(texels) => DVec3::splat(f64::from(texels[index])),
            Texels::Colour(texels) => DVec3::from(texels[index].map(f64::from)),
        }
    }

    /// Returns the next coarser level: means of two by two texels, or of two where this level has a
    /// single row or column.
    fn halved(&self) -> Self {
        let mut coarser = Self::sized(self.size, matches!(self.texels, Texels::Grey(_)));
        let [w, h] = self.size;
        for y in 0..coarser.size[1] {
            let rows = [2 * y, (2 * y + 1).min(h - 1)];
            for x in 0..coarser.size[0] {
                let columns = [2 * x, (2 * x + 1).min(w - 1)];
                let row = |y: u32| self.texel(columns[0], y) + self.texel(columns[1], y);
                coarser.set(x, y, 0.25 * (row(rows[0]) + row(rows[1])));
            }
        }
        coarser
    }
}

/// The upper limit of the ratio of a footprint's axes, which bounds the time of a lookup; larger
/// limits in files are clamped to it.
pub(crate) const MAX_ANISOTROPY: f64 = 64.0;

/// An image with its pyramid and wrap modes, for filtered lookups.
#[derive(Clone, Copy)]
pub(crate) struct Mipmap<'a> {
    pub(crate) image: &'a ImageData,
    pub(crate) pyramid: &'a Pyramid,
    pub(crate) wrap: [Wrap; 2],
}

impl Mipmap<'_> {
    /// Returns the level, as a real number, whose texels have this width in units of the image's
    /// width. The finest level is 0; smaller widths give negative numbers.
    fn level(&self, width: f64) -> f64 {
        self.pyramid.top().1 as f64 + log2(width.max(1e-8))
    }

    /// Returns the texel around a point, on the coarsest level whose texels are no wider than the
    /// footprint.
    pub(crate) fn nearest(&self, at: &Footprint) -> DVec3 {
        let level = self.below(at);
        let [x, y] = self.on_level(level, at.uv);
        self.texel(level, x.round(), y.round())
    }

    /// Returns the bilinear interpolation on the coarsest level whose texels are no wider than the
    /// footprint.
    pub(crate) fn bilinear(&self, at: &Footprint) -> DVec3 {
        self.on(self.below(at), at.uv)
    }

    /// Returns the bilinear interpolations on the two levels around the footprint's width, and a
    /// linear one between them. The width is twice the larger change of the coordinates.
    pub(crate) fn trilinear(&self, at: &Footprint) -> DVec3 {
        let level = self.level(2.0 * at.reach().max_element());
        self.between(level, |k| self.on(k, at.uv))
    }

    /// Returns the elliptically weighted average (Heckbert 1989, *Fundamentals of Texture Mapping
    /// and Image Warping*): the mean, with a Gaussian's weights, over the ellipse of the footprint.
    ///
    /// The ellipse is widened until its length is at most `max_anisotropy` times its width. The
    /// level is chosen by the width, so that few texels lie across, and the means on the two levels
    /// around are interpolated.
    pub(crate) fn ellipse(&self, at: &Footprint, max_anisotropy: f64) -> DVec3 {
        // Sort the axes, and widen the minor one.
        let (mut major, mut minor) = (at.dx, at.dy);
        if major.length_squared() < minor.length_squared() {
            (major, minor) = (minor, major);
        }
        let least = major.length() / max_anisotropy;
        let width = minor.length();
        if width < least {
            minor = if width > 0.0 {
                minor * (least / width)
            } else {
                major.perp() / max_anisotropy
            };
        }
        // Average over the ellipse on the two levels around the width.
        let level = self.level(minor.length()).max(0.0);
        self.between(level, |k| self.ellipse_on(k, at.uv, [major, minor]))
    }

    /// Returns the weighted mean over an ellipse with these axes on one level.
    fn ellipse_on(&self, level: usize, uv: DVec2, axes: [DVec2; 2]) -> DVec3 {
        // The coarsest level has one texel.
        if level >= self.pyramid.top().1 {
            return self.on(level, uv);
        }
        // Convert centre and axes to texels of the level, whose rows count from the top.
        let [x, y] = self.on_level(level, uv);
        let [w, h] = self.size(level).map(f64::from);
        let [p, q] = axes.map(|axis| axis * DVec2::new(w, -h));
        // Find the implicit form a x² + b x y + c y² < 1 of the ellipse. Adding 1 to a and c makes
        // it a texel larger (in quadrature), so that it always holds the centre of a texel.
        let (a, b, c) = (
            p.y * p.y + q.y * q.y + 1.0,
            -2.0 * (p.x * p.y + q.x * q.y),
            p.x * p.x + q.x * q.x + 1.0,
        );
        let discriminant = a * c - 0.25 * b * b;
        let (reach_x, reach_y) = (c.sqrt(), a.sqrt());
        let (a, b, c) = (a / discriminant, b / discriminant, c / discriminant);
        // Add up the texels of its bounding box that are inside.
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for row in whole_numbers(y, reach_y) {
            let dy = row - y;
            for column in whole_numbers(x, reach_x) {
                let dx = column - x;
                let square = a * dx * dx + b * dx * dy + c * dy * dy;
                if square < 1.0 {
                    let weight = gaussian(square);
                    sum += weight * self.texel(level, column, row);
                    weights += weight;
                }
            }
        }
        sum / weights
    }

    /// Returns the linear interpolation of `on` between the two whole levels around a real one,
    /// which is clamped to the levels that exist.
    fn between(&self, level: f64, on: impl Fn(usize) -> DVec3) -> DVec3 {
        let top = self.pyramid.top().1;
        if level <= 0.0 {
            return on(0);
        }
        let lower = whole(level);
        if lower >= top {
            return on(top);
        }
        on(lower).lerp(on(lower + 1), level - lower as f64)
    }

    /// Returns the coarsest whole level whose texels are no wider than the footprint.
    fn below(&self, at: &Footprint) -> usize {
        let level = self.level(2.0 * at.reach().max_element());
        whole(level).min(self.pyramid.top().1)
    }

    /// Returns the bilinear interpolation on one level.
    fn on(&self, level: usize, uv: DVec2) -> DVec3 {
        bilinear(self.on_level(level, uv), |x, y| self.texel(level, x, y))
    }

    /// Returns texture coordinates in texels of a level: the centres of texels are at whole
    /// numbers, and rows count from the top.
    fn on_level(&self, level: usize, uv: DVec2) -> [f64; 2] {
        let [w, h] = self.size(level).map(f64::from);
        [uv.x * w - 0.5, (1.0 - uv.y) * h - 0.5]
    }

    /// Returns the number of columns and rows of a level.
    fn size(&self, level: usize) -> [u32; 2] {
        let coarser = level.checked_sub(1).map(|k| &self.pyramid.coarser[k]);
        coarser.map_or(self.pyramid.size, |level| level.size)
    }

    /// Returns the texel of a level at whole coordinates, which are wrapped beyond its edges.
    fn texel(&self, level: usize, x: f64, y: f64) -> DVec3 {
        let [w, h] = self.size(level);
        match (wrapped(self.wrap[0], x, w), wrapped(self.wrap[1], y, h)) {
            (Some(x), Some(y)) => self.pyramid.texel(self.image, level, x, y),
            _ => DVec3::ZERO,
        }
    }
}

/// Returns the integer part of a positive number; zero for other numbers.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, which is meant"
)]
fn whole(number: f64) -> usize {
    number as usize
}

/// Returns the bilinear interpolation between the values of `at` at whole numbers.
pub(crate) fn bilinear([x, y]: [f64; 2], at: impl Fn(f64, f64) -> DVec3) -> DVec3 {
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let top = at(x0, y0) * (1.0 - fx) + at(x0 + 1.0, y0) * fx;
    let bottom = at(x0, y0 + 1.0) * (1.0 - fx) + at(x0 + 1.0, y0 + 1.0) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// Returns the whole numbers within a distance of a centre. They are counted, so that the loop ends
/// even where numbers are so large that adding one does not change them.
fn whole_numbers(centre: f64, distance: f64) -> impl Iterator<Item = f64> {
    let first = (centre - distance).ceil();
    // At most the texels of a level times the anisotropy.
    let count = whole((centre + distance).floor() - first);
    (0..=count).map(move |k| first + k as f64)
}

/// Returns the weight exp(−2 r²) − exp(−2) for the square of a radius in [0, 1), from a table of
/// 128 values like pbrt's.
fn gaussian(square: f64) -> f64 {
    const COUNT: usize = 128;
    static TABLE: LazyLock<[f64; COUNT]> = LazyLock::new(|| {
        std::array::from_fn(|i| {
            let square = i as f64 / (COUNT - 1) as f64;
            exp(-2.0 * square) - exp(-2.0f64)
        })
    });
    let index = whole(square * COUNT as f64);
    TABLE[index.min(COUNT - 1)]
}

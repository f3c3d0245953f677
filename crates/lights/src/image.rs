//! This module draws points on textured quads in proportion to an image: the image is a density
//! that is constant on each pixel, tabulated as running sums.
#![allow(
    clippy::disallowed_types,
    reason = "tables of a textured light, built with it"
)]

use crate::PointTechnique;
use crate::density::{Area, Pdf};
use crate::samples::PointSample;
use linelit_geometry::finite::{below_one, fraction, power_of_two_over};
use linelit_geometry::{ConvexPolygon, DVec3, predicates};

/// The direction in which a line runs over a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureAxis {
    /// The line runs along u, at a constant v: along the rows of the image.
    U,
    /// The line runs along v, at a constant u: along the columns of the image.
    V,
}

/// Running sums of each row of a table of numbers, and the running sum of the rows' totals.
#[derive(Clone, Debug, PartialEq)]
struct Rows {
    count: usize,
    length: usize,
    /// Running sums of each row, count × (length + 1) numbers.
    sums: Vec<f64>,
    /// Running sums of the row totals, count + 1 numbers.
    totals: Vec<f64>,
}

impl Rows {
    /// Sums `count` rows of `length` numbers; `value` takes the index in the row, and the row.
    fn new(count: usize, length: usize, value: impl Fn(usize, usize) -> f64) -> Self {
        let mut sums = Vec::with_capacity(count * (length + 1));
        let mut totals = Vec::with_capacity(count + 1);
        totals.push(0.0);
        let mut total = 0.0;
        for j in 0..count {
            let mut sum = 0.0;
            sums.push(0.0);
            for i in 0..length {
                sum += value(i, j);
                sums.push(sum);
            }
            total += sum;
            totals.push(total);
        }
        Self {
            count,
            length,
            sums,
            totals,
        }
    }

    /// Returns the running sums of a row.
    fn row(&self, j: usize) -> &[f64] {
        &self.sums[j * (self.length + 1)..(j + 1) * (self.length + 1)]
    }
}

/// A density on the unit square that is constant on each pixel of an image. A point is drawn by
/// choosing a row by its total, and then a pixel of the row. For line samples, rows or columns are
/// chosen by their totals, and the pixels along them serve as a density along the line.
///
/// Construction allocates two numbers for each pixel; a sample costs one or two binary searches.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportanceImage {
    rows: Rows,
    columns: Rows,
}

/// Finds where the running sums reach the fraction `u` of the last sum: returns the index of a cell
/// with positive mass, and the position within this cell, in [0, 1).
pub(crate) fn pick(sums: &[f64], u: f64) -> (usize, f64) {
    pick_mass(sums, fraction(u) * sums[sums.len() - 1])
}

/// Finds the cell and the position in it at which the running sums reach the mass `target`, as
/// [`pick`] does for a fraction of the last sum.
fn pick_mass(sums: &[f64], target: f64) -> (usize, f64) {
    let last = sums.len() - 1;
    let after = sums.partition_point(|&s| s <= target);
    let mut i = after.clamp(1, last) - 1;
    // Rounding at the very end may lead to an empty cell: step back to one that is not empty.
    while i > 0 && sums[i + 1] - sums[i] <= 0.0 {
        i -= 1;
    }
    let width = sums[i + 1] - sums[i];
    let place = if width > 0.0 {
        (target - sums[i]) / width
    } else {
        0.0
    };
    (i, below_one(place))
}

/// Inverts [`pick`]: returns the fraction at a position in a cell.
pub(crate) fn unpick(sums: &[f64], i: usize, place: f64) -> f64 {
    let last = sums.len() - 1;
    below_one(below(sums, i, place) / sums[last])
}

/// Returns the running sum at a position within a cell.
fn below(sums: &[f64], i: usize, place: f64) -> f64 {
    sums[i] + (sums[i + 1] - sums[i]) * place
}

/// Returns the index of the cell, out of `n`, that a coordinate in [0, 1] falls into, and the
/// position in [0, 1] within this cell.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "image sizes are far below 2^53, the cast saturates and the minimum follows"
)]
pub(crate) fn cell(x: f64, n: usize) -> (usize, f64) {
    let scaled = fraction(x) * n as f64;
    let i = (scaled as usize).min(n - 1);
    (i, below_one(scaled - i as f64))
}

/// Returns the coordinate of a position within a cell, such that [`cell`] finds the same cell
/// again.
#[allow(clippy::cast_precision_loss, reason = "image sizes are far below 2^53")]
fn coordinate(i: usize, place: f64, n: usize) -> f64 {
    let (cell_start, count) = (i as f64, n as f64);
    let x = below_one((cell_start + place) / count);
    let scaled = x * count;
    if scaled >= cell_start && scaled < cell_start + 1.0 {
        return x;
    }
    within_cell(x, i, n)
}

/// Moves a coordinate into cell `i`. The quotient and the product are rounded separately, so that
/// next to a border [`cell`] may name the neighbour, which may be black; one or two steps to the
/// next number bring it back.
#[cold]
#[inline(never)]
fn within_cell(mut x: f64, i: usize, n: usize) -> f64 {
    while cell(x, n).0 > i {
        x = x.next_down();
    }
    while cell(x, n).0 < i {
        x = x.next_up();
    }
    x
}

/// Values of an image up to this fraction of its largest value count as zero: the density of a row
/// of such values would not be a number.
const LEAST: f64 = 1e-280;

impl ImportanceImage {
    /// Makes an image of `width × height` values ≥ 0 (luminance, say), with its first row at v = 0.
    /// Values up to 1e-280 of the largest count as zero, since the density of a row of such values
    /// would not be a number. `None` if the number of values is wrong, a value is negative or not
    /// finite, or all are zero.
    #[must_use]
    pub fn new(width: usize, height: usize, values: &[f64]) -> Option<Self> {
        let usable = values.iter().all(|v| *v >= 0.0 && v.is_finite());
        if width == 0 || width.checked_mul(height)? != values.len() || !usable {
            return None;
        }
        let largest = values.iter().copied().fold(0.0, f64::max);
        if largest <= 0.0 {
            return None;
        }
        // Scale by a power of two, so that no sum and no density of very large values overflows.
        let scale = power_of_two_over(largest);
        let value = |i: usize, j: usize| match values[j * width + i] * scale {
            v if v > LEAST => v,
            _ => 0.0,
        };
        let image = Self {
            rows: Rows::new(height, width, value),
            columns: Rows::new(width, height, |j, i| value(i, j)),
        };
        Some(image)
    }

    /// Returns the numbers of columns and rows of pixels.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.columns.count, self.rows.count)
    }

    fn total(&self) -> f64 {
        self.rows.totals[self.rows.count]
    }

    /// Returns the table whose rows run along `axis`.
    fn table(&self, axis: TextureAxis) -> &Rows {
        match axis {
            TextureAxis::U => &self.rows,
            TextureAxis::V => &self.columns,
        }
    }

    /// Returns the value of a pixel, as the difference of two running sums.
    pub(crate) fn pixel(&self, i: usize, j: usize) -> f64 {
        let row = self.rows.row(j);
        row[i + 1] - row[i]
    }

    /// Returns the running sums over the totals of the lines along `axis`.
    pub(crate) fn line_sums(&self, axis: TextureAxis) -> &[f64] {
        &self.table(axis).totals
    }

    /// Returns the point (u, v) of the unit square for two random numbers in [0, 1): `x[1]` chooses
    /// the row, and `x[0]` the position in it.
    #[must_use]
    pub fn sample(&self, x: [f64; 2]) -> [f64; 2] {
        let (j, v) = pick(&self.rows.totals, x[1]);
        let (i, u) = pick(self.rows.row(j), x[0]);
        let (width, height) = self.size();
        [coordinate(i, u, width), coordinate(j, v, height)]
    }

    /// Returns the density at (u, v); its mean over the unit square is 1.
    #[must_use]
    pub fn density(&self, uv: [f64; 2]) -> f64 {
        let (width, height) = self.size();
        let (i, j) = (cell(uv[0], width).0, cell(uv[1], height).0);
        #[allow(clippy::cast_precision_loss, reason = "image sizes are far below 2^53")]
        let pixels = (width * height) as f64;
        self.pixel(i, j) * pixels / self.total()
    }

    /// Returns the random numbers from which [`sample`](Self::sample) makes the point (u, v);
    /// `None` where the density is zero.
    #[must_use]
    pub fn invert(&self, uv: [f64; 2]) -> Option<[f64; 2]> {
        let (width, height) = self.size();
        let (i, u) = cell(uv[0], width);
        let (j, v) = cell(uv[1], height);
        (self.density(uv) > 0.0).then(|| {
            [
                unpick(self.rows.row(j), i, u),
                unpick(&self.rows.totals, j, v),
            ]
        })
    }

    /// Returns the running sum of the pixels of line `j` along `axis` up to a coordinate in [0, 1].
    pub(crate) fn mass_below(&self, axis: TextureAxis, j: usize, place: f64) -> f64 {
        let table = self.table(axis);
        let (i, within) = cell(place, table.length);
        below(table.row(j), i, within)
    }

    /// Returns the coordinate at which the running sum of line `j` along `axis` reaches `mass`.
    pub(crate) fn place_of_mass(&self, axis: TextureAxis, j: usize, mass: f64) -> f64 {
        let table = self.table(axis);
        let (i, within) = pick_mass(table.row(j), mass);
        coordinate(i, within, table.length)
    }
}

/// Samples points of a parallelogram in proportion to an image on it. The image's u runs along the
/// polygon's first edge, and its v along the last.
///
/// The density per area is the image's density divided by the area. An integrand that is
/// proportional to the image has no variance.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{ImportanceImage, PointTechnique, TexturedSampler};
/// let light = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y)?;
/// // The right half is three times as bright as the left.
/// let image = ImportanceImage::new(2, 1, &[1.0, 3.0]).unwrap();
/// let sampler = TexturedSampler::new(&light, &image).unwrap();
/// let [left, right] = [0.0, 1.0].map(|x| sampler.pdf(DVec3::new(x, 0.5, 1.0)).value());
/// assert!((right / left - 3.0).abs() < 1e-12);
/// # Ok::<(), linelit_lights::geometry::PolygonError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct TexturedSampler<'i> {
    origin: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    area: f64,
    image: &'i ImportanceImage,
}

impl<'i> TexturedSampler<'i> {
    /// Sets the technique up; `None` if the polygon is not a parallelogram.
    #[must_use]
    pub fn new(polygon: &ConvexPolygon, image: &'i ImportanceImage) -> Option<Self> {
        let (origin, a, b) = polygon.as_parallelogram()?;
        Some(Self {
            origin,
            edges: [a, b],
            normal: polygon.normal(),
            area: polygon.area(),
            image,
        })
    }

    /// Returns the texture coordinates of a point in the light's plane.
    #[must_use]
    pub fn coordinates(&self, point: DVec3) -> [f64; 2] {
        let [a, b] = self.edges;
        let p = point - self.origin;
        let over = |x: DVec3, y: DVec3| predicates::cross(x, y).dot(self.normal) / self.area;
        [over(p, b), over(a, p)]
    }
}

impl PointTechnique for TexturedSampler<'_> {
    type Measure = Area;

    fn sample(&self, u: [f64; 2]) -> PointSample<Area> {
        let uv = self.image.sample(u);
        let point = self.origin + self.edges[0] * uv[0] + self.edges[1] * uv[1];
        PointSample::at(point, Pdf::new(self.image.density(uv) / self.area))
    }

    fn pdf(&self, point: DVec3) -> Pdf<Area> {
        Pdf::new(self.image.density(self.coordinates(point)) / self.area)
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        self.image.invert(self.coordinates(point))
    }
}

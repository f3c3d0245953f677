//! Textured quads: images as densities.

use crate::area::PointSample;
use crate::fan::ONE_MINUS;
use crate::pdf::{Area, Pdf};
use linelit_geometry::{ConvexPolygon, DVec3, predicates};

/// A density on the unit square that is constant on the pixels of an image: rows by their sums, then pixels of a row.
///
/// Allocates when made; sampling is two binary searches.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportanceImage {
    width: usize,
    height: usize,
    /// Running sums of each row, height × (width + 1).
    rows: Vec<f64>,
    /// Running sums of the row totals, height + 1.
    marginal: Vec<f64>,
}

/// The largest index whose running sum is ≤ target and whose own share is positive, and the place in it.
fn pick(sums: &[f64], u: f64) -> (usize, f64) {
    let last = sums.len() - 1;
    let target = u * sums[last];
    let after = sums.partition_point(|&s| s <= target);
    let mut i = after.clamp(1, last) - 1;
    // Rounding at the very end may land in an empty cell: step back to one that is not.
    while i > 0 && sums[i + 1] - sums[i] <= 0.0 {
        i -= 1;
    }
    let width = sums[i + 1] - sums[i];
    let place = if width > 0.0 {
        (target - sums[i]) / width
    } else {
        0.0
    };
    (i, place.clamp(0.0, ONE_MINUS))
}

/// The inverse of [`pick`].
fn unpick(sums: &[f64], i: usize, place: f64) -> f64 {
    let last = sums.len() - 1;
    ((sums[i] + (sums[i + 1] - sums[i]) * place) / sums[last]).clamp(0.0, ONE_MINUS)
}

/// Cell and place of a coordinate in [0, 1].
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "image sizes are far below 2^53, the cast saturates and the minimum follows"
)]
fn cell(x: f64, n: usize) -> (usize, f64) {
    let scaled = x.clamp(0.0, 1.0) * n as f64;
    let i = (scaled as usize).min(n - 1);
    (i, (scaled - i as f64).clamp(0.0, ONE_MINUS))
}

#[allow(clippy::cast_precision_loss, reason = "image sizes are far below 2^53")]
fn coordinate(i: usize, place: f64, n: usize) -> f64 {
    ((i as f64 + place) / n as f64).min(ONE_MINUS)
}

impl ImportanceImage {
    /// An image of `width × height` values ≥ 0 (luminance, say), first row at v = 0. `None` if the count is wrong, a value
    /// is negative or not finite, or all are zero.
    #[must_use]
    pub fn new(width: usize, height: usize, values: &[f64]) -> Option<Self> {
        let usable = values.iter().all(|v| *v >= 0.0 && v.is_finite());
        if width == 0 || width.checked_mul(height)? != values.len() || !usable {
            return None;
        }
        let mut rows = Vec::with_capacity(height * (width + 1));
        let mut marginal = vec![0.0];
        let mut total = 0.0;
        for row in values.chunks(width) {
            let mut sum = 0.0;
            rows.push(0.0);
            for v in row {
                sum += v;
                rows.push(sum);
            }
            total += sum;
            marginal.push(total);
        }
        (total > 0.0 && total.is_finite()).then_some(Self {
            width,
            height,
            rows,
            marginal,
        })
    }

    fn row(&self, j: usize) -> &[f64] {
        &self.rows[j * (self.width + 1)..(j + 1) * (self.width + 1)]
    }

    /// The point (u, v) of the unit square for two random numbers in [0, 1): `x[1]` picks the row, `x[0]` the place in it.
    #[must_use]
    pub fn sample(&self, x: [f64; 2]) -> [f64; 2] {
        let (j, v) = pick(&self.marginal, x[1]);
        let (i, u) = pick(self.row(j), x[0]);
        [coordinate(i, u, self.width), coordinate(j, v, self.height)]
    }

    /// The density at (u, v), with mean 1 on the unit square.
    #[must_use]
    pub fn density(&self, uv: [f64; 2]) -> f64 {
        let (i, _) = cell(uv[0], self.width);
        let (j, _) = cell(uv[1], self.height);
        let row = self.row(j);
        #[allow(clippy::cast_precision_loss, reason = "image sizes are far below 2^53")]
        let pixels = (self.width * self.height) as f64;
        (row[i + 1] - row[i]) * pixels / self.marginal[self.height]
    }

    /// The random numbers that give (u, v); `None` where the density is zero.
    #[must_use]
    pub fn invert(&self, uv: [f64; 2]) -> Option<[f64; 2]> {
        let (i, u) = cell(uv[0], self.width);
        let (j, v) = cell(uv[1], self.height);
        (self.density(uv) > 0.0).then(|| [unpick(self.row(j), i, u), unpick(&self.marginal, j, v)])
    }

    /// The offset v of a line along the rows, drawn by the marginal density of the image.
    #[must_use]
    pub fn sample_row(&self, x: f64) -> f64 {
        let (j, v) = pick(&self.marginal, x);
        coordinate(j, v, self.height)
    }

    /// The marginal density of the rows at v, with mean 1.
    #[must_use]
    pub fn row_density(&self, v: f64) -> f64 {
        let (j, _) = cell(v, self.height);
        #[allow(clippy::cast_precision_loss, reason = "image sizes are far below 2^53")]
        let rows = self.height as f64;
        (self.marginal[j + 1] - self.marginal[j]) * rows / self.marginal[self.height]
    }
}

/// Samples a parallelogram by an image on it; the image's u runs along the first edge, v along the last.
///
/// Density per area: the image's, over A. Zero variance for what is proportional to the image.
#[derive(Clone, Copy, Debug)]
pub struct TexturedSampler<'i> {
    origin: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    area: f64,
    image: &'i ImportanceImage,
}

impl<'i> TexturedSampler<'i> {
    /// `None` unless the polygon is a parallelogram.
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

    /// A point from two random numbers in [0, 1).
    #[must_use]
    pub fn sample(&self, u: [f64; 2]) -> PointSample<Area> {
        let uv = self.image.sample(u);
        PointSample {
            point: self.origin + self.edges[0] * uv[0] + self.edges[1] * uv[1],
            pdf: Pdf::new(self.image.density(uv) / self.area),
        }
    }

    /// Texture coordinates of a point of the light's plane.
    #[must_use]
    pub fn coordinates(&self, point: DVec3) -> [f64; 2] {
        let [a, b] = self.edges;
        let p = point - self.origin;
        let over = |x: DVec3, y: DVec3| predicates::cross(x, y).dot(self.normal) / self.area;
        [over(p, b), over(a, p)]
    }

    /// The density at a point, which is taken to lie on the light.
    #[must_use]
    pub fn pdf(&self, point: DVec3) -> Pdf<Area> {
        Pdf::new(self.image.density(self.coordinates(point)) / self.area)
    }

    /// The random numbers that give `point`; `None` where the image is black.
    #[must_use]
    pub fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        self.image.invert(self.coordinates(point))
    }
}

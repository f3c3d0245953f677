//! Emission that varies over an area light.

use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AreaLight, ImportanceImage, TexturedSampler};
use linelit_scene::EmissionMap;

/// Cells of the importance images of all lights together, and of one light at least and at most.
const CELLS: f64 = 4e6;
const CELLS_ALONG: [f64; 2] = [2.0, 1024.0];

/// Texels that are looked at along a cell that holds many.
const MOST_TEXELS: f64 = 16.0;

/// The share of the importance that is the same everywhere, so that what falls between the texels
/// looked at is found, too.
const FLOOR: f64 = 1.0 / 64.0;

/// A texture over an area light: what it emits where, and an image to draw points in proportion.
#[derive(Clone, Debug)]
pub struct EmissionTexture {
    map: EmissionMap,
    /// A parallelogram that holds the light, and the importance of its parts.
    around: ConvexPolygon,
    importance: ImportanceImage,
    /// Whether that is the light itself.
    fits: bool,
}

impl EmissionTexture {
    /// The texture over `light`, one of `count` textured ones; `None` if nothing can be drawn in
    /// proportion to it.
    pub(crate) fn new(map: &EmissionMap, light: &ConvexPolygon, count: usize) -> Option<Self> {
        let (around, fits) = match light.as_parallelogram() {
            Some(_) => (*light, true),
            None => (surrounding(light)?, false),
        };
        let (origin, a, b) = around.as_parallelogram()?;
        let most = (CELLS / count as f64).sqrt();
        let most = most.clamp(CELLS_ALONG[0], CELLS_ALONG[1]);
        let [(width, du), (height, dv)] = [a, b].map(|edge| {
            let texels = map.texels(edge).ceil().max(1.0);
            let cells = texels.min(most);
            let looks = (texels / cells).ceil().min(MOST_TEXELS);
            (whole(cells), whole(looks))
        });
        let (across, up) = (a / width as f64, b / height as f64);
        let mut values = Vec::with_capacity(width * height);
        for j in 0..height {
            for i in 0..width {
                let corner = origin + across * i as f64 + up * j as f64;
                values.push(mean(map, corner, (across, du), (up, dv)));
            }
        }
        let average = values.iter().sum::<f64>() / values.len() as f64;
        for value in &mut values {
            *value += FLOOR * average;
        }
        let importance = ImportanceImage::new(width, height, &values)?;
        Some(Self {
            map: map.clone(),
            around,
            importance,
            fits,
        })
    }

    /// The radiance at a point of the light, seen from the side whose sign is `side`.
    pub(crate) fn towards(&self, area: &AreaLight, on_light: DVec3, side: f64) -> DVec3 {
        if area.emission.towards(side) == DVec3::ZERO {
            DVec3::ZERO
        } else {
            self.map.at(on_light)
        }
    }

    /// Points in proportion to the texture, on the light or (see [`EmissionTexture::fits`]) around
    /// it.
    pub(crate) fn points(&self) -> Option<TexturedSampler<'_>> {
        TexturedSampler::new(&self.around, &self.importance)
    }

    /// Whether all points that are drawn lie on the light.
    pub(crate) const fn fits(&self) -> bool {
        self.fits
    }

    /// The importance over the light, if it is a parallelogram.
    pub(crate) fn over(&self, light: &ConvexPolygon) -> Option<&ImportanceImage> {
        (self.fits && self.around == *light).then_some(&self.importance)
    }
}

/// A parallelogram around a polygon: of a triangle the smallest, else the rectangle along its first
/// edge.
fn surrounding(light: &ConvexPolygon) -> Option<ConvexPolygon> {
    let vertices = light.vertices();
    if let [p, q, r] = *vertices {
        return ConvexPolygon::parallelogram(p, q - p, r - p).ok();
    }
    let frame = light.plane_frame();
    let places = vertices.iter().map(|v| frame.to_plane(*v));
    let low = places.clone().reduce(|a, b| a.min(b))?;
    let high = places.reduce(|a, b| a.max(b))?;
    let (x, y) = (frame.axes.x, frame.axes.y);
    let corner = frame.origin + x * low.x + y * low.y;
    let size = high - low;
    ConvexPolygon::parallelogram(corner, x * size.x, y * size.y).ok()
}

/// The mean of the emission over a cell, whose texels are looked at one by one.
fn mean(map: &EmissionMap, corner: DVec3, across: (DVec3, usize), up: (DVec3, usize)) -> f64 {
    let (parts, step) = (across.1 * up.1, |(edge, n): (DVec3, usize)| edge / n as f64);
    let (dx, dy) = (step(across), step(up));
    let mut sum = 0.0;
    for (j, v) in (0..up.1).flat_map(|j| KNOTS.map(|v| (j, v))) {
        for (i, u) in (0..across.1).flat_map(|i| KNOTS.map(|u| (i, u))) {
            let point = corner + dx * (i as f64 + u.0) + dy * (j as f64 + v.0);
            sum += u.1 * v.1 * map.at(point).element_sum();
        }
    }
    sum / (3.0 * parts as f64)
}

/// Places and weights: exact where emission is linear between the middle of a texel and its ends.
const KNOTS: [(f64, f64); 3] = [(0.0, 0.25), (0.5, 0.5), (1.0, 0.25)];

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 1 and the number of cells"
)]
fn whole(number: f64) -> usize {
    number as usize
}

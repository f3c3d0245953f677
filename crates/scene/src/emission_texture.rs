//! Textured area lights: the emission at each point, and an image of its importance by which points
//! are sampled approximately in proportion to it.
//!
//! A parallelogram around the light is divided into cells, about one for each texel. The importance
//! of a cell is the mean emission over it, plus a floor, so that small bright spots between the
//! lookups are sampled, too. Cells that do not touch the light have none.

use crate::EmissionMap;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{ImportanceImage, TexturedSampler};

/// The largest number of cells in the importance images of all lights together, unless there are so
/// many lights that the smallest image of each has more.
const CELLS: f64 = 4e6;
/// The range of the limit on the number of cells along an edge of one light. The limit follows from
/// [`CELLS`] and the number of textured lights, and is clamped to this range.
const CELLS_ALONG: [f64; 2] = [2.0, 1024.0];

/// The largest number of texture lookups on all lights together, unless there are so many lights
/// that the smallest number for each is more: as many as an image of 4096 × 4096 has texels. This
/// limit bounds the time to a few seconds for images that repeat any number of times.
const LOOKS: f64 = (1u32 << 24) as f64;

/// The importance that is added to each cell that touches the light, as a fraction of the mean
/// importance. With it, bright spots between the lookups are sampled, too.
const FLOOR: f64 = 1.0 / 64.0;

/// The texture of an area light: its emission at each point, and an image of its importance, by
/// which points are sampled.
#[derive(Clone, Debug)]
pub struct EmissionTexture {
    map: EmissionMap,
    /// A parallelogram that holds the light.
    around: ConvexPolygon,
    /// The importance of the cells of the parallelogram `around`.
    importance: ImportanceImage,
    /// Whether the parallelogram is the light itself.
    fits: bool,
}

impl EmissionTexture {
    /// Creates the texture over `light`, which is one of `count` textured lights; `None` if points
    /// cannot be sampled in proportion to it.
    #[must_use]
    pub fn new(map: &EmissionMap, light: &ConvexPolygon, count: usize) -> Option<Self> {
        // Divide a parallelogram around the light into cells.
        let (around, fits) = match light.as_parallelogram() {
            Some(_) => (*light, true),
            None => (surrounding(light)?, false),
        };
        let (origin, a, b) = around.as_parallelogram()?;
        let [(width, du), (height, dv)] = [a, b].map(|edge| parts(map.texels(edge), count));
        let (across, up) = (a / width as f64, b / height as f64);
        // Take the mean emission over each cell that touches the light.
        let cells = (0..height).flat_map(|j| (0..width).map(move |i| (i, j)));
        let values = cells.map(|(i, j)| {
            let corner = origin + across * i as f64 + up * j as f64;
            touches(light, corner, across, up).then(|| mean(map, corner, (across, du), (up, dv)))
        });
        let values: Vec<Option<f64>> = values.collect();
        let (sum, touching) = values
            .iter()
            .flatten()
            .fold((0.0, 0.0), |s, v| (s.0 + v, s.1 + 1.0));
        // Add the floor. If all lookups were black, the importance is uniform: the light emits
        // somewhere, or it would not be a light.
        let floor = if sum > 0.0 {
            FLOOR * sum / touching
        } else {
            1.0
        };
        let values: Vec<f64> = values
            .iter()
            .map(|v| v.map_or(0.0, |v| v + floor))
            .collect();
        let importance = ImportanceImage::new(width, height, &values)?;
        Some(Self {
            map: map.clone(),
            around,
            importance,
            fits,
        })
    }
}

impl linelit_lights::EmissionTexture for EmissionTexture {
    fn radiance(&self, on_light: DVec3) -> DVec3 {
        self.map.at(on_light)
    }

    fn points(&self) -> Option<TexturedSampler<'_>> {
        TexturedSampler::new(&self.around, &self.importance)
    }

    fn fits(&self) -> bool {
        self.fits
    }

    fn over(&self, light: &ConvexPolygon) -> Option<&ImportanceImage> {
        (self.fits && self.around == *light).then_some(&self.importance)
    }
}

/// Returns a parallelogram around a polygon: for a triangle the smallest, for other polygons the
/// bounding rectangle along the first edge.
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

/// Returns the number of cells along an edge that spans this number of texels, and the number of
/// lookups along each cell, for a light that is one of `count` textured lights.
fn parts(texels: f64, count: usize) -> (usize, usize) {
    let among = |all: f64| (all / count as f64).sqrt();
    let most = among(CELLS).clamp(CELLS_ALONG[0], CELLS_ALONG[1]);
    let texels = texels.ceil().max(1.0);
    let cells = texels.min(most).floor();
    let looks = (texels / cells).ceil().min(among(LOOKS) / cells);
    (whole(cells), whole(looks.max(1.0)))
}

/// Returns whether a cell may touch the light: it is not entirely beyond one of the light's edges.
/// A margin of a thousandth of a cell, which is more than rounding, counts as touching.
fn touches(light: &ConvexPolygon, corner: DVec3, across: DVec3, up: DVec3) -> bool {
    let vertices = light.vertices();
    let next = vertices.iter().cycle().skip(1);
    vertices.iter().zip(next).all(|(from, to)| {
        let inwards = light.normal().cross(*to - *from);
        let (x, y) = (inwards.dot(across), inwards.dot(up));
        let innermost = inwards.dot(corner - *from) + x.max(0.0) + y.max(0.0);
        innermost >= -1e-3 * (x.abs() + y.abs())
    })
}

/// Returns the mean of the emission over a cell, averaged over the channels. `across` and `up` are
/// the sides of the cell, each with the number of lookups along it.
fn mean(map: &EmissionMap, corner: DVec3, across: (DVec3, usize), up: (DVec3, usize)) -> f64 {
    let mut sum = 0.0;
    for (v, by_v) in looks(up.1) {
        for (u, by_u) in looks(across.1) {
            sum += by_u * by_v * map.at(corner + across.0 * u + up.0 * v).element_sum();
        }
    }
    sum / 3.0
}

/// Returns the positions of lookups along a cell, from 0 to 1, and their weights: the centres of
/// the texels if there are many; for a single texel both ends and the centre, between which a
/// bilinear image is linear.
fn looks(count: usize) -> impl Iterator<Item = (f64, f64)> {
    const SINGLE: [(f64, f64); 3] = [(0.0, 0.25), (0.5, 0.5), (1.0, 0.25)];
    let single = if count == 1 { &SINGLE[..] } else { &[] };
    let many = if count == 1 { 0 } else { count };
    let share = 1.0 / count as f64;
    let middle = move |k: usize| ((k as f64 + 0.5) * share, share);
    single.iter().copied().chain((0..many).map(middle))
}

/// Returns a whole number as an integer.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 1 and the number of cells"
)]
fn whole(number: f64) -> usize {
    number as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImageData, ImageTexture, PlaneUv, Texture, UvMapping};
    use linelit_geometry::DVec2;
    use linelit_lights::EmissionTexture as _;
    use linelit_lights::PointTechnique;
    use std::sync::Arc;

    /// Returns an image that is white in its first pixels and black in the others, repeated over
    /// the unit square.
    fn repeated(side: u32, white: u32, times: f64) -> EmissionMap {
        let pixel = |k: u32| {
            if k % side < white && k / side < white {
                [255; 3]
            } else {
                [0; 3]
            }
        };
        let pixels = (0..side * side).map(pixel).collect();
        let mapping = UvMapping {
            scale: DVec2::splat(times),
            ..UvMapping::IDENTITY
        };
        let data = ImageData::new(side, side, pixels, false).unwrap();
        let texture = Texture::Image(Arc::new(ImageTexture {
            mapping,
            ..ImageTexture::new(data.into())
        }));
        EmissionMap {
            radiance: DVec3::ONE,
            factor: Arc::new(texture),
            coordinates: PlaneUv::new(
                [DVec3::ZERO, DVec3::X, DVec3::ONE.with_z(0.0)],
                [DVec2::ZERO, DVec2::X, DVec2::ONE],
            ),
        }
    }

    /// For any number of texels and lights, the number of lookups is bounded, with at least two
    /// along each edge of a light.
    #[test]
    fn looks_are_bounded() {
        for count in [1, 2, 7, 1000, 1_000_000] {
            for texels in [0.0, 1.0, 16.0, 999.5, 1e4, 1e30, f64::INFINITY] {
                let (cells, looks) = parts(texels, count);
                let along = (cells * looks) as f64;
                assert!(cells >= 1 && looks >= 1);
                let most = (LOOKS / count as f64)
                    .sqrt()
                    .max(CELLS_ALONG[1].min(texels.max(1.0)));
                assert!(
                    along <= most,
                    "{texels} texels, {count} lights: {cells} x {looks}"
                );
            }
        }
        assert_eq!(parts(4096.0, 1), (1024, 4));
        assert_eq!(parts(64.0, 1), (64, 1));
    }

    #[test]
    fn looks_weigh_one() {
        for count in 1..5 {
            let sum: f64 = looks(count).map(|(_, weight)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-15, "{count}: {sum}");
        }
    }

    /// Each of 126 repetitions has one lookup, of the 126 along each edge, at its centre, which is
    /// black: the light is sampled all the same.
    #[test]
    fn what_no_look_meets_is_still_a_texture() {
        let square = ConvexPolygon::parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap();
        let (map, lights) = (repeated(8, 1, 126.0), 1000);
        assert_eq!(parts(8.0 * 126.0, lights), (63, 2));
        let texture = EmissionTexture::new(&map, &square, lights).unwrap();
        let drawn = texture.points().unwrap();
        assert!((drawn.sample([0.3, 0.6]).pdf.value() - 1.0).abs() < 1e-12);
    }

    /// Points of the parallelogram around a triangle fall into cells that touch the triangle.
    #[test]
    fn points_around_a_triangle_are_beside_it_by_a_cell_at_most() {
        let triangle = ConvexPolygon::triangle(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap();
        let texture = EmissionTexture::new(&repeated(32, 32, 1.0), &triangle, 1).unwrap();
        let drawn = texture.points().unwrap();
        for k in 0..1000 {
            let u = f64::from(k);
            let at = drawn
                .sample([(u + 0.5) / 1000.0, (u * 0.618).fract()])
                .point;
            assert!(at.x + at.y <= 1.0 + 2.0 / 32.0, "{at}");
        }
        // Of 1024 cells 528 below the diagonal or on it, and 31 that touch it with a corner.
        let density = drawn.pdf(DVec3::splat(0.25).with_z(0.0)).value();
        assert!((density - 1024.0 / 559.0).abs() < 1e-9, "{density}");
    }
}

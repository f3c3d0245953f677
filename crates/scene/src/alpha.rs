//! Alpha masks, which cut holes into surfaces: each point of a mesh is there or not, by the value
//! of a texture. Visibility needs a mask as numbers on a grid ([`AlphaGrid`]).

use crate::texture::{Texture, UvMapping, Wrap};
use linelit_geometry::{DVec2, DVec3};
use std::sync::Arc;

/// A mask that cuts holes into a surface: a point exists if the value of a texture there is not
/// below a cutoff. There is no partial transparency.
#[derive(Clone, Debug)]
pub struct Alpha {
    /// A number over the surface.
    pub texture: Texture,
    /// The surface exists where the number is at least this.
    pub cutoff: f32,
}

/// The numbers of an [`Alpha`] on a grid, in which shadow rays and shafts look masks up.
#[derive(Clone, Debug, PartialEq)]
pub struct AlphaGrid {
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// The numbers, the top row first.
    pub values: Vec<f32>,
    /// The mapping from texture coordinates to coordinates of the grid, which is the unit square.
    pub mapping: UvMapping,
    /// The wrap modes beyond the edges, across and up.
    pub wrap: [Wrap; 2],
    /// Whether lookups take the nearest texel instead of the bilinear interpolation.
    pub nearest: bool,
    /// The surface exists where the number is at least this.
    pub cutoff: f32,
}

impl AlphaGrid {
    /// The largest distance of grid coordinates from zero, in texels (2²⁴); coordinates beyond this
    /// distance are clamped to it.
    pub const FARTHEST: f64 = 16_777_216.0;

    /// Maps texture coordinates to coordinates of the grid, which is the unit square with rows from
    /// the top. The result is clamped to [`AlphaGrid::FARTHEST`] texels from zero, and is zero
    /// where it is not a number.
    #[must_use]
    pub fn place(&self, uv: DVec2) -> [f64; 2] {
        let most = Self::FARTHEST / DVec2::new(self.width.into(), self.height.into());
        let at = self.mapping.apply(uv);
        let at = DVec2::new(at.x, 1.0 - at.y).clamp(-most, most);
        at.to_array().map(|c| if c.is_finite() { c } else { 0.0 })
    }
}

impl Alpha {
    /// The cutoff by which a surface exists where the number is not zero, as in pbrt-v3.
    pub const ABOVE_ZERO: f32 = f32::MIN_POSITIVE;

    /// Returns the mask as a grid of numbers, if its texture is a constant, an image or a
    /// checkerboard of constants, times constants. It is `None` for other textures: products and
    /// mixtures of several images, and inverted images that are black beyond their edges (which the
    /// inversion makes white).
    #[must_use]
    pub fn grid(&self) -> Option<AlphaGrid> {
        let grid = |width, height, values, mapping, wrap, nearest| AlphaGrid {
            width,
            height,
            values,
            mapping,
            wrap,
            nearest,
            cutoff: self.cutoff,
        };
        // Take constant factors off the texture, and compute the values of the grid with them.
        let (texture, factor) = without_factors(&self.texture)?;
        match texture {
            Texture::Constant(value) => {
                let values = vec![rounded(factor * *value)];
                let wrap = [Wrap::Repeat; 2];
                Some(grid(1, 1, values, UvMapping::IDENTITY, wrap, true))
            }
            Texture::Image(image) => {
                let (width, height) = (image.data.width(), image.data.height());
                if image.invert && image.wrap.contains(&Wrap::Black) {
                    return None;
                }
                let rows = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
                let value = |[x, y]: [u32; 2]| {
                    let value = image.finished(image.data.pixel(x, y));
                    rounded(factor * value)
                };
                let nearest = image.filter == crate::TextureFilter::Point;
                let values = rows.map(value).collect();
                Some(grid(
                    width,
                    height,
                    values,
                    image.mapping,
                    image.wrap,
                    nearest,
                ))
            }
            Texture::Checkerboard {
                mapping, even, odd, ..
            } => {
                let [even, odd] = [even, odd].map(|t| t.as_constant());
                let [even, odd] = [even?, odd?].map(|v| rounded(factor * v));
                // One period of the pattern: the square of four cells at the origin, its upper row
                // first. The grid is half as many cells wide as the pattern, hence the factors.
                let mapping = UvMapping {
                    scale: 0.5 * mapping.scale,
                    offset: 0.5 * mapping.offset,
                    ..*mapping
                };
                let values = vec![odd, even, even, odd];
                Some(grid(2, 2, values, mapping, [Wrap::Repeat; 2], true))
            }
            Texture::Product(..) | Texture::Mix { .. } => None,
        }
    }

    /// Returns whether some texture coordinates are beyond [`AlphaGrid::FARTHEST`] texels on an
    /// image of the mask, so that lookups would clamp them.
    #[must_use]
    pub fn is_beyond(&self, uvs: &[[f32; 2]]) -> bool {
        let mut beyond = false;
        self.texture.for_each_image(&mut |image| {
            let size = DVec2::new(image.data.width().into(), image.data.height().into());
            beyond |= uvs.iter().any(|[u, v]| {
                let uv = DVec2::new((*u).into(), (*v).into());
                let at = image.mapping.apply(uv) * size;
                !(at.abs().max_element() < AlphaGrid::FARTHEST)
            });
        });
        beyond
    }

    /// Returns whether this mask is certainly the same as another one: constants and images are
    /// compared, and other textures count as different.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let same = match (&self.texture, &other.texture) {
            (Texture::Constant(a), Texture::Constant(b)) => a == b,
            (Texture::Image(a), Texture::Image(b)) => Arc::ptr_eq(a, b) || a.is_same(b),
            _ => false,
        };
        same && self.cutoff.to_bits() == other.cutoff.to_bits()
    }
}

/// Splits a product into a constant factor and a texture that is not a product; `None` if the
/// product has more than one texture that is not constant.
fn without_factors(texture: &Texture) -> Option<(&Texture, DVec3)> {
    let Texture::Product(a, b) = texture else {
        return Some((texture, DVec3::ONE));
    };
    let ((a, x), (b, y)) = (without_factors(a)?, without_factors(b)?);
    match (a, b) {
        (_, Texture::Constant(value)) => Some((a, x * y * *value)),
        (Texture::Constant(value), _) => Some((b, x * y * *value)),
        _ => None,
    }
}

/// Returns the value of a texture as a number in single precision: the luminance of a colour, or
/// the number itself.
#[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
fn rounded(value: DVec3) -> f32 {
    Texture::Constant(value).evaluate_number(DVec2::ZERO) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImageData, ImageTexture, TextureFilter};

    /// Returns the number of a grid at texture coordinates, by its nearest texel.
    fn nearest(grid: &AlphaGrid, uv: DVec2) -> f32 {
        let [x, y] = grid.place(uv);
        let (x, y) = (x * f64::from(grid.width), y * f64::from(grid.height));
        let x = crate::texture::wrapped(grid.wrap[0], x.floor(), grid.width).unwrap();
        let y = crate::texture::wrapped(grid.wrap[1], y.floor(), grid.height).unwrap();
        grid.values[(y * grid.width + x) as usize]
    }

    #[test]
    fn grids_are_what_is_looked_up() {
        let mapping = UvMapping {
            scale: DVec2::new(3.0, -2.0),
            offset: DVec2::new(0.3, 0.1),
            rotation: 0.7,
        };
        let checker = Texture::Checkerboard {
            mapping,
            filtered: true,
            even: Arc::new(Texture::number(0.25)),
            odd: Arc::new(Texture::number(1.0)),
        };
        let pixels = (0..6).map(|i| [40 * i; 3]).collect();
        let data = Arc::new(ImageData::new(3, 2, pixels, false).unwrap());
        let image = ImageTexture {
            mapping,
            filter: TextureFilter::Point,
            invert: true,
            ..ImageTexture::new(data)
        };
        let image = Arc::new(Texture::Image(Arc::new(image)));
        let half = Arc::new(Texture::number(0.5));
        for texture in [checker, Texture::Product(half, image)] {
            let alpha = Alpha {
                texture,
                cutoff: 0.5,
            };
            let grid = alpha.grid().unwrap();
            for i in 0..400 {
                let uv = DVec2::new(0.013 * f64::from(i), 0.37 * f64::from(i % 17));
                let want = alpha.texture.evaluate_number(uv);
                let got = f64::from(nearest(&grid, uv));
                // Rounded to f32 once.
                assert!((got - want).abs() <= 1e-7, "{uv}: {got} {want}");
            }
        }
    }

    #[test]
    fn what_is_no_grid_is_none() {
        let data = Arc::new(ImageData::new(1, 1, vec![[9; 3]], false).unwrap());
        let mut image = ImageTexture::new(data);
        let two = [(); 2].map(|()| Arc::new(Texture::Image(Arc::new(image.clone()))));
        let [a, b] = two;
        let cutoff = Alpha::ABOVE_ZERO;
        let texture = Texture::Product(a, b);
        assert!(Alpha { texture, cutoff }.grid().is_none());
        (image.invert, image.wrap) = (true, [Wrap::Black; 2]);
        let texture = Texture::Image(Arc::new(image));
        assert!(Alpha { texture, cutoff }.grid().is_none());
    }
}

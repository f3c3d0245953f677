//! Textures, which are values over a surface: constants, images, checkerboards, and products and
//! mixtures of textures. Lookups are at a point or over the footprint of a pixel.

use crate::footprint::Footprint;
use crate::image::{ImageData, LUMINANCE};
use crate::mipmap::{MAX_ANISOTROPY, bilinear};
use linelit_geometry::{DVec2, DVec3};
use std::sync::Arc;

/// The continuation of an image beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image repeats.
    Repeat,
    /// The image repeats, and every other copy is mirrored.
    Mirror,
    /// The continuation is black.
    Black,
    /// The continuation has the colour of the nearest pixel of the edge.
    Clamp,
}

/// The filter by which an image is looked up over a pixel's footprint, on the levels of a mipmap. A
/// lookup at a point is bilinear in the image, or with `Point` takes its nearest pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureFilter {
    /// The nearest texel of the coarsest level whose texels are no wider than the footprint.
    Point,
    /// The bilinear interpolation on that level.
    Bilinear,
    /// The bilinear interpolations on the two levels around the footprint's width, and a linear
    /// interpolation between them.
    Trilinear,
    /// The mean over an ellipse with the weights of a Gaussian (elliptically weighted average).
    Ewa {
        /// The largest ratio of an ellipse's axes, from 1 to [`TextureFilter::MAX_ANISOTROPY`];
        /// longer ellipses are widened.
        max_anisotropy: f64,
    },
}

impl TextureFilter {
    /// The upper limit of the ratio of axes in [`TextureFilter::Ewa`], which bounds the time of a
    /// lookup.
    pub const MAX_ANISOTROPY: f64 = MAX_ANISOTROPY;
}

impl Default for TextureFilter {
    /// Returns the default of pbrt-v3: ellipses up to eight times as long as wide.
    fn default() -> Self {
        Self::Ewa {
            max_anisotropy: 8.0,
        }
    }
}

/// Scales, turns and shifts texture coordinates: `(u, v)` becomes
/// `R (scale * (u, v)) + offset`, where `R` turns counter-clockwise by `rotation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvMapping {
    /// The factors, which are applied first.
    pub scale: DVec2,
    /// The shifts, which are applied last.
    pub offset: DVec2,
    /// The rotation in radians, which is applied between the two.
    pub rotation: f64,
}

impl UvMapping {
    /// The mapping that does not change coordinates.
    pub const IDENTITY: Self = Self {
        scale: DVec2::ONE,
        offset: DVec2::ZERO,
        rotation: 0.0,
    };

    /// Returns the coordinates after this mapping.
    pub fn apply(&self, uv: DVec2) -> DVec2 {
        let scaled = self.scale * uv;
        if self.rotation == 0.0 {
            return scaled + self.offset;
        }
        DVec2::from_angle(self.rotation).rotate(scaled) + self.offset
    }

    /// Returns the change of the mapped coordinates for a change of the coordinates.
    pub fn apply_to_change(&self, change: DVec2) -> DVec2 {
        let scaled = self.scale * change;
        if self.rotation == 0.0 {
            return scaled;
        }
        DVec2::from_angle(self.rotation).rotate(scaled)
    }
}

/// An image that is looked up by texture coordinates; (0, 0) is its lower left corner.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    /// The pixels.
    pub data: Arc<ImageData>,
    /// The mapping from surface to image coordinates.
    pub mapping: UvMapping,
    /// The wrap modes beyond the edges, across and up.
    pub wrap: [Wrap; 2],
    /// The filter by which the image is looked up over a pixel's footprint.
    pub filter: TextureFilter,
    /// A factor on every value.
    pub scale: f64,
    /// Whether the result is one minus the scaled value, and at least zero.
    pub invert: bool,
}

impl ImageTexture {
    /// Creates the texture of an image over the unit square, which repeats beyond it, with the
    /// default filter and without scale or inversion.
    #[must_use]
    pub fn new(data: Arc<ImageData>) -> Self {
        Self {
            data,
            mapping: UvMapping::IDENTITY,
            wrap: [Wrap::Repeat; 2],
            filter: TextureFilter::default(),
            scale: 1.0,
            invert: false,
        }
    }
}

/// A value over the surface: a linear RGB colour, or a number, which all three components have.
#[derive(Clone, Debug)]
pub enum Texture {
    /// A constant.
    Constant(DVec3),
    /// An image.
    Image(Arc<ImageTexture>),
    /// The product of two textures.
    Product(Arc<Self>, Arc<Self>),
    /// `(1 - amount) * a + amount * b`.
    Mix {
        /// The texture at amount zero.
        a: Arc<Self>,
        /// The texture at amount one.
        b: Arc<Self>,
        /// The weight of `b`.
        amount: Arc<Self>,
    },
    /// A checkerboard of squares of unit size.
    Checkerboard {
        /// The mapping from surface to checkerboard coordinates.
        mapping: UvMapping,
        /// Whether a lookup over a footprint takes the mean over the rectangle that reaches one
        /// pixel to each side, as in pbrt-v3, instead of the value of the square at its centre.
        filtered: bool,
        /// The texture of the squares whose column and row numbers have an even sum.
        even: Arc<Self>,
        /// The texture of the squares whose column and row numbers have an odd sum.
        odd: Arc<Self>,
    },
}

impl Texture {
    /// Creates a texture of a constant number, the same in all channels.
    pub const fn number(value: f64) -> Self {
        Self::Constant(DVec3::splat(value))
    }

    /// Returns the value at texture coordinates, or over a footprint. A product over a footprint is
    /// the product of its factors' means, and likewise a mixture, as in pbrt.
    #[inline]
    pub fn evaluate(&self, at: impl Into<Footprint>) -> DVec3 {
        if let Self::Constant(value) = self {
            return *value;
        }
        self.over(&at.into())
    }

    /// Returns the value of the texture over a footprint, which may be a point.
    fn over(&self, at: &Footprint) -> DVec3 {
        match self {
            Self::Constant(value) => *value,
            Self::Image(image) => image.evaluate(*at),
            Self::Product(a, b) => a.over(at) * b.over(at),
            Self::Mix { a, b, amount } => {
                let t = amount.over(at);
                a.over(at) * (DVec3::ONE - t) + b.over(at) * t
            }
            Self::Checkerboard {
                mapping,
                filtered,
                even,
                odd,
            } => {
                // Find the fraction of odd squares in the footprint, and mix the two textures.
                let mut place = at.mapped(mapping);
                if !filtered {
                    place = place.uv.into();
                }
                let share = odd_share(&place);
                if share <= 0.0 {
                    even.over(at)
                } else if share >= 1.0 {
                    odd.over(at)
                } else {
                    even.over(at).lerp(odd.over(at), share)
                }
            }
        }
    }

    /// Returns the value of the texture as a number: the luminance of a colour, or the number
    /// itself.
    #[inline]
    pub fn evaluate_number(&self, at: impl Into<Footprint>) -> f64 {
        match self {
            Self::Constant(value) if value.x.to_bits() == value.y.to_bits() => value.x,
            _ => self.evaluate(at).dot(LUMINANCE),
        }
    }

    /// Returns the textures that this texture is directly made of: the factors of a product, the
    /// three textures of a mixture, or the two of a checkerboard.
    fn parts(&self) -> impl Iterator<Item = &Self> {
        let parts = match self {
            Self::Constant(_) | Self::Image(_) => [None; 3],
            Self::Product(a, b) => [Some(a), Some(b), None],
            Self::Mix { a, b, amount } => [Some(a), Some(b), Some(amount)],
            Self::Checkerboard { even, odd, .. } => [Some(even), Some(odd), None],
        };
        parts.into_iter().flatten().map(Arc::as_ref)
    }

    /// Returns whether the value of the texture may vary over a surface, so that lookups need
    /// footprints.
    pub(crate) fn varies(&self) -> bool {
        let is_looked_up = matches!(self, Self::Image(_) | Self::Checkerboard { .. });
        is_looked_up || self.parts().any(Self::varies)
    }

    /// Returns the value of the texture if it is a constant. (Expressions of constants count as not
    /// constant.)
    pub const fn as_constant(&self) -> Option<DVec3> {
        match self {
            Self::Constant(value) => Some(*value),
            _ => None,
        }
    }

    /// Calls a function with every image of the expression.
    pub(crate) fn for_each_image(&self, f: &mut dyn FnMut(&ImageTexture)) {
        if let Self::Image(image) = self {
            f(image);
        }
        self.parts().for_each(|part| part.for_each_image(f));
    }

    /// Returns the number of nodes of the expression, to which the time of its evaluation is
    /// proportional.
    #[must_use]
    pub fn cost(&self) -> usize {
        1 + self.parts().map(Self::cost).sum::<usize>()
    }
}

impl ImageTexture {
    /// Returns the value at surface coordinates, or over a footprint by [`ImageTexture::filter`].
    pub fn evaluate(&self, at: impl Into<Footprint>) -> DVec3 {
        let at: Footprint = at.into();
        let at = at.mapped(&self.mapping);
        if !at.uv.is_finite() {
            return DVec3::ZERO;
        }
        self.finished(self.looked_up(&at))
    }

    /// Returns whether two textures look the same pixels up in the same way.
    #[allow(clippy::float_cmp, reason = "asks whether it is the very same number")]
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.data, &other.data)
            && (self.mapping, self.wrap, self.filter) == (other.mapping, other.wrap, other.filter)
            && self.scale == other.scale
            && self.invert == other.invert
    }

    /// Returns the texture's value for a value of the image: the value, scaled and then inverted if
    /// the texture is inverted.
    pub(crate) fn finished(&self, value: DVec3) -> DVec3 {
        let value = self.scale * value;
        if self.invert {
            (DVec3::ONE - value).max(DVec3::ZERO)
        } else {
            value
        }
    }

    /// Returns the image's value over a footprint in image coordinates.
    fn looked_up(&self, at: &Footprint) -> DVec3 {
        if at.is_point() {
            // Look a point up in the image itself, as mipmaps are resampled to powers of two.
            let (w, h) = (self.data.width(), self.data.height());
            // Pixel centres are at half-integers; rows count from the top.
            let x = at.uv.x * f64::from(w) - 0.5;
            let y = (1.0 - at.uv.y) * f64::from(h) - 0.5;
            let pixel = |x, y| match (wrapped(self.wrap[0], x, w), wrapped(self.wrap[1], y, h)) {
                (Some(i), Some(j)) => self.data.pixel(i, j),
                _ => DVec3::ZERO,
            };
            return match self.filter {
                TextureFilter::Point => pixel(x.round(), y.round()),
                TextureFilter::Bilinear | TextureFilter::Trilinear | TextureFilter::Ewa { .. } => {
                    bilinear([x, y], pixel)
                }
            };
        }
        // Filter a footprint on the levels of the mipmap.
        let mipmap = self.data.mipmap(self.wrap);
        match self.filter {
            TextureFilter::Point => mipmap.nearest(at),
            TextureFilter::Bilinear => mipmap.bilinear(at),
            TextureFilter::Trilinear => mipmap.trilinear(at),
            TextureFilter::Ewa { max_anisotropy } => {
                mipmap.ellipse(at, max_anisotropy.clamp(1.0, MAX_ANISOTROPY))
            }
        }
    }
}

/// Returns the fraction of the area of odd squares in the rectangle around a footprint.
///
/// Squares are even where s(x) s(y) = 1, with s the square wave of period two that begins with 1;
/// the mean of a product over a rectangle is the product of the means.
fn odd_share(at: &Footprint) -> f64 {
    let reach = at.reach();
    0.5 - 0.5 * mean_of_wave(at.uv.x, reach.x) * mean_of_wave(at.uv.y, reach.y)
}

/// Returns the mean over [x − r, x + r] of the wave that is 1 in [0, 1), −1 in [1, 2), and so on:
/// the difference of its integral, a triangle wave, over 2 r.
#[allow(clippy::float_cmp, reason = "asks whether whole numbers are the same")]
fn mean_of_wave(x: f64, r: f64) -> f64 {
    let (from, to) = (x - r, x + r);
    if from.floor() == to.floor() {
        let is_even = x.floor().rem_euclid(2.0) < 0.5;
        return if is_even { 1.0 } else { -1.0 };
    }
    let integral = |x: f64| {
        let x = x.rem_euclid(2.0);
        x.min(2.0 - x)
    };
    (integral(to) - integral(from)) / (to - from)
}

/// Returns the index, from 0 to `n` − 1, of the row or column `i` after wrapping; `None` beyond a
/// black edge.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "wrapped into [0, n) before the cast"
)]
pub(crate) fn wrapped(wrap: Wrap, i: f64, n: u32) -> Option<u32> {
    let n = f64::from(n);
    let index = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Mirror => {
            let k = i.rem_euclid(2.0 * n);
            k.min(2.0 * n - 1.0 - k)
        }
        Wrap::Clamp => i.clamp(0.0, n - 1.0),
        Wrap::Black if (0.0..n).contains(&i) => i,
        Wrap::Black => return None,
    };
    Some(index.min(n - 1.0) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_go_on_as_told() {
        let at = |wrap, list: [i32; 6]| list.map(|i| wrapped(wrap, f64::from(i), 3));
        let list = [-4, -1, 0, 2, 3, 7];
        let some = |list: [u32; 6]| list.map(Some);
        assert_eq!(at(Wrap::Repeat, list), some([2, 2, 0, 2, 0, 1]));
        assert_eq!(at(Wrap::Mirror, list), some([2, 0, 0, 2, 2, 1]));
        assert_eq!(at(Wrap::Clamp, list), some([0, 0, 0, 2, 2, 2]));
        let black = [None, None, Some(0), Some(2), None, None];
        assert_eq!(at(Wrap::Black, list), black);
    }

    #[test]
    fn mappings_scale_then_turn_then_shift() {
        let mapping = UvMapping {
            scale: DVec2::new(2.0, 1.0),
            offset: DVec2::new(0.5, 0.0),
            rotation: std::f64::consts::FRAC_PI_2,
        };
        // (1, 0) is scaled to (2, 0), turned to (0, 2), shifted.
        let got = mapping.apply(DVec2::X);
        assert!((got - DVec2::new(0.5, 2.0)).length() < 1e-15, "{got}");
    }
}

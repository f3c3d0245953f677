//! Textures: values over the surface.

use crate::footprint::Footprint;
use crate::image::{ImageData, LUMINANCE};
use crate::mipmap::{MAX_ANISOTROPY, bilinear};
use linelit_geometry::{DVec2, DVec3};
use std::sync::Arc;

/// The continuation of an image beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// The image again, every other one turned over.
    Mirror,
    /// Black.
    Black,
    /// The colour of the edge.
    Clamp,
}

/// The filter by which an image is looked up over a pixel's footprint, in smaller copies of itself.
/// A lookup without extent is bilinear in the image, or by `Point` that of its nearest pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureFilter {
    /// The nearest texel of the coarsest copy whose texels are no wider than the footprint.
    Point,
    /// Bilinear in that copy.
    Bilinear,
    /// Bilinear in the two copies around the footprint's width, and linear between the two.
    Trilinear,
    /// Means over an ellipse with the weights of a Gaussian (elliptically weighted average).
    Ewa {
        /// The largest ratio of an ellipse's axes, from 1 to [`TextureFilter::MAX_ANISOTROPY`];
        /// longer ones are widened.
        max_anisotropy: f64,
    },
}

impl TextureFilter {
    /// Most that [`TextureFilter::Ewa`] is long over wide, so that a lookup stays bounded.
    pub const MAX_ANISOTROPY: f64 = MAX_ANISOTROPY;
}

impl Default for TextureFilter {
    /// pbrt-v3's: ellipses up to eight times as long as wide.
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
    /// Factors.
    pub scale: DVec2,
    /// Shifts, applied in the end.
    pub offset: DVec2,
    /// The rotation in radians, applied between the two.
    pub rotation: f64,
}

impl UvMapping {
    /// Leaves coordinates alone.
    pub const IDENTITY: Self = Self {
        scale: DVec2::ONE,
        offset: DVec2::ZERO,
        rotation: 0.0,
    };

    /// The mapped coordinates.
    pub fn apply(&self, uv: DVec2) -> DVec2 {
        let scaled = self.scale * uv;
        if self.rotation == 0.0 {
            return scaled + self.offset;
        }
        DVec2::from_angle(self.rotation).rotate(scaled) + self.offset
    }

    /// The change of mapped coordinates by a change of coordinates.
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
    /// The filter by which it is looked up over a pixel's footprint.
    pub filter: TextureFilter,
    /// Factor on every value.
    pub scale: f64,
    /// Whether the result is one minus the value.
    pub invert: bool,
}

impl ImageTexture {
    /// Creates the texture of an image over the unit square, repeated beyond, unchanged.
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

/// A value over the surface: a linear RGB triple, or a number in all three components.
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
        /// The share of `b`.
        amount: Arc<Self>,
    },
    /// Squares of unit size, alternating.
    Checkerboard {
        /// The mapping from surface to checkerboard coordinates.
        mapping: UvMapping,
        /// Whether a footprint sees the mean over the rectangle that reaches a pixel to each side,
        /// as pbrt-v3's does, or the square in its middle.
        filtered: bool,
        /// The texture where the sum of the cell numbers is even.
        even: Arc<Self>,
        /// The texture where that sum is odd.
        odd: Arc<Self>,
    },
}

impl Texture {
    /// Creates a texture of a constant number, the same in all channels.
    pub const fn number(value: f64) -> Self {
        Self::Constant(DVec3::splat(value))
    }

    /// The value at texture coordinates, or over a footprint. Products and mixtures are those of
    /// their parts' means, as in pbrt.
    #[inline]
    pub fn evaluate(&self, at: impl Into<Footprint>) -> DVec3 {
        if let Self::Constant(value) = self {
            return *value;
        }
        self.over(&at.into())
    }

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

    /// The value as a number: the luminance, which for a number is the number.
    #[inline]
    pub fn evaluate_number(&self, at: impl Into<Footprint>) -> f64 {
        match self {
            Self::Constant(value) if value.x.to_bits() == value.y.to_bits() => value.x,
            _ => self.evaluate(at).dot(LUMINANCE),
        }
    }

    /// The textures that it is made of.
    fn parts(&self) -> impl Iterator<Item = &Self> {
        let parts = match self {
            Self::Constant(_) | Self::Image(_) => [None; 3],
            Self::Product(a, b) => [Some(a), Some(b), None],
            Self::Mix { a, b, amount } => [Some(a), Some(b), Some(amount)],
            Self::Checkerboard { even, odd, .. } => [Some(even), Some(odd), None],
        };
        parts.into_iter().flatten().map(Arc::as_ref)
    }

    /// Whether it is looked up over footprints: not constant.
    pub(crate) fn varies(&self) -> bool {
        let is_looked_up = matches!(self, Self::Image(_) | Self::Checkerboard { .. });
        is_looked_up || self.parts().any(Self::varies)
    }

    /// The value if it is the same everywhere.
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

    /// The number of nodes of the expression, which its evaluation takes time for.
    #[must_use]
    pub fn cost(&self) -> usize {
        1 + self.parts().map(Self::cost).sum::<usize>()
    }
}

impl ImageTexture {
    /// The value at surface coordinates, or over a footprint: as [`ImageTexture::filter`] says.
    pub fn evaluate(&self, at: impl Into<Footprint>) -> DVec3 {
        let at: Footprint = at.into();
        let at = at.mapped(&self.mapping);
        if !at.uv.is_finite() {
            return DVec3::ZERO;
        }
        self.finished(self.looked_up(&at))
    }

    /// Whether it is the same look at the same pixels.
    #[allow(clippy::float_cmp, reason = "asks whether it is the very same number")]
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.data, &other.data)
            && (self.mapping, self.wrap, self.filter) == (other.mapping, other.wrap, other.filter)
            && self.scale == other.scale
            && self.invert == other.invert
    }

    /// Returns the texture's value for a value of the image.
    pub(crate) fn finished(&self, value: DVec3) -> DVec3 {
        let value = self.scale * value;
        if self.invert {
            (DVec3::ONE - value).max(DVec3::ZERO)
        } else {
            value
        }
    }

    fn looked_up(&self, at: &Footprint) -> DVec3 {
        if at.is_point() {
            // The image itself: pyramids hold it resampled to powers of two.
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

/// The share of odd squares in the rectangle that a footprint reaches.
///
/// Squares are even where s(x) s(y) = 1, with s the square wave of period two that begins with 1;
/// the mean of a product over a rectangle is the product of the means.
fn odd_share(at: &Footprint) -> f64 {
    let reach = at.reach();
    0.5 - 0.5 * mean_of_wave(at.uv.x, reach.x) * mean_of_wave(at.uv.y, reach.y)
}

/// The mean over [x − r, x + r] of the wave that is 1 in [0, 1), −1 in [1, 2), and so on: the
/// difference of its integral, a triangle wave, over 2 r.
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

/// The index of a row or column after wrapping; `None` outside.
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

//! Textures: values over the surface.

use crate::color::LUMINANCE;
use crate::image::ImageData;
use linelit_geometry::{DVec2, DVec3};
use std::sync::Arc;

/// What lies beyond the edges of an image.
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

/// Scales, turns and shifts texture coordinates: `(u, v)` becomes
/// `R (scale * (u, v)) + offset`, where `R` turns counter-clockwise by `rotation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvMapping {
    /// Factors.
    pub scale: DVec2,
    /// Shifts, applied in the end.
    pub offset: DVec2,
    /// In radians, applied between the two.
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
}

/// An image that is looked up by texture coordinates; (0, 0) is its lower left corner.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    /// The pixels.
    pub data: Arc<ImageData>,
    /// From surface to image coordinates.
    pub mapping: UvMapping,
    /// What lies beyond the edges, across and up.
    pub wrap: [Wrap; 2],
    /// Factor on every value.
    pub scale: f64,
    /// One minus the value instead of the value.
    pub invert: bool,
    /// Where it was read from, relative to the scene file, for export; empty for an image that
    /// has no file of its own.
    pub filename: String,
}

/// A value over the surface: a linear RGB triple, or a number in all three components.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Texture {
    /// The same everywhere.
    Constant(DVec3),
    /// An image.
    Image(Arc<ImageTexture>),
    /// The product of two textures.
    Product(Arc<Self>, Arc<Self>),
    /// `(1 - amount) * a + amount * b`.
    Mix {
        /// At amount zero.
        a: Arc<Self>,
        /// At amount one.
        b: Arc<Self>,
        /// The share of `b`.
        amount: Arc<Self>,
    },
    /// Squares of unit size, alternating.
    Checkerboard {
        /// From surface to checkerboard coordinates.
        mapping: UvMapping,
        /// Where the sum of the cell numbers is even.
        even: Arc<Self>,
        /// Where it is odd.
        odd: Arc<Self>,
    },
}

impl Texture {
    /// The same number everywhere.
    pub const fn number(value: f64) -> Self {
        Self::Constant(DVec3::splat(value))
    }

    /// The value at texture coordinates.
    pub fn evaluate(&self, uv: DVec2) -> DVec3 {
        match self {
            Self::Constant(value) => *value,
            Self::Image(image) => image.evaluate(uv),
            Self::Product(a, b) => a.evaluate(uv) * b.evaluate(uv),
            Self::Mix { a, b, amount } => {
                let t = amount.evaluate(uv);
                a.evaluate(uv) * (DVec3::ONE - t) + b.evaluate(uv) * t
            }
            Self::Checkerboard { mapping, even, odd } => {
                let cell = mapping.apply(uv).floor();
                let is_even = (cell.x + cell.y).rem_euclid(2.0) < 0.5;
                if is_even {
                    even.evaluate(uv)
                } else {
                    odd.evaluate(uv)
                }
            }
        }
    }

    /// The value as a number: the luminance, which for a number is the number.
    pub fn evaluate_number(&self, uv: DVec2) -> f64 {
        match self {
            Self::Constant(value) if value.x.to_bits() == value.y.to_bits() => value.x,
            _ => self.evaluate(uv).dot(LUMINANCE),
        }
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
        match self {
            Self::Constant(_) => {}
            Self::Image(image) => f(image),
            Self::Product(a, b) => [a, b].iter().for_each(|t| t.for_each_image(f)),
            Self::Mix { a, b, amount } => [a, b, amount].iter().for_each(|t| t.for_each_image(f)),
            Self::Checkerboard { even, odd, .. } => {
                [even, odd].iter().for_each(|t| t.for_each_image(f));
            }
        }
    }

    /// Nodes of the expression, to keep evaluation bounded.
    pub(crate) fn cost(&self) -> usize {
        match self {
            Self::Constant(_) | Self::Image(_) => 1,
            Self::Product(a, b) => 1 + a.cost() + b.cost(),
            Self::Mix { a, b, amount } => 1 + a.cost() + b.cost() + amount.cost(),
            Self::Checkerboard { even, odd, .. } => 1 + even.cost() + odd.cost(),
        }
    }
}

impl ImageTexture {
    /// The bilinearly interpolated value at surface coordinates.
    pub fn evaluate(&self, uv: DVec2) -> DVec3 {
        let st = self.mapping.apply(uv);
        if !st.is_finite() {
            return DVec3::ZERO;
        }
        let (w, h) = (self.data.width(), self.data.height());
        // Pixel centres are at half-integers; rows count from the top.
        let x = st.x * f64::from(w) - 0.5;
        let y = (1.0 - st.y) * f64::from(h) - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let texel = |x: f64, y: f64| match (place(self.wrap[0], x, w), place(self.wrap[1], y, h)) {
            (Some(i), Some(j)) => self.data.pixel(i, j),
            _ => DVec3::ZERO,
        };
        let top = texel(x0, y0) * (1.0 - fx) + texel(x0 + 1.0, y0) * fx;
        let bottom = texel(x0, y0 + 1.0) * (1.0 - fx) + texel(x0 + 1.0, y0 + 1.0) * fx;
        let value = (top * (1.0 - fy) + bottom * fy) * self.scale;
        if self.invert {
            (DVec3::ONE - value).max(DVec3::ZERO)
        } else {
            value
        }
    }
}

/// The index of a row or column after wrapping; `None` outside.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "wrapped into [0, n) before the cast"
)]
fn place(wrap: Wrap, i: f64, n: u32) -> Option<u32> {
    let n = f64::from(n);
    let wrapped = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Mirror => {
            let k = i.rem_euclid(2.0 * n);
            k.min(2.0 * n - 1.0 - k)
        }
        Wrap::Clamp => i.clamp(0.0, n - 1.0),
        Wrap::Black if (0.0..n).contains(&i) => i,
        Wrap::Black => return None,
    };
    Some(wrapped.min(n - 1.0) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_go_on_as_told() {
        let at = |wrap, list: [i32; 6]| list.map(|i| place(wrap, f64::from(i), 3));
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

//! [`ImageData`], the pixels of an image that textures look up: bytes, linear or sRGB-encoded, or
//! linear numbers. Values are decoded to linear RGB at each lookup.

use crate::mipmap::{Mipmap, Pyramids};
use crate::texture::Wrap;
use linelit_elementary::pow;
use linelit_geometry::DVec3;
use std::fmt;
use std::sync::LazyLock;

/// The weights of linear Rec. 709 RGB in the luminance.
pub const LUMINANCE: DVec3 = DVec3::new(0.212_671, 0.715_160, 0.072_169);

/// The pixels of a texture, as bytes or as linear numbers, with mipmaps that are built when they
/// are first needed.
#[derive(Clone, PartialEq)]
pub struct ImageData {
    width: u32,
    height: u32,
    pixels: Pixels,
    /// Whether the integers in the image's file are sRGB-encoded.
    srgb: bool,
    pyramids: Pyramids,
}

/// The pixels by rows, the top row first.
#[derive(Clone, PartialEq)]
enum Pixels {
    Bytes(Vec<[u8; 3]>),
    Linear(Vec<[f32; 3]>),
}

impl fmt::Debug for ImageData {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ImageData({} x {})", self.width, self.height)
    }
}

/// The linear values of sRGB-encoded bytes.
static SRGB: LazyLock<[f64; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f64 / 255.0)));

/// The linear values of bytes that are not encoded.
static LINEAR: LazyLock<[f64; 256]> = LazyLock::new(|| std::array::from_fn(|i| i as f64 / 255.0));

impl ImageData {
    /// Makes an image of bytes from its rows, top row first. `srgb` says whether they are
    /// sRGB-encoded. `None` if the number of pixels is not width times height.
    pub fn new(width: u32, height: u32, rgb: Vec<[u8; 3]>, srgb: bool) -> Option<Self> {
        let count = rgb.len();
        Self::with([width, height], count, Pixels::Bytes(rgb), srgb)
    }

    /// Makes an image of 16-bit integers from its rows, top row first, decoded to linear `f32`
    /// (with a relative error of 2⁻²⁴). `None` if the number of pixels is not width times height.
    pub fn of_words(width: u32, height: u32, rgb: &[[u16; 3]], srgb: bool) -> Option<Self> {
        #[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
        let linear = |word: u16| {
            let v = f64::from(word) / 65535.0;
            (if srgb { srgb_to_linear(v) } else { v }) as f32
        };
        let table: Vec<f32> = (0..=u16::MAX).map(linear).collect();
        let value = |rgb: &[u16; 3]| rgb.map(|word| table[usize::from(word)]);
        let pixels = Pixels::Linear(rgb.iter().map(value).collect());
        Self::with([width, height], rgb.len(), pixels, srgb)
    }

    /// Makes an image of linear values, which may be above one, from its rows, top row first.
    /// `None` if the number of pixels is not width times height, or a value is negative or not
    /// finite.
    pub fn linear(width: u32, height: u32, rgb: Vec<[f32; 3]>) -> Option<Self> {
        let good = |v: &f32| *v >= 0.0 && v.is_finite();
        let all = rgb.iter().flatten().all(good);
        let count = rgb.len();
        Self::with([width, height], count, Pixels::Linear(rgb), false).filter(|_| all)
    }

    /// Makes an image of `count` pixels; `None` if `count` is zero or is not width times height.
    fn with([width, height]: [u32; 2], count: usize, pixels: Pixels, srgb: bool) -> Option<Self> {
        let expected = u64::from(width) * u64::from(height);
        (expected > 0 && expected == count as u64).then_some(Self {
            width,
            height,
            pixels,
            srgb,
            pyramids: Pyramids::default(),
        })
    }

    /// Returns the image in grey: each pixel becomes the luminance of its linear value, rounded to
    /// the nearest byte for images of bytes.
    #[must_use]
    pub fn to_luminance(&self) -> Self {
        let mut grey = self.clone();
        match &mut grey.pixels {
            Pixels::Bytes(rgb) => to_grey(rgb, table(self.srgb)),
            Pixels::Linear(rgb) => {
                for value in rgb {
                    let luminance = DVec3::from(value.map(f64::from)).dot(LUMINANCE);
                    #[allow(clippy::cast_possible_truncation, reason = "rounding is meant")]
                    let rounded = luminance as f32;
                    *value = [rounded; 3];
                }
            }
        }
        grey
    }

    /// Returns one component (0: red, 1: green, 2: blue) as an image in grey.
    #[must_use]
    pub fn component(&self, k: usize) -> Self {
        let mut grey = self.clone();
        match &mut grey.pixels {
            Pixels::Bytes(rgb) => rgb.iter_mut().for_each(|rgb| *rgb = [rgb[k]; 3]),
            Pixels::Linear(rgb) => rgb.iter_mut().for_each(|rgb| *rgb = [rgb[k]; 3]),
        }
        grey
    }

    /// Returns the number of pixels across.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Returns the number of pixels down.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Returns the size of the pixels in bytes.
    pub const fn memory(&self) -> usize {
        match &self.pixels {
            Pixels::Bytes(rgb) => 3 * rgb.len(),
            Pixels::Linear(rgb) => 12 * rgb.len(),
        }
    }

    /// Returns the size of the mipmaps that have been built, in bytes.
    pub(crate) fn pyramid_memory(&self) -> usize {
        self.pyramids.memory()
    }

    /// Returns the image with its mipmap for these wrap modes; the first call builds the mipmap.
    pub(crate) fn mipmap(&self, wrap: [Wrap; 2]) -> Mipmap<'_> {
        Mipmap {
            image: self,
            pyramid: self.pyramids.of(self, wrap),
            wrap,
        }
    }

    /// Returns whether red, green and blue are equal in every pixel.
    #[must_use]
    pub fn is_grey(&self) -> bool {
        match &self.pixels {
            Pixels::Bytes(rgb) => rgb.iter().all(|[r, g, b]| r == g && g == b),
            Pixels::Linear(rgb) => {
                let is_grey = |[r, g, b]: [u32; 3]| r == g && g == b;
                rgb.iter().all(|rgb| is_grey(rgb.map(f32::to_bits)))
            }
        }
    }

    /// Returns the linear value of the pixel in column `x` of row `y`, counted from the top. It is
    /// zero beyond the last pixel.
    pub fn pixel(&self, x: u32, y: u32) -> DVec3 {
        let index = y as usize * self.width as usize + x as usize;
        let value = match &self.pixels {
            Pixels::Bytes(rgb) => {
                let table = table(self.srgb);
                rgb.get(index)
                    .map(|rgb| rgb.map(|byte| table[usize::from(byte)]))
            }
            Pixels::Linear(rgb) => rgb.get(index).map(|rgb| rgb.map(f64::from)),
        };
        value.map_or(DVec3::ZERO, DVec3::from_array)
    }

    /// Returns the mean of all pixels' linear values.
    #[must_use]
    pub fn mean(&self) -> DVec3 {
        let row = |y| -> DVec3 { (0..self.width).map(|x| self.pixel(x, y)).sum() };
        (0..self.height).map(row).sum::<DVec3>() / (f64::from(self.width) * f64::from(self.height))
    }
}

/// Returns the linear value of an sRGB-encoded value, both from 0 to 1.
fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 {
        v / 12.92
    } else {
        pow((v + 0.055) / 1.055, 2.4)
    }
}

/// Returns the linear values of the bytes 0 to 255; `srgb` says whether the bytes are sRGB-encoded.
fn table(srgb: bool) -> &'static [f64; 256] {
    if srgb { &SRGB } else { &LINEAR }
}

/// Replaces each colour by the grey byte whose linear value is nearest to its luminance.
fn to_grey(rgb: &mut [[u8; 3]], table: &[f64; 256]) {
    let nearest = |linear: f64| {
        let k = table.partition_point(|v| *v < linear);
        let lower = k.saturating_sub(1);
        let k = k.min(255);
        u8::try_from(if linear - table[lower] < table[k] - linear {
            lower
        } else {
            k
        })
        .unwrap_or(255)
    };
    for rgb in rgb {
        if rgb[0] != rgb[1] || rgb[1] != rgb[2] {
            let linear = DVec3::from(rgb.map(|byte| table[usize::from(byte)]));
            *rgb = [nearest(linear.dot(LUMINANCE)); 3];
        }
    }
}

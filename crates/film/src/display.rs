//! The conversion of linear radiance to the colours of a screen, false colours, and PNG files.

use linelit_elementary::{exp2, ln, log2, pow};
use std::path::Path;

use crate::moments::to_f32;
use crate::{FilmError, Image};

/// Returns the sRGB transfer function of IEC 61966-2-1, from linear values in [0, 1] to encoded
/// values in [0, 1].
///
/// Other values are clamped to [0, 1]; NaN gives zero.
#[must_use]
pub fn srgb_encode(linear: f64) -> f64 {
    let linear = unit(linear);
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * pow(linear, 1.0 / 2.4) - 0.055
    }
}

/// Returns the inverse of [`srgb_encode`].
#[must_use]
pub fn srgb_decode(encoded: f64) -> f64 {
    let encoded = unit(encoded);
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        pow((encoded + 0.055) / 1.055, 2.4)
    }
}

/// Returns a value clamped to [0, 1]. NaN becomes zero, where `f64::clamp` would return NaN.
pub(crate) fn unit(value: f64) -> f64 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

/// The brightness of a picture on a screen: radiance is multiplied by 2^`stops`, clamped, and
/// converted by the sRGB transfer function. By default, radiance one is white.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exposure {
    /// The number of doublings of brightness.
    pub stops: f64,
}

impl Exposure {
    /// Returns the exposure that shows the given quantile of the pixels' largest channels as white,
    /// so that a light in the picture does not leave the rest black. The exposure is rounded down
    /// to half stops, and is zero for a black picture.
    ///
    /// ```
    /// use linelit_film::{Exposure, Image};
    /// let dim = Image { width: 1, height: 1, rgb: vec![[0.25; 3]] };
    /// assert_eq!(Exposure::fitting(&dim, 0.99).stops, 2.0);
    /// ```
    #[must_use]
    pub fn fitting(image: &Image, quantile: f64) -> Self {
        // Sort the largest channels of all pixels that are not black.
        let mut peaks: Vec<f32> = image
            .rgb
            .iter()
            .map(|pixel| pixel[0].max(pixel[1]).max(pixel[2]))
            .filter(|peak| peak.is_finite() && *peak > 0.0)
            .collect();
        peaks.sort_by(f32::total_cmp);
        let Some(last) = peaks.len().checked_sub(1) else {
            return Self::default();
        };
        // Make the quantile white.
        #[allow(
            clippy::cast_possible_truncation,
            reason = "an index, below the length"
        )]
        let index = (quantile.clamp(0.0, 1.0) * last as f64).round() as usize;
        let white = f64::from(peaks[index.min(last)]);
        Self {
            stops: (-2.0 * log2(white)).floor() / 2.0,
        }
    }

    /// Returns the three sRGB bytes that show a pixel.
    #[must_use]
    pub fn show(self, pixel: [f32; 3]) -> [u8; 3] {
        let gain = exp2(self.stops);
        pixel.map(|value| to_byte(srgb_encode(f64::from(value) * gain)))
    }
}

/// Returns the byte nearest to an encoded value.
pub(crate) fn to_byte(encoded: f64) -> u8 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "rounding to 8 bits is the purpose"
    )]
    let byte = (encoded.clamp(0.0, 1.0) * 255.0).round() as u8;
    byte
}

/// Returns the bytes of a PNG file of the picture, sRGB with 8 bits for each channel.
///
/// # Errors
/// [`FilmError::Invalid`] for a picture without pixels.
pub fn encode_png(image: &Image, exposure: Exposure) -> Result<Vec<u8>, FilmError> {
    image.check()?;
    let bytes: Vec<u8> = image
        .rgb
        .iter()
        .flat_map(|&pixel| exposure.show(pixel))
        .collect();
    encode_bytes(image.width, image.height, &bytes)
}

/// Writes a PNG file of the picture, sRGB with 8 bits for each channel.
///
/// # Errors
/// [`FilmError::Invalid`] for a picture without pixels; [`FilmError::Io`] when the file cannot be
/// written.
pub fn write_png(path: &Path, image: &Image, exposure: Exposure) -> Result<(), FilmError> {
    crate::write_atomically(path, &encode_png(image, exposure)?)
}

/// Returns the bytes of a PNG file of these sRGB bytes.
pub(crate) fn encode_bytes(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, FilmError> {
    let invalid = |e: png::EncodingError| FilmError::Invalid(e.to_string());
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header().map_err(invalid)?;
    writer.write_image_data(rgb).map_err(invalid)?;
    writer.finish().map_err(invalid)?;
    Ok(bytes)
}

/// The scale of a picture in false colours, which shows one number for each pixel.
///
/// ```
/// use linelit_film::HeatMap;
/// let map = HeatMap { low: 1.0, high: 100.0, logarithmic: true };
/// assert_eq!(map.position(10.0), Some(0.5));
/// let png = map.encode_png(2, 1, &[1.0, 64.0])?;
/// assert!(png.starts_with(b"\x89PNG"));
/// # Ok::<(), linelit_film::FilmError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatMap {
    /// The value of the darkest colour.
    pub low: f64,
    /// The value of the brightest colour.
    pub high: f64,
    /// Whether equal ratios instead of equal differences are equal steps; both ends must then be
    /// positive.
    pub logarithmic: bool,
}

impl HeatMap {
    /// Returns the linear scale that spans the finite values; from 0 to 1 if there are none.
    #[must_use]
    pub fn spanning(values: &[f32]) -> Self {
        let finite = values.iter().filter(|value| value.is_finite());
        let ends = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            let value = f64::from(*value);
            [low.min(value), high.max(value)]
        });
        let [low, high] = if ends[0] > ends[1] { [0.0, 1.0] } else { ends };
        Self {
            low,
            high,
            logarithmic: false,
        }
    }

    /// Returns the position of a value on the scale, in [0, 1]; `None` for NaN.
    #[must_use]
    pub fn position(&self, value: f64) -> Option<f64> {
        if value.is_nan() {
            return None;
        }
        // Find the position between the ends, on a logarithmic scale between their logarithms.
        let scale = |x: f64| {
            if self.logarithmic {
                ln(x.max(f64::MIN_POSITIVE))
            } else {
                x
            }
        };
        let (low, high) = (scale(self.low), scale(self.high));
        let position = (scale(value) - low) / (high - low);
        // If both ends are equal, their value is in the middle.
        Some(if position.is_nan() {
            0.5
        } else {
            position.clamp(0.0, 1.0)
        })
    }

    /// Returns the colour of a value as sRGB bytes; magenta, which is not on the scale, for NaN.
    #[must_use]
    pub fn colour(&self, value: f64) -> [u8; 3] {
        self.position(value).map_or([255, 0, 255], heat_colour)
    }

    /// Returns the bytes of a PNG file that shows these values, which are row by row from the top.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] when there is not one value for each pixel.
    pub fn encode_png(
        &self,
        width: u32,
        height: u32,
        values: &[f32],
    ) -> Result<Vec<u8>, FilmError> {
        if values.is_empty() || values.len() != crate::image::area(width, height) {
            let found = values.len();
            return Err(FilmError::Invalid(format!(
                "{found} values for {width} × {height} pixels"
            )));
        }
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|&value| self.colour(f64::from(value)))
            .collect();
        encode_bytes(width, height, &bytes)
    }
}

/// Returns the colour at `position` in [0, 1] of a scale from near-black blue over purple, red and
/// orange to pale yellow, as sRGB bytes.
///
/// Five colours are interpolated linearly in Björn Ottosson's Oklab (2020). As lightness rises in
/// equal steps, the order of values can be seen in grey print and by colour-blind readers.
#[must_use]
pub fn heat_colour(position: f64) -> [u8; 3] {
    /// The colours of the scale in Oklab, at equal distances from 0 to 1. The three numbers of each
    /// are the lightness, a (from green to red) and b (from blue to yellow).
    const STOPS: [[f64; 3]; 5] = [
        [0.14, 0.005, -0.050],
        [0.345, 0.085, -0.115],
        [0.55, 0.165, 0.010],
        [0.755, 0.105, 0.125],
        [0.96, -0.020, 0.110],
    ];
    let along = position.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    #[allow(clippy::cast_possible_truncation, reason = "clamped to the stops")]
    let index = (along as usize).min(STOPS.len() - 2);
    let fraction = along - index as f64;
    let mix = |k: usize| STOPS[index][k] + fraction * (STOPS[index + 1][k] - STOPS[index][k]);
    oklab_to_linear([mix(0), mix(1), mix(2)])
        .map(|linear| Exposure::default().show([to_f32(linear); 3])[0])
}

/// Converts Oklab to linear sRGB by Ottosson's published matrices.
fn oklab_to_linear([lightness, a, b]: [f64; 3]) -> [f64; 3] {
    let cube = |x: f64| x * x * x;
    let l = cube(lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
    let m = cube(lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
    let s = cube(lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transfer_matches_published_values_and_inverts() {
        // IEC 61966-2-1: middle grey 0.18 is byte 118; 0.5 is byte 188.
        assert_eq!(to_byte(srgb_encode(0.18)), 118);
        assert_eq!(to_byte(srgb_encode(0.5)), 188);
        assert_eq!(srgb_encode(f64::NAN).to_bits(), 0.0_f64.to_bits());
        for byte in 0..=255_u8 {
            let encoded = f64::from(byte) / 255.0;
            assert_eq!(to_byte(srgb_encode(srgb_decode(encoded))), byte);
        }
        // The two pieces meet within the rounding of the standard's constants, 2e-8 (found: 1e-8).
        let gap = srgb_encode(0.003_130_8) - srgb_encode(0.003_130_800_01);
        assert!(gap.abs() < 1e-7, "{gap}");
    }

    #[test]
    fn exposure_fits_the_quantile_and_ignores_the_light() {
        let mut image = Image::from_fn(10, 10, |_, _| [0.1, 0.2, 0.05]);
        image.set(3, 3, [100.0; 3]);
        image.set(4, 3, [f32::NAN; 3]);
        let stops = Exposure::fitting(&image, 0.9).stops;
        // 0.2·2^2 = 0.8 is below white and 0.2·2^2.5 above.
        assert!((stops - 2.0).abs() < 1e-12, "{stops}");
        let black = Image::new(2, 2);
        assert_eq!(Exposure::fitting(&black, 0.99), Exposure::default());
        assert_eq!(Exposure { stops }.show([100.0; 3]), [255; 3]);
    }

    #[test]
    fn heat_gets_lighter_all_the_way_and_stays_in_gamut() {
        let lightness = |byte: [u8; 3]| {
            let [r, g, b] = byte.map(|c| srgb_decode(f64::from(c) / 255.0));
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let mut last = -1.0;
        for step in 0..=64 {
            let now = lightness(heat_colour(f64::from(step) / 64.0));
            assert!(now > last, "step {step}: {now} after {last}");
            last = now;
        }
        assert!(last > 0.85, "the hot end is light: {last}");
    }

    #[test]
    fn heat_positions() {
        let linear = HeatMap::spanning(&[2.0, 6.0, f32::NAN, f32::INFINITY]);
        assert_eq!((linear.low, linear.high), (2.0, 6.0));
        assert_eq!(linear.position(3.0), Some(0.25));
        assert_eq!(linear.position(9.0), Some(1.0));
        assert_eq!(linear.colour(f64::NAN), [255, 0, 255]);
        let flat = HeatMap::spanning(&[2.0]);
        assert_eq!(flat.position(2.0), Some(0.5));
        assert_eq!(HeatMap::spanning(&[]).position(0.25), Some(0.25));
        assert!(linear.encode_png(2, 2, &[0.0; 3]).is_err());
    }

    #[test]
    fn png_bytes_decode_to_what_was_shown() {
        let image = Image::from_fn(3, 2, |x, y| [x as f32 * 0.4, y as f32, -1.0]);
        let exposure = Exposure { stops: -1.0 };
        let bytes = encode_png(&image, exposure).unwrap();
        let shown = image.rgb.iter().map(|&p| exposure.show(p)).collect();
        let want = crate::ByteImage::of([3, 2], shown).unwrap();
        assert_eq!(crate::png::read(&bytes), Ok(crate::Pixels::Bytes(want)));
        assert!(encode_png(&Image::default(), Exposure::default()).is_err());
    }
}

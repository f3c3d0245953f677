//! Pixels of textures, and the readers of their files.

use crate::color::{LUMINANCE, srgb_to_linear};
use crate::mipmap::{Mipmap, Pyramids};
use crate::texture::Wrap;
use linelit_geometry::DVec3;
use std::fmt;
use std::sync::LazyLock;

/// Pixels that any image may have, however small its file is.
const FREE_PIXELS: u64 = 1 << 24;
/// Pixels that an image may have for each byte of its file: flat colour packs well.
const PIXELS_PER_BYTE: u64 = 128;
/// Most pixels that an image may have.
const MAX_PIXELS: u64 = 1 << 28;

/// Refuses sizes that a file of so many bytes should not ask for; the error is a message.
pub(crate) fn check_size(what: &str, width: u32, height: u32, bytes: usize) -> Result<(), String> {
    let count = u64::from(width) * u64::from(height);
    let limit = (FREE_PIXELS + PIXELS_PER_BYTE * bytes as u64).min(MAX_PIXELS);
    if count == 0 || count > limit {
        return Err(format!(
            "{what} image of {width} x {height} pixels in {bytes} bytes"
        ));
    }
    Ok(())
}

/// The pixels of a texture: bytes, or numbers.
#[derive(Clone, PartialEq)]
pub struct ImageData {
    width: u32,
    height: u32,
    pixels: Pixels,
    pyramids: Pyramids,
}

/// Pixels, the top row first.
#[derive(Clone, PartialEq)]
enum Pixels {
    Bytes { rgb: Vec<[u8; 3]>, srgb: bool },
    Linear(Vec<[f32; 3]>),
}

impl fmt::Debug for ImageData {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ImageData({} x {})", self.width, self.height)
    }
}

static SRGB: LazyLock<[f64; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(u8::try_from(i).unwrap_or(255))));

static LINEAR: LazyLock<[f64; 256]> = LazyLock::new(|| std::array::from_fn(|i| i as f64 / 255.0));

impl ImageData {
    /// An image of bytes from its rows, top row first; `None` if the count does not fit.
    pub fn new(width: u32, height: u32, rgb: Vec<[u8; 3]>, srgb: bool) -> Option<Self> {
        let count = rgb.len();
        Self::with(width, height, count, Pixels::Bytes { rgb, srgb })
    }

    /// An image of linear values, which may be above one, from its rows, top row first; `None` if
    /// the count does not fit or a value is negative or not finite.
    pub fn linear(width: u32, height: u32, rgb: Vec<[f32; 3]>) -> Option<Self> {
        let good = |v: &f32| *v >= 0.0 && v.is_finite();
        let all = rgb.iter().flatten().all(good);
        let count = rgb.len();
        Self::with(width, height, count, Pixels::Linear(rgb)).filter(|_| all)
    }

    fn with(width: u32, height: u32, count: usize, pixels: Pixels) -> Option<Self> {
        let expected = u64::from(width) * u64::from(height);
        (expected > 0 && expected == count as u64).then_some(Self {
            width,
            height,
            pixels,
            pyramids: Pyramids::default(),
        })
    }

    /// The same image in grey, each pixel the luminance of its linear value.
    pub(crate) fn to_luminance(&self) -> Self {
        let mut grey = self.clone();
        match &mut grey.pixels {
            Pixels::Bytes { rgb, srgb } => to_grey(rgb, table(*srgb)),
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

    /// One component (0: red, 1: green, 2: blue) in grey.
    #[cfg(feature = "gltf")]
    pub(crate) fn component(&self, k: usize) -> Self {
        let mut grey = self.clone();
        match &mut grey.pixels {
            Pixels::Bytes { rgb, .. } => rgb.iter_mut().for_each(|rgb| *rgb = [rgb[k]; 3]),
            Pixels::Linear(rgb) => rgb.iter_mut().for_each(|rgb| *rgb = [rgb[k]; 3]),
        }
        grey
    }

    /// Pixels across.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Bytes of the pixels.
    pub const fn memory(&self) -> usize {
        match &self.pixels {
            Pixels::Bytes { rgb, .. } => 3 * rgb.len(),
            Pixels::Linear(rgb) => 12 * rgb.len(),
        }
    }

    /// Bytes of the smaller copies that were made of it.
    pub(crate) fn pyramid_memory(&self) -> usize {
        self.pyramids.memory()
    }

    /// The image and its smaller copies, which the first call makes.
    pub(crate) fn mipmap(&self, wrap: [Wrap; 2]) -> Mipmap<'_> {
        Mipmap {
            image: self,
            pyramid: self.pyramids.of(self, wrap),
            wrap,
        }
    }

    /// Whether red, green and blue are the same everywhere.
    pub(crate) fn is_grey(&self) -> bool {
        match &self.pixels {
            Pixels::Bytes { rgb, .. } => rgb.iter().all(|[r, g, b]| r == g && g == b),
            Pixels::Linear(rgb) => {
                let is_grey = |[r, g, b]: [u32; 3]| r == g && g == b;
                rgb.iter().all(|rgb| is_grey(rgb.map(f32::to_bits)))
            }
        }
    }

    /// Whether the pixels are sRGB-encoded bytes rather than linear.
    pub const fn is_srgb(&self) -> bool {
        matches!(self.pixels, Pixels::Bytes { srgb: true, .. })
    }

    /// Whether the pixels are numbers, which no file of bytes can hold.
    pub const fn is_linear(&self) -> bool {
        matches!(self.pixels, Pixels::Linear(_))
    }

    /// The linear value of a pixel; row 0 is the top. Zero outside.
    pub fn pixel(&self, x: u32, y: u32) -> DVec3 {
        let index = y as usize * self.width as usize + x as usize;
        let value = match &self.pixels {
            Pixels::Bytes { rgb, srgb } => {
                let table = table(*srgb);
                rgb.get(index)
                    .map(|rgb| rgb.map(|byte| table[usize::from(byte)]))
            }
            Pixels::Linear(rgb) => rgb.get(index).map(|rgb| rgb.map(f64::from)),
        };
        value.map_or(DVec3::ZERO, DVec3::from_array)
    }
}

impl ImageData {
    /// Writes bytes as an uncompressed TGA file of 24 bits.
    ///
    /// # Errors
    /// When writing fails, when the pixels are [numbers](Self::is_linear), or when the image is
    /// larger than the format allows (65535 pixels along a side).
    pub fn write_tga(&self, out: &mut impl std::io::Write) -> std::io::Result<()> {
        let Pixels::Bytes { rgb, .. } = &self.pixels else {
            return Err(std::io::Error::other("numbers do not fit into bytes"));
        };
        let side = |n: u32| u16::try_from(n).map_err(std::io::Error::other);
        let ([w0, w1], [h0, h1]) = (
            side(self.width)?.to_le_bytes(),
            side(self.height)?.to_le_bytes(),
        );
        // True colour without a map; the top row first.
        out.write_all(&[0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, w0, w1, h0, h1, 24, 0x20])?;
        let bytes: Vec<u8> = rgb.iter().flat_map(|[r, g, b]| [*b, *g, *r]).collect();
        out.write_all(&bytes)
    }
}

/// The linear values of bytes, in ascending order.
fn table(srgb: bool) -> &'static [f64; 256] {
    if srgb { &SRGB } else { &LINEAR }
}

/// Replaces colours by the byte whose linear value is nearest to their luminance.
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

/// Reads an image by its first bytes or else the extension of its name: `None` if there is no
/// reader for it.
pub(crate) fn read(name: &str, bytes: &[u8], srgb: bool) -> Option<Result<ImageData, String>> {
    if bytes.starts_with(b"\x89PNG") {
        return Some(crate::png::read(bytes, srgb));
    }
    if bytes.starts_with(b"\xff\xd8\xff") {
        return read_jpeg(bytes, srgb);
    }
    if bytes.starts_with(b"\x76\x2f\x31\x01") {
        return read_numbers(bytes);
    }
    let extension = name.rsplit('.').next().unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "tga" => Some(read_tga(bytes, srgb)),
        "png" => Some(crate::png::read(bytes, srgb)),
        "exr" | "pfm" => read_numbers(bytes),
        "jpg" | "jpeg" => Some(Err("it is not a JPEG file".into())),
        _ => None,
    }
}

/// Reads an EXR or PFM file, if the feature is on; the error is a message without a place.
#[cfg(feature = "hdr")]
fn read_numbers(bytes: &[u8]) -> Option<Result<ImageData, String>> {
    let read = || {
        let mut image = linelit_film::Image::from_bytes(bytes).map_err(|e| e.to_string())?;
        check_size("an", image.width, image.height, bytes.len())?;
        without_ringing(&mut image.rgb);
        ImageData::linear(image.width, image.height, image.rgb)
            .ok_or_else(|| "a value is negative or not finite".to_owned())
    };
    Some(read())
}

/// Images that were resampled have values a little below zero beside bright ones: these become zero.
/// Others below zero stay, to be refused.
#[cfg(feature = "hdr")]
fn without_ringing(rgb: &mut [[f32; 3]]) {
    const LARGEST: f32 = 1e-3;
    let least = -LARGEST * rgb.iter().flatten().fold(0.0, |a: f32, v| a.max(*v));
    for value in rgb.iter_mut().flatten() {
        if *value < 0.0 && *value >= least {
            *value = 0.0;
        }
    }
}

#[cfg(not(feature = "hdr"))]
fn read_numbers(_: &[u8]) -> Option<Result<ImageData, String>> {
    None
}

/// Reads a JPEG file, if the feature is on; the error is a message without a place.
#[cfg(feature = "jpeg")]
fn read_jpeg(bytes: &[u8], srgb: bool) -> Option<Result<ImageData, String>> {
    Some(crate::jpeg::read(bytes, srgb))
}

#[cfg(not(feature = "jpeg"))]
fn read_jpeg(_: &[u8], _: bool) -> Option<Result<ImageData, String>> {
    None
}

/// Reads a TGA file: true colour or grey, 8, 24 or 32 bits, plain or run-length encoded.
/// The error is a message without a place.
pub(crate) fn read_tga(bytes: &[u8], srgb: bool) -> Result<ImageData, String> {
    let header: &[u8; 18] = bytes
        .first_chunk()
        .ok_or("the file ends within the TGA header")?;
    let (id_length, has_map, kind) = (usize::from(header[0]), header[1] != 0, header[2]);
    let u16_at = |i: usize| u16::from_le_bytes([header[i], header[i + 1]]);
    let map_bytes = if has_map {
        usize::from(u16_at(5)) * usize::from(header[7]).div_ceil(8)
    } else {
        0
    };
    let (width, height) = (u32::from(u16_at(12)), u32::from(u16_at(14)));
    let (bits, descriptor) = (header[16], header[17]);
    let depth = usize::from(bits) / 8;
    let run_length = match (kind, bits) {
        (2, 24 | 32) | (3, 8) => false,
        (10, 24 | 32) | (11, 8) => true,
        _ => {
            return Err(format!(
                "TGA images of type {kind} with {bits} bits are not supported"
            ));
        }
    };
    let count = u64::from(width) * u64::from(height);
    check_size("a TGA", width, height, bytes.len())?;
    let data = bytes.get(18 + id_length + map_bytes..).unwrap_or(&[]);
    // The least number of bytes that can hold that many pixels.
    let least = if run_length {
        count.div_ceil(128) * (1 + depth as u64)
    } else {
        count * depth as u64
    };
    if (data.len() as u64) < least {
        return Err(format!(
            "the TGA file ends early: {width} x {height} pixels need {least} bytes, it has {}",
            data.len()
        ));
    }
    let count = usize::try_from(count).map_err(|e| e.to_string())?;
    let mut rgb = if run_length {
        decode_runs(data, depth, count)?
    } else {
        data.chunks_exact(depth)
            .take(count)
            .map(tga_pixel)
            .collect()
    };
    let w = width as usize;
    if descriptor & 0x20 == 0 {
        let flipped: Vec<[u8; 3]> = rgb.chunks_exact(w).rev().flatten().copied().collect();
        rgb = flipped;
    }
    if descriptor & 0x10 != 0 {
        rgb.chunks_exact_mut(w).for_each(<[_]>::reverse);
    }
    ImageData::new(width, height, rgb, srgb).ok_or_else(|| "an empty TGA image".into())
}

/// Blue, green, red (and alpha) or grey.
fn tga_pixel(bytes: &[u8]) -> [u8; 3] {
    match *bytes {
        [b, g, r, ..] => [r, g, b],
        [grey, ..] => [grey; 3],
        [] => [0; 3],
    }
}

fn decode_runs(data: &[u8], depth: usize, count: usize) -> Result<Vec<[u8; 3]>, String> {
    let mut rgb = Vec::with_capacity(count);
    let mut rest = data;
    while rgb.len() < count {
        let short = || "the TGA file ends within its pixels".to_owned();
        let (&packet, tail) = rest.split_first().ok_or_else(short)?;
        let n = (usize::from(packet & 0x7f) + 1).min(count - rgb.len());
        let bytes = if packet & 0x80 != 0 { depth } else { n * depth };
        let pixels = tail.get(..bytes).ok_or_else(short)?;
        if packet & 0x80 != 0 {
            rgb.resize(rgb.len() + n, tga_pixel(pixels));
        } else {
            rgb.extend(pixels.chunks_exact(depth).map(tga_pixel));
        }
        rest = &tail[bytes..];
    }
    Ok(rgb)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(kind: u8, w: u8, h: u8, bits: u8, descriptor: u8) -> Vec<u8> {
        vec![
            0, 0, kind, 0, 0, 0, 0, 0, 0, 0, 0, 0, w, 0, h, 0, bits, descriptor,
        ]
    }

    fn rgb(image: &ImageData) -> &[[u8; 3]] {
        match &image.pixels {
            Pixels::Bytes { rgb, .. } => rgb,
            Pixels::Linear(_) => &[],
        }
    }

    #[test]
    fn reads_bottom_up_and_top_down() {
        let pixels = [1, 2, 3, 4, 5, 6]; // two rows of one pixel, blue first
        for (descriptor, top) in [(0, [6, 5, 4]), (0x20, [3, 2, 1])] {
            let mut file = header(2, 1, 2, 24, descriptor);
            file.extend(pixels);
            let image = read_tga(&file, false).unwrap();
            assert_eq!(rgb(&image)[0], top);
        }
    }

    #[test]
    fn reads_runs() {
        let mut file = header(11, 3, 1, 8, 0x20);
        file.extend([0x81, 9, 0x00, 7]);
        let image = read_tga(&file, false).unwrap();
        assert_eq!(rgb(&image), [[9; 3], [9; 3], [7; 3]]);
    }

    #[test]
    fn what_is_written_is_read() {
        let pixels = (0..6).map(|i| [i, 2 * i, 255 - i]).collect();
        let image = ImageData::new(3, 2, pixels, true).unwrap();
        let mut file = Vec::new();
        image.write_tga(&mut file).unwrap();
        assert!(read_tga(&file, true).unwrap() == image);
    }

    #[test]
    fn truncated_files_are_errors_and_do_not_allocate() {
        let mut file = header(10, 255, 255, 24, 0);
        file[13] = 255;
        file[15] = 255;
        assert!(read_tga(&file, true).is_err());
        for cut in 0..18 {
            assert!(read_tga(&header(2, 1, 1, 24, 0)[..cut], true).is_err());
        }
        assert!(read_tga(&header(2, 1, 1, 24, 0), true).is_err());
    }
}

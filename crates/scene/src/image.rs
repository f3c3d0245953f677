//! Pixels of textures, and the readers of their files.

use crate::color::{LUMINANCE, srgb_to_linear};
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

/// Eight-bit pixels, top row first.
#[derive(Clone, PartialEq, Eq)]
pub struct ImageData {
    width: u32,
    height: u32,
    rgb: Vec<[u8; 3]>,
    srgb: bool,
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
    /// An image from its rows, top row first; `None` if the count does not fit.
    pub fn new(width: u32, height: u32, rgb: Vec<[u8; 3]>, srgb: bool) -> Option<Self> {
        let count = u64::from(width) * u64::from(height);
        (count > 0 && count == rgb.len() as u64).then_some(Self {
            width,
            height,
            rgb,
            srgb,
        })
    }

    /// The same image in grey, each pixel the luminance of its linear value.
    pub(crate) fn to_luminance(&self) -> Self {
        let nearest = |linear: f64| {
            let table = self.table();
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
        let mut grey = self.clone();
        for rgb in &mut grey.rgb {
            if rgb[0] != rgb[1] || rgb[1] != rgb[2] {
                let [r, g, b] = rgb.map(|byte| self.table()[usize::from(byte)]);
                *rgb = [nearest(DVec3::new(r, g, b).dot(LUMINANCE)); 3];
            }
        }
        grey
    }

    /// One component (0: red, 1: green, 2: blue) in grey.
    #[cfg(feature = "gltf")]
    pub(crate) fn component(&self, k: usize) -> Self {
        let mut grey = self.clone();
        grey.rgb.iter_mut().for_each(|rgb| *rgb = [rgb[k]; 3]);
        grey
    }

    /// The linear values of the bytes, in ascending order.
    fn table(&self) -> &'static [f64; 256] {
        if self.srgb { &SRGB } else { &LINEAR }
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
        3 * self.rgb.len()
    }

    /// Whether the bytes are sRGB-encoded rather than linear.
    pub const fn is_srgb(&self) -> bool {
        self.srgb
    }

    /// The linear value of a pixel; row 0 is the top. Zero outside.
    pub fn pixel(&self, x: u32, y: u32) -> DVec3 {
        let index = y as usize * self.width as usize + x as usize;
        let Some(&[r, g, b]) = self.rgb.get(index) else {
            return DVec3::ZERO;
        };
        let table = self.table();
        DVec3::from_array([r, g, b].map(|byte| table[usize::from(byte)]))
    }
}

impl ImageData {
    /// Writes the pixels as an uncompressed TGA file of 24 bits.
    ///
    /// # Errors
    /// When writing fails, or when the image is larger than the format allows (65535 pixels along
    /// a side).
    pub fn write_tga(&self, out: &mut impl std::io::Write) -> std::io::Result<()> {
        let side = |n: u32| u16::try_from(n).map_err(std::io::Error::other);
        let ([w0, w1], [h0, h1]) = (
            side(self.width)?.to_le_bytes(),
            side(self.height)?.to_le_bytes(),
        );
        // True colour without a map; the top row first.
        out.write_all(&[0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, w0, w1, h0, h1, 24, 0x20])?;
        let bytes: Vec<u8> = self.rgb.iter().flat_map(|[r, g, b]| [*b, *g, *r]).collect();
        out.write_all(&bytes)
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
    let extension = name.rsplit('.').next().unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "tga" => Some(read_tga(bytes, srgb)),
        "png" => Some(crate::png::read(bytes, srgb)),
        "jpg" | "jpeg" => Some(Err("it is not a JPEG file".into())),
        _ => None,
    }
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

    #[test]
    fn reads_bottom_up_and_top_down() {
        let pixels = [1, 2, 3, 4, 5, 6]; // two rows of one pixel, blue first
        for (descriptor, top) in [(0, [6, 5, 4]), (0x20, [3, 2, 1])] {
            let mut file = header(2, 1, 2, 24, descriptor);
            file.extend(pixels);
            let image = read_tga(&file, false).unwrap();
            assert_eq!(image.rgb[0], top);
        }
    }

    #[test]
    fn reads_runs() {
        let mut file = header(11, 3, 1, 8, 0x20);
        file.extend([0x81, 9, 0x00, 7]);
        let image = read_tga(&file, false).unwrap();
        assert_eq!(image.rgb, [[9; 3], [9; 3], [7; 3]]);
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

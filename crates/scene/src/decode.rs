//! Image files of all kinds as pixels: which reader, and what it may take.

use crate::error::ErrorKind;
use crate::image::ImageData;
use crate::source::Refusal;

/// Bytes that the pixels of any image may take, however small its file is.
const FREE_BYTES: usize = 1 << 28;
/// Bytes that the pixels may take for each byte of the file: flat colour packs well.
const BYTES_PER_BYTE: usize = 64;
/// The most bytes that the pixels of an image may take.
const MAX_BYTES: usize = 1 << 32;

/// An image, and what was strange about its file.
pub(crate) struct Decoded {
    pub(crate) image: ImageData,
    pub(crate) warning: Option<String>,
}

impl From<ImageData> for Decoded {
    fn from(image: ImageData) -> Self {
        let warning = None;
        Self { image, warning }
    }
}

/// Bytes that the pixels of a file of so many bytes may take.
fn limit(file: usize) -> usize {
    FREE_BYTES
        .saturating_add(BYTES_PER_BYTE.saturating_mul(file))
        .min(MAX_BYTES)
}

/// Bytes of an image with so many for each pixel; sizes that a file of so many bytes should not
/// ask for are refused, the error is a message.
pub(crate) fn check_size(
    what: &str,
    [width, height]: [u32; 2],
    pixel: usize,
    file: usize,
) -> Result<usize, Refusal> {
    let (columns, rows) = (width as usize, height as usize);
    let needed = columns.saturating_mul(rows).saturating_mul(pixel);
    if needed == 0 {
        return Err(format!("{what} image of {width} x {height} pixels").into());
    }
    let limit = limit(file);
    if needed > limit {
        let message = format!(
            "{what} image of {width} x {height} pixels takes {needed} bytes, {limit} are allowed \
             for a file of {file}"
        );
        return Err(Refusal::new(ErrorKind::Limit, message));
    }
    Ok(needed)
}

/// Reads an image by its first bytes or else the extension of its name: `None` if there is no
/// reader for it.
pub(crate) fn read(name: &str, bytes: &[u8], srgb: bool) -> Option<Result<Decoded, Refusal>> {
    let plain = |image: Result<ImageData, Refusal>| Some(image.map(Decoded::from));
    if bytes.starts_with(b"\x89PNG") {
        return plain(crate::png::read(bytes, srgb));
    }
    if bytes.starts_with(b"\xff\xd8\xff") {
        return read_jpeg(bytes, srgb).and_then(plain);
    }
    if bytes.starts_with(b"\x76\x2f\x31\x01") {
        return read_numbers(bytes);
    }
    let extension = name.rsplit('.').next().unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "tga" => plain(crate::tga::read(bytes, srgb)),
        "png" => plain(crate::png::read(bytes, srgb)),
        "exr" | "pfm" => read_numbers(bytes),
        "jpg" | "jpeg" => Some(Err("it is not a JPEG file".into())),
        _ => None,
    }
}

/// Reads an EXR or PFM file, if the feature is on.
#[cfg(feature = "hdr")]
fn read_numbers(bytes: &[u8]) -> Option<Result<Decoded, Refusal>> {
    let read = || {
        let found = linelit_film::Image::from_bytes(bytes, limit(bytes.len()));
        let mut image = found.map_err(|e| {
            let kind = if e.too_large {
                ErrorKind::Limit
            } else {
                ErrorKind::Syntax
            };
            Refusal::new(kind, e.to_string())
        })?;
        let width = image.width;
        let place = |k: usize| {
            let k = u32::try_from(k).unwrap_or(u32::MAX);
            format!("pixel ({}, {})", k % width.max(1), k / width.max(1))
        };
        let odd = |p: &[f32; 3]| p.iter().any(|v| !v.is_finite());
        if let Some(k) = image.rgb.iter().position(odd) {
            return Err(format!("{} is {:?}, not finite", place(k), image.rgb[k]).into());
        }
        let warning = without_negatives(&mut image.rgb, place);
        ImageData::linear(image.width, image.height, image.rgb)
            .map(|image| Decoded { image, warning })
            .ok_or_else(|| "it has no pixels".into())
    };
    Some(read())
}

#[cfg(not(feature = "hdr"))]
fn read_numbers(_: &[u8]) -> Option<Result<Decoded, Refusal>> {
    None
}

/// Makes values below zero zero: there is no such light. Images that were resampled have some, a
/// little below zero beside bright ones; others are worth a warning, which is given.
#[cfg(feature = "hdr")]
fn without_negatives(rgb: &mut [[f32; 3]], place: impl Fn(usize) -> String) -> Option<String> {
    const RINGING: f32 = 1e-3;
    let allowed = -RINGING * rgb.iter().flatten().fold(0.0, |a: f32, v| a.max(*v));
    let least = |p: &[f32; 3]| p.iter().fold(0.0, |a: f32, v| a.min(*v));
    let mut count = 0_usize;
    let mut worst = (0.0, 0);
    for (k, pixel) in rgb.iter_mut().enumerate() {
        let low = least(pixel);
        if low < allowed {
            count += 1;
            if low < worst.0 {
                worst = (low, k);
            }
        }
        *pixel = pixel.map(|v| v.max(0.0));
    }
    (count > 0).then(|| {
        let (low, at) = (worst.0, place(worst.1));
        format!("{count} pixels are below zero and read as zero; the least is {low} at {at}")
    })
}

/// Reads a JPEG file, if the feature is on.
#[cfg(feature = "jpeg")]
fn read_jpeg(bytes: &[u8], srgb: bool) -> Option<Result<ImageData, Refusal>> {
    Some(crate::jpeg::read(bytes, srgb))
}

#[cfg(not(feature = "jpeg"))]
fn read_jpeg(_: &[u8], _: bool) -> Option<Result<ImageData, Refusal>> {
    None
}

//! Picture files of all kinds as pixels: which reader, and what memory it may take.

use crate::{FormatError, Image};

/// Bytes that the pixels of any image may take, however small its file is.
const FREE_BYTES: usize = 1 << 28;
/// Bytes that the pixels may take for each byte of the file: flat colour packs well.
const BYTES_PER_BYTE: usize = 64;
/// The most bytes that the pixels of an image may take.
const MAX_BYTES: usize = 1 << 32;

/// A picture of integers, three to a pixel. Whether they are sRGB-encoded or linear is for those to
/// know who use it: files do not say, or not reliably.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IntegerImage<T> {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Red, green and blue, row by row, the top row first; `width` × `height` of them.
    pub rgb: Vec<[T; 3]>,
}

/// A picture of eight bits a channel.
pub type ByteImage = IntegerImage<u8>;

/// A picture of sixteen bits a channel.
pub type WordImage = IntegerImage<u16>;

impl<T> IntegerImage<T> {
    /// A picture of its rows; `None` if it has no pixels or another number of them.
    pub(crate) fn of([width, height]: [u32; 2], rgb: Vec<[T; 3]>) -> Option<Self> {
        let count = crate::image::area(width, height);
        (count > 0 && rgb.len() == count).then_some(Self { width, height, rgb })
    }
}

/// The pixels of a picture file of any kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// Pixels of a PNG, TGA or JPEG file.
    Bytes(ByteImage),
    /// Pixels of a PNG file of 16 bits a channel.
    Words(WordImage),
    /// Pixels of an EXR or PFM file: linear values, finite and not below zero.
    Linear(Image),
}

/// A picture, and what was strange about its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// The picture.
    pub pixels: Pixels,
    /// Description of what was left out or changed to make sense of the file.
    pub warning: Option<String>,
}

/// Why a picture was not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct DecodeError {
    /// Description of the fault, on one line.
    pub message: String,
    /// Whether the file may be whole, but asks for more memory than a file of its size should.
    pub too_large: bool,
}

impl From<String> for DecodeError {
    fn from(message: String) -> Self {
        let too_large = false;
        Self { message, too_large }
    }
}

impl From<&str> for DecodeError {
    fn from(message: &str) -> Self {
        message.to_owned().into()
    }
}

impl From<FormatError> for DecodeError {
    fn from(error: FormatError) -> Self {
        Self {
            message: error.to_string(),
            too_large: error.too_large,
        }
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
) -> Result<usize, DecodeError> {
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
        let too_large = true;
        return Err(DecodeError { message, too_large });
    }
    Ok(needed)
}

/// Reads a picture of any kind, by its first bytes or else the extension of its name; `None` if
/// there is no reader for it. Its size is asked before memory is: pixels may take 256 MiB, or 64
/// bytes for each of the file if that is more, 4 GiB at most.
///
/// ```
/// use linelit_film::{ByteImage, Exposure, Image, Pixels, decode_picture, encode_png};
///
/// let file = encode_png(&Image::new(1, 1), Exposure::default())?;
/// let black = ByteImage { width: 1, height: 1, rgb: vec![[0; 3]] };
/// assert_eq!(decode_picture("a.png", &file).unwrap()?.pixels, Pixels::Bytes(black));
/// assert!(decode_picture("a.txt", b"text").is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the file is broken, not of the kind that its name says, or asks for more memory.
pub fn decode_picture(name: &str, bytes: &[u8]) -> Option<Result<Decoded, DecodeError>> {
    let plain = |image: Result<ByteImage, DecodeError>| {
        Some(image.map(|image| Decoded {
            pixels: Pixels::Bytes(image),
            warning: None,
        }))
    };
    if bytes.starts_with(b"\x89PNG") {
        return read_png(bytes);
    }
    if bytes.starts_with(b"\xff\xd8\xff") {
        return read_jpeg(bytes).and_then(plain);
    }
    if bytes.starts_with(b"\x76\x2f\x31\x01") {
        return Some(read_numbers(bytes));
    }
    let extension = name.rsplit('.').next().unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "tga" => plain(crate::tga::read(bytes)),
        "png" => read_png(bytes),
        "exr" | "pfm" => Some(read_numbers(bytes)),
        "jpg" | "jpeg" => Some(Err("it is not a JPEG file".into())),
        _ => None,
    }
}

/// Reads the alpha channel of a picture as grey integers, within the same limits; `None` if it has
/// none, and of files other than PNG and TGA.
///
/// # Errors
/// As [`decode_picture`].
pub fn decode_alpha(name: &str, bytes: &[u8]) -> Result<Option<Pixels>, DecodeError> {
    if bytes.starts_with(b"\x89PNG") {
        return crate::png::read_alpha(bytes);
    }
    let extension = name.rsplit('.').next().unwrap_or("");
    if extension.eq_ignore_ascii_case("tga") {
        return Ok(crate::tga::read_alpha(bytes)?.map(Pixels::Bytes));
    }
    Ok(None)
}

fn read_png(bytes: &[u8]) -> Option<Result<Decoded, DecodeError>> {
    let warning = None;
    Some(crate::png::read(bytes).map(|pixels| Decoded { pixels, warning }))
}

/// Reads an EXR or PFM file.
fn read_numbers(bytes: &[u8]) -> Result<Decoded, DecodeError> {
    let (mut image, placement) = Image::placed(bytes, limit(bytes.len()))?;
    if image.rgb.is_empty() {
        return Err("it has no pixels".into());
    }
    let width = image.width;
    let coordinates = |k: usize| {
        let k = u32::try_from(k).unwrap_or(u32::MAX);
        format!("pixel ({}, {})", k % width.max(1), k / width.max(1))
    };
    let odd = |p: &[f32; 3]| p.iter().any(|v| !v.is_finite());
    if let Some(k) = image.rgb.iter().position(odd) {
        return Err(format!("{} is {:?}, not finite", coordinates(k), image.rgb[k]).into());
    }
    // pbrt takes the data window for the image, too.
    let size = [image.width, image.height];
    let placement = placement.filter(|p| p.full != size || p.origin != [0, 0]);
    let windows = placement.map(|placement| {
        let ([w, h], [x, y]) = (placement.full, placement.origin);
        format!("its pixels lie at {x}, {y} of a picture of {w} x {h}, and are taken for all of it")
    });
    let negatives = without_negatives(&mut image.rgb, coordinates);
    let warnings: Vec<String> = windows.into_iter().chain(negatives).collect();
    let warning = (!warnings.is_empty()).then(|| warnings.join("; "));
    let pixels = Pixels::Linear(image);
    Ok(Decoded { pixels, warning })
}

/// Makes values below zero zero: there is no such light. Images that were resampled have some, a
/// little below zero beside bright ones; others are worth a warning, which is given.
fn without_negatives(
    rgb: &mut [[f32; 3]],
    coordinates: impl Fn(usize) -> String,
) -> Option<String> {
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
        let (low, at) = (worst.0, coordinates(worst.1));
        format!("{count} pixels are below zero and read as zero; the least is {low} at {at}")
    })
}

/// Reads a JPEG file, if the feature is on.
#[cfg(feature = "jpeg")]
fn read_jpeg(bytes: &[u8]) -> Option<Result<ByteImage, DecodeError>> {
    Some(crate::jpeg::read(bytes))
}

#[cfg(not(feature = "jpeg"))]
fn read_jpeg(_: &[u8]) -> Option<Result<ByteImage, DecodeError>> {
    None
}

//! [`decode_picture`], which reads picture files in any format: it chooses the reader, and limits
//! the memory that the pixels may take.

use crate::{FormatError, Image};

/// The number of bytes that the pixels of an image may take, however small its file is. Larger
/// images are refused unless [`BYTES_PER_BYTE`] allows them.
const FREE_BYTES: usize = 1 << 28;
/// The number of bytes that the pixels of an image may take for each byte of its file, if that is
/// more than [`FREE_BYTES`]; flat colours compress well.
const BYTES_PER_BYTE: usize = 64;
/// The largest number of bytes that the pixels of an image may take, for a file of any size; larger
/// images are refused.
const MAX_BYTES: usize = 1 << 32;

/// A picture with three integers for each pixel. The caller has to know whether they are
/// sRGB-encoded or linear, as files do not say so reliably.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IntegerImage<T> {
    /// The number of pixels across.
    pub width: u32,
    /// The number of pixels down.
    pub height: u32,
    /// The `width` × `height` pixels row by row, the top row first: red, green and blue.
    pub rgb: Vec<[T; 3]>,
}

/// A picture with eight bits for each channel.
pub type ByteImage = IntegerImage<u8>;

/// A picture with sixteen bits for each channel.
pub type WordImage = IntegerImage<u16>;

impl<T> IntegerImage<T> {
    /// Creates a picture of these pixels, row by row from the top; `None` if there are none, or
    /// their number does not fit the size.
    pub(crate) fn of([width, height]: [u32; 2], rgb: Vec<[T; 3]>) -> Option<Self> {
        let count = crate::image::area(width, height);
        (count > 0 && rgb.len() == count).then_some(Self { width, height, rgb })
    }
}

/// The pixels of a picture file in any format.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// The pixels of a PNG, TGA or JPEG file.
    Bytes(ByteImage),
    /// The pixels of a PNG file with 16 bits for each channel.
    Words(WordImage),
    /// The pixels of an EXR or PFM file: linear values that are finite and not negative.
    Linear(Image),
}

/// A picture, and a warning if the file was unusual.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// The picture.
    pub pixels: Pixels,
    /// A description of parts of the file that were left out or changed, if there were any.
    pub warning: Option<String>,
}

/// The reason why a picture could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct DecodeError {
    /// A description of the error, on one line.
    pub message: String,
    /// Whether the file may be valid, but needs more memory than is allowed for a file of its size.
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

/// Returns the number of bytes that the pixels may take, for a file of `file` bytes.
fn limit(file: usize) -> usize {
    FREE_BYTES
        .saturating_add(BYTES_PER_BYTE.saturating_mul(file))
        .min(MAX_BYTES)
}

/// Returns the number of bytes of an image with `pixel` bytes for each pixel. It is an error if
/// they are more than is allowed for a file of `file` bytes, or zero. `what` names the format in
/// messages.
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

/// Reads a picture in any format. The format is known by the first bytes, or else by the extension
/// of the name; the result is `None` if there is no reader for it.
///
/// The size is checked before memory is allocated: pixels may take 256 MiB, or 64 bytes for each
/// byte of the file if that is more, but at most 4 GiB.
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
/// The file is damaged, is not in the format of its extension, or needs more memory than these
/// limits.
pub fn decode_picture(name: &str, bytes: &[u8]) -> Option<Result<Decoded, DecodeError>> {
    // Recognise the format by the first bytes.
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
    // Recognise it by the extension.
    let extension = name.rsplit('.').next().unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "tga" => plain(crate::tga::read(bytes)),
        "png" => read_png(bytes),
        "exr" | "pfm" => Some(read_numbers(bytes)),
        "jpg" | "jpeg" => Some(Err("it is not a JPEG file".into())),
        _ => None,
    }
}

/// Reads the alpha channel of a PNG or TGA file as grey integers, with the limits of
/// [`decode_picture`]; `None` if it has no alpha channel, and for files of other formats.
///
/// # Errors
/// The same as for [`decode_picture`].
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

/// Reads a PNG file.
fn read_png(bytes: &[u8]) -> Option<Result<Decoded, DecodeError>> {
    let warning = None;
    Some(crate::png::read(bytes).map(|pixels| Decoded { pixels, warning }))
}

/// Reads an EXR or PFM file.
fn read_numbers(bytes: &[u8]) -> Result<Decoded, DecodeError> {
    // Refuse images without pixels, or with values that are not finite.
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
    // Warn if the pixels are a part of a larger picture. They are used as the whole image, as pbrt
    // does, too.
    let size = [image.width, image.height];
    let placement = placement.filter(|p| p.full != size || p.origin != [0, 0]);
    let windows = placement.map(|placement| {
        let ([w, h], [x, y]) = (placement.full, placement.origin);
        format!("its pixels lie at {x}, {y} of a picture of {w} x {h}, and are taken for all of it")
    });
    // Set negative values to zero.
    let negatives = without_negatives(&mut image.rgb, coordinates);
    let warnings: Vec<String> = windows.into_iter().chain(negatives).collect();
    let warning = (!warnings.is_empty()).then(|| warnings.join("; "));
    let pixels = Pixels::Linear(image);
    Ok(Decoded { pixels, warning })
}

/// Sets negative values to zero, as there is no negative light. Images that were resampled have
/// such values a little below zero next to bright pixels; larger ones give the warning that is
/// returned.
fn without_negatives(
    rgb: &mut [[f32; 3]],
    coordinates: impl Fn(usize) -> String,
) -> Option<String> {
    /// The magnitude of a negative value, as a fraction of the largest value of the image, up to
    /// which there is no warning about it.
    const RINGING: f32 = 1e-3;
    let allowed = -RINGING * rgb.iter().flatten().fold(0.0, |a: f32, v| a.max(*v));
    let least = |p: &[f32; 3]| p.iter().fold(0.0, |a: f32, v| a.min(*v));
    // Count the pixels below that, find the worst, and clamp all.
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

/// Reads a JPEG file; `None` if the feature `jpeg` is off.
#[cfg(feature = "jpeg")]
fn read_jpeg(bytes: &[u8]) -> Option<Result<ByteImage, DecodeError>> {
    Some(crate::jpeg::read(bytes))
}

#[cfg(not(feature = "jpeg"))]
fn read_jpeg(_: &[u8]) -> Option<Result<ByteImage, DecodeError>> {
    None
}

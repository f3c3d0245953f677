//! The reader of JPEG files, baseline and progressive.
//!
//! The decoder is used without its SIMD code, so that pixels are the same on every machine.

use crate::ByteImage;
use crate::decode::{DecodeError, check_size};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Reads an image; the error does not name the file.
pub(crate) fn read(bytes: &[u8]) -> Result<ByteImage, DecodeError> {
    let options = DecoderOptions::new_safe()
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| message(&e))?;
    let (width, height) = decoder.dimensions().ok_or("the JPEG file has no size")?;
    let side = |n: usize| u32::try_from(n).map_err(|e| e.to_string());
    let (width, height) = (side(width)?, side(height)?);
    check_size("a JPEG", [width, height], 3, bytes.len())?;
    let pixels = decoder.decode().map_err(|e| message(&e))?;
    let rgb = match decoder.output_colorspace() {
        Some(ColorSpace::Luma) => pixels.iter().map(|grey| [*grey; 3]).collect(),
        Some(ColorSpace::RGB) => pixels.as_chunks::<3>().0.to_vec(),
        _ => return Err("a JPEG image of unknown colours".into()),
    };
    ByteImage::of([width, height], rgb).ok_or_else(|| "the JPEG file ends early".into())
}

/// Returns the message for an error of the decoder, on one line.
fn message(error: &impl std::fmt::Debug) -> String {
    let text = format!("{error:?}");
    let line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    format!("the JPEG data are broken: {line}")
}

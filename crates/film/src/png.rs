//! Reading PNG pictures: all colour types and depths, reduced to eight bits, their checksums
//! verified.

use crate::ByteImage;
use crate::decode::{DecodeError, check_size};
use flate2::Crc;
use png::{ColorType, DecodeOptions, Decoder, DecodingError, Limits, Transformations};
use std::io::Cursor;

/// Reads an image; the error is a message without a place.
pub(crate) fn read(bytes: &[u8]) -> Result<ByteImage, DecodeError> {
    let colour = |p: &[u8]| match *p {
        [r, g, b, ..] => [r, g, b],
        [grey, ..] => [grey; 3],
        [] => [0; 3],
    };
    unpack(bytes)?.image(colour)
}

/// Reads the alpha channel of an image, or of its palette, as grey; `None` if it has none.
pub(crate) fn read_alpha(bytes: &[u8]) -> Result<Option<ByteImage>, DecodeError> {
    let unpacked = unpack(bytes)?;
    let has_alpha = unpacked.channels.is_multiple_of(2);
    let alpha = |p: &[u8]| [p.last().copied().unwrap_or(u8::MAX); 3];
    has_alpha.then(|| unpacked.image(alpha)).transpose()
}

/// Eight bits for each channel of each pixel.
struct Unpacked {
    size: [u32; 2],
    channels: usize,
    pixels: Vec<u8>,
}

impl Unpacked {
    fn image(&self, pixel: impl Fn(&[u8]) -> [u8; 3]) -> Result<ByteImage, DecodeError> {
        let rgb = self.pixels.chunks_exact(self.channels).map(pixel).collect();
        ByteImage::of(self.size, rgb).ok_or_else(|| "an empty PNG image".into())
    }
}

fn unpack(bytes: &[u8]) -> Result<Unpacked, DecodeError> {
    check_chunks(bytes)?;
    let mut options = DecodeOptions::default();
    options.set_ignore_checksums(false);
    // Texts and profiles are for others.
    options.set_ignore_text_chunk(true);
    options.set_ignore_iccp_chunk(true);
    let mut decoder = Decoder::new_with_options(Cursor::new(bytes), options);
    let info = decoder.read_header_info().map_err(|e| message(&e))?;
    let (width, height) = (info.width, info.height);
    let size = check_size("a PNG", [width, height], 3, bytes.len())?;
    // A row before and after it is unpacked, of four channels of 16 bits at most, beside the image.
    decoder.set_limits(Limits {
        bytes: 2 * size + 32 * width as usize + (1 << 16),
    });
    decoder.set_transformations(Transformations::EXPAND | Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(|e| message(&e))?;
    let mut pixels = vec![0; reader.output_buffer_size().ok_or("a PNG image too large")?];
    let frame = reader.next_frame(&mut pixels).map_err(|e| message(&e))?;
    // What follows the rows holds the last checksums.
    reader.finish().map_err(|e| message(&e))?;
    pixels.truncate(frame.buffer_size());
    let channels = match frame.color_type {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => return Err("a PNG image whose palette is missing".into()),
    };
    Ok(Unpacked {
        size: [width, height],
        channels,
        pixels,
    })
}

/// Checks the frames and checksums of the chunks that hold the picture, so that the message can
/// say which one and where; the decoder drops others that are broken.
fn check_chunks(bytes: &[u8]) -> Result<(), String> {
    let mut at = b"\x89PNG\r\n\x1a\n".len();
    while let Some(start) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
        let word = |i: usize| start.get(i..).and_then(<[u8]>::first_chunk::<4>);
        let cut = || format!("the PNG file ends within the chunk at byte {at}");
        let (length, kind) = (word(0).ok_or_else(cut)?, word(4).ok_or_else(cut)?);
        let length = u32::from_be_bytes(*length) as usize;
        let covered = start.get(4..8 + length).ok_or_else(cut)?;
        let written = u32::from_be_bytes(*word(8 + length).ok_or_else(cut)?);
        let mut crc = Crc::new();
        crc.update(covered);
        if kind[0].is_ascii_uppercase() && crc.sum() != written {
            return Err(format!(
                "chunk `{}` at byte {at}: its CRC-32 is {written:08x}, that of its data {:08x}",
                kind.escape_ascii(),
                crc.sum()
            ));
        }
        at += 12 + length;
        if kind == b"IEND" {
            break;
        }
    }
    Ok(())
}

/// The decoder's message; it has no name for the one checksum that is not a chunk's.
fn message(error: &DecodingError) -> String {
    let text = format!("{error:?}");
    if text.contains("WrongChecksum") {
        return "the Adler-32 checksum does not match the pixels".into();
    }
    match error {
        DecodingError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the PNG file ends early".into()
        }
        DecodingError::LimitsExceeded => "the PNG file asks for more memory than its image".into(),
        _ => format!("the PNG data are broken: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chunk with its checksum.
    fn chunk(kind: &[u8], data: &[u8]) -> Vec<u8> {
        let mut crc = Crc::new();
        crc.update(kind);
        crc.update(data);
        let length = u32::try_from(data.len()).unwrap().to_be_bytes();
        [&length[..], kind, data, &crc.sum().to_be_bytes()].concat()
    }

    /// A PNG file of one stored block.
    fn file(width: u8, height: u8, depth: u8, colour: u8, raw: &[u8]) -> Vec<u8> {
        let header = [0, 0, 0, width, 0, 0, 0, height, depth, colour, 0, 0, 0];
        let n = u16::try_from(raw.len()).unwrap();
        let (a, b) = raw.iter().fold((1_u32, 0_u32), |(a, b), byte| {
            let a = (a + u32::from(*byte)) % 65521;
            (a, (b + a) % 65521)
        });
        let block = [
            &[0x78, 1, 1],
            &n.to_le_bytes()[..],
            &(!n).to_le_bytes(),
            raw,
            &((b << 16) | a).to_be_bytes(),
        ]
        .concat();
        [
            &b"\x89PNG\r\n\x1a\n"[..],
            &chunk(b"IHDR", &header),
            &chunk(b"IDAT", &block),
            &chunk(b"IEND", &[]),
        ]
        .concat()
    }

    fn row(image: &ByteImage) -> Vec<u8> {
        image.rgb.iter().flatten().copied().collect()
    }

    #[test]
    fn all_kinds_become_eight_bits_of_colour() {
        let grey = |v: &[u8]| v.iter().flat_map(|v| [*v; 3]).collect::<Vec<_>>();
        for (depth, colour, raw, want) in [
            (2, 0, &[0, 0b00_01_10_11][..], grey(&[0, 85, 170, 255])),
            (
                16,
                0,
                &[0, 10, 255, 20, 0, 30, 1, 40, 128],
                grey(&[10, 20, 30, 40]),
            ),
            (
                8,
                4,
                &[0, 10, 9, 20, 9, 30, 9, 40, 9],
                grey(&[10, 20, 30, 40]),
            ),
        ] {
            let image = read(&file(4, 1, depth, colour, raw)).unwrap();
            assert_eq!(row(&image), want, "{depth} {colour}");
        }
    }

    #[test]
    fn alpha_is_read_where_there_is_one() {
        let raw = [0, 10, 9, 20, 8, 30, 7, 40, 255];
        let image = read_alpha(&file(4, 1, 8, 4, &raw)).unwrap().unwrap();
        assert_eq!(image.rgb, [9, 8, 7, 255].map(|a| [a; 3]));
        let grey = file(4, 1, 8, 0, &[0, 1, 2, 3, 4]);
        assert_eq!(read_alpha(&grey), Ok(None));
    }

    #[test]
    fn every_cut_is_an_error() {
        let whole = file(4, 1, 2, 0, &[0, 0b00_01_10_11]);
        for cut in 0..whole.len() - 12 {
            assert!(read(&whole[..cut]).is_err(), "{cut}");
        }
    }

    #[test]
    fn checksums_are_verified_and_named() {
        let whole = file(4, 1, 8, 0, &[0, 1, 2, 3, 4]);
        let data = 8 + 25 + 8;
        let mut changed = whole.clone();
        changed[data + 8] ^= 1; // a pixel
        let error = read(&changed).unwrap_err().message;
        assert!(
            error.starts_with("chunk `IDAT` at byte 33: its CRC-32 is "),
            "{error}"
        );
        // The chunk's own checksum made good again: the pixels' remains.
        let length = 2 + 5 + 5 + 4;
        let again = chunk(b"IDAT", &changed[data..data + length]);
        changed.splice(33..33 + again.len(), again);
        let error = read(&changed).unwrap_err().message;
        assert!(error.starts_with("the Adler-32 checksum"), "{error}");
    }
}

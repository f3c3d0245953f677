//! The reader of PNG files of all colour types. Channels of sixteen bits stay as they are, and
//! channels of fewer bits become eight bits. All checksums are verified.

use crate::decode::{DecodeError, IntegerImage, Pixels, check_size};
use flate2::Crc;
use png::{BitDepth, ColorType, DecodeOptions, Decoder, DecodingError, Limits, Transformations};
use std::io::Cursor;

/// Reads the colours of an image; the error does not name the file.
pub(crate) fn read(bytes: &[u8]) -> Result<Pixels, DecodeError> {
    unpack(bytes)?.image(|channels| if channels > 2 { [0, 1, 2] } else { [0; 3] })
}

/// Reads the alpha channel of an image, or of its palette, as grey; `None` if the image has no
/// alpha channel.
pub(crate) fn read_alpha(bytes: &[u8]) -> Result<Option<Pixels>, DecodeError> {
    let unpacked = unpack(bytes)?;
    let has_alpha = unpacked.channels.is_multiple_of(2);
    let alpha = |channels| [channels - 1; 3];
    has_alpha.then(|| unpacked.image(alpha)).transpose()
}

/// A decoded image with all of its channels.
struct Unpacked {
    size: [u32; 2],
    /// The number of channels of each pixel.
    channels: usize,
    /// The number of bytes of a channel: one, or two with the high byte first.
    depth: usize,
    bytes: Vec<u8>,
}

impl Unpacked {
    /// Returns an image of three of the channels. `chosen` is called with the number of all
    /// channels and returns the indices of the three.
    fn image(&self, chosen: impl Fn(usize) -> [usize; 3]) -> Result<Pixels, DecodeError> {
        let chosen = chosen(self.channels);
        let pixels = self.bytes.chunks_exact(self.depth * self.channels);
        let image = if self.depth == 1 {
            let rgb = pixels.map(|pixel| chosen.map(|k| pixel[k])).collect();
            IntegerImage::of(self.size, rgb).map(Pixels::Bytes)
        } else {
            let word =
                |pixel: &[u8], k: usize| u16::from_be_bytes([pixel[2 * k], pixel[2 * k + 1]]);
            let rgb = pixels.map(|pixel| chosen.map(|k| word(pixel, k))).collect();
            IntegerImage::of(self.size, rgb).map(Pixels::Words)
        };
        image.ok_or_else(|| "an empty PNG image".into())
    }
}

/// Decodes an image, and verifies all checksums.
fn unpack(bytes: &[u8]) -> Result<Unpacked, DecodeError> {
    check_chunks(bytes)?;
    let unpacked = decode(bytes, true);
    // The decoder's error does not say that the checksum of the pixels is wrong. It is the only one
    // left, so that it is wrong if the image can be decoded without it.
    if unpacked.is_err() && decode(bytes, false).is_ok() {
        return Err("the Adler-32 checksum does not match the pixels".into());
    }
    unpacked
}

/// Decodes an image whose chunks have been checked. `verify` says whether to verify the checksum of
/// its pixels.
fn decode(bytes: &[u8], verify: bool) -> Result<Unpacked, DecodeError> {
    // Read the size, and check it before memory is allocated. Texts and profiles are ignored.
    let mut options = DecodeOptions::default();
    options.set_ignore_checksums(!verify);
    options.set_ignore_text_chunk(true);
    options.set_ignore_iccp_chunk(true);
    let mut decoder = Decoder::new_with_options(Cursor::new(bytes), options);
    let info = decoder.read_header_info().map_err(|e| message(&e))?;
    let (width, height) = (info.width, info.height);
    let depth = if info.bit_depth == BitDepth::Sixteen {
        2
    } else {
        1
    };
    let size = check_size("a PNG", [width, height], 3 * depth, bytes.len())?;
    // Limit the decoder's memory. It needs the image and, in addition, two rows of at most four
    // channels of 16 bits, before and after unpacking.
    decoder.set_limits(Limits {
        bytes: 2 * size + 32 * width as usize + (1 << 16),
    });
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|e| message(&e))?;
    // Check the palette: the decoder assumes that it has at least one colour.
    if let Some(palette) = &reader.info().palette
        && (palette.is_empty() || !palette.len().is_multiple_of(3))
    {
        let length = palette.len();
        return Err(format!("a PNG image with a palette of {length} bytes").into());
    }
    // Decode the pixels, and read on to the end of the file, where the last checksums are.
    let mut pixels = vec![0; reader.output_buffer_size().ok_or("a PNG image too large")?];
    let frame = reader.next_frame(&mut pixels).map_err(|e| message(&e))?;
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
        depth,
        bytes: pixels,
    })
}

/// Checks the lengths of all chunks, and the checksums of the critical ones, which the picture
/// needs (their names begin with a capital letter). The messages say which chunk is wrong and where
/// it is; the decoder ignores other broken chunks.
fn check_chunks(bytes: &[u8]) -> Result<(), String> {
    let mut at = b"\x89PNG\r\n\x1a\n".len();
    while let Some(start) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
        // Find the parts of the chunk: length, name, data and CRC-32 of name and data.
        let word = |i: usize| start.get(i..).and_then(<[u8]>::first_chunk::<4>);
        let cut = || format!("the PNG file ends within the chunk at byte {at}");
        let (length, kind) = (word(0).ok_or_else(cut)?, word(4).ok_or_else(cut)?);
        let length = u32::from_be_bytes(*length) as usize;
        let covered = start.get(4..8 + length).ok_or_else(cut)?;
        let written = u32::from_be_bytes(*word(8 + length).ok_or_else(cut)?);
        // Compare the checksum, and go on to the next chunk.
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

/// Returns the message for an error of the decoder.
fn message(error: &DecodingError) -> String {
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

    /// Returns a chunk with its checksum.
    fn chunk(kind: &[u8], data: &[u8]) -> Vec<u8> {
        let mut crc = Crc::new();
        crc.update(kind);
        crc.update(data);
        let length = u32::try_from(data.len()).unwrap().to_be_bytes();
        [&length[..], kind, data, &crc.sum().to_be_bytes()].concat()
    }

    /// Returns a PNG file of one stored block.
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

    fn row(pixels: &Pixels) -> Vec<u16> {
        match pixels {
            Pixels::Bytes(image) => image.rgb.iter().flatten().map(|b| u16::from(*b)).collect(),
            Pixels::Words(image) => image.rgb.iter().flatten().copied().collect(),
            Pixels::Linear(_) => panic!("a PNG file has integers"),
        }
    }

    #[test]
    fn all_kinds_become_colour_of_eight_or_of_all_sixteen_bits() {
        let grey = |v: &[u16]| v.iter().flat_map(|v| [*v; 3]).collect::<Vec<_>>();
        for (depth, colour, raw, want) in [
            (2, 0, &[0, 0b00_01_10_11][..], grey(&[0, 85, 170, 255])),
            (
                16,
                0,
                &[0, 10, 255, 20, 0, 30, 1, 40, 128],
                grey(&[0x0aff, 0x1400, 0x1e01, 0x2880]),
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
            assert_eq!(matches!(image, Pixels::Words(_)), depth == 16);
        }
        let raw = [0, 1, 2, 3, 4, 5, 6, 7, 8];
        let image = read(&file(1, 1, 16, 6, &raw)).unwrap();
        assert_eq!(row(&image), [0x0102, 0x0304, 0x0506]);
        let alpha = read_alpha(&file(1, 1, 16, 6, &raw)).unwrap().unwrap();
        assert_eq!(row(&alpha), [0x0708; 3]);
        let image = read(&file(1, 1, 16, 2, &raw[..7])).unwrap();
        assert_eq!(row(&image), [0x0102, 0x0304, 0x0506]);
    }

    #[test]
    fn alpha_is_read_where_there_is_one() {
        let raw = [0, 10, 9, 20, 8, 30, 7, 40, 255];
        let image = read_alpha(&file(4, 1, 8, 4, &raw)).unwrap().unwrap();
        assert_eq!(row(&image), [9, 9, 9, 8, 8, 8, 7, 7, 7, 255, 255, 255]);
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

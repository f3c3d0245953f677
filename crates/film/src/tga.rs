//! The reader of TGA files.

use crate::ByteImage;
use crate::decode::{DecodeError, check_size};

/// Reads a TGA file in true colour or grey, with 8, 24 or 32 bits, uncompressed or run-length
/// encoded. The error does not name the file.
pub(crate) fn read(bytes: &[u8]) -> Result<ByteImage, DecodeError> {
    read_as(bytes, tga_pixel)
}

/// Reads the alpha channel of a TGA file as grey; `None` if the file has no alpha channel.
pub(crate) fn read_alpha(bytes: &[u8]) -> Result<Option<ByteImage>, DecodeError> {
    // The descriptor has the number of alpha bits. It is zero in some files of 32 bits, in which
    // the fourth byte has no meaning.
    let has_alpha = bytes.get(16) == Some(&32) && bytes.get(17).is_some_and(|d| d & 0x0f != 0);
    let alpha = |p: &[u8]| [p.get(3).copied().unwrap_or(u8::MAX); 3];
    has_alpha.then(|| read_as(bytes, alpha)).transpose()
}

/// Reads a TGA file; `pixel` converts the bytes of a pixel.
fn read_as(bytes: &[u8], pixel: fn(&[u8]) -> [u8; 3]) -> Result<ByteImage, DecodeError> {
    // Read the header.
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
            let message = format!("TGA images of type {kind} with {bits} bits are not supported");
            return Err(message.into());
        }
    };
    // Check that the file is long enough for the pixels, at least if all runs are of full length.
    let count = u64::from(width) * u64::from(height);
    check_size("a TGA", [width, height], 3, bytes.len())?;
    let data = bytes.get(18 + id_length + map_bytes..).unwrap_or(&[]);
    let least = if run_length {
        count.div_ceil(128) * (1 + depth as u64)
    } else {
        count * depth as u64
    };
    if (data.len() as u64) < least {
        return Err(format!(
            "the TGA file ends early: {width} x {height} pixels need {least} bytes, it has {}",
            data.len()
        )
        .into());
    }
    // Decode the pixels.
    let count = usize::try_from(count).map_err(|e| e.to_string())?;
    let mut rgb = if run_length {
        decode_runs(data, depth, count, pixel)?
    } else {
        data.chunks_exact(depth).take(count).map(pixel).collect()
    };
    // Put the top row first, and the left column first.
    let w = width as usize;
    if descriptor & 0x20 == 0 {
        let flipped: Vec<[u8; 3]> = rgb.chunks_exact(w).rev().flatten().copied().collect();
        rgb = flipped;
    }
    if descriptor & 0x10 != 0 {
        rgb.chunks_exact_mut(w).for_each(<[_]>::reverse);
    }
    ByteImage::of([width, height], rgb).ok_or_else(|| "an empty TGA image".into())
}

/// Converts the bytes of a pixel, which are blue, green, red (and alpha), or grey.
fn tga_pixel(bytes: &[u8]) -> [u8; 3] {
    match *bytes {
        [b, g, r, ..] => [r, g, b],
        [grey, ..] => [grey; 3],
        [] => [0; 3],
    }
}

/// Decodes run-length encoded pixels. A packet is a byte with a count, and either one pixel that is
/// repeated (if the highest bit is set) or this number of pixels.
fn decode_runs(
    data: &[u8],
    depth: usize,
    count: usize,
    pixel: fn(&[u8]) -> [u8; 3],
) -> Result<Vec<[u8; 3]>, String> {
    let mut rgb = Vec::with_capacity(count);
    let mut rest = data;
    while rgb.len() < count {
        let short = || "the TGA file ends within its pixels".to_owned();
        let (&packet, tail) = rest.split_first().ok_or_else(short)?;
        let n = (usize::from(packet & 0x7f) + 1).min(count - rgb.len());
        let bytes = if packet & 0x80 != 0 { depth } else { n * depth };
        let pixels = tail.get(..bytes).ok_or_else(short)?;
        if packet & 0x80 != 0 {
            rgb.resize(rgb.len() + n, pixel(pixels));
        } else {
            rgb.extend(pixels.chunks_exact(depth).map(pixel));
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
            let image = read(&file).unwrap();
            assert_eq!(image.rgb[0], top);
        }
    }

    #[test]
    fn alpha_is_read_where_there_is_one() {
        let alpha = |bits: u8, descriptor| {
            let mut file = header(10, 3, 1, bits, descriptor);
            file.extend([0x81, 1, 2, 3, 9, 0x00, 4, 5, 6, 7]);
            read_alpha(&file).unwrap().map(|image| image.rgb)
        };
        assert_eq!(alpha(32, 0x28), Some(vec![[9; 3], [9; 3], [7; 3]]));
        assert_eq!(alpha(32, 0x20), None);
        assert_eq!(alpha(24, 0x28), None);
    }

    #[test]
    fn reads_runs() {
        let mut file = header(11, 3, 1, 8, 0x20);
        file.extend([0x81, 9, 0x00, 7]);
        let image = read(&file).unwrap();
        assert_eq!(image.rgb, [[9; 3], [9; 3], [7; 3]]);
    }

    #[test]
    fn truncated_files_are_errors_and_do_not_allocate() {
        let mut file = header(10, 255, 255, 24, 0);
        file[13] = 255;
        file[15] = 255;
        assert!(read(&file).is_err());
        for cut in 0..18 {
            assert!(read(&header(2, 1, 1, 24, 0)[..cut]).is_err());
        }
        assert!(read(&header(2, 1, 1, 24, 0)).is_err());
    }
}

//! The reading and writing of PFM files (portable float maps), which have a text header and then
//! 32-bit floating-point numbers, with rows from bottom to top.

use crate::{FilmError, FormatError, Image};

/// The name of the format in messages.
const FORMAT: &str = "PFM";

/// Reads the picture in the bytes of a file, if it takes at most `limit` bytes of memory.
///
/// It may be colour (`PF`) or grey (`Pf`, which gives three equal channels). The sign of the
/// header's scale is the byte order; the magnitude of the scale is ignored, as other readers do.
pub(crate) fn decode(bytes: &[u8], limit: usize) -> Result<Image, FormatError> {
    // Read the header.
    let channels = match bytes.get(..2) {
        Some(b"PF") => 3,
        Some(b"Pf") => 1,
        // The message must not quote the file: a scene could name any file of the machine.
        other => {
            let found = other.map_or("end of file", |_| "other bytes");
            return Err(FormatError::new(FORMAT, "`PF` or `Pf`", found));
        }
    };
    let mut header = Header { bytes, at: 2 };
    let (width, height, scale) = header.size_and_scale()?;
    let data = header.data()?;
    // Check the number of bytes and the memory.
    let pixels = u128::from(width) * u128::from(height);
    let expected = pixels * channels * 4;
    if data.len() as u128 != expected {
        let expected = format!("{expected} bytes of pixels for {width} × {height}");
        let found = format!("{} bytes", data.len());
        return Err(FormatError::new(FORMAT, expected, found));
    }
    if pixels * 12 > limit as u128 {
        let size = [width, height];
        return Err(FormatError::too_large(FORMAT, size, pixels * 12, limit));
    }
    // Convert the numbers, and reverse the order of the rows.
    let float = |chunk: &[u8]| {
        let raw = [chunk[0], chunk[1], chunk[2], chunk[3]];
        if scale < 0.0 {
            f32::from_le_bytes(raw)
        } else {
            f32::from_be_bytes(raw)
        }
    };
    let (row_bytes, pixel_bytes) = if channels == 3 {
        (width as usize * 12, 12)
    } else {
        (width as usize * 4, 4)
    };
    let rgb = data
        .chunks_exact(row_bytes)
        .rev()
        .flat_map(|row| row.chunks_exact(pixel_bytes))
        .map(|pixel| match pixel.len() {
            12 => [float(pixel), float(&pixel[4..]), float(&pixel[8..])],
            _ => [float(pixel); 3],
        })
        .collect();
    Ok(Image { width, height, rgb })
}

/// Returns the bytes of a PFM file of the picture: linear colours in little-endian order.
///
/// ```
/// use linelit_film::{Image, encode_pfm};
/// let image = Image { width: 1, height: 1, rgb: vec![[0.25, 0.5, 1.0]] };
/// assert_eq!(Image::from_bytes(&encode_pfm(&image)?, 1 << 10).unwrap(), image);
/// # Ok::<(), linelit_film::FilmError>(())
/// ```
///
/// # Errors
/// [`FilmError::Invalid`] for a picture without pixels, or whose number of pixels does not fit its
/// size.
pub fn encode_pfm(image: &Image) -> Result<Vec<u8>, FilmError> {
    image.check()?;
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width, image.height).into_bytes();
    for row in image.rgb.chunks_exact(image.width as usize).rev() {
        bytes.extend(row.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
    Ok(bytes)
}

/// The header of a file, which is read from left to right.
struct Header<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Header<'a> {
    /// Reads two positive integers, and a number whose sign is the byte order.
    fn size_and_scale(&mut self) -> Result<(u32, u32, f64), FormatError> {
        let width: u32 = self.number("the width, a positive integer")?;
        let height: u32 = self.number("the height, a positive integer")?;
        let scale: f64 = self.number("the scale, its sign the byte order")?;
        let wrong = |expected, found| Err(FormatError::new(FORMAT, expected, found));
        if width == 0 || height == 0 {
            return wrong("a positive size", format!("{width} × {height}"));
        }
        if scale == 0.0 || !scale.is_finite() {
            return wrong("a finite scale that is not zero", scale.to_string());
        }
        Ok((width, height, scale))
    }

    /// Reads blanks and a number; `expected` describes it in messages.
    fn number<T: std::str::FromStr>(&mut self, expected: &str) -> Result<T, FormatError> {
        // Read a word. Its length is limited, or a message could quote a long binary file.
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        let blank = rest
            .iter()
            .take_while(|byte| byte.is_ascii_whitespace())
            .count();
        let word: Vec<u8> = rest[blank..]
            .iter()
            .copied()
            .take_while(|byte| !byte.is_ascii_whitespace())
            .take(40)
            .collect();
        let wrong = |found: String| FormatError::new(FORMAT, expected, found);
        if blank == 0 || word.is_empty() {
            return Err(wrong(if rest.is_empty() {
                "end of file".to_owned()
            } else {
                format!("`{}`", word.escape_ascii())
            }));
        }
        // Convert it to a number.
        self.at += blank + word.len();
        std::str::from_utf8(&word)
            .ok()
            .and_then(|word| word.parse().ok())
            .ok_or_else(|| wrong(format!("`{}`", word.escape_ascii())))
    }

    /// Returns the bytes of the pixels, which begin after exactly one blank (or a carriage return
    /// and a line feed).
    fn data(&self) -> Result<&'a [u8], FormatError> {
        match &self.bytes[self.at..] {
            [b'\r', b'\n', data @ ..] => Ok(data),
            [blank, data @ ..] if blank.is_ascii_whitespace() => Ok(data),
            [] => Err(FormatError::new(
                FORMAT,
                "a line end and the pixels",
                "end of file",
            )),
            [other, ..] => Err(FormatError::new(
                FORMAT,
                "a line end after the scale",
                format!("byte {other:#04x}"),
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode_all(bytes: &[u8]) -> Result<Image, FormatError> {
        decode(bytes, usize::MAX)
    }

    fn pfm(header: &str, values: &[f32], little: bool) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        for value in values {
            bytes.extend(if little {
                value.to_le_bytes()
            } else {
                value.to_be_bytes()
            });
        }
        bytes
    }

    #[test]
    fn rows_run_from_bottom_to_top_in_either_byte_order() {
        let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let want = Image {
            width: 1,
            height: 2,
            rgb: vec![[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]],
        };
        assert_eq!(
            decode_all(&pfm("PF\n1 2\n-1.0\n", &values, true)).unwrap(),
            want
        );
        assert_eq!(
            decode_all(&pfm("PF 1 2 1\r\n", &values, false)).unwrap(),
            want
        );
    }

    #[test]
    fn grey_becomes_three_channels() {
        let image = decode_all(&pfm("Pf\n2 1\n-1\n", &[0.5, 7.0], true)).unwrap();
        assert_eq!(image.rgb, [[0.5; 3], [7.0; 3]]);
    }

    #[test]
    fn errors_say_what_was_expected_and_found() {
        let cases: [(&[u8], &str); 9] = [
            (b"", "expected `PF` or `Pf`, found end of file"),
            (b"P6\n1 1\n", "expected `PF` or `Pf`, found other bytes"),
            (
                b"PF\n-1 1\n-1\n",
                "expected the width, a positive integer, found `-1`",
            ),
            (
                b"PF\n1 x\n-1\n",
                "expected the height, a positive integer, found `x`",
            ),
            (
                b"PF\n1 1",
                "expected the scale, its sign the byte order, found end of file",
            ),
            (b"PF\n1 0\n-1\n", "expected a positive size, found 1 × 0"),
            (
                b"PF\n1 1\n0\n",
                "expected a finite scale that is not zero, found 0",
            ),
            (
                b"PF\n1 1\n-1",
                "expected a line end and the pixels, found end of file",
            ),
            (
                b"PF\n1 1\n-1\nabc",
                "expected 12 bytes of pixels for 1 × 1, found 3 bytes",
            ),
        ];
        for (bytes, message) in cases {
            let error = decode_all(bytes).unwrap_err().to_string();
            let message = format!("not a readable PFM file: {message}");
            assert_eq!(error.as_bytes(), message.as_bytes(), "{error}");
        }
    }

    #[test]
    fn sizes_are_asked_before_memory() {
        let whole = pfm("Pf\n2 1\n-1\n", &[0.5, 7.0], true);
        assert!(decode(&whole, 24).is_ok());
        let error = decode(&whole, 23).unwrap_err().to_string();
        let want =
            "expected a picture that takes at most 23 bytes, found 2 × 1 pixels that take 24";
        assert!(error.ends_with(want), "{error}");
    }

    #[test]
    fn a_huge_announced_size_is_refused_without_allocating() {
        let error = decode_all(b"PF\n4294967295 4294967295\n-1\n1234").unwrap_err();
        assert!(error.expected.starts_with("221360928"), "{error}");
    }
}

//! Reading PNG textures: all colour types and depths, reduced to eight bits.
//!
//! A reader of our own, because textures need no more than this; pictures are written by the film
//! crate.

use crate::image::{ImageData, check_size};
use crate::inflate;

const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// What the header says.
struct Header {
    width: usize,
    height: usize,
    depth: usize,
    colour: u8,
    interlaced: bool,
}

/// Every how many pixels a pass over an image has one, and from where: across, down.
type Pass = ([usize; 2], [usize; 2]);

/// Rows one after another.
const PLAIN: &[Pass] = &[([0, 0], [1, 1])];
/// Adam7: coarse pixels first.
const INTERLACED: &[Pass] = &[
    ([0, 0], [8, 8]),
    ([4, 0], [8, 8]),
    ([0, 4], [4, 8]),
    ([2, 0], [4, 4]),
    ([0, 2], [2, 4]),
    ([1, 0], [2, 2]),
    ([0, 1], [1, 2]),
];

impl Header {
    fn parse(chunk: &[u8], file: usize) -> Result<Self, String> {
        let data: &[u8; 13] = chunk.first_chunk().ok_or("the PNG header is too short")?;
        let number =
            |i: usize| u32::from_be_bytes([data[i], data[i + 1], data[i + 2], data[i + 3]]);
        let (width, height) = (number(0), number(4));
        check_size("a PNG", width, height, file)?;
        let (depth, colour) = (data[8], data[9]);
        let known = matches!(
            (colour, depth),
            (0, 1 | 2 | 4 | 8 | 16) | (3, 1 | 2 | 4 | 8) | (2 | 4 | 6, 8 | 16)
        );
        if !known {
            return Err(format!(
                "PNG colour type {colour} with {depth} bits does not exist"
            ));
        }
        if data[12] > 1 {
            return Err(format!("PNG interlacing {} does not exist", data[12]));
        }
        Ok(Self {
            width: width as usize,
            height: height as usize,
            depth: usize::from(depth),
            colour,
            interlaced: data[12] == 1,
        })
    }

    const fn channels(&self) -> usize {
        match self.colour {
            2 => 3,
            4 => 2,
            6 => 4,
            _ => 1,
        }
    }

    /// Bytes of a row of so many pixels without its filter byte.
    const fn row(&self, width: usize) -> usize {
        (width * self.channels() * self.depth).div_ceil(8)
    }

    /// The passes that have any pixels, with their sizes.
    fn passes(&self) -> Vec<(Pass, [usize; 2])> {
        let all = if self.interlaced { INTERLACED } else { PLAIN };
        let size = |&([x, y], [dx, dy]): &Pass| {
            [
                self.width.saturating_sub(x).div_ceil(dx),
                self.height.saturating_sub(y).div_ceil(dy),
            ]
        };
        all.iter()
            .map(|pass| (*pass, size(pass)))
            .filter(|(_, [w, h])| w * h > 0)
            .collect()
    }

    /// Bytes from a pixel to its left neighbour, for the filters.
    const fn step(&self) -> usize {
        let bits = self.channels() * self.depth;
        if bits < 8 { 1 } else { bits / 8 }
    }
}

/// Reads an image; the error is a message without a place.
pub(crate) fn read(bytes: &[u8], srgb: bool) -> Result<ImageData, String> {
    let mut rest = bytes
        .strip_prefix(&SIGNATURE)
        .ok_or("it is not a PNG file")?;
    let (mut header, mut palette, mut data) = (None, Vec::new(), Vec::new());
    while let Some((length, tail)) = rest.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        let cut = || "the PNG file ends early".to_owned();
        let (kind, tail) = tail.split_first_chunk::<4>().ok_or_else(cut)?;
        let chunk = tail.get(..length).ok_or_else(cut)?;
        match kind {
            b"IHDR" => header = Some(Header::parse(chunk, bytes.len())?),
            b"PLTE" => palette = chunk.as_chunks::<3>().0.to_vec(),
            b"IDAT" => data.extend_from_slice(chunk),
            b"IEND" => break,
            _ => {}
        }
        // Four bytes of checksum follow.
        rest = tail.get(length + 4..).unwrap_or(&[]);
    }
    let header = header.ok_or("the PNG file has no header")?;
    // Deflate packs at most about 1032 to 1, so that small files cannot ask for large images.
    let passes = header.passes();
    let bytes = |[w, h]: [usize; 2]| h * (header.row(w) + 1);
    let size: usize = passes.iter().map(|(_, s)| bytes(*s)).sum();
    if size / 1040 > data.len() {
        return Err("the PNG file ends early".into());
    }
    let mut raw = inflate::zlib(&data, size)?;
    if raw.len() != size {
        return Err("the PNG file ends early".into());
    }
    let mut rgb = vec![[0; 3]; header.width * header.height];
    let mut rest = &mut raw[..];
    for (([x0, y0], [dx, dy]), [w, h]) in passes {
        let (pass, tail) = rest.split_at_mut(bytes([w, h]));
        unfilter(pass, header.row(w), header.step())?;
        for (y, row) in pass.chunks_exact(header.row(w) + 1).enumerate() {
            let line = &mut rgb[(y0 + y * dy) * header.width..][..header.width];
            for x in 0..w {
                line[x0 + x * dx] = pixel(&header, &palette, &row[1..], x);
            }
        }
        rest = tail;
    }
    let side = |n: usize| u32::try_from(n).map_err(|e| e.to_string());
    ImageData::new(side(header.width)?, side(header.height)?, rgb, srgb)
        .ok_or_else(|| "an empty PNG image".into())
}

/// Undoes the prediction of each row.
fn unfilter(raw: &mut [u8], row: usize, step: usize) -> Result<(), String> {
    let zeros = vec![0; row];
    let mut above: &[u8] = &zeros;
    for line in raw.chunks_exact_mut(row + 1) {
        let (filter, line) = line.split_first_mut().ok_or("an empty row")?;
        for i in 0..row {
            let left = if i >= step { line[i - step] } else { 0 };
            let corner = if i >= step { above[i - step] } else { 0 };
            let up = above[i];
            let prediction = match *filter {
                0 => 0,
                1 => left,
                2 => up,
                3 => left.midpoint(up),
                4 => paeth(left, up, corner),
                other => return Err(format!("PNG filter {other} does not exist")),
            };
            line[i] = line[i].wrapping_add(prediction);
        }
        above = line;
    }
    Ok(())
}

fn paeth(a: u8, b: u8, c: u8) -> u8 {
    let [ia, ib, ic] = [a, b, c].map(i32::from);
    let p = ia + ib - ic;
    let [da, db, dc] = [ia, ib, ic].map(|v| (p - v).abs());
    if da <= db && da <= dc {
        a
    } else if db <= dc {
        b
    } else {
        c
    }
}

fn pixel(header: &Header, palette: &[[u8; 3]], row: &[u8], x: usize) -> [u8; 3] {
    let sample = |k: usize| {
        let i = x * header.channels() + k;
        match header.depth {
            8 => row[i],
            16 => row[2 * i],
            bits => {
                let bit = i * bits;
                (row[bit / 8] >> (8 - bits - bit % 8)) & ((1 << bits) - 1)
            }
        }
    };
    // Grey of fewer bits is stretched to the whole range.
    let grey = |v: u8| {
        if header.depth < 8 {
            v * (255 / ((1 << header.depth) - 1))
        } else {
            v
        }
    };
    match header.colour {
        2 | 6 => [sample(0), sample(1), sample(2)],
        3 => palette
            .get(usize::from(sample(0)))
            .copied()
            .unwrap_or([0; 3]),
        _ => [grey(sample(0)); 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A PNG file of stored blocks; the checksums are not looked at.
    fn file(width: u8, height: u8, depth: u8, colour: u8, raw: &[u8]) -> Vec<u8> {
        let chunk = |kind: &[u8], data: &[u8]| {
            let length = u32::try_from(data.len()).unwrap().to_be_bytes();
            [&length[..], kind, data, &[0; 4]].concat()
        };
        let header = [0, 0, 0, width, 0, 0, 0, height, depth, colour, 0, 0, 0];
        let n = u16::try_from(raw.len()).unwrap();
        let block = [
            &[0x78, 1, 1],
            &n.to_le_bytes()[..],
            &(!n).to_le_bytes(),
            raw,
            &[0; 4],
        ]
        .concat();
        [
            &SIGNATURE[..],
            &chunk(b"IHDR", &header),
            &chunk(b"IDAT", &block),
            &chunk(b"IEND", &[]),
        ]
        .concat()
    }

    #[test]
    fn undoes_every_filter() {
        // Two columns of RGB; the second row of each pair predicts from the first.
        for (filter, row, want) in [
            (0, [1, 2, 3, 4, 5, 6], [1, 2, 3, 4, 5, 6]),
            (1, [1, 2, 3, 4, 5, 6], [1, 2, 3, 5, 7, 9]),
            (2, [1, 2, 3, 4, 5, 6], [11, 22, 33, 44, 55, 66]),
            (3, [1, 2, 3, 4, 5, 6], [6, 12, 18, 27, 36, 45]),
            (4, [1, 2, 3, 4, 5, 6], [11, 22, 33, 44, 55, 66]),
        ] {
            let raw = [&[0, 10, 20, 30, 40, 50, 60][..], &[filter], &row].concat();
            let image = read(&file(2, 2, 8, 2, &raw), false).unwrap();
            let got: Vec<f64> = (0..2)
                .flat_map(|x| (image.pixel(x, 1) * 255.0).round().to_array())
                .collect();
            assert_eq!(got, want.map(f64::from), "filter {filter}");
        }
    }

    #[test]
    fn bits_are_stretched_and_cuts_are_errors() {
        let whole = file(4, 1, 2, 0, &[0, 0b00_01_10_11]);
        let image = read(&whole, false).unwrap();
        let got: Vec<f64> = (0..4).map(|x| image.pixel(x, 0).x * 3.0).collect();
        assert_eq!(
            got.iter().map(|v| v.round()).collect::<Vec<_>>(),
            [0.0, 1.0, 2.0, 3.0]
        );
        for cut in 0..whole.len() - 20 {
            assert!(read(&whole[..cut], true).is_err(), "{cut}");
        }
    }
}

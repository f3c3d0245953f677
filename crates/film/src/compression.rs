//! How EXR files are packed.

use std::fmt;
use std::str::FromStr;

use flate2::{Compress, FlushCompress, Status};

/// The compression of the pixels of an EXR file; all are lossless.
///
/// ```
/// use linelit_film::Compression;
/// assert_eq!("zip:9".parse(), Ok(Compression::Zip(9)));
/// assert_eq!("zip".parse(), Ok(Compression::default()));
/// assert!("zip:10".parse::<Compression>().is_err());
/// assert_eq!(Compression::Rle.to_string(), "rle");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// `none`: as they are.
    None,
    /// `rle`: runs of equal bytes, row by row; shrinks flat pictures only.
    Rle,
    /// `zip` or `zip:LEVEL`: deflate of 16 rows at a time, by a level from 1, fast, to 9, small;
    /// others count as the nearest. Files of rendered radiance shrink to about two fifths by any
    /// level: the highest saves one percent over the lowest, and takes ten times as long.
    Zip(u8),
}

impl Default for Compression {
    /// The fastest that shrinks.
    fn default() -> Self {
        Self::Zip(1)
    }
}

impl fmt::Display for Compression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.pad("none"),
            Self::Rle => f.pad("rle"),
            Self::Zip(level) => f.pad(&format!("zip:{level}")),
        }
    }
}

impl FromStr for Compression {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let level = |text: &str| text.parse().ok().filter(|level| (1..=9).contains(level));
        let found = match text {
            "none" => Some(Self::None),
            "rle" => Some(Self::Rle),
            "zip" => Some(Self::default()),
            _ => text.strip_prefix("zip:").and_then(level).map(Self::Zip),
        };
        found.ok_or_else(|| {
            format!("compression `{text}`; expected none, rle, zip, or zip:1 to zip:9")
        })
    }
}

/// Packs blocks of rows as OpenEXR's ZIP does; what it keeps is memory.
pub(crate) struct Zip {
    deflate: Compress,
    /// The bytes of a block in the order and as the differences that are packed.
    changed: Vec<u8>,
    halves: Vec<u8>,
}

impl Zip {
    pub(crate) fn new(level: u8) -> Self {
        let level = flate2::Compression::new(u32::from(level.clamp(1, 9)));
        Self {
            deflate: Compress::new(level, true),
            changed: Vec::new(),
            halves: Vec::new(),
        }
    }

    /// A block in a file: packed, or as it is if that is not longer.
    pub(crate) fn pack(&mut self, block: Vec<u8>) -> Vec<u8> {
        self.change(&block);
        self.deflate.reset();
        let mut packed = Vec::with_capacity(block.len().saturating_sub(1));
        let finish = FlushCompress::Finish;
        match (self.deflate).compress_vec(&self.changed, &mut packed, finish) {
            Ok(Status::StreamEnd) => packed,
            // It did not fit.
            _ => block,
        }
    }

    /// The bytes of even index before those of odd, as values' high bytes are alike; then of each
    /// the difference to the one before, plus 128 (OpenEXR's `ImfZip.cpp`).
    fn change(&mut self, block: &[u8]) {
        let (pairs, last) = block.as_chunks::<2>();
        self.halves.clear();
        self.halves.extend(pairs.iter().map(|pair| pair[0]));
        self.halves.extend(last);
        self.halves.extend(pairs.iter().map(|pair| pair[1]));
        self.changed.clear();
        self.changed.extend(self.halves.first());
        let differences = self.halves.windows(2);
        let shifted = differences.map(|pair| pair[1].wrapping_sub(pair[0]).wrapping_add(128));
        self.changed.extend(shifted);
    }
}

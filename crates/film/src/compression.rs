//! [`Compression`], the ways in which the pixels of EXR files are compressed, and the compressor of
//! OpenEXR's ZIP, which lets the level be chosen.

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
    /// `none`: the pixels are not compressed.
    None,
    /// `rle`: runs of equal bytes are shortened, row by row. It helps only for flat pictures.
    Rle,
    /// `zip` or `zip:LEVEL`: 16 rows at a time are compressed by deflate, with a level from 1
    /// (fast) to 9 (small); other levels are clamped. Files of rendered radiance shrink to about
    /// two fifths with any level: the highest saves one percent over the lowest, and takes ten
    /// times as long.
    Zip(u8),
}

impl Default for Compression {
    /// Returns `zip` with level 1, the fastest compression that makes files of radiance smaller.
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

/// A compressor of blocks of rows by OpenEXR's ZIP, which has memory that is used again for each
/// block.
pub(crate) struct Zip {
    deflate: Compress,
    /// The differences of the reordered bytes of a block, which are compressed.
    changed: Vec<u8>,
    /// The reordered bytes of a block.
    halves: Vec<u8>,
}

impl Zip {
    /// Creates a compressor with a compression level, which is clamped to 1 to 9.
    pub(crate) fn new(level: u8) -> Self {
        let level = flate2::Compression::new(u32::from(level.clamp(1, 9)));
        Self {
            deflate: Compress::new(level, true),
            changed: Vec::new(),
            halves: Vec::new(),
        }
    }

    /// Returns the bytes that represent a block in a file: compressed, or unchanged if compression
    /// does not make it shorter.
    pub(crate) fn pack(&mut self, block: Vec<u8>) -> Vec<u8> {
        self.change(&block);
        self.deflate.reset();
        let mut packed = Vec::with_capacity(block.len().saturating_sub(1));
        let finish = FlushCompress::Finish;
        match (self.deflate).compress_vec(&self.changed, &mut packed, finish) {
            Ok(Status::StreamEnd) => packed,
            // The compressed block would be at least as long.
            _ => block,
        }
    }

    /// Transforms a block before deflate, as OpenEXR does (`ImfZip.cpp`). Bytes of even index come
    /// before bytes of odd index, as the high bytes of values are similar. Then each byte is
    /// replaced by its difference from the previous one, plus 128.
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

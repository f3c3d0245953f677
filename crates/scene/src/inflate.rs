//! Decompression of gzip and zlib data (RFC 1950, 1951, 1952), for `.ply.gz` and PNG.
//!
//! Checksums are not verified: what is inside is checked by its own reader.

/// More output than this is refused (a gigabyte fits no scene that we could draw).
const MAX_OUTPUT: usize = 1 << 30;
/// Output of any gzip file that is not refused, however small the file is.
const FREE_OUTPUT: usize = 1 << 26;
/// Output for each byte of a gzip file: meshes and text pack by less.
const OUTPUT_PER_BYTE: usize = 64;

/// Contents of a gzip file; the error is a message.
pub(crate) fn gunzip(data: &[u8]) -> Result<Vec<u8>, String> {
    let short = || "the gzip header is cut".to_owned();
    let header: &[u8; 10] = data.first_chunk().ok_or_else(short)?;
    if header[..3] != [0x1f, 0x8b, 8] {
        return Err("it is not gzip data".into());
    }
    let flags = header[3];
    let mut rest = &data[10..];
    if flags & 4 != 0 {
        let length: &[u8; 2] = rest.first_chunk().ok_or_else(short)?;
        rest = rest
            .get(2 + usize::from(u16::from_le_bytes(*length))..)
            .ok_or_else(short)?;
    }
    for flag in [8, 16] {
        if flags & flag != 0 {
            let end = rest.iter().position(|b| *b == 0).ok_or_else(short)?;
            rest = &rest[end + 1..];
        }
    }
    if flags & 2 != 0 {
        rest = rest.get(2..).ok_or_else(short)?;
    }
    let limit = FREE_OUTPUT.saturating_add(OUTPUT_PER_BYTE.saturating_mul(data.len()));
    inflate(rest, limit.min(MAX_OUTPUT))
}

/// Contents of a zlib stream of at most `limit` bytes; the error is a message.
pub(crate) fn zlib(data: &[u8], limit: usize) -> Result<Vec<u8>, String> {
    match data {
        [cmf, flg, rest @ ..] if cmf & 15 == 8 && flg & 32 == 0 => {
            inflate(rest, limit.min(MAX_OUTPUT))
        }
        _ => Err("it is not zlib data".into()),
    }
}

/// Bits from the least significant end.
struct Bits<'a> {
    data: &'a [u8],
    at: usize,
    buffer: u64,
    count: u32,
}

impl Bits<'_> {
    /// At least 48 bits in the buffer; zeros stand in for what is behind the end, which `skip`
    /// notices.
    fn fill(&mut self) {
        if let Some(next) = self.data.get(self.at..).and_then(<[u8]>::first_chunk::<8>) {
            // Bits above the count may be set already: they are these same bits.
            self.buffer |= u64::from_le_bytes(*next) << self.count;
            let bytes = (63 - self.count) / 8;
            self.at += usize::try_from(bytes).unwrap_or(0);
            self.count += 8 * bytes;
            return;
        }
        // The last bytes one by one.
        while self.count <= 48 {
            let byte = self.data.get(self.at).copied().unwrap_or(0);
            self.buffer |= u64::from(byte) << self.count;
            self.at += 1;
            self.count += 8;
        }
    }

    /// Drops bits of the buffer, which holds that many; an error behind the end of the data.
    fn skip(&mut self, n: u32) -> Result<(), String> {
        self.buffer >>= n;
        self.count -= n;
        if self.at - usize::try_from(self.count / 8).unwrap_or(0) > self.data.len() {
            return Err("the compressed data end early".into());
        }
        Ok(())
    }

    fn take(&mut self, n: u32) -> Result<usize, String> {
        self.fill();
        let value = self.buffer & ((1 << n) - 1);
        self.skip(n)?;
        usize::try_from(value).map_err(|e| e.to_string())
    }
}

const MAX_BITS: usize = 15;
/// Bits that a table looks up at once; longer codes are rare.
const TABLE_BITS: u32 = 10;
const TABLE_LENGTH: usize = 10;

/// A canonical Huffman code: how many symbols have each length, and the symbols in order.
struct Code {
    counts: [u16; MAX_BITS + 1],
    symbols: Vec<u16>,
    /// By the next bits: symbol and length of codes that are no longer; length zero for others.
    table: Vec<(u16, u8)>,
}

impl Code {
    fn new(lengths: &[u8]) -> Self {
        let mut counts = [0; MAX_BITS + 1];
        for length in lengths {
            counts[usize::from(*length)] += 1;
        }
        counts[0] = 0;
        let mut symbols: Vec<u16> = (0..).take(lengths.len()).collect();
        symbols.retain(|s| lengths[usize::from(*s)] > 0);
        symbols.sort_by_key(|s| (lengths[usize::from(*s)], *s));
        let mut code = Self {
            counts,
            symbols,
            table: Vec::new(),
        };
        // Short codes with few symbols are not worth a table.
        if code.symbols.len() > 19 {
            code.table = (0..1_u64 << TABLE_BITS)
                .map(|bits| code.find(bits, TABLE_LENGTH).unwrap_or((0, 0)))
                .collect();
        }
        code
    }

    /// Symbol and length of the code at the low end of some bits, if it is no longer than `most`.
    fn find(&self, mut bits: u64, most: usize) -> Option<(u16, u8)> {
        let (mut code, mut first, mut index) = (0_usize, 0_usize, 0_usize);
        for (length, count) in (1_u8..).zip(&self.counts[1..=most]) {
            code |= usize::from(bits & 1 == 1);
            bits >>= 1;
            let count = usize::from(*count);
            if code < first + count {
                let symbol = self.symbols.get(index + code - first);
                return symbol.map(|s| (*s, length));
            }
            index += count;
            first = (first + count) << 1;
            code <<= 1;
        }
        None
    }

    fn decode(&self, bits: &mut Bits<'_>) -> Result<u16, String> {
        bits.fill();
        let low = usize::try_from(bits.buffer & ((1 << TABLE_BITS) - 1)).unwrap_or(0);
        let (symbol, length) = match self.table.get(low) {
            Some(&(symbol, length)) if length > 0 => (symbol, length),
            _ => self
                .find(bits.buffer, MAX_BITS)
                .ok_or("the compressed data are broken")?,
        };
        bits.skip(u32::from(length))?;
        Ok(symbol)
    }
}

const LENGTH_BASE: [u16; 29] = [
    3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131,
    163, 195, 227, 258,
];
const LENGTH_EXTRA: [u8; 29] = [
    0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0,
];
const DISTANCE_BASE: [u16; 30] = [
    1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537,
    2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577,
];
const DISTANCE_EXTRA: [u8; 30] = [
    0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13,
    13,
];

fn inflate(data: &[u8], limit: usize) -> Result<Vec<u8>, String> {
    let mut bits = Bits {
        data,
        at: 0,
        buffer: 0,
        count: 0,
    };
    let mut out = Vec::new();
    loop {
        let last = bits.take(1)? == 1;
        match bits.take(2)? {
            0 => stored(&mut bits, &mut out, limit)?,
            1 => {
                let mut lengths = [8_u8; 288];
                lengths[144..256].fill(9);
                lengths[256..280].fill(7);
                block(
                    &mut bits,
                    &Code::new(&lengths),
                    &Code::new(&[5; 30]),
                    &mut out,
                    limit,
                )?;
            }
            2 => {
                let (literals, distances) = dynamic_codes(&mut bits)?;
                block(&mut bits, &literals, &distances, &mut out, limit)?;
            }
            _ => return Err("the compressed data are broken".into()),
        }
        if last {
            return Ok(out);
        }
    }
}

fn too_long(limit: usize) -> String {
    format!("unpacks to more than {limit} bytes")
}

fn stored(bits: &mut Bits<'_>, out: &mut Vec<u8>, limit: usize) -> Result<(), String> {
    bits.take(bits.count % 8)?;
    let (length, complement) = (bits.take(16)?, bits.take(16)?);
    if length != complement ^ 0xffff {
        return Err("the compressed data are broken".into());
    }
    if out.len() + length > limit {
        return Err(too_long(limit));
    }
    for _ in 0..length {
        out.push(u8::try_from(bits.take(8)?).unwrap_or(0));
    }
    Ok(())
}

fn dynamic_codes(bits: &mut Bits<'_>) -> Result<(Code, Code), String> {
    const ORDER: [usize; 19] = [
        16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15,
    ];
    let literals = bits.take(5)? + 257;
    let total = literals + bits.take(5)? + 1;
    let mut lengths = [0_u8; 19];
    let given = bits.take(4)? + 4;
    for slot in &ORDER[..given] {
        lengths[*slot] = u8::try_from(bits.take(3)?).unwrap_or(0);
    }
    let code = Code::new(&lengths);
    let mut lengths: Vec<u8> = Vec::with_capacity(total);
    while lengths.len() < total {
        let (value, repeat) = match code.decode(bits)? {
            16 => {
                let last = *lengths.last().ok_or("the compressed data are broken")?;
                (last, 3 + bits.take(2)?)
            }
            17 => (0, 3 + bits.take(3)?),
            18 => (0, 11 + bits.take(7)?),
            symbol => (u8::try_from(symbol).unwrap_or(0), 1),
        };
        lengths.resize(lengths.len() + repeat, value);
    }
    if lengths.len() > total {
        return Err("the compressed data are broken".into());
    }
    Ok((
        Code::new(&lengths[..literals]),
        Code::new(&lengths[literals..]),
    ))
}

fn block(
    bits: &mut Bits<'_>,
    literals: &Code,
    distances: &Code,
    out: &mut Vec<u8>,
    limit: usize,
) -> Result<(), String> {
    let broken = || "the compressed data are broken".to_owned();
    let extra = |bits: &mut Bits<'_>, symbol: usize, base: &[u16], extra: &[u8]| {
        let (Some(base), Some(extra)) = (base.get(symbol), extra.get(symbol)) else {
            return Err(broken());
        };
        Ok(usize::from(*base) + bits.take(u32::from(*extra))?)
    };
    loop {
        let symbol = literals.decode(bits)?;
        if let Ok(byte) = u8::try_from(symbol) {
            out.push(byte);
        } else if symbol == 256 {
            return Ok(());
        } else {
            let length = extra(bits, usize::from(symbol) - 257, &LENGTH_BASE, &LENGTH_EXTRA)?;
            let symbol = usize::from(distances.decode(bits)?);
            let distance = extra(bits, symbol, &DISTANCE_BASE, &DISTANCE_EXTRA)?;
            let start = out.len().checked_sub(distance).ok_or_else(broken)?;
            if distance >= length {
                out.extend_from_within(start..start + length);
            } else {
                for k in start..start + length {
                    out.push(out[k]);
                }
            }
        }
        if out.len() > limit {
            return Err(too_long(limit));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_stored_fixed_and_dynamic_blocks() {
        let stored = [0x78, 0x01, 0x01, 3, 0, 0xfc, 0xff, b'a', b'b', b'c'];
        assert_eq!(zlib(&stored, 10).unwrap(), b"abc");
        assert!(zlib(&stored, 2).is_err());
        let fixed = [120, 156, 75, 76, 74, 78, 36, 132, 0, 255, 0, 13, 201];
        assert_eq!(zlib(&fixed, 100).unwrap(), b"abcabcabcabc".repeat(3));
        assert_eq!(zlib(&DYNAMIC, 1000).unwrap(), DYNAMIC_TEXT.as_bytes());
    }

    const DYNAMIC: [u8; 150] = [
        120, 218, 69, 144, 217, 1, 3, 48, 8, 66, 103, 69, 217, 127, 134, 242, 48, 109, 255, 12,
        167, 70, 214, 104, 119, 71, 90, 205, 88, 153, 128, 250, 132, 130, 228, 29, 124, 86, 96, 59,
        85, 198, 227, 122, 64, 162, 66, 18, 38, 136, 237, 198, 9, 52, 164, 177, 24, 123, 163, 2,
        100, 10, 54, 216, 162, 13, 23, 169, 219, 241, 43, 54, 201, 82, 187, 34, 166, 26, 67, 183,
        112, 153, 230, 95, 40, 165, 37, 11, 51, 221, 6, 86, 170, 124, 129, 113, 221, 190, 251, 212,
        17, 182, 228, 78, 162, 65, 175, 62, 11, 190, 178, 191, 157, 92, 113, 24, 16, 187, 244, 136,
        130, 183, 139, 190, 71, 223, 194, 115, 36, 37, 119, 170, 166, 73, 252, 219, 244, 198, 247,
        191, 177, 221, 18, 12, 250, 0, 4, 59, 153, 38,
    ];
    const DYNAMIC_TEXT: &str = "adabacccbaacabbdacbadabaaacababacacccabaacbabcaababcbcabbdccbdacabbabcbaccaacbbcacabdddbaacaaaccabcbdbcbcdabcaccabacbdcacbcbbbaccddbcdaaacdaacbaaaacababadabbaaabcabbcbccaabbbbababcadbaaabaaaccbcaccacabdbbabaaabaabbabdbaacadadcadcababaadbdacabbccabdbbaaabdabbababcbcccaaaaaaacabbdcbbbbabadcadcabababaabaddbadcadabbbdcacbaabadaabaaaadbaacaaaabbcbcbcbaabaaabdbcbbbaabdcabadccbbacabaababacadbabbababdbaba";

    #[test]
    fn every_cut_is_an_error() {
        let stored = [0x78, 0x01, 0x01, 3, 0, 0xfc, 0xff, b'a', b'b', b'c'];
        for cut in 0..stored.len() {
            assert!(zlib(&stored[..cut], 10).is_err(), "{cut}");
        }
        // The last four bytes are a checksum.
        for cut in 0..DYNAMIC.len() - 4 {
            assert!(zlib(&DYNAMIC[..cut], 1000).is_err(), "{cut}");
        }
        assert!(gunzip(b"\x1f\x8b").is_err());
        assert!(gunzip(b"plain text, not gzip").is_err());
    }
}

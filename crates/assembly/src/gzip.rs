//! The decompression of gzip files (RFC 1952), with their checksums verified.

use crate::diagnostics::{ErrorKind, Result, SceneError};
use flate2::read::MultiGzDecoder;
use std::io::Read as _;

/// The largest number of bytes of output, for a file of any size; larger files are refused (a
/// gigabyte of mesh or text is too large a scene anyway).
const MAX_OUTPUT: usize = 1 << 30;
/// The number of bytes of output that is allowed however small the file is.
const FREE_OUTPUT: usize = 1 << 26;
/// The number of bytes of output that is allowed for each byte of a file; meshes and text compress
/// by a smaller factor.
const OUTPUT_PER_BYTE: usize = 64;

/// Returns the contents of a gzip file: all its members one after another.
pub(crate) fn unpack(data: &[u8]) -> Result<Vec<u8>> {
    let limit = FREE_OUTPUT.saturating_add(OUTPUT_PER_BYTE.saturating_mul(data.len()));
    let limit = limit.min(MAX_OUTPUT);
    let broken = |message: &str| Err(SceneError::new(ErrorKind::Syntax, message));
    if !data.starts_with(&[0x1f, 0x8b, 8]) {
        return broken("it is not gzip data");
    }
    let mut out = Vec::new();
    let mut members = MultiGzDecoder::new(data).take(limit as u64 + 1);
    match members.read_to_end(&mut out) {
        Ok(_) if out.len() <= limit => Ok(out),
        Ok(_) => {
            let packed = data.len();
            let message = format!("its {packed} bytes unpack to more than {limit}");
            Err(SceneError::new(ErrorKind::Limit, message))
        }
        Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            broken("the compressed data end early")
        }
        Err(error) => broken(&format!("{error} behind {} bytes of contents", out.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One stored block of `abc`, with its CRC-32 and length.
    const ABC: [u8; 26] = [
        0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3, 1, 3, 0, 0xfc, 0xff, b'a', b'b', b'c', 0xc2, 0x41,
        0x24, 0x35, 3, 0, 0, 0,
    ];

    #[test]
    fn members_are_read_one_after_another() {
        assert_eq!(unpack(&ABC).unwrap(), b"abc");
        assert_eq!(unpack(&[ABC, ABC].concat()).unwrap(), b"abcabc");
    }

    #[test]
    fn sizes_are_limited() {
        use std::io::Write as _;
        let fast = flate2::Compression::fast();
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), fast);
        packed
            .write_all(&vec![0; FREE_OUTPUT + (40 << 20)])
            .unwrap();
        let packed = packed.finish().unwrap();
        let refusal = unpack(&packed).unwrap_err();
        assert_eq!(refusal.kind(), ErrorKind::Limit);
        let limit = FREE_OUTPUT + OUTPUT_PER_BYTE * packed.len();
        assert!(refusal.message().ends_with(&format!("more than {limit}")));
    }

    #[test]
    fn every_change_behind_the_header_and_every_cut_is_an_error() {
        // The first byte of the block has bits without a meaning.
        for k in 11..ABC.len() {
            let mut changed = ABC;
            changed[k] ^= 0x10;
            assert!(unpack(&changed).is_err(), "{k}");
        }
        for cut in 0..ABC.len() {
            assert!(unpack(&ABC[..cut]).is_err(), "{cut}");
        }
        let mut changed = ABC;
        changed[18] ^= 1;
        assert!(unpack(&changed).unwrap_err().message().contains("checksum"));
    }
}

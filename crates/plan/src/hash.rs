//! SHA-256: of plans, units, inputs and parts.

use sha2::{Digest as _, Sha256};
use std::fmt::Write as _;

/// Bytes of a digest.
pub(crate) const BYTES: usize = 32;

/// A digest.
pub(crate) type Digest = [u8; BYTES];

/// The digest of pieces, one after the other.
pub(crate) fn digest(pieces: &[&[u8]]) -> Digest {
    let mut hasher = Sha256::new();
    for piece in pieces {
        hasher.update(piece);
    }
    hasher.finalize().into()
}

/// A digest in hexadecimal digits.
pub(crate) fn hex(digest: &Digest) -> String {
    let mut text = String::with_capacity(2 * BYTES);
    for byte in digest {
        // A string takes everything.
        let _ = write!(text, "{byte:02x}");
    }
    text
}

/// The SHA-256 digest of bytes in hexadecimal digits, as `sha256sum` prints it.
///
/// ```
/// let empty = linelit_plan::hash(b"");
/// assert!(empty.starts_with("e3b0c44298fc1c14") && empty.len() == 64);
/// ```
#[must_use]
pub fn hash(bytes: &[u8]) -> String {
    hex(&digest(&[bytes]))
}

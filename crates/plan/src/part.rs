//! The format of parts: the result of a unit, and which unit of which plan it belongs to.
//!
//! | bytes | content |
//! |---|---|
//! | 16 | `linelit-part 2` and two line feeds |
//! | 32 | digest of the plan |
//! | 32 | digest of the unit |
//! | n | payload |
//! | 32 | SHA-256 of all of these |

use sha2::{Digest as _, Sha256};

/// The first bytes of every part.
const MAGIC: &[u8; 16] = b"linelit-part 2\n\n";

/// A SHA-256 digest.
pub(crate) type Digest = [u8; 32];

/// The number of bytes of a part before its payload.
const HEADER: usize = MAGIC.len() + 2 * size_of::<Digest>();
/// The number of bytes of a part in addition to its payload: the header and the checksum.
const OVERHEAD: usize = HEADER + size_of::<Digest>();

/// Returns the digest of pieces, one after the other.
pub(crate) fn digest(pieces: &[&[u8]]) -> Digest {
    let mut hasher = Sha256::new();
    pieces.iter().for_each(|piece| hasher.update(piece));
    hasher.finalize().into()
}

/// Returns a digest, or a part of one, in hexadecimal digits.
pub(crate) fn hex(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns the SHA-256 digest of bytes in hexadecimal digits, as `sha256sum` prints it.
///
/// ```
/// let empty = linelit_plan::hash(b"");
/// assert!(empty.starts_with("e3b0c44298fc1c14") && empty.len() == 64);
/// ```
#[must_use]
pub fn hash(bytes: &[u8]) -> String {
    hex(&digest(&[bytes]))
}

/// Returns the header of a part, and the checksum that follows its payload.
pub(crate) fn frame(plan: &Digest, unit: &Digest, payload: &[u8]) -> (Vec<u8>, Digest) {
    let header = [&MAGIC[..], plan, unit].concat();
    let checksum = digest(&[&header, payload]);
    (header, checksum)
}

/// Returns the payload of a part if it is complete and belongs to this unit; otherwise a text that
/// says what is wrong with the part.
pub(crate) fn payload(mut bytes: Vec<u8>, plan: &Digest, unit: &Digest) -> Result<Vec<u8>, String> {
    let Some(end) = bytes
        .len()
        .checked_sub(size_of::<Digest>())
        .filter(|end| *end >= HEADER)
    else {
        let length = bytes.len();
        return Err(format!(
            "it has {length} bytes, a part has {OVERHEAD} and more"
        ));
    };
    // Verify the checksum before any other byte is used.
    if digest(&[&bytes[..end]]) != bytes[end..] {
        return Err("its checksum is not that of its bytes".to_owned());
    }
    // Compare the header with the plan and the unit.
    let (magic, digests) = bytes[..HEADER].split_at(MAGIC.len());
    if magic != MAGIC {
        return Err("it does not begin as a part does".to_owned());
    }
    let found = digests.chunks_exact(size_of::<Digest>());
    for ((what, expected), found) in [("plan", plan), ("unit", unit)].into_iter().zip(found) {
        if found != expected {
            let [found, expected] = [found, expected].map(|digest| hex(&digest[..6]));
            return Err(format!(
                "it is of another {what}: {found} in place of {expected}"
            ));
        }
    }
    bytes.truncate(end);
    bytes.drain(..HEADER);
    Ok(bytes)
}

//! The bytes of a part: what was computed, and for which unit of which plan.
//!
//! Four fields of fixed size, the payload, and a digest of all before it:
//!
//! | bytes | content |
//! |---|---|
//! | 16 | `linelit-part 1` and two line feeds |
//! | 32 | digest of the plan |
//! | 32 | digest of the unit |
//! | 8 | length n of the payload, little-endian |
//! | n | payload |
//! | 32 | SHA-256 of all of these |

use crate::hash::{self, BYTES, Digest, digest};

const MAGIC: [u8; 16] = *b"linelit-part 1\n\n";
const HEADER: usize = MAGIC.len() + 2 * BYTES + 8;

/// Bytes of a part beside its payload.
pub(crate) const OVERHEAD: usize = HEADER + BYTES;

/// What a part is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Of {
    pub(crate) plan: Digest,
    pub(crate) unit: Digest,
}

/// What stands before the payload, and what behind.
pub(crate) fn frame(of: &Of, payload: &[u8]) -> ([u8; HEADER], Digest) {
    let mut header = [0; HEADER];
    let length = (payload.len() as u64).to_le_bytes();
    let pieces = [&MAGIC[..], &of.plan, &of.unit, &length];
    let bytes = pieces.iter().copied().flatten();
    for (to, from) in header.iter_mut().zip(bytes) {
        *to = *from;
    }
    (header, digest(&[&header, payload]))
}

/// The payload of a part, if it is that of this unit and whole; or what is wrong with it.
pub(crate) fn payload(mut bytes: Vec<u8>, of: &Of) -> Result<Vec<u8>, String> {
    if bytes.len() < OVERHEAD {
        return Err(format!(
            "it has {} bytes, a part has {OVERHEAD} and more",
            bytes.len()
        ));
    }
    let (content, checksum) = bytes.split_at(bytes.len() - BYTES);
    let (header, rest) = content.split_at(HEADER);
    let (magic, fields) = header.split_at(MAGIC.len());
    if magic != MAGIC {
        return Err("it does not begin as a part does".to_owned());
    }
    let length = fields[2 * BYTES..].iter().rev();
    let length = length.fold(0_u64, |n, byte| n << 8 | u64::from(*byte));
    if rest.len() as u64 != length {
        return Err(format!(
            "its payload has {} bytes, {length} are announced",
            rest.len()
        ));
    }
    // Before what it says is believed.
    if digest(&[content]) != checksum {
        return Err("its checksum is not that of its bytes".to_owned());
    }
    for (what, found, expected) in [
        ("plan", &fields[..BYTES], &of.plan),
        ("unit", &fields[BYTES..2 * BYTES], &of.unit),
    ] {
        if found != expected {
            let found: Digest = found.try_into().unwrap_or_default();
            return Err(format!(
                "it is of another {what}: {} in place of {}",
                &hash::hex(&found)[..12],
                &hash::hex(expected)[..12]
            ));
        }
    }
    bytes.truncate(bytes.len() - BYTES);
    bytes.drain(..HEADER);
    Ok(bytes)
}

//! Puts the attributes of an EXR header in the order of their names.
//!
//! The `exr` crate keeps custom attributes in a hash map and writes them in its random order; equal
//! pictures would not be equal files. A header is a list of `name\0 type\0 size(i32) value`, ended
//! by a zero byte; the order of attributes is free, and sorting moves nothing behind the header.

/// Sorts the attributes of a single-part file in place; leaves alone what it does not understand.
pub(crate) fn sort_attributes(file: &mut [u8]) {
    const START: usize = 8; // magic number and version
    let Some((mut attributes, end)) = attributes(file, START) else {
        return;
    };
    attributes.sort_by(|a, b| name(&file[a.clone()]).cmp(name(&file[b.clone()])));
    let sorted: Vec<u8> = attributes
        .into_iter()
        .flat_map(|range| file[range].to_vec())
        .collect();
    file[START..end].copy_from_slice(&sorted);
}

fn attributes(file: &[u8], start: usize) -> Option<(Vec<std::ops::Range<usize>>, usize)> {
    let mut all = Vec::new();
    let mut at = start;
    while *file.get(at)? != 0 {
        let kind = after_zero(file, at)?;
        let size_at = after_zero(file, kind)?;
        let size = file.get(size_at..size_at + 4)?;
        let size = i32::from_le_bytes(size.try_into().ok()?);
        let end = (size_at + 4).checked_add(usize::try_from(size).ok()?)?;
        if end > file.len() {
            return None;
        }
        all.push(at..end);
        at = end;
    }
    Some((all, at))
}

fn after_zero(file: &[u8], from: usize) -> Option<usize> {
    Some(from + file.get(from..)?.iter().position(|&byte| byte == 0)? + 1)
}

fn name(attribute: &[u8]) -> &[u8] {
    let end = attribute
        .iter()
        .position(|&byte| byte == 0)
        .unwrap_or(attribute.len());
    &attribute[..end]
}

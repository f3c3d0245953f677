//! The sorting of the attributes in an EXR header by their names.
//!
//! The `exr` crate stores custom attributes in a hash map and writes them in its random order, so
//! that equal pictures would not be equal files. A header is a list of attributes, each
//! `name\0 type\0 size(i32) value`, and ends with a zero byte. The order of attributes is free, and
//! sorting them moves no byte after the header.

/// Sorts the attributes of a file with a single part in place. A file whose header cannot be parsed
/// is not changed.
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

/// Returns the ranges of all attributes in a header, and the position of the zero byte after them;
/// `None` if the header is malformed.
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

/// Returns the position after the next zero byte at or after `from`; `None` if there is none.
fn after_zero(file: &[u8], from: usize) -> Option<usize> {
    Some(from + file.get(from..)?.iter().position(|&byte| byte == 0)? + 1)
}

/// Returns the name of an attribute.
fn name(attribute: &[u8]) -> &[u8] {
    let end = attribute
        .iter()
        .position(|&byte| byte == 0)
        .unwrap_or(attribute.len());
    &attribute[..end]
}

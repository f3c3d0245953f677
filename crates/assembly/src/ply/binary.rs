//! Rows of binary PLY files.

use super::header::{Element, Header, Scalar, Shape};
use super::{Role, Sink, element_role, truncated};
use crate::diagnostics::{ErrorKind, Result, SceneError, Source};

/// Reads all elements; `LE`: little-endian.
pub(super) fn read<const LE: bool>(
    source: &Source,
    header: &Header,
    sink: &mut Sink,
) -> Result<()> {
    let mut cursor = Cursor::<LE> {
        bytes: source.bytes(),
        at: header.body,
    };
    for (i, element) in header.elements.iter().enumerate() {
        let left = cursor.bytes.len() - cursor.at;
        let least = element.least_size();
        if least == 0 {
            continue;
        }
        let rows = left / least;
        if rows < element.count {
            return Err(truncated(element, rows)
                .at_byte(source, cursor.bytes.len())
                .note(format!(
                    "the header promises {} rows of at least {least} bytes, {left} bytes are left",
                    element.count
                )));
        }
        let role = element_role(&sink.layout, i);
        match role {
            Role::Vertex => sink.reserve(element.count, 0),
            Role::Face => sink.reserve(0, element.count),
            Role::Skip => {}
        }
        let done = match role {
            Role::Face if is_plain_face(element) => cursor.plain_faces(source, element, sink)?,
            Role::Vertex if fixed_stride(element).is_some() => {
                cursor.plain_vertices(source, element, sink)?
            }
            _ => 0,
        };
        for row in done..element.count {
            cursor.row(source, element, row, role, sink)?;
        }
    }
    Ok(())
}

/// The offsets of the properties and the size of a row, if it has no lists.
fn fixed_stride(element: &Element) -> Option<(Vec<(usize, Scalar)>, usize)> {
    let mut offset = 0;
    let mut list = Vec::new();
    for p in &element.properties {
        let Shape::Scalar(s) = p.shape else {
            return None;
        };
        list.push((offset, s));
        offset += s.size();
    }
    Some((list, offset))
}

/// One list of four-byte integers with a byte for its length: what nearly all files have.
fn is_plain_face(element: &Element) -> bool {
    let plain = Shape::List {
        count: Scalar::U8,
        item: Scalar::I32,
    };
    matches!(&element.properties[..], [p] if p.shape == plain)
}

struct Cursor<'a, const LE: bool> {
    bytes: &'a [u8],
    at: usize,
}

impl<const LE: bool> Cursor<'_, LE> {
    fn take(&mut self, scalar: Scalar) -> Option<f64> {
        let bytes = self.bytes.get(self.at..self.at + scalar.size())?;
        self.at += scalar.size();
        Some(value::<LE>(scalar, bytes))
    }

    /// Vertices without lists.
    fn plain_vertices(
        &mut self,
        source: &Source,
        element: &Element,
        sink: &mut Sink,
    ) -> Result<usize> {
        let Some((offsets, stride)) = fixed_stride(element) else {
            return Ok(0);
        };
        let mut row = vec![0.0; offsets.len()];
        // The caller has checked that there are enough bytes.
        for _ in 0..element.count {
            let bytes = &self.bytes[self.at..self.at + stride];
            for (slot, (offset, scalar)) in row.iter_mut().zip(&offsets) {
                *slot = value::<LE>(*scalar, &bytes[*offset..offset + scalar.size()]);
            }
            sink.vertex(&row).map_err(|m| bad_row(source, self.at, m))?;
            self.at += stride;
        }
        Ok(element.count)
    }

    /// Triangles and quads as nearly all files have them; stops before the first other row.
    fn plain_faces(
        &mut self,
        source: &Source,
        element: &Element,
        sink: &mut Sink,
    ) -> Result<usize> {
        for k in 0..element.count {
            let Some((&n @ 3..=4, rest)) = self.bytes[self.at..].split_first() else {
                return Ok(k);
            };
            let n = usize::from(n);
            let Some(bytes) = rest.get(..4 * n) else {
                return Ok(k);
            };
            let mut indices = [0_i64; 4];
            for (slot, b) in indices.iter_mut().zip(bytes.chunks_exact(4)) {
                let b = [b[0], b[1], b[2], b[3]];
                *slot = i64::from(if LE {
                    i32::from_le_bytes(b)
                } else {
                    i32::from_be_bytes(b)
                });
            }
            sink.face(&indices[..n])
                .map_err(|m| bad_row(source, self.at, m))?;
            self.at += 1 + 4 * n;
        }
        Ok(element.count)
    }

    /// Any row, property by property.
    fn row(
        &mut self,
        source: &Source,
        element: &Element,
        row: usize,
        role: Role,
        sink: &mut Sink,
    ) -> Result<()> {
        let start = self.at;
        let short = || truncated(element, row).at_byte(source, source.bytes().len());
        let mut values = Vec::new();
        let mut face = Vec::new();
        for (i, property) in element.properties.iter().enumerate() {
            match property.shape {
                Shape::Scalar(s) => {
                    let v = self.take(s).ok_or_else(short)?;
                    if role == Role::Vertex {
                        values.push(v);
                    }
                }
                Shape::List { count, item } => {
                    if role == Role::Vertex {
                        values.push(0.0);
                    }
                    let n = self.take(count).ok_or_else(short)?;
                    let n = list_length(n)
                        .ok_or_else(|| bad_row(source, start, format!("a list of length {n}")))?;
                    let left = self.bytes.len() - self.at;
                    if n.saturating_mul(item.size()) > left {
                        return Err(short());
                    }
                    if role == Role::Face && i == sink.layout.indices {
                        for _ in 0..n {
                            let v = self.take(item).ok_or_else(short)?;
                            face.push(to_index(v));
                        }
                    } else {
                        self.at += n * item.size();
                    }
                }
            }
        }
        let result = match role {
            Role::Vertex => sink.vertex(&values),
            Role::Face => sink.face(&face),
            Role::Skip => Ok(()),
        };
        result.map_err(|m| bad_row(source, start, m))
    }
}

/// The length of a list, if it is one.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a 32-bit integer held in f64, checked not to be negative"
)]
fn list_length(n: f64) -> Option<usize> {
    (n >= 0.0).then_some(n as usize)
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "a 32-bit integer held in f64"
)]
fn to_index(v: f64) -> i64 {
    v as i64
}

fn bad_row(source: &Source, at: usize, message: String) -> SceneError {
    SceneError::new(ErrorKind::BadMesh, message).at_byte(source, at)
}

/// The number in the first bytes of a slice, which is long enough.
fn value<const LE: bool>(scalar: Scalar, b: &[u8]) -> f64 {
    macro_rules! read {
        ($t:ty, $n:literal) => {{
            let mut a = [0_u8; $n];
            a.copy_from_slice(&b[..$n]);
            f64::from(if LE {
                <$t>::from_le_bytes(a)
            } else {
                <$t>::from_be_bytes(a)
            })
        }};
    }
    match scalar {
        Scalar::I8 => read!(i8, 1),
        Scalar::U8 => read!(u8, 1),
        Scalar::I16 => read!(i16, 2),
        Scalar::U16 => read!(u16, 2),
        Scalar::I32 => read!(i32, 4),
        Scalar::U32 => read!(u32, 4),
        Scalar::F32 => read!(f32, 4),
        Scalar::F64 => read!(f64, 8),
    }
}

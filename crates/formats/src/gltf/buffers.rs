//! Buffers, views and accessors: the binary data of a glTF file, decoded to numbers.

use super::Reader;
use super::document::{Document, List, Raw};
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, Engine as _, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::accessor::{Accessor, ComponentType, Type, sparse};
use gltf::json::buffer;
use gltf::json::validation::{Checked, USize64};
use linelit_assembly::{ErrorKind, Result, shorten};
use linelit_geometry::stop;
use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;

/// The number of numbers that may be decoded from buffers of any size, in addition to one number
/// for each byte of the buffers. Files that need more are refused.
pub(super) const FREE_NUMBERS: usize = 1 << 24;

/// A part of a buffer.
pub(super) struct View {
    data: Arc<[u8]>,
    range: Range<usize>,
    /// The distance between elements in bytes, if it is given.
    stride: Option<usize>,
}

impl View {
    /// Returns the bytes of the view.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.data[self.range.clone()]
    }
}

/// The decoded numbers of an accessor.
#[derive(Debug)]
pub(super) struct Numbers {
    /// The number of numbers in each element.
    pub(super) width: usize,
    pub(super) values: Vec<f64>,
}

impl<'a> Reader<'a> {
    /// Returns the bytes of a buffer, which are loaded once.
    fn buffer(&mut self, index: usize, raw: Raw<'a>) -> Result<Arc<[u8]>> {
        let doc = self.doc;
        if let Some(data) = &self.buffers[index] {
            return Ok(Arc::clone(data));
        }
        // Load the data from a URI, or take the binary chunk of a GLB file.
        let node: buffer::Buffer = doc.read(raw)?;
        let data: Arc<[u8]> = match &node.uri {
            Some(uri) => self.load_uri(uri, doc.find(raw, &["uri"]))?.into(),
            None => match &self.binary {
                Some(data) if index == 0 => Arc::clone(data),
                _ => {
                    // Name the extension that has the data in a form of its own, if there is one.
                    let extension = doc.extensions(raw).into_keys().min();
                    let (kind, message) = match extension {
                        Some(name) => {
                            let what = "the data of a buffer are there by the extension alone:";
                            let message = format!("{what} `{}` is not supported", shorten(&name));
                            (ErrorKind::Unsupported, message)
                        }
                        None => (
                            ErrorKind::MissingParameter,
                            "a buffer without `uri` and without binary chunk".to_owned(),
                        ),
                    };
                    return Err(doc.error(kind, message, raw, "has no data"));
                }
            },
        };
        // Check the length, and allow one decoded number for each byte.
        let length = size(node.byte_length);
        if data.len() < length {
            let message = format!("a buffer of {} bytes should have {length}", data.len());
            return Err(doc.error(ErrorKind::Truncated, message, raw, "too short"));
        }
        // (Accessors that do not overlap have at most one number for each byte.)
        self.numbers_left = self.numbers_left.saturating_add(data.len());
        self.buffers[index] = Some(Arc::clone(&data));
        Ok(data)
    }

    /// Reads a view: its bytes, and its stride if it has one.
    pub(super) fn view(&mut self, raw: Raw<'a>) -> Result<View> {
        let doc = self.doc;
        let node: buffer::View = doc.read(raw)?;
        let index = node.buffer.value();
        let buffer = doc.element(List::Buffers, index, raw, "buffer")?;
        let data = self.buffer(index, buffer)?;
        let (start, length) = (node.byte_offset.map_or(0, size), size(node.byte_length));
        match start.checked_add(length) {
            Some(end) if end <= data.len() => Ok(View {
                data,
                range: start..end,
                stride: node.byte_stride.map(|s| s.0),
            }),
            _ => {
                let whole = data.len();
                let message = format!(
                    "a view of {length} bytes from {start} leaves its buffer of {whole} bytes"
                );
                Err(doc.error(ErrorKind::BadMesh, message, raw, "out of range"))
            }
        }
    }

    /// Returns all numbers of the accessor to which the object `from` refers under a key. The
    /// numbers are decoded once, and then cached.
    pub(super) fn numbers(
        &mut self,
        index: usize,
        from: Raw<'a>,
        key: &str,
    ) -> Result<Rc<Numbers>> {
        // Look for the accessor among those that have been decoded.
        let doc = self.doc;
        let raw = doc.element(List::Accessors, index, from, key)?;
        if let Some(numbers) = self.accessors.get(&index) {
            return Ok(Rc::clone(numbers));
        }
        // Decode the elements of its view, or begin with zeros.
        let node: Accessor = doc.read(raw)?;
        let layout = Layout::new(doc, &node, raw)?;
        let mut values = match node.buffer_view {
            Some(view) => {
                let view = doc.element(List::BufferViews, view.value(), raw, "bufferView")?;
                let offset = node.byte_offset.map_or(0, size);
                self.dense(raw, view, offset, layout)?
            }
            None => {
                if node.sparse.is_none() {
                    let message = "an accessor without `bufferView`: its numbers are zeros";
                    let at = doc.at(raw);
                    self.base.suspicious(message, "has no data", at)?;
                }
                zeros(doc, raw, layout, self.base.max_triangles)?
            }
        };
        // Replace single elements.
        if let Some(sparse) = &node.sparse {
            self.sparse(sparse, raw, layout, &mut values)?;
        }
        let width = layout.width;
        let numbers = Rc::new(Numbers { width, values });
        self.accessors.insert(index, Rc::clone(&numbers));
        Ok(numbers)
    }

    /// Decodes `layout.count` elements of a view, from an offset in bytes on.
    fn dense(
        &mut self,
        node: Raw<'a>,
        view: Raw<'a>,
        offset: usize,
        layout: Layout,
    ) -> Result<Vec<f64>> {
        let doc = self.doc;
        let View {
            data,
            range,
            stride,
        } = self.view(view)?;
        let Layout {
            component,
            width,
            count,
            normalized,
        } = layout;
        // Check that the elements are within the view, and the number of numbers within the limit.
        let size = width * component.size();
        let stride = stride.unwrap_or(size);
        let bytes = &data[range];
        let needed = count.checked_sub(1).map_or(Some(0), |n| {
            n.checked_mul(stride)?
                .checked_add(size)?
                .checked_add(offset)
        });
        if stride < size || needed.is_none_or(|n| n > bytes.len()) {
            let message = format!(
                "an accessor of {count} elements leaves its view of {} bytes",
                bytes.len()
            );
            return Err(doc.error(ErrorKind::BadMesh, message, node, "out of range"));
        }
        let Some(left) = self.numbers_left.checked_sub(count * width) else {
            let message = "the accessors ask for far more numbers than the buffers hold";
            return Err(doc.error(ErrorKind::Limit, message, node, "one too many"));
        };
        self.numbers_left = left;
        // Decode them, as fractions if they are normalised integers.
        let mut values = Vec::with_capacity(count * width);
        for k in 0..count {
            stop::check();
            let element = &bytes[offset + k * stride..][..size];
            let numbers = element.chunks_exact(component.size());
            let numbers = numbers.map(|b| value(component, b));
            if normalized {
                values.extend(numbers.map(|v| fraction(component, v)));
            } else {
                values.extend(numbers);
            }
        }
        Ok(values)
    }

    /// Replaces single elements by the sparse values of an accessor.
    fn sparse(
        &mut self,
        sparse: &sparse::Sparse,
        raw: Raw<'a>,
        layout: Layout,
        values: &mut [f64],
    ) -> Result<()> {
        // Decode the indices of the elements.
        let doc = self.doc;
        let part = |key: &str| doc.find(raw, &["sparse", key]);
        let (places, new) = (part("indices"), part("values"));
        let count = size(sparse.count);
        let Checked::Valid(component) = sparse.indices.component_type else {
            let message = "sparse indices of another type than unsigned integers";
            return Err(doc.error(ErrorKind::BadParameter, message, places, ""));
        };
        let place_layout = Layout {
            component: component.0,
            width: 1,
            count,
            normalized: false,
        };
        let view =
            |from: Raw<'a>, index: usize| doc.element(List::BufferViews, index, from, "bufferView");
        let of_indices = view(places, sparse.indices.buffer_view.value())?;
        let offset = size(sparse.indices.byte_offset);
        let indices = self.dense(places, of_indices, offset, place_layout)?;
        // Decode their new values, and write them.
        let of_values = view(new, sparse.values.buffer_view.value())?;
        let offset = size(sparse.values.byte_offset);
        let layout_of_new = Layout { count, ..layout };
        let new = self.dense(new, of_values, offset, layout_of_new)?;
        for (index, element) in indices.iter().zip(new.chunks_exact(layout.width)) {
            let place = whole(*index, layout.count).ok_or_else(|| {
                let message = format!("sparse index {index} is out of range");
                let label = format!("there are {} elements", layout.count);
                doc.error(ErrorKind::BadMesh, message, places, &label)
            })?;
            values[place * layout.width..][..layout.width].copy_from_slice(element);
        }
        Ok(())
    }

    /// Returns the bytes of a URI, which is a file name or a `data:` URI.
    pub(super) fn load_uri(&mut self, uri: &str, place: Raw<'a>) -> Result<Vec<u8>> {
        let Some(data) = uri.strip_prefix("data:") else {
            let file = self.base.open(&percent_decode(uri), self.doc.at(place));
            return file.map(|file| file.bytes);
        };
        let decoded = match data.split_once(',') {
            Some((kind, text)) if kind.ends_with(";base64") => base64(text.as_bytes()),
            Some((_, text)) => Some(percent_bytes(text)),
            None => None,
        };
        decoded.ok_or_else(|| {
            let message = "a data URI that is not base64";
            let kind = ErrorKind::Syntax;
            self.doc.error(kind, message, place, "cannot be decoded")
        })
    }
}

/// Converts a number to an index, if it is a whole number below `count`.
fn whole(value: f64, count: usize) -> Option<usize> {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "compared with the count and with the number itself"
    )]
    let index = value as usize;
    let exact = (index as f64).to_bits() == value.abs().to_bits();
    (value >= 0.0 && exact && index < count).then_some(index)
}

/// Returns the elements of an accessor without a view: zeros, some of which sparse values replace.
/// Their number is limited, as a small file could request any number of them.
fn zeros<'a>(doc: &Document<'a>, node: Raw<'a>, layout: Layout, most: usize) -> Result<Vec<f64>> {
    if layout.count > most.min(MAX_ZEROS) {
        let message = format!("an accessor of {} zeros", layout.count);
        return Err(doc.error(ErrorKind::Limit, message, node, "without any data"));
    }
    Ok(vec![0.0; layout.count * layout.width])
}

/// The largest number of elements of an accessor without data; accessors with more are refused.
const MAX_ZEROS: usize = 1 << 20;

/// The layout of an accessor's numbers.
#[derive(Clone, Copy, Debug)]
struct Layout {
    component: ComponentType,
    /// The number of numbers in each element.
    width: usize,
    /// The number of elements.
    count: usize,
    /// Whether integers represent fractions.
    normalized: bool,
}

impl Layout {
    /// Creates the layout of an accessor; it is an error if the accessor's types are unknown.
    fn new<'a>(doc: &Document<'a>, node: &Accessor, raw: Raw<'a>) -> Result<Self> {
        // Refuse unknown types; floating-point numbers are never normalised.
        let wrong = |key: &str| {
            let message = format!("an accessor of unknown `{key}`");
            doc.error(ErrorKind::BadParameter, message, raw, "")
        };
        let Checked::Valid(component) = node.component_type else {
            return Err(wrong("componentType"));
        };
        let Checked::Valid(kind) = node.type_ else {
            return Err(wrong("type"));
        };
        Ok(Self {
            component: component.0,
            width: match kind {
                Type::Scalar => 1,
                Type::Vec2 => 2,
                Type::Vec3 => 3,
                Type::Vec4 | Type::Mat2 => 4,
                Type::Mat3 => 9,
                Type::Mat4 => 16,
            },
            count: size(node.count),
            normalized: node.normalized && component.0 != ComponentType::F32,
        })
    }
}

/// Returns a count or an offset as a `usize`. A number that does not fit becomes the largest one,
/// which is larger than any file.
fn size(value: USize64) -> usize {
    usize::try_from(value.0).unwrap_or(usize::MAX)
}

/// Decodes escapes such as `%20`.
pub(super) fn percent_decode(uri: &str) -> String {
    String::from_utf8_lossy(&percent_bytes(uri)).into_owned()
}

/// Returns the bytes of a text whose escapes are decoded. A percent sign without two digits stays.
fn percent_bytes(uri: &str) -> Vec<u8> {
    let mut out = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&b, tail)) = rest.split_first() {
        let code = tail.get(..2).and_then(|d| std::str::from_utf8(d).ok());
        match code.and_then(|d| u8::from_str_radix(d, 16).ok()) {
            Some(code) if b == b'%' => {
                out.push(code);
                rest = &tail[2..];
            }
            _ => {
                out.push(b);
                rest = tail;
            }
        }
    }
    out
}

/// Decodes base64 as leniently as browsers do: it may use either alphabet, contain white space, and
/// have padding or none.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let lenient = GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    let one_alphabet = |b: &u8| match b {
        b'-' => b'+',
        b'_' => b'/',
        other => *other,
    };
    let text = text.iter().filter(|b| !b.is_ascii_whitespace());
    let text: Vec<u8> = text.map(one_alphabet).collect();
    GeneralPurpose::new(&STANDARD, lenient).decode(text).ok()
}

/// Returns the fraction that a normalised integer c represents: c over the largest number of its
/// type, and at least −1 (glTF 2.0, section 3.11).
const fn fraction(component: ComponentType, c: f64) -> f64 {
    let largest = match component {
        ComponentType::I8 => 127.0,
        ComponentType::U8 => 255.0,
        ComponentType::I16 => 32767.0,
        ComponentType::U16 => 65535.0,
        ComponentType::U32 => 4294967295.0,
        ComponentType::F32 => 1.0,
    };
    (c / largest).max(-1.0)
}

/// Returns the value of a number of type `component` that is stored as the little-endian bytes `b`.
fn value(component: ComponentType, b: &[u8]) -> f64 {
    let four = || [b[0], b[1], b[2], b[3]];
    match component {
        ComponentType::I8 => f64::from(i8::from_le_bytes([b[0]])),
        ComponentType::U8 => f64::from(b[0]),
        ComponentType::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
        ComponentType::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
        ComponentType::U32 => f64::from(u32::from_le_bytes(four())),
        ComponentType::F32 => f64::from(f32::from_le_bytes(four())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_and_percent_signs() {
        assert_eq!(base64(b"TWFu").unwrap(), b"Man");
        assert_eq!(base64(b"TQ==").unwrap(), b"M");
        assert_eq!(base64(b"-_\n-_").unwrap(), [0xfb, 0xff, 0xbf]);
        assert_eq!(base64(b"TQ").unwrap(), b"M");
        assert!(base64(b"T*==").is_none());
        assert_eq!(percent_decode("a%20b%"), "a b%");
    }
}

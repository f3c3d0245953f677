//! The rows after the header of a PLY file, as text or as bytes. They are read number by number;
//! binary rows with the usual types are read at once, which is faster.

use super::header::{Element, Format, Header, Property, Scalar};
use super::{Role, Sink};
use crate::diagnostics::{ErrorKind, Location, Result, SceneError, Source, Span, shorten};
use linelit_geometry::stop;

/// The reason why a number was not read.
enum Stop {
    /// The file has ended.
    End,
    /// The number is not valid.
    Bad(SceneError),
}

/// The numbers of a file, which are read one after another.
struct Numbers<'a> {
    source: &'a Source,
    format: Format,
    /// The offset of the next number, or of white space before it.
    at: usize,
}

/// Reads all rows, and passes those of vertices and faces to the sink.
pub(super) fn read(source: &Source, header: &Header, sink: &mut Sink) -> Result<()> {
    let (format, at) = (header.format, header.body);
    let mut numbers = Numbers { source, format, at };
    let (mut values, mut list) = (Vec::new(), Vec::new());
    for (i, element) in header.elements.iter().enumerate() {
        // Check that the file can have this number of rows: lists are empty at least.
        let first = |p: &Property| numbers.least(p.length.unwrap_or(p.item));
        let least: usize = element.properties.iter().map(first).sum();
        if least == 0 {
            continue;
        }
        let (name, count) = (&element.name, element.count);
        let truncated = |numbers: &Numbers<'_>, row: usize| {
            let message = format!("the file ends in `{name}` {row} of {count}");
            let at = numbers.since(source.bytes().len());
            at.error(ErrorKind::Truncated, message, "the file ends here")
        };
        let left = numbers.left();
        if format != Format::Ascii && left / least < count {
            let rows = format!("{count} rows of at least {least} bytes, {left} bytes are left");
            let error = truncated(&numbers, left / least);
            return Err(error.note(format!("the header promises {rows}")));
        }
        // Reserve memory, and read the rows.
        let role = sink.role(i);
        sink.reserve(role, count.min(left / least + 1));
        let is_plain = numbers.is_plain(role, element);
        for row in 0..count {
            stop::check();
            if is_plain && numbers.plain(role, element, &mut values, sink) {
                continue;
            }
            // Read a row number by number, and pass it to the sink.
            let start = numbers.next_start();
            let wanted = (role == Role::Face).then_some(sink.indices);
            match numbers.row(element, wanted, &mut values, &mut list) {
                Ok(()) => {}
                Err(Stop::End) => return Err(truncated(&numbers, row)),
                Err(Stop::Bad(error)) => return Err(error),
            }
            let taken = match role {
                Role::Vertex => sink.vertex(&values),
                Role::Face => sink.face(&list),
                Role::Skip => Ok(()),
            };
            let bad = |message| numbers.since(start).error(ErrorKind::BadMesh, message, "");
            taken.map_err(bad)?;
        }
    }
    Ok(())
}

impl Numbers<'_> {
    /// Returns whether an element has the types that most files use: vertices with little-endian
    /// `float`s only, or faces with one list of `int`s whose length is a `uchar`.
    fn is_plain(&self, role: Role, element: &Element) -> bool {
        let scalars = |p: &Property| p.length.is_none() && p.item == Scalar::F32;
        let corners = |p: &Property| (p.length, p.item) == (Some(Scalar::U8), Scalar::I32);
        let properties = &element.properties;
        self.format == Format::Little
            && match role {
                Role::Vertex => properties.iter().all(scalars),
                Role::Face => properties.len() == 1 && corners(&properties[0]),
                Role::Skip => false,
            }
    }

    /// Reads a row of an element with such types ([`Numbers::is_plain`]) at once, twice as fast as
    /// number by number. The result is false, and nothing is read, for polygons with more than
    /// three corners and for rows that are not valid.
    #[inline]
    fn plain(
        &mut self,
        role: Role,
        element: &Element,
        values: &mut Vec<f64>,
        sink: &mut Sink,
    ) -> bool {
        let rest = &self.source.bytes()[self.at..];
        let size = if role == Role::Face {
            // A triangle has 13 bytes: the length 3 and three indices.
            let corners = rest.first_chunk::<13>().filter(|row| row[0] == 3);
            let taken = corners.is_some_and(|row| sink.triangle(row[1..].as_chunks::<4>().0));
            if taken { 13 } else { 0 }
        } else {
            // A vertex has four bytes for each property.
            let row = rest.get(..4 * element.properties.len()).unwrap_or_default();
            let numbers = row.as_chunks::<4>().0.iter();
            values.clear();
            values.extend(numbers.map(|bytes| f64::from(f32::from_le_bytes(*bytes))));
            let is_whole = values.len() == element.properties.len();
            if is_whole && sink.vertex(values).is_ok() {
                row.len()
            } else {
                0
            }
        };
        self.at += size;
        size > 0
    }

    /// Reads one row: `values` gets its numbers, with a zero for each list, and `list` gets the
    /// list with the index `wanted`.
    fn row(
        &mut self,
        element: &Element,
        wanted: Option<usize>,
        values: &mut Vec<f64>,
        list: &mut Vec<f64>,
    ) -> std::result::Result<(), Stop> {
        values.clear();
        list.clear();
        for (i, property) in element.properties.iter().enumerate() {
            // Read a number.
            let Some(length) = property.length else {
                values.push(self.next(property.item, false)?);
                continue;
            };
            // Read the length of a list, and check that the file can have such a list.
            values.push(0.0);
            let start = self.next_start();
            let count = self.next(length, true)?;
            if !(0.0..=f64::from(u32::MAX)).contains(&count) {
                let message = format!("a list of length {count}");
                let at = self.since(start);
                let error = at.error(ErrorKind::BadMesh, message, "expected a length");
                return Err(Stop::Bad(error));
            }
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "an integer, just checked to be in range"
            )]
            let count = count as usize;
            // (The last word of a text needs no separator after it.)
            if count.saturating_mul(self.least(property.item)) > self.left() + 1 {
                return Err(Stop::End);
            }
            // Read the list; its numbers must be integers if it is the wanted one.
            let is_wanted = wanted == Some(i);
            for _ in 0..count {
                let item = self.next(property.item, is_wanted)?;
                if is_wanted {
                    list.push(item);
                }
            }
        }
        Ok(())
    }

    /// Returns the number of bytes that have not been read.
    fn left(&self) -> usize {
        self.source.bytes().len() - self.at
    }

    /// Returns the least number of bytes of a number; in a text, it is a digit and a separator.
    fn least(&self, scalar: Scalar) -> usize {
        if self.format == Format::Ascii {
            2
        } else {
            scalar.size()
        }
    }

    /// Returns the offset of the next number, after white space.
    fn next_start(&self) -> usize {
        let rest = &self.source.bytes()[self.at..];
        match self.format {
            Format::Ascii => self.at + rest.len() - rest.trim_ascii_start().len(),
            Format::Little | Format::Big => self.at,
        }
    }

    /// Returns the location of the text that was read since `start`, for messages.
    fn since(&self, start: usize) -> Location<'_> {
        match self.format {
            Format::Ascii => self.source.at(Span::new(start, self.at.max(start))),
            Format::Little | Format::Big => self.source.at_byte(start),
        }
    }

    /// Reads the next number. `whole` says that it must be an integer.
    #[inline]
    fn next(&mut self, scalar: Scalar, whole: bool) -> std::result::Result<f64, Stop> {
        if self.format == Format::Ascii {
            return self.word(whole);
        }
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.take()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    /// Reads the next `N` bytes, and returns them with the least significant first.
    #[inline]
    fn take<const N: usize>(&mut self) -> std::result::Result<[u8; N], Stop> {
        let rest = self.source.bytes().get(self.at..);
        let mut bytes = *rest.and_then(|b| b.first_chunk()).ok_or(Stop::End)?;
        if self.format == Format::Big {
            bytes.reverse();
        }
        self.at += N;
        Ok(bytes)
    }

    /// Reads the next word of a text as a number.
    fn word(&mut self, whole: bool) -> std::result::Result<f64, Stop> {
        // Find the word.
        let start = self.next_start();
        let rest = &self.source.bytes()[start..];
        let length = rest.iter().position(u8::is_ascii_whitespace);
        let word = &rest[..length.unwrap_or(rest.len())];
        self.at = start + word.len();
        if word.is_empty() {
            return Err(Stop::End);
        }
        // Convert it. Some writers write indices as `3.0`, which count as integers.
        let value = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        let value = value.filter(|v: &f64| !whole || v.fract().abs() <= 0.0);
        value.ok_or_else(|| {
            let what = if whole { "an integer" } else { "a number" };
            let shown = shorten(&String::from_utf8_lossy(word));
            let message = format!("`{shown}` is not {what}");
            let at = self.since(start);
            Stop::Bad(at.error(ErrorKind::Syntax, message, format!("expected {what}")))
        })
    }
}

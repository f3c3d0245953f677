//! The rows behind the header, as text or as bytes.

use super::header::{Element, Format, Header, Property, Scalar};
use super::{Role, Sink};
use crate::diagnostics::{ErrorKind, Location, Result, SceneError, Source, Span, shorten};
use linelit_geometry::stop;

/// Why a number was not read.
enum Stop {
    /// The file ends.
    End,
    Bad(SceneError),
}

/// The numbers of a file, one after another.
struct Numbers<'a> {
    source: &'a Source,
    format: Format,
    /// The offset at which the next number starts, but for white space.
    at: usize,
}

/// Hands all rows to the sink.
pub(super) fn read(source: &Source, header: &Header, sink: &mut Sink) -> Result<()> {
    let (format, at) = (header.format, header.body);
    let mut numbers = Numbers { source, format, at };
    let (mut values, mut list) = (Vec::new(), Vec::new());
    for (i, element) in header.elements.iter().enumerate() {
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
        let role = sink.role(i);
        sink.reserve(role, count.min(left / least + 1));
        let is_plain = numbers.is_plain(role, element);
        for row in 0..count {
            stop::check();
            if is_plain && numbers.plain(role, element, &mut values, sink) {
                continue;
            }
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
    /// Whether rows are what most files have: vertices of little-endian `float`s alone, faces of
    /// one list of `int`s behind a `uchar`.
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

    /// Takes a row of such an element at once, twice as fast as number by number; false, and
    /// nothing is taken, of a polygon and of what is wrong.
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
            let corners = rest.first_chunk::<13>().filter(|row| row[0] == 3);
            let taken = corners.is_some_and(|row| sink.triangle(row[1..].as_chunks::<4>().0));
            if taken { 13 } else { 0 }
        } else {
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

    /// One row: its numbers with a zero for each list, and the list that is wanted.
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
            let Some(length) = property.length else {
                values.push(self.next(property.item, false)?);
                continue;
            };
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
            // The last word of a text needs no separator behind it.
            if count.saturating_mul(self.least(property.item)) > self.left() + 1 {
                return Err(Stop::End);
            }
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

    /// Bytes behind the numbers so far.
    fn left(&self) -> usize {
        self.source.bytes().len() - self.at
    }

    /// Fewest bytes of a number: as text, a digit and a separator.
    fn least(&self, scalar: Scalar) -> usize {
        if self.format == Format::Ascii {
            2
        } else {
            scalar.size()
        }
    }

    /// Returns the offset at which the next number starts.
    fn next_start(&self) -> usize {
        let rest = &self.source.bytes()[self.at..];
        match self.format {
            Format::Ascii => self.at + rest.len() - rest.trim_ascii_start().len(),
            Format::Little | Format::Big => self.at,
        }
    }

    /// Returns the location of the text read since `start`, to point at.
    fn since(&self, start: usize) -> Location<'_> {
        match self.format {
            Format::Ascii => self.source.at(Span::new(start, self.at.max(start))),
            Format::Little | Format::Big => self.source.at_byte(start),
        }
    }

    /// The next number; `whole`: it must be an integer.
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

    /// The next bytes, the least significant first.
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

    /// The next word.
    fn word(&mut self, whole: bool) -> std::result::Result<f64, Stop> {
        let start = self.next_start();
        let rest = &self.source.bytes()[start..];
        let length = rest.iter().position(u8::is_ascii_whitespace);
        let word = &rest[..length.unwrap_or(rest.len())];
        self.at = start + word.len();
        if word.is_empty() {
            return Err(Stop::End);
        }
        let value = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        // Some writers put indices as `3.0`.
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

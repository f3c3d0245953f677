//! Rows of ASCII PLY files.

use super::header::{Element, Header, Scalar, Shape};
use super::{Role, Sink, element_role, truncated};
use crate::diagnostics::{ErrorKind, Result, SceneError, Source, Span};

/// Reads all elements; numbers are separated by any white space.
pub(super) fn read(source: &Source, header: &Header, sink: &mut Sink) -> Result<()> {
    let mut words = Words {
        source,
        at: header.body,
    };
    for (i, element) in header.elements.iter().enumerate() {
        let role = element_role(&sink.layout, i);
        if element.properties.is_empty() {
            continue;
        }
        // Each number takes at least two bytes with its separator.
        let left = source.bytes().len() - words.at;
        let rows = element.count.min(left / (2 * element.properties.len()) + 1);
        match role {
            Role::Vertex => sink.reserve(rows, 0),
            Role::Face => sink.reserve(0, rows),
            Role::Skip => {}
        }
        for row in 0..element.count {
            read_row(&mut words, element, row, role, sink)?;
        }
    }
    Ok(())
}

fn read_row(
    words: &mut Words<'_>,
    element: &Element,
    row: usize,
    role: Role,
    sink: &mut Sink,
) -> Result<()> {
    let source = words.source;
    let start = words.here();
    let mut values = Vec::new();
    let mut face = Vec::new();
    let short = || {
        let end = source.bytes().len();
        truncated(element, row).at(source, Span::new(end, end), "the file ends here")
    };
    for (i, property) in element.properties.iter().enumerate() {
        match property.shape {
            Shape::Scalar(_) => {
                let span = words.next().ok_or_else(short)?;
                values.push(number(source, span)?);
            }
            Shape::List { item, .. } => {
                if role == Role::Vertex {
                    values.push(0.0);
                }
                let span = words.next().ok_or_else(short)?;
                let n = integer(source, span)?;
                let n = u32::try_from(n).map_err(|_| {
                    SceneError::new(ErrorKind::BadMesh, format!("a list of length {n}")).at(
                        source,
                        span,
                        "expected a length",
                    )
                })?;
                for _ in 0..n {
                    let span = words.next().ok_or_else(short)?;
                    if role == Role::Face && i == sink.layout.indices {
                        face.push(integer(source, span)?);
                    } else if item == Scalar::F32 {
                        number(source, span)?;
                    }
                }
            }
        }
    }
    let result = match role {
        Role::Vertex => sink.vertex(&values),
        Role::Face => sink.face(&face),
        Role::Skip => Ok(()),
    };
    result.map_err(|message| {
        let span = Span::new(start, words.at.max(start));
        SceneError::new(ErrorKind::BadMesh, message).at(source, span, "")
    })
}

/// Words separated by white space.
struct Words<'a> {
    source: &'a Source,
    at: usize,
}

impl Words<'_> {
    /// The start of the next word.
    fn here(&self) -> usize {
        let rest = &self.source.bytes()[self.at..];
        let skip = rest.iter().position(|b| !b.is_ascii_whitespace());
        self.at + skip.unwrap_or(rest.len())
    }

    fn next(&mut self) -> Option<Span> {
        let start = self.here();
        let rest = &self.source.bytes()[start..];
        let length = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        self.at = start + length;
        (length > 0).then_some(Span::new(start, self.at))
    }
}

fn number(source: &Source, span: Span) -> Result<f64> {
    parse(source, span).ok_or_else(|| bad_number(source, span))
}

fn integer(source: &Source, span: Span) -> Result<i64> {
    // Some writers put indices as `3.0`.
    let exact = |v: f64| {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::float_cmp,
            reason = "compared exactly with its truncation"
        )]
        (v == v.trunc() && v.abs() < 9e15).then_some(v as i64)
    };
    parse::<i64>(source, span)
        .or_else(|| parse(source, span).and_then(exact))
        .ok_or_else(|| {
            let text: String = source.text(span).chars().take(40).collect();
            SceneError::new(ErrorKind::Syntax, format!("`{text}` is not an integer")).at(
                source,
                span,
                "expected an integer",
            )
        })
}

fn parse<T: std::str::FromStr>(source: &Source, span: Span) -> Option<T> {
    let bytes = &source.bytes()[span.start..span.end];
    std::str::from_utf8(bytes).ok()?.parse().ok()
}

fn bad_number(source: &Source, span: Span) -> SceneError {
    let text: String = source.text(span).chars().take(40).collect();
    SceneError::new(ErrorKind::Syntax, format!("`{text}` is not a number")).at(
        source,
        span,
        "expected a number",
    )
}

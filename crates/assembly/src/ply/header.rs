//! The text at the start of a PLY file.

use crate::diagnostics::{ErrorKind, Result, SceneError, Source, Span, nearest};

/// How the rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    Little,
    Big,
}

/// A number's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

const SCALARS: &[(&str, Scalar)] = &[
    ("char", Scalar::I8),
    ("int8", Scalar::I8),
    ("uchar", Scalar::U8),
    ("uint8", Scalar::U8),
    ("short", Scalar::I16),
    ("int16", Scalar::I16),
    ("ushort", Scalar::U16),
    ("uint16", Scalar::U16),
    ("int", Scalar::I32),
    ("int32", Scalar::I32),
    ("uint", Scalar::U32),
    ("uint32", Scalar::U32),
    ("float", Scalar::F32),
    ("float32", Scalar::F32),
    ("double", Scalar::F64),
    ("float64", Scalar::F64),
];

impl Scalar {
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    const fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// What a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Clone, Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) shape: Shape,
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// The number of the scalar property of that name.
    pub(super) fn scalar(&self, name: &str) -> Option<usize> {
        self.properties
            .iter()
            .position(|p| p.name == name && matches!(p.shape, Shape::Scalar(_)))
    }

    /// The number of the integer list property of one of these names.
    pub(super) fn list(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|p| {
            names.contains(&p.name.as_str())
                && matches!(p.shape, Shape::List { item, .. } if !item.is_float())
        })
    }

    /// Fewest bytes of a row in binary.
    pub(super) fn least_size(&self) -> usize {
        let sizes = self.properties.iter().map(|p| match p.shape {
            Shape::Scalar(s) => s.size(),
            Shape::List { count, .. } => count.size(),
        });
        sizes.sum()
    }
}

#[derive(Clone, Debug)]
pub(super) struct Header {
    pub(super) format: Format,
    pub(super) elements: Vec<Element>,
    /// Where the rows start.
    pub(super) body: usize,
    /// The line `end_header`.
    pub(super) span: Span,
}

/// Most elements and properties that a header may have; ordinary files have a dozen.
const MAX_ENTRIES: usize = 1000;

impl Header {
    pub(super) fn parse(source: &Source) -> Result<Self> {
        let mut lines = Lines { source, at: 0 };
        let first = lines.next().map(|span| source.text(span));
        if first.as_deref().map(str::trim_end) != Some("ply") {
            // What other files hold is nobody's business.
            let error = SceneError::new(ErrorKind::Syntax, "this is no PLY file");
            return Err(error
                .in_file(source.name())
                .note("expected `ply` on the first line"));
        }
        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut entries = 0;
        while let Some(span) = lines.next() {
            let text = source.text(span);
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            let bad = |message: String, label: &str| {
                SceneError::new(ErrorKind::Syntax, message).at(source, span, label)
            };
            match words.as_slice() {
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, "1.0"] => {
                    format = Some(match *name {
                        "ascii" => Format::Ascii,
                        "binary_little_endian" => Format::Little,
                        "binary_big_endian" => Format::Big,
                        _ => {
                            let names = ["ascii", "binary_little_endian", "binary_big_endian"];
                            return Err(bad(format!("unknown PLY format `{name}`"), "")
                                .suggest(nearest(name, names)));
                        }
                    });
                }
                ["format", ..] => {
                    let label = "expected `format`, one of `ascii`, `binary_little_endian` and \
                                 `binary_big_endian`, and the version `1.0`";
                    let what = match words.get(2) {
                        None => "has no version".to_owned(),
                        Some(version) => {
                            let version: String = version.chars().take(20).collect();
                            format!("is of version `{version}`, which is not supported")
                        }
                    };
                    return Err(bad(format!("the `format` of the PLY file {what}"), label));
                }
                ["element", name, _] if elements.iter().any(|e| e.name == *name) => {
                    let name: String = name.chars().take(40).collect();
                    let message = format!("element `{name}` is described twice");
                    return Err(bad(message, "the second time"));
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| {
                        bad(
                            format!("`{count}` is not a number of rows"),
                            "expected a count",
                        )
                    })?;
                    elements.push(Element {
                        name: (*name).to_owned(),
                        count,
                        properties: Vec::new(),
                    });
                    entries += 1;
                }
                ["property", rest @ ..] => {
                    let property = parse_property(rest).map_err(|m| bad(m, ""))?;
                    let Some(element) = elements.last_mut() else {
                        return Err(bad("a property before the first element".into(), ""));
                    };
                    element.properties.push(property);
                    entries += 1;
                }
                ["end_header"] => {
                    let Some(format) = format else {
                        return Err(bad("the PLY header has no `format`".into(), "ends here"));
                    };
                    let body = lines.at;
                    return Ok(Self {
                        format,
                        elements,
                        body,
                        span,
                    });
                }
                [word, ..] => {
                    let names = ["comment", "format", "element", "property", "end_header"];
                    let word: String = word.chars().take(40).collect();
                    // Some writers break comments into several lines; a slip of the pen in a
                    // keyword is another matter.
                    if let Some(near) = nearest(&word, names) {
                        return Err(bad(format!("unknown line `{word}` in the PLY header"), "")
                            .suggest(Some(near)));
                    }
                }
            }
            if entries > MAX_ENTRIES {
                return Err(
                    SceneError::new(ErrorKind::Limit, "the PLY header is too long").at(
                        source,
                        span,
                        "too many elements and properties",
                    ),
                );
            }
        }
        let end = source.bytes().len();
        Err(
            SceneError::new(ErrorKind::Truncated, "the PLY header has no `end_header`").at(
                source,
                Span::new(end, end),
                "the file ends here",
            ),
        )
    }
}

fn scalar(name: &str) -> std::result::Result<Scalar, String> {
    let found = SCALARS.iter().find(|(n, _)| *n == name);
    found.map(|(_, s)| *s).ok_or_else(|| {
        let short: String = name.chars().take(40).collect();
        match nearest(name, SCALARS.iter().map(|(n, _)| *n)) {
            Some(near) => format!("unknown number type `{short}`; did you mean `{near}`?"),
            None => format!("unknown number type `{short}`"),
        }
    })
}

fn parse_property(words: &[&str]) -> std::result::Result<Property, String> {
    let (shape, name) = match words {
        ["list", count, item, name] => {
            let (count, item) = (scalar(count)?, scalar(item)?);
            if count.is_float() {
                return Err("the length of a list must be an integer".into());
            }
            (Shape::List { count, item }, name)
        }
        [ty, name] => (Shape::Scalar(scalar(ty)?), name),
        _ => return Err("expected `property TYPE NAME` or `property list TYPE TYPE NAME`".into()),
    };
    Ok(Property {
        name: (*name).to_owned(),
        shape,
    })
}

/// Lines that end in LF, CR LF or CR.
struct Lines<'a> {
    source: &'a Source,
    at: usize,
}

impl Iterator for Lines<'_> {
    type Item = Span;

    fn next(&mut self) -> Option<Span> {
        let bytes = self.source.bytes();
        let rest = bytes.get(self.at..).filter(|r| !r.is_empty())?;
        // A header line is short; a binary file without line ends is no header.
        let end = rest
            .iter()
            .take(1 << 16)
            .position(|b| matches!(b, b'\n' | b'\r'));
        let span = Span::new(self.at, self.at + end.unwrap_or(rest.len()));
        self.at = span.end;
        if end.is_some() {
            let crlf = bytes[span.end..].starts_with(b"\r\n");
            self.at += if crlf { 2 } else { 1 };
        }
        Some(span)
    }
}

//! The header of a PLY file, a text that describes the elements and their properties.

use crate::diagnostics::{ErrorKind, Result, SceneError, Source, Span, nearest, shorten};

/// The encoding of the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    Little,
    Big,
}

/// The type of a number.
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

/// The types with their older and their newer name, and their numbers of bytes.
const SCALARS: [(Scalar, [&str; 2], usize); 8] = [
    (Scalar::I8, ["char", "int8"], 1),
    (Scalar::U8, ["uchar", "uint8"], 1),
    (Scalar::I16, ["short", "int16"], 2),
    (Scalar::U16, ["ushort", "uint16"], 2),
    (Scalar::I32, ["int", "int32"], 4),
    (Scalar::U32, ["uint", "uint32"], 4),
    (Scalar::F32, ["float", "float32"], 4),
    (Scalar::F64, ["double", "float64"], 8),
];

impl Scalar {
    /// Returns the number of bytes of a number of this type in a binary file.
    pub(super) const fn size(self) -> usize {
        SCALARS[self as usize].2
    }

    /// Returns whether this is a floating-point type.
    pub(super) const fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// Returns the type that has this name in a header.
    fn named(name: &str) -> std::result::Result<Self, String> {
        let found = SCALARS.iter().find(|(_, names, _)| names.contains(&name));
        found.map(|found| found.0).ok_or_else(|| {
            let message = format!("unknown number type `{}`", shorten(name));
            match nearest(name, SCALARS.iter().flat_map(|s| s.1)) {
                Some(near) => format!("{message}; did you mean `{near}`?"),
                None => message,
            }
        })
    }
}

/// A property of an element, of which each row has a value: a number, or a list with its length
/// before it.
#[derive(Clone, Debug)]
pub(super) struct Property {
    pub(super) name: String,
    /// The type of a list's length; `None` for a number.
    pub(super) length: Option<Scalar>,
    /// The type of the number, or of the numbers in the list.
    pub(super) item: Scalar,
}

/// An element, such as `vertex` or `face`: a table with a number of rows.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

/// The header of a file.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) format: Format,
    pub(super) elements: Vec<Element>,
    /// The offset at which the rows start.
    pub(super) body: usize,
    /// The position of the line `end_header`.
    pub(super) span: Span,
}

/// The largest number of elements and properties of a header; ordinary files have a dozen.
const MAX_ENTRIES: usize = 1000;

/// A function that makes an error at a line from a message and a label.
type Bad<'a> = &'a dyn Fn(String, &str) -> SceneError;

impl Header {
    /// Reads the header of a file.
    pub(super) fn parse(source: &Source) -> Result<Self> {
        // Check the first line.
        let mut at = 0;
        if source.text(next_line(source, &mut at)).trim_end() != "ply" {
            // The message must not quote the file: a scene could name any file of the machine.
            let whole = source.whole();
            let error = whole.error(ErrorKind::Syntax, "this is no PLY file", "");
            return Err(error.note("expected `ply` on the first line"));
        }
        let (mut format, mut elements, mut entries) = (None, Vec::<Element>::new(), 0);
        while at < source.bytes().len() {
            // Read a line, up to `end_header`.
            let span = next_line(source, &mut at);
            let text = source.text(span);
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            let bad = |message, label: &str| source.error(ErrorKind::Syntax, message, span, label);
            match words.as_slice() {
                [] | ["comment" | "obj_info", ..] => {}
                ["format", rest @ ..] => format = Some(parse_format(rest, &bad)?),
                ["element", name, count] => {
                    elements.push(parse_element(&elements, name, count, &bad)?)
                }
                ["property", rest @ ..] => {
                    let property = parse_property(rest).map_err(|m| bad(m, ""))?;
                    let none = || bad("a property before the first element".into(), "");
                    let element = elements.last_mut().ok_or_else(none)?;
                    element.properties.push(property);
                }
                ["end_header"] => {
                    let none = || bad("the PLY header has no `format`".into(), "ends here");
                    let (format, body) = (format.ok_or_else(none)?, at);
                    return Ok(Self {
                        format,
                        elements,
                        body,
                        span,
                    });
                }
                [word, ..] => {
                    let names = ["comment", "format", "element", "property", "end_header"];
                    // Ignore unknown lines, as some writers break comments into several lines; but
                    // refuse a misspelt keyword.
                    if let Some(near) = nearest(word, names) {
                        let message = format!("unknown line `{}` in the PLY header", shorten(word));
                        return Err(bad(message, "").suggest(Some(near)));
                    }
                }
            }
            // Limit the length of the header.
            entries += usize::from(matches!(words[..], ["element" | "property", ..]));
            if entries > MAX_ENTRIES {
                let (kind, message) = (ErrorKind::Limit, "the PLY header is too long");
                let label = "too many elements and properties";
                return Err(source.error(kind, message, span, label));
            }
        }
        let (kind, message) = (ErrorKind::Truncated, "the PLY header has no `end_header`");
        Err(source.error(kind, message, Span::new(at, at), "the file ends here"))
    }
}

/// Reads the words after `format`.
fn parse_format(words: &[&str], bad: Bad<'_>) -> Result<Format> {
    const NAMES: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];
    let what = match words {
        ["ascii", "1.0"] => return Ok(Format::Ascii),
        ["binary_little_endian", "1.0"] => return Ok(Format::Little),
        ["binary_big_endian", "1.0"] => return Ok(Format::Big),
        [name, "1.0"] => {
            let error = bad(format!("unknown PLY format `{}`", shorten(name)), "");
            return Err(error.suggest(nearest(name, NAMES)));
        }
        [_, version, ..] => format!(
            "is of version `{}`, which is not supported",
            shorten(version)
        ),
        [] | [_] => "has no version".to_owned(),
    };
    let label = "expected `format`, one of `ascii`, `binary_little_endian` and \
                 `binary_big_endian`, and the version `1.0`";
    Err(bad(format!("the `format` of the PLY file {what}"), label))
}

/// Reads the name and the number of rows of an element, which must not be described before.
fn parse_element(before: &[Element], name: &str, count: &str, bad: Bad<'_>) -> Result<Element> {
    if before.iter().any(|e| e.name == name) {
        let message = format!("element `{}` is described twice", shorten(name));
        return Err(bad(message, "the second time"));
    }
    let what = || format!("`{}` is not a number of rows", shorten(count));
    Ok(Element {
        name: name.to_owned(),
        count: count.parse().map_err(|_| bad(what(), "expected a count"))?,
        properties: Vec::new(),
    })
}

/// Reads the words after `property`.
fn parse_property(words: &[&str]) -> std::result::Result<Property, String> {
    let (length, item, name) = match words {
        ["list", length, item, name] => (Some(Scalar::named(length)?), item, name),
        [item, name] => (None, item, name),
        _ => return Err("expected `property TYPE NAME` or `property list TYPE TYPE NAME`".into()),
    };
    if length.is_some_and(Scalar::is_float) {
        return Err("the length of a list must be an integer".into());
    }
    let (name, item) = ((*name).to_owned(), Scalar::named(item)?);
    Ok(Property { name, length, item })
}

/// Returns the line that begins at `at` and ends in LF, CR LF or CR, and moves `at` to the next
/// line.
fn next_line(source: &Source, at: &mut usize) -> Span {
    let rest = &source.bytes()[*at..];
    // Do not search a binary file without line ends to its end: lines of a header are short.
    let mut window = rest.iter().take(1 << 16);
    let length = window.position(|b| matches!(b, b'\n' | b'\r'));
    let span = Span::new(*at, *at + length.unwrap_or(rest.len()));
    *at = span.end
        + match &source.bytes()[span.end..] {
            [] => 0,
            [b'\r', b'\n', ..] => 2,
            [_, ..] => 1,
        };
    span
}

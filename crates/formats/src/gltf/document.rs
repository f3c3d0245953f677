//! The JSON of a glTF file, with the position of every value.
//!
//! The lists at the top level are read at once, and their elements when they are needed. Until then
//! an element is a slice of the file's text, whose address gives its position for messages.

use linelit_assembly::{ErrorKind, Location, Result, SceneError, Source, Span, shorten};
use serde::Deserialize;
use serde_json::error::Category;
use serde_json::value::RawValue;
use std::collections::HashMap;
use std::ops::Range;

/// A value of the file as text, which has not been parsed yet.
pub(super) type Raw<'a> = &'a RawValue;

/// The members of the root object of the file.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Lists<'a> {
    #[serde(borrow)]
    pub(super) accessors: Vec<Raw<'a>>,
    pub(super) animations: Vec<Raw<'a>>,
    pub(super) asset: Option<Raw<'a>>,
    pub(super) buffer_views: Vec<Raw<'a>>,
    pub(super) buffers: Vec<Raw<'a>>,
    pub(super) cameras: Vec<Raw<'a>>,
    pub(super) extensions: HashMap<String, Raw<'a>>,
    pub(super) extensions_required: Vec<Raw<'a>>,
    pub(super) extensions_used: Vec<Raw<'a>>,
    pub(super) images: Vec<Raw<'a>>,
    pub(super) materials: Vec<Raw<'a>>,
    pub(super) meshes: Vec<Raw<'a>>,
    pub(super) nodes: Vec<Raw<'a>>,
    pub(super) samplers: Vec<Raw<'a>>,
    pub(super) scene: Option<Raw<'a>>,
    pub(super) scenes: Vec<Raw<'a>>,
    pub(super) skins: Vec<Raw<'a>>,
    pub(super) textures: Vec<Raw<'a>>,
}

/// The lists whose elements other values refer to by index.
#[derive(Clone, Copy)]
pub(super) enum List {
    Accessors,
    BufferViews,
    Buffers,
    Cameras,
    Images,
    Materials,
    Meshes,
    Nodes,
    Samplers,
    Scenes,
    Textures,
}

/// The document and its text.
pub(super) struct Document<'a> {
    pub(super) source: &'a Source,
    pub(super) lists: Lists<'a>,
}

impl<'a> Document<'a> {
    /// Parses the top level of a file's JSON.
    pub(super) fn new(source: &'a Source) -> Result<Self> {
        let bytes = source.bytes();
        let start = if bytes.starts_with(b"\xef\xbb\xbf") {
            3
        } else {
            0
        };
        // Cut off padding: GLB pads its JSON with blanks, but some writers use zeros.
        let end = bytes.iter().rposition(|b| *b != 0).map_or(start, |k| k + 1);
        let text = &bytes[start.min(end)..end];
        let first = text.iter().position(|b| !b.is_ascii_whitespace());
        // Refuse anything but an object: serde would read an array as the values of the fields.
        if let Some(k) = first.filter(|k| text[*k] != b'{') {
            let at = source.at(Span::new(start + k, start + k + 1));
            return Err(at.error(
                ErrorKind::Syntax,
                "the file is no JSON object",
                "expected `{`",
            ));
        }
        let lists = serde_json::from_slice(text).map_err(|e| malformed(source, start, text, &e))?;
        Ok(Self { source, lists })
    }

    /// Returns the name of a list in the file, and its elements.
    fn list(&self, list: List) -> (&'static str, &[Raw<'a>]) {
        let lists = &self.lists;
        match list {
            List::Accessors => ("accessors", &lists.accessors),
            List::BufferViews => ("bufferViews", &lists.buffer_views),
            List::Buffers => ("buffers", &lists.buffers),
            List::Cameras => ("cameras", &lists.cameras),
            List::Images => ("images", &lists.images),
            List::Materials => ("materials", &lists.materials),
            List::Meshes => ("meshes", &lists.meshes),
            List::Nodes => ("nodes", &lists.nodes),
            List::Samplers => ("samplers", &lists.samplers),
            List::Scenes => ("scenes", &lists.scenes),
            List::Textures => ("textures", &lists.textures),
        }
    }

    /// Returns the element with this index of a list. The object `from` refers to the element under
    /// a key, which messages name if there is no such element.
    pub(super) fn element(
        &self,
        list: List,
        index: usize,
        from: Raw<'a>,
        key: &str,
    ) -> Result<Raw<'a>> {
        let (name, list) = self.list(list);
        list.get(index).copied().ok_or_else(|| {
            let message = format!("`{key}` refers to number {index} of `{name}`");
            let label = format!("there are {}, counted from 0", list.len());
            self.error(ErrorKind::BadMesh, message, self.find(from, &[key]), &label)
        })
    }

    /// Returns the element of a list at an index that is known to exist.
    pub(super) fn known(&self, list: List, index: usize) -> Raw<'a> {
        self.list(list).1[index]
    }

    /// Parses a value.
    pub(super) fn read<T: Deserialize<'a>>(&self, raw: Raw<'a>) -> Result<T> {
        let text = raw.get();
        serde_json::from_str(text)
            .map_err(|e| malformed(self.source, self.span(raw).start, text.as_bytes(), &e))
    }

    /// Returns the value inside another at a path of keys; if a key is missing, the last value on
    /// the path that exists.
    pub(super) fn find(&self, raw: Raw<'a>, path: &[&str]) -> Raw<'a> {
        let step = |raw, key: &&str| self.get(raw, key).ok_or(raw);
        path.iter().try_fold(raw, step).unwrap_or_else(|last| last)
    }

    /// Returns the value of a key, if `raw` is an object that has this key.
    pub(super) fn get(&self, raw: Raw<'a>, key: &str) -> Option<Raw<'a>> {
        let object = serde_json::from_str::<HashMap<String, Raw<'a>>>(raw.get());
        object.ok()?.remove(key)
    }

    /// Returns the extensions of a value by their names.
    pub(super) fn extensions(&self, raw: Raw<'a>) -> HashMap<String, Raw<'a>> {
        let extensions = self.get(raw, "extensions");
        let named = extensions.and_then(|raw| serde_json::from_str(raw.get()).ok());
        named.unwrap_or_default()
    }

    /// Returns the position of a value in the file.
    fn span(&self, raw: Raw<'a>) -> Span {
        let text = raw.get();
        let start = text.as_ptr() as usize - self.source.bytes().as_ptr() as usize;
        Span::new(start, start + text.len())
    }

    /// Returns the location of a value, for messages.
    pub(super) fn at(&self, raw: Raw<'a>) -> Location<'a> {
        self.source.at(self.span(raw))
    }

    /// Returns the location of the first character of a long value, for messages.
    pub(super) fn at_start(&self, raw: Raw<'a>) -> Location<'a> {
        let start = self.span(raw).start;
        self.source.at(Span::new(start, start + 1))
    }

    /// Returns an error that points at a value.
    pub(super) fn error(
        &self,
        kind: ErrorKind,
        message: impl Into<String>,
        raw: Raw<'a>,
        label: &str,
    ) -> SceneError {
        self.at(raw).error(kind, message, label)
    }

    /// Unwraps the value of a key that has to exist in the object `raw`.
    pub(super) fn require<T>(&self, value: Option<T>, raw: Raw<'a>, key: &str) -> Result<T> {
        value.ok_or_else(|| {
            let message = format!("`{key}` is missing");
            self.error(ErrorKind::MissingParameter, message, raw, "in this object")
        })
    }
}

/// Converts an error of serde_json to one with the position in the file. `text` is the part of the
/// file that was parsed, and begins at `start`.
fn malformed(source: &Source, start: usize, text: &[u8], error: &serde_json::Error) -> SceneError {
    // Find the offset from the line and the column, and take the position off the message.
    let line_start: usize = text
        .split_inclusive(|b| *b == b'\n')
        .take(error.line().saturating_sub(1))
        .map(<[u8]>::len)
        .sum();
    // Columns count bytes from one; of the end of a line, zero.
    let at = (line_start + error.column().saturating_sub(1)).min(text.len());
    let whole = error.to_string();
    let said = whole
        .rsplit_once(" at line ")
        .map_or(&*whole, |(said, _)| said);
    // Choose message and position by the kind of the error.
    let point = |at: usize| Span::new(start + at, start + at + 1);
    let (kind, message, label, span) = match error.classify() {
        Category::Eof => (
            ErrorKind::Syntax,
            "the JSON ends early".to_owned(),
            said,
            point(at),
        ),
        Category::Syntax if said.starts_with("recursion limit") => {
            let message = "the JSON is nested too deeply".to_owned();
            (ErrorKind::Limit, message, "one level too many", point(at))
        }
        Category::Syntax | Category::Io => {
            let message = format!("the JSON is broken: {said}");
            (ErrorKind::Syntax, message, "here", point(at))
        }
        Category::Data => {
            // Point at the whole value that has the wrong type or misses a field.
            let value = value_around(text, at);
            if let Some(field) = said.strip_prefix("missing field ") {
                let message = format!("{field} is missing");
                let place = point(value.start);
                (
                    ErrorKind::MissingParameter,
                    message,
                    "in this object",
                    place,
                )
            } else {
                let message = match key_of(&text[..value.start]) {
                    Some(key) => format!("`{key}`: {said}"),
                    None => said.to_owned(),
                };
                let place = Span::new(start + value.start, start + value.end);
                (
                    ErrorKind::BadParameter,
                    message,
                    "not what glTF has here",
                    place,
                )
            }
        }
    };
    source.error(kind, message, span, label)
}

/// Returns the range of the JSON value in which the parser reported an error. `at` is on the last
/// byte of the value or, for numbers and words, just before or after it; for an object or an array
/// it may also be the first byte.
fn value_around(text: &[u8], at: usize) -> Range<usize> {
    // Skip blanks, and find the bracket or quote that opens the value which ends here.
    let blanks = text[at..]
        .iter()
        .take_while(|b| b.is_ascii_whitespace())
        .count();
    let at = at + blanks;
    let before = &text[..at];
    let opened = |open: u8, close: u8| {
        let mut depth = 0_usize;
        before.iter().rposition(|b| {
            depth += usize::from(*b == close);
            let found = *b == open && depth == 0;
            depth -= usize::from(*b == open && depth > 0);
            found
        })
    };
    let first = match text.get(at) {
        Some(b'}') => opened(b'{', b'}'),
        Some(b']') => opened(b'[', b']'),
        Some(b'"') => before.iter().rposition(|b| *b == b'"'),
        Some(b'{' | b'[') => Some(at),
        _ => before
            .iter()
            .rposition(|b| !b.is_ascii_alphanumeric() && !b"+-.".contains(b))
            .map(|k| k + 1),
    };
    // Parse the value from there on, to find its end.
    let first = first.unwrap_or(0);
    let mut values = serde_json::Deserializer::from_slice(&text[first..]).into_iter::<Raw<'_>>();
    let length = values
        .next()
        .and_then(|v| v.ok())
        .map_or(1, |value| value.get().len());
    first..first + length
}

/// Returns the key of a value, if the text before the value ends in one.
fn key_of(before: &[u8]) -> Option<String> {
    let before = before.trim_ascii_end().strip_suffix(b":")?.trim_ascii_end();
    let name = before.strip_suffix(b"\"")?;
    let first = name.iter().rposition(|b| *b == b'"')? + 1;
    Some(shorten(&String::from_utf8_lossy(&name[first..])))
}

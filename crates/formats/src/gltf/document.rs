//! The JSON of a glTF file, with the place of every value.
//!
//! The lists at the top are read at once, their elements when they are asked for: until then they
//! are text, whose address tells where in the file they stand.

use linelit_assembly::{ErrorKind, Location, Result, SceneError, Source, Span, shorten};
use serde::Deserialize;
use serde_json::error::Category;
use serde_json::value::RawValue;
use std::collections::HashMap;
use std::ops::Range;

/// A value of the file, not taken apart.
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

/// The lists that others refer to by number.
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
    pub(super) fn new(source: &'a Source) -> Result<Self> {
        let bytes = source.bytes();
        let start = if bytes.starts_with(b"\xef\xbb\xbf") {
            3
        } else {
            0
        };
        // GLB pads its JSON with blanks, some writers with zeros.
        let end = bytes.iter().rposition(|b| *b != 0).map_or(start, |k| k + 1);
        let text = &bytes[start.min(end)..end];
        let first = text.iter().position(|b| !b.is_ascii_whitespace());
        // The reader would take an array for the values of its fields.
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

    /// An element of a list, which `from` names under a key.
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

    /// An element of a list that has been asked for before.
    pub(super) fn known(&self, list: List, index: usize) -> Raw<'a> {
        self.list(list).1[index]
    }

    /// Takes a value apart.
    pub(super) fn read<T: Deserialize<'a>>(&self, raw: Raw<'a>) -> Result<T> {
        let text = raw.get();
        serde_json::from_str(text)
            .map_err(|e| malformed(self.source, self.span(raw).start, text.as_bytes(), &e))
    }

    /// A value within another, by keys; where the file does not have it, the last that it has.
    pub(super) fn find(&self, raw: Raw<'a>, path: &[&str]) -> Raw<'a> {
        let step = |raw, key: &&str| self.get(raw, key).ok_or(raw);
        path.iter().try_fold(raw, step).unwrap_or_else(|last| last)
    }

    /// The value of a key, if the value is an object that has it.
    pub(super) fn get(&self, raw: Raw<'a>, key: &str) -> Option<Raw<'a>> {
        let object = serde_json::from_str::<HashMap<String, Raw<'a>>>(raw.get());
        object.ok()?.remove(key)
    }

    /// The extensions of a value by their names.
    pub(super) fn extensions(&self, raw: Raw<'a>) -> HashMap<String, Raw<'a>> {
        let extensions = self.get(raw, "extensions");
        let named = extensions.and_then(|raw| serde_json::from_str(raw.get()).ok());
        named.unwrap_or_default()
    }

    /// The place of a value.
    fn span(&self, raw: Raw<'a>) -> Span {
        let text = raw.get();
        let start = text.as_ptr() as usize - self.source.bytes().as_ptr() as usize;
        Span::new(start, start + text.len())
    }

    /// A value, to point at.
    pub(super) fn at(&self, raw: Raw<'a>) -> Location<'a> {
        self.source.at(self.span(raw))
    }

    /// The start of a long value, to point at.
    pub(super) fn at_start(&self, raw: Raw<'a>) -> Location<'a> {
        let start = self.span(raw).start;
        self.source.at(Span::new(start, start + 1))
    }

    /// An error at a value.
    pub(super) fn error(
        &self,
        kind: ErrorKind,
        message: impl Into<String>,
        raw: Raw<'a>,
        label: &str,
    ) -> SceneError {
        self.at(raw).error(kind, message, label)
    }

    /// Something that has to be there.
    pub(super) fn require<T>(&self, value: Option<T>, raw: Raw<'a>, key: &str) -> Result<T> {
        value.ok_or_else(|| {
            let message = format!("`{key}` is missing");
            self.error(ErrorKind::MissingParameter, message, raw, "in this object")
        })
    }
}

/// Adds its place to an error of the JSON reader, in a piece of the file that begins at `start`.
fn malformed(source: &Source, start: usize, text: &[u8], error: &serde_json::Error) -> SceneError {
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

/// The value whose end, or whose last byte before, the reader was at.
fn value_around(text: &[u8], at: usize) -> Range<usize> {
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
    let first = first.unwrap_or(0);
    let mut values = serde_json::Deserializer::from_slice(&text[first..]).into_iter::<Raw<'_>>();
    let length = values
        .next()
        .and_then(|v| v.ok())
        .map_or(1, |value| value.get().len());
    first..first + length
}

/// The key that stands before a value.
fn key_of(before: &[u8]) -> Option<String> {
    let before = before.trim_ascii_end().strip_suffix(b":")?.trim_ascii_end();
    let name = before.strip_suffix(b"\"")?;
    let first = name.iter().rposition(|b| *b == b'"')? + 1;
    Some(shorten(&String::from_utf8_lossy(&name[first..])))
}

//! Opening files (all that a scene is made of are opened here), their text, and places in it.
#![allow(
    clippy::disallowed_methods,
    reason = "the files that scenes are read from"
)]

use super::error::{ErrorKind, Result, SceneError};
use crate::options::{LoadOptions, Root};
use std::collections::BTreeMap;
use std::fs::{self, File, Metadata};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Why the system did not read a file; the place is for those to add who know who names it.
fn refused(error: &io::Error) -> SceneError {
    let message = match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        _ => error.to_string(),
    };
    SceneError::new(ErrorKind::Io, message)
}

/// The bytes of a regular file of at most `limit` bytes.
fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let check = |found: &Metadata| {
        if found.is_dir() {
            return Err(SceneError::new(ErrorKind::Io, "it is a folder"));
        }
        if !found.is_file() {
            let message = "it is a pipe, a socket or a device, not a regular file";
            return Err(SceneError::new(ErrorKind::Io, message));
        }
        within(found.len(), limit)
    };
    // Asked before the file is opened, because opening a pipe waits for its writer; and again of
    // what has been opened, because names can change hands.
    check(&fs::metadata(path).map_err(|e| refused(&e))?)?;
    let file = File::open(path).map_err(|e| refused(&e))?;
    let found = file.metadata().map_err(|e| refused(&e))?;
    check(&found)?;
    let mut bytes = Vec::new();
    let size = usize::try_from(found.len()).unwrap_or(usize::MAX);
    if bytes.try_reserve_exact(size).is_err() {
        let message = format!("its {size} bytes do not fit into memory");
        return Err(SceneError::new(ErrorKind::Limit, message));
    }
    // Some files are longer than they say.
    let mut file = file.take(limit.saturating_add(1));
    file.read_to_end(&mut bytes).map_err(|e| refused(&e))?;
    within(bytes.len() as u64, limit)?;
    Ok(bytes)
}

fn within(bytes: u64, limit: u64) -> Result<()> {
    if bytes <= limit {
        return Ok(());
    }
    let message = format!("it has {bytes} bytes or more, {limit} are allowed");
    Err(SceneError::new(ErrorKind::Limit, message))
}

/// The files that a scene names: where they are looked up, where they must lie, how long they may
/// be.
#[derive(Clone, Debug)]
pub(crate) struct Files {
    /// The folder that relative names start from.
    folder: PathBuf,
    /// The folder that must hold them, links followed, and what messages call it; `None`: any.
    root: Option<(PathBuf, String)>,
    /// The files in memory, in place of all folders.
    memory: Option<Arc<BTreeMap<String, Vec<u8>>>>,
    max_bytes: u64,
}

impl Files {
    /// Creates the files of the scene in the file at `path`, or in memory.
    pub(crate) fn new(path: Option<&Path>, options: &LoadOptions) -> Self {
        let folder = path.and_then(Path::parent).unwrap_or(Path::new(""));
        let mut memory = None;
        let root = match &options.root {
            Root::Anywhere => None,
            Root::Memory(files) => {
                memory = Some(Arc::clone(files));
                None
            }
            Root::SceneFolder => Some((folder, "the scene's folder".to_owned())),
            Root::Folder(root) => Some((root.as_path(), format!("`{}`", root.display()))),
        };
        let root = root.map(|(root, shown)| {
            let named = if root.as_os_str().is_empty() {
                Path::new(".")
            } else {
                root
            };
            // A folder that cannot be found holds no file.
            let whole = named.canonicalize().unwrap_or_else(|_| named.to_owned());
            (whole, shown)
        });
        Self {
            folder: folder.to_owned(),
            root,
            memory,
            max_bytes: options.max_file_bytes,
        }
    }

    /// The path of a file by its name in the scene, and the same with links followed; refused
    /// outside of the root, whether or not there is such a file. The backslashes of a name that is
    /// not there are those of Windows: slashes.
    pub(crate) fn find(&self, name: &str) -> Result<(PathBuf, PathBuf)> {
        let found = self.find_exactly(name);
        if found.is_err() && name.contains('\\') {
            return self.find_exactly(&name.replace('\\', "/"));
        }
        found
    }

    fn find_exactly(&self, name: &str) -> Result<(PathBuf, PathBuf)> {
        if let Some(files) = &self.memory {
            let there = files.contains_key(name).then(|| PathBuf::from(name));
            let absent = || refused(&io::ErrorKind::NotFound.into());
            return there.map(|p| (p.clone(), p)).ok_or_else(absent);
        }
        let path = self.folder.join(name);
        let found = path.canonicalize();
        if let Some((root, shown)) = &self.root {
            let inside = match &found {
                Ok(whole) => whole.starts_with(root),
                Err(_) => where_it_would_be(&path).starts_with(root),
            };
            if !inside {
                let message = format!("it lies outside of {shown}");
                return Err(SceneError::new(ErrorKind::Outside, message));
            }
        }
        let whole = found.map_err(|e| refused(&e))?;
        Ok((path, whole))
    }

    /// The bytes of a file that [`Files::find`] has found.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>> {
        let Some(files) = &self.memory else {
            return read(path, self.max_bytes);
        };
        let found = path.to_str().and_then(|name| files.get(name));
        let bytes = found.ok_or_else(|| refused(&io::ErrorKind::NotFound.into()))?;
        within(bytes.len() as u64, self.max_bytes)?;
        Ok(bytes.clone())
    }

    /// Whether there is such a file, a regular one, and the scene may name it.
    pub(crate) fn has(&self, name: &str) -> bool {
        let found = self.find(name);
        found.is_ok_and(|(_, whole)| self.memory.is_some() || whole.is_file())
    }
}

/// Returns where a file that cannot be found would be: links of the existing folders are followed,
/// and the rest of the name is taken literally.
fn where_it_would_be(path: &Path) -> PathBuf {
    use std::path::Component;
    // Without a folder of its own, a name begins in the current one.
    let path = Path::new(".").join(path);
    let there = path.ancestors().find_map(|folder| {
        let whole = folder.canonicalize().ok()?;
        Some((whole, path.strip_prefix(folder).ok()?))
    });
    let Some((mut whole, rest)) = there else {
        return path;
    };
    for part in rest.components() {
        match part {
            Component::ParentDir => drop(whole.pop()),
            Component::CurDir => {}
            Component::Normal(_) | Component::RootDir | Component::Prefix(_) => whole.push(part),
        }
    }
    whole
}

/// A half-open range of bytes in a [`Source`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// The offset of the first byte.
    pub start: usize,
    /// The byte behind its last.
    pub end: usize,
}

impl Span {
    /// Creates the span from a byte to before another.
    pub const fn new(start: usize, end: usize) -> Self {
        Self { start, end }
    }

    /// Returns the span from the start of `self` to the end of `other`.
    pub const fn to(self, other: Self) -> Self {
        Self::new(self.start, other.end)
    }
}

/// One file in memory, with its name for messages.
#[derive(Debug)]
pub struct Source {
    name: Arc<str>,
    bytes: Vec<u8>,
    line_starts: OnceLock<Vec<usize>>,
}

/// The location that a message points at; the line is only looked for when there is a message.
#[derive(Clone, Copy, Debug)]
pub struct Location<'a>(Within<'a>);

#[derive(Clone, Copy, Debug)]
enum Within<'a> {
    File(&'a Source),
    Byte(&'a Source, usize),
    Text(&'a Source, Span),
}

impl Location<'_> {
    /// An error there; the label stands beside the caret.
    pub fn error(
        self,
        kind: ErrorKind,
        message: impl Into<String>,
        label: impl Into<String>,
    ) -> SceneError {
        SceneError::new(kind, message).at(self, label)
    }

    /// Returns the place for a message.
    pub(crate) fn place(self) -> Place {
        let (source, position) = match self.0 {
            Within::File(source) => (source, Position::File),
            Within::Byte(source, offset) => (source, Position::Byte(offset)),
            Within::Text(source, span) => {
                (source, Position::Text(Box::new(source.text_place(span))))
            }
        };
        let file = Arc::clone(&source.name);
        Place { file, position }
    }
}

/// The place that a message points at: a file and, if known, a place in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) file: Arc<str>,
    pub(crate) position: Position,
}

/// The place within a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Position {
    /// The file as a whole.
    File,
    /// A byte of a binary file.
    Byte(usize),
    /// A stretch of a line of text.
    Text(Box<TextPlace>),
}

/// A stretch of a line of text, cut to what a terminal shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TextPlace {
    /// Counted from one.
    pub(crate) line: usize,
    /// Characters, counted from one.
    pub(crate) column: usize,
    /// The line, or the part of it around the caret.
    pub(crate) excerpt: String,
    /// Characters of the excerpt before the caret.
    pub(crate) indent: usize,
    /// Characters under the caret, at least one.
    pub(crate) width: usize,
}

/// Characters of a line that are shown before and after the caret.
const SHOWN_BEFORE: usize = 40;
const SHOWN_AFTER: usize = 60;

impl Source {
    /// The file that a scene is read from; `name` is its path.
    ///
    /// # Errors
    /// When it is no regular file, longer than allowed, or cannot be read.
    pub fn open(path: &Path, options: &LoadOptions) -> Result<Arc<Self>> {
        let name = path.display().to_string();
        match read(path, options.max_file_bytes) {
            Ok(bytes) => Ok(Self::new(name, bytes)),
            Err(error) => {
                let message = format!("cannot read the scene: {}", error.message());
                Err(SceneError::new(error.kind(), message).in_file(&name))
            }
        }
    }

    /// Bytes, and what messages call them.
    pub fn new(name: impl Into<Arc<str>>, bytes: Vec<u8>) -> Arc<Self> {
        Arc::new(Self {
            name: name.into(),
            bytes,
            line_starts: OnceLock::new(),
        })
    }

    /// Returns the name used in messages.
    pub fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// Returns all bytes of the file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The text under a span, with bytes that are not UTF-8 replaced.
    pub fn text(&self, span: Span) -> String {
        let end = span.end.min(self.bytes.len());
        String::from_utf8_lossy(&self.bytes[span.start.min(end)..end]).into_owned()
    }

    /// An error about the text under a span; the label stands beside the caret.
    pub fn error(
        &self,
        kind: ErrorKind,
        message: impl Into<String>,
        span: Span,
        label: impl Into<String>,
    ) -> SceneError {
        self.at(span).error(kind, message, label)
    }

    /// The text under a span, to point at.
    pub const fn at(&self, span: Span) -> Location<'_> {
        Location(Within::Text(self, span))
    }

    /// A byte of a binary file, to point at.
    pub const fn at_byte(&self, offset: usize) -> Location<'_> {
        Location(Within::Byte(self, offset))
    }

    /// The file, to point at as a whole.
    pub const fn whole(&self) -> Location<'_> {
        Location(Within::File(self))
    }

    /// `file:line:column` of the start of a span.
    pub fn short(&self, span: Span) -> String {
        let (line, start) = self.line_of(span.start);
        let column = char_count(&self.bytes[start..span.start.min(self.bytes.len())]) + 1;
        format!("{}:{}:{}", self.name, line, column)
    }

    /// Line number (from one) and the offset of its first byte.
    fn line_of(&self, offset: usize) -> (usize, usize) {
        let offset = offset.min(self.bytes.len());
        let starts = self.line_starts.get_or_init(|| {
            let newlines = self.bytes.iter().enumerate().filter(|(_, b)| **b == b'\n');
            std::iter::once(0)
                .chain(newlines.map(|(i, _)| i + 1))
                .collect()
        });
        let line = starts.partition_point(|s| *s <= offset);
        (line, starts[line - 1])
    }

    fn text_place(&self, span: Span) -> TextPlace {
        let start = span.start.min(self.bytes.len());
        let (line, line_start) = self.line_of(start);
        let line_end = self.bytes[line_start..]
            .iter()
            .position(|b| *b == b'\n')
            .map_or(self.bytes.len(), |n| line_start + n);
        let start = start.min(line_end);
        let column = char_count(&self.bytes[line_start..start]);
        // A character has at most four bytes, so these windows hold enough of the line.
        let from = line_start.max(start.saturating_sub(4 * SHOWN_BEFORE));
        let to = line_end.min(start + 4 * SHOWN_AFTER);
        let before: Vec<char> = clean(&self.bytes[from..start]);
        let after: Vec<char> = clean(&self.bytes[start..to]);
        let cut_before = before.len().saturating_sub(SHOWN_BEFORE);
        let mut excerpt = String::new();
        if cut_before > 0 || from > line_start {
            excerpt.push('…');
        }
        excerpt.extend(&before[cut_before..]);
        let indent = excerpt.chars().count();
        excerpt.extend(after.iter().take(SHOWN_AFTER));
        let shown = excerpt.trim_end().chars().count().max(indent);
        let mut excerpt: String = excerpt.chars().take(shown).collect();
        if after.len() > SHOWN_AFTER || to < line_end {
            excerpt.push('…');
        }
        let end = span.end.clamp(start, line_end);
        let width = char_count(&self.bytes[start..end.min(to)]);
        TextPlace {
            line,
            column: column + 1,
            excerpt,
            indent,
            width: width.clamp(1, (shown - indent).max(1)),
        }
    }
}

fn char_count(bytes: &[u8]) -> usize {
    String::from_utf8_lossy(bytes).chars().count()
}

/// The characters of a piece of a line, with control characters shown as blanks so that the
/// caret stays under its text.
fn clean(bytes: &[u8]) -> Vec<char> {
    String::from_utf8_lossy(bytes)
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_from_one_and_in_characters() {
        let s = Source::new("f", "ab\n\tä x\n".as_bytes().to_vec());
        let offset = "ab\n\tä ".len();
        assert_eq!(s.short(Span::new(offset, offset + 1)), "f:2:4");
        assert_eq!(s.short(Span::new(0, 1)), "f:1:1");
        assert_eq!(s.short(Span::new(999, 1000)), "f:3:1");
    }

    #[test]
    fn long_lines_are_cut_around_the_caret() {
        let text = format!("{}HERE{}", "a ".repeat(300), " b".repeat(300));
        let s = Source::new("f", text.into_bytes());
        let place = s.text_place(Span::new(600, 604));
        assert_eq!(place.column, 601);
        assert!(place.excerpt.chars().count() <= SHOWN_BEFORE + SHOWN_AFTER + 2);
        let caret: String = place
            .excerpt
            .chars()
            .skip(place.indent)
            .take(place.width)
            .collect();
        assert_eq!(caret, "HERE");
    }
}

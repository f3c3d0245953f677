//! The opening of files, their text, and positions in it. All files of a scene are opened here, so
//! that limits and the rule where files have to be hold for each of them.
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

/// Returns the error of the system when it could not read a file. The caller adds the location
/// where the file is named.
fn refused(error: &io::Error) -> SceneError {
    let message = match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        _ => error.to_string(),
    };
    SceneError::new(ErrorKind::Io, message)
}

/// Reads a regular file of at most `limit` bytes.
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
    // Check the file before it is opened, because opening a pipe waits for its writer; and again
    // after that, because the name may refer to another file by then.
    check(&fs::metadata(path).map_err(|e| refused(&e))?)?;
    let file = File::open(path).map_err(|e| refused(&e))?;
    let found = file.metadata().map_err(|e| refused(&e))?;
    check(&found)?;
    // Read at most the limit, as some files are longer than the system reports.
    let mut bytes = Vec::new();
    let size = usize::try_from(found.len()).unwrap_or(usize::MAX);
    if bytes.try_reserve_exact(size).is_err() {
        let message = format!("its {size} bytes do not fit into memory");
        return Err(SceneError::new(ErrorKind::Limit, message));
    }
    let mut file = file.take(limit.saturating_add(1));
    file.read_to_end(&mut bytes).map_err(|e| refused(&e))?;
    within(bytes.len() as u64, limit)?;
    Ok(bytes)
}

/// Refuses a file with more bytes than the limit.
fn within(bytes: u64, limit: u64) -> Result<()> {
    if bytes <= limit {
        return Ok(());
    }
    let message = format!("it has {bytes} bytes or more, {limit} are allowed");
    Err(SceneError::new(ErrorKind::Limit, message))
}

/// The files that a scene may name: the folder in which they are looked up, the folder in which
/// they have to be, and the largest length.
#[derive(Clone, Debug)]
pub(crate) struct Files {
    /// The folder to which names are relative.
    folder: PathBuf,
    /// The folder in which the files have to be after symbolic links, and its name in messages;
    /// `None` if they may be anywhere.
    root: Option<(PathBuf, String)>,
    /// The files in memory, if they replace all files on disks.
    memory: Option<Arc<BTreeMap<String, Vec<u8>>>>,
    max_bytes: u64,
}

impl Files {
    /// Returns the files of the scene at `path`, or of a scene in memory.
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
            // If the folder does not exist, no file is in it.
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

    /// Returns the path of a file by its name in the scene, before and after symbolic links. A file
    /// outside of the root is refused, whether or not it exists. If there is no file of the name,
    /// its backslashes are read as slashes, as in names from Windows.
    pub(crate) fn find(&self, name: &str) -> Result<(PathBuf, PathBuf)> {
        let found = self.find_exactly(name);
        if found.is_err() && name.contains('\\') {
            return self.find_exactly(&name.replace('\\', "/"));
        }
        found
    }

    /// Does the work of [`Files::find`] for the name without changes.
    fn find_exactly(&self, name: &str) -> Result<(PathBuf, PathBuf)> {
        // Look it up in memory.
        if let Some(files) = &self.memory {
            let there = files.contains_key(name).then(|| PathBuf::from(name));
            let absent = || refused(&io::ErrorKind::NotFound.into());
            return there.map(|p| (p.clone(), p)).ok_or_else(absent);
        }
        // Look it up on the disk, and check that it is inside the root.
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

    /// Returns the bytes of a file that [`Files::find`] has found.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>> {
        let Some(files) = &self.memory else {
            return read(path, self.max_bytes);
        };
        let found = path.to_str().and_then(|name| files.get(name));
        let bytes = found.ok_or_else(|| refused(&io::ErrorKind::NotFound.into()))?;
        within(bytes.len() as u64, self.max_bytes)?;
        Ok(bytes.clone())
    }

    /// Returns whether a regular file of this name exists, and the scene may name it.
    pub(crate) fn has(&self, name: &str) -> bool {
        let found = self.find(name);
        found.is_ok_and(|(_, whole)| self.memory.is_some() || whole.is_file())
    }
}

/// Returns the path at which a file that does not exist would be: symbolic links of existing
/// folders are followed, and the rest of the name is taken literally.
fn where_it_would_be(path: &Path) -> PathBuf {
    use std::path::Component;
    // Find the longest existing part. A name without a folder begins in the current one.
    let path = Path::new(".").join(path);
    let there = path.ancestors().find_map(|folder| {
        let whole = folder.canonicalize().ok()?;
        Some((whole, path.strip_prefix(folder).ok()?))
    });
    let Some((mut whole, rest)) = there else {
        return path;
    };
    // Append the rest.
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
    /// The offset after the last byte.
    pub end: usize,
}

impl Span {
    /// Returns the span from the byte `start` up to, but without, the byte `end`.
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
    /// The offsets at which lines begin, which are computed for the first message.
    line_starts: OnceLock<Vec<usize>>,
}

/// The location in a file that a message points at: the file as a whole, a byte, or a part of the
/// text. It is cheap to make; the line and the column are only computed for a message.
#[derive(Clone, Copy, Debug)]
pub struct Location<'a>(Within<'a>);

/// The kinds of locations.
#[derive(Clone, Copy, Debug)]
enum Within<'a> {
    File(&'a Source),
    Byte(&'a Source, usize),
    Text(&'a Source, Span),
}

impl Location<'_> {
    /// Creates an error at this location; the label is printed next to the caret.
    pub fn error(
        self,
        kind: ErrorKind,
        message: impl Into<String>,
        label: impl Into<String>,
    ) -> SceneError {
        SceneError::new(kind, message).at(self, label)
    }

    /// Returns the location with its line and column, for a message.
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

/// The location of a message: a file, and the position in it if that is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) file: Arc<str>,
    pub(crate) position: Position,
}

/// The position of a message in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Position {
    /// The file as a whole.
    File,
    /// A byte of a binary file.
    Byte(usize),
    /// A part of a line of text.
    Text(Box<TextPlace>),
}

/// A part of a line of text, with an excerpt that fits a terminal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TextPlace {
    /// The line, counted from one.
    pub(crate) line: usize,
    /// The column in characters, counted from one.
    pub(crate) column: usize,
    /// The line, or the part of it around the caret.
    pub(crate) excerpt: String,
    /// The number of characters of the excerpt before the caret.
    pub(crate) indent: usize,
    /// The number of characters under the caret, at least one.
    pub(crate) width: usize,
}

/// The largest number of characters of a line that are shown before the caret.
const SHOWN_BEFORE: usize = 40;
/// The largest number of characters of a line that are shown from the caret on.
const SHOWN_AFTER: usize = 60;

impl Source {
    /// Reads the file of a scene.
    ///
    /// # Errors
    /// The file is not a regular file, is longer than allowed, or cannot be read.
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

    /// Creates a file in memory of these bytes; `name` is the name of the file in messages.
    pub fn new(name: impl Into<Arc<str>>, bytes: Vec<u8>) -> Arc<Self> {
        Arc::new(Self {
            name: name.into(),
            bytes,
            line_starts: OnceLock::new(),
        })
    }

    /// Returns the name of the file that messages use.
    pub fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// Returns all bytes of the file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the text at a span, with bytes that are not UTF-8 replaced.
    pub fn text(&self, span: Span) -> String {
        let end = span.end.min(self.bytes.len());
        String::from_utf8_lossy(&self.bytes[span.start.min(end)..end]).into_owned()
    }

    /// Returns an error about the text at a span; the label is printed next to the caret.
    pub fn error(
        &self,
        kind: ErrorKind,
        message: impl Into<String>,
        span: Span,
        label: impl Into<String>,
    ) -> SceneError {
        self.at(span).error(kind, message, label)
    }

    /// Returns the location of the text at a span, for messages.
    pub const fn at(&self, span: Span) -> Location<'_> {
        Location(Within::Text(self, span))
    }

    /// Returns the location of a byte of a binary file, for messages.
    pub const fn at_byte(&self, offset: usize) -> Location<'_> {
        Location(Within::Byte(self, offset))
    }

    /// Returns the location of the file as a whole, for messages.
    pub const fn whole(&self) -> Location<'_> {
        Location(Within::File(self))
    }

    /// Returns the start of a span as `file:line:column`.
    pub fn short(&self, span: Span) -> String {
        let (line, start) = self.line_of(span.start);
        let column = char_count(&self.bytes[start..span.start.min(self.bytes.len())]) + 1;
        format!("{}:{}:{}", self.name, line, column)
    }

    /// Returns the number of the line of an offset (from one), and the offset of its first byte.
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

    /// Returns the line and the column of a span, with an excerpt of the line.
    fn text_place(&self, span: Span) -> TextPlace {
        // Find the line and the column.
        let start = span.start.min(self.bytes.len());
        let (line, line_start) = self.line_of(start);
        let line_end = self.bytes[line_start..]
            .iter()
            .position(|b| *b == b'\n')
            .map_or(self.bytes.len(), |n| line_start + n);
        let start = start.min(line_end);
        let column = char_count(&self.bytes[line_start..start]);
        // Take enough of the line before and after the caret: a character has at most four bytes.
        let from = line_start.max(start.saturating_sub(4 * SHOWN_BEFORE));
        let to = line_end.min(start + 4 * SHOWN_AFTER);
        let before: Vec<char> = clean(&self.bytes[from..start]);
        let after: Vec<char> = clean(&self.bytes[start..to]);
        // Shorten both parts, with ellipses where the line was cut off.
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
        // Underline the span as far as it is shown.
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

/// Returns the number of characters of a text, in which bytes that are not UTF-8 are replaced.
fn char_count(bytes: &[u8]) -> usize {
    String::from_utf8_lossy(bytes).chars().count()
}

/// Returns the characters of a part of a line. Control characters become blanks, so that the caret
/// is under its text.
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

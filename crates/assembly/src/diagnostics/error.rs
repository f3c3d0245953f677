//! What went wrong, where, and what to do about it.

use super::source::{Location, Place, Position};
use std::collections::HashMap;
use std::fmt;
use std::ops::Deref;

/// The result of a reader, or the error that ends it.
pub type Result<T> = std::result::Result<T, SceneError>;

/// The kind of an error or a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// A file could not be read.
    Io,
    /// A file lies outside of the folder whose files the scene may name.
    Outside,
    /// The text does not follow the grammar of its format.
    Syntax,
    /// A directive, parameter, material, texture or object that nobody defined.
    UnknownName,
    /// A parameter has another type or another number of values than it should have.
    BadParameter,
    /// A parameter that cannot be left out is missing.
    MissingParameter,
    /// A number is out of its range, or not finite.
    OutOfRange,
    /// Blocks that are not closed, or closed twice, or directives in the wrong place.
    Nesting,
    /// A transform that is singular or not finite.
    BadTransform,
    /// Vertices or indices of a mesh make no sense.
    BadMesh,
    /// A file ends before what its header promises.
    Truncated,
    /// A file that includes itself.
    Recursion,
    /// More triangles, nesting or pixels than the limits allow.
    Limit,
    /// Something that linelit does not support.
    Unsupported,
    /// Something that is allowed but probably not meant.
    Suspicious,
}

/// A scene could not be loaded.
///
/// `Display` prints it over several lines in the manner of rustc: the message, the file with line
/// and column, the line itself with a caret, and what to do.
///
/// ```
/// use linelit_assembly::{ErrorKind, SceneError, Source, Span};
///
/// let source = Source::new("demo.pbrt", "WorldBegin\nShpae \"sphere\"\n".into());
/// let error = SceneError::new(ErrorKind::UnknownName, "unknown directive `Shpae`")
///     .at(source.at(Span::new(11, 16)), "expected a directive")
///     .suggest(Some("Shape"));
/// assert_eq!((error.line(), error.column()), (Some(2), Some(1)));
/// assert_eq!(
///     error.to_string(),
///     "error: unknown directive `Shpae`
///  --> demo.pbrt:2:1
///   |
/// 2 | Shpae \"sphere\"
///   | ^^^^^ expected a directive
///   = help: did you mean `Shape`?"
/// );
/// ```
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct SceneError(Box<Diagnostic>);

/// Something in the file that is left out, replaced, or probably not meant: prints itself as a
/// [`SceneError`], and answers what that does.
#[derive(Clone, Debug)]
pub struct Warning {
    warning: SceneError,
    repeats: usize,
}

/// A message with its place.
#[derive(Clone, Debug)]
struct Diagnostic {
    severity: &'static str,
    kind: ErrorKind,
    message: String,
    place: Option<Place>,
    label: String,
    help: Option<String>,
    notes: Vec<String>,
}

impl SceneError {
    /// A message without a place.
    pub fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self(Box::new(Diagnostic {
            severity: "error",
            kind,
            message: message.into(),
            place: None,
            label: String::new(),
            help: None,
            notes: Vec::new(),
        }))
    }

    /// Points at a place; the label stands beside the caret.
    pub fn at(mut self, location: Location<'_>, label: impl Into<String>) -> Self {
        self.0.place = Some(location.place());
        self.0.label = label.into();
        self
    }

    /// Points at a file as a whole.
    pub fn in_file(mut self, name: &str) -> Self {
        self.0.place = Some(Place {
            file: name.into(),
            position: Position::File,
        });
        self
    }

    /// Adds advice on what to do about it, on a line of its own.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }

    /// A hint at the nearest known name, if there is one.
    pub fn suggest(self, nearest: Option<&str>) -> Self {
        match nearest {
            Some(name) => self.help(format!("did you mean `{name}`?")),
            None => self,
        }
    }

    /// Adds a note, on a line of its own.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.0.notes.push(note.into());
        self
    }

    fn with_severity(mut self, severity: &'static str) -> Self {
        self.0.severity = severity;
        self
    }

    /// Returns the kind of mistake.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// The message alone, on one line.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// The name of the file that it is in.
    pub fn file(&self) -> Option<&str> {
        self.0.place.as_ref().map(|p| &*p.file)
    }

    /// The line, counted from one; `None` for binary files.
    pub fn line(&self) -> Option<usize> {
        self.line_column().map(|p| p.0)
    }

    /// The column in characters, counted from one; `None` for binary files.
    pub fn column(&self) -> Option<usize> {
        self.line_column().map(|p| p.1)
    }

    fn line_column(&self) -> Option<(usize, usize)> {
        match &self.0.place.as_ref()?.position {
            Position::Text(text) => Some((text.line, text.column)),
            Position::File | Position::Byte(_) => None,
        }
    }
}

impl Warning {
    /// Returns the number of times that the same message came; the place is that of the first.
    pub fn repeats(&self) -> usize {
        self.repeats
    }
}

impl Deref for Warning {
    type Target = SceneError;

    fn deref(&self) -> &SceneError {
        &self.warning
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.warning)?;
        if self.repeats > 1 {
            write!(f, "\n  = note: {} times in all", self.repeats)?;
        }
        Ok(())
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.severity, self.message)?;
        let mut gutter = " ".to_owned();
        if let Some(place) = &self.place {
            match &place.position {
                Position::File => write!(f, "\n --> {}", place.file)?,
                Position::Byte(offset) => write!(f, "\n --> {}: byte {offset}", place.file)?,
                Position::Text(text) => {
                    let number = text.line.to_string();
                    gutter = " ".repeat(number.len());
                    write!(
                        f,
                        "\n{gutter}--> {}:{}:{}\n{gutter} |\n{number} | {}\n{gutter} | {}{}",
                        place.file,
                        text.line,
                        text.column,
                        text.excerpt,
                        " ".repeat(text.indent),
                        "^".repeat(text.width)
                    )?;
                    if !self.label.is_empty() {
                        write!(f, " {}", self.label)?;
                    }
                }
            }
        }
        if let Some(help) = &self.help {
            write!(f, "\n{gutter} = help: {help}")?;
        }
        for note in &self.notes {
            write!(f, "\n{gutter} = note: {note}")?;
        }
        Ok(())
    }
}

/// Collects warnings: the same message once, with a count, and no more than a readable number.
#[derive(Debug, Default)]
pub struct Warnings {
    strict: bool,
    list: Vec<Warning>,
    index: HashMap<String, usize>,
    more: usize,
}

/// Distinct warnings that are kept.
const MAX_WARNINGS: usize = 200;

impl Warnings {
    /// Creates an empty list; if `strict`, the first warning is an error.
    pub fn new(strict: bool) -> Self {
        Self {
            strict,
            ..Self::default()
        }
    }

    /// Records a warning whose place is only worked out when it is new; an error when strict.
    pub fn warn(
        &mut self,
        kind: ErrorKind,
        message: impl Into<String>,
        place: impl FnOnce(SceneError) -> SceneError,
    ) -> Result<()> {
        let message = message.into();
        if let Some(&i) = self.index.get(&message) {
            self.list[i].repeats += 1;
            return Ok(());
        }
        if self.list.len() >= MAX_WARNINGS {
            self.more += 1;
            return Ok(());
        }
        let warning = place(SceneError::new(kind, message.clone()));
        if self.strict {
            return Err(warning.note("warnings are errors with `strict`"));
        }
        self.index.insert(message, self.list.len());
        self.add(warning);
        Ok(())
    }

    fn add(&mut self, warning: SceneError) {
        self.list.push(Warning {
            warning: warning.with_severity("warning"),
            repeats: 1,
        });
    }

    pub(crate) fn into_list(mut self) -> Vec<Warning> {
        if self.more > 0 {
            let text = format!("{} more warnings are not shown", self.more);
            self.add(SceneError::new(ErrorKind::Suspicious, text));
        }
        self.list
    }
}

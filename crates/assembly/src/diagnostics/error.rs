//! What went wrong, where, and what to do about it.

use super::source::{Place, Position, Source, Span};
use std::fmt;

/// What a reader gives, or the error that ends it.
pub type Result<T> = std::result::Result<T, SceneError>;

/// What kind of thing an error or a warning is about.
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
///     .at(&source, Span::new(11, 16), "expected a directive")
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
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct SceneError(Box<Diagnostic>);

/// Something in the file that is left out, replaced, or probably not meant.
///
/// `Display` prints it as [`SceneError`] prints itself.
#[derive(Clone, Debug)]
pub struct Warning {
    diagnostic: Box<Diagnostic>,
    pub(crate) repeats: usize,
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

    /// Points at a stretch of text; the label stands beside the caret.
    pub fn at(mut self, source: &Source, span: Span, label: impl Into<String>) -> Self {
        self.0.place = Some(source.place(span));
        self.0.label = label.into();
        self
    }

    /// Points at a byte of a binary file.
    pub fn at_byte(mut self, source: &Source, offset: usize) -> Self {
        self.0.place = Some(Place {
            file: source.name().clone(),
            position: Position::Byte(offset),
        });
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

    /// What to do about it, on a line of its own.
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

    /// What else there is to know, on a line of its own.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.0.notes.push(note.into());
        self
    }

    pub(crate) fn into_warning(mut self) -> Warning {
        self.0.severity = "warning";
        Warning {
            diagnostic: self.0,
            repeats: 1,
        }
    }

    /// What kind of mistake it is.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// The message alone, on one line.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// The name of the file that the error is in.
    pub fn file(&self) -> Option<&str> {
        self.0.file()
    }

    /// The line, counted from one; `None` for binary files.
    pub fn line(&self) -> Option<usize> {
        self.0.line_column().map(|p| p.0)
    }

    /// The column in characters, counted from one; `None` for binary files.
    pub fn column(&self) -> Option<usize> {
        self.0.line_column().map(|p| p.1)
    }
}

impl Warning {
    /// What kind of thing it is about.
    pub fn kind(&self) -> ErrorKind {
        self.diagnostic.kind
    }

    /// The message alone, on one line.
    pub fn message(&self) -> &str {
        &self.diagnostic.message
    }

    /// The name of the file.
    pub fn file(&self) -> Option<&str> {
        self.diagnostic.file()
    }

    /// The line, counted from one.
    pub fn line(&self) -> Option<usize> {
        self.diagnostic.line_column().map(|p| p.0)
    }

    /// How often the same message came; the place is that of the first.
    pub fn repeats(&self) -> usize {
        self.repeats
    }

    pub(crate) fn into_error(mut self) -> SceneError {
        self.diagnostic.severity = "error";
        self.diagnostic
            .notes
            .push("warnings are errors with `strict`".into());
        SceneError(self.diagnostic)
    }
}

impl Diagnostic {
    fn file(&self) -> Option<&str> {
        self.place.as_ref().map(|p| &*p.file)
    }

    fn line_column(&self) -> Option<(usize, usize)> {
        match &self.place.as_ref()?.position {
            Position::Text(text) => Some((text.line, text.column)),
            Position::File | Position::Byte(_) => None,
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.diagnostic)?;
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
    index: std::collections::HashMap<String, usize>,
    more: usize,
}

/// Distinct warnings that are kept.
const MAX_WARNINGS: usize = 200;

impl Warnings {
    /// None; `strict`: the first is an error.
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
        let warning = place(SceneError::new(kind, message.clone())).into_warning();
        if self.strict {
            return Err(warning.into_error());
        }
        self.index.insert(message, self.list.len());
        self.list.push(warning);
        Ok(())
    }

    pub(crate) fn into_list(mut self) -> Vec<Warning> {
        if self.more > 0 {
            let text = format!("{} more warnings are not shown", self.more);
            self.list
                .push(SceneError::new(ErrorKind::Suspicious, text).into_warning());
        }
        self.list
    }
}

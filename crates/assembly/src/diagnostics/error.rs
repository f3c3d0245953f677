//! [`SceneError`], an error with its location and advice, and [`Warnings`], the list of warnings of
//! a scene.

use super::source::{Location, Place, Position};
use std::collections::HashMap;
use std::fmt;
use std::ops::Deref;

/// The result of a reader, or the error that ended it.
pub type Result<T> = std::result::Result<T, SceneError>;

/// The kind of an error or a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// A file could not be read.
    Io,
    /// A file is outside of the folder whose files the scene may name.
    Outside,
    /// The text does not follow the grammar of its format.
    Syntax,
    /// A directive, parameter, material, texture or object has an unknown name.
    UnknownName,
    /// A parameter has another type or another number of values than it should have.
    BadParameter,
    /// A parameter that cannot be left out is missing.
    MissingParameter,
    /// A number is out of its range, or not finite.
    OutOfRange,
    /// A block is not closed or closed twice, or a directive is at a position where it is not
    /// allowed.
    Nesting,
    /// A transform is singular or not finite.
    BadTransform,
    /// The vertices or indices of a mesh are not valid.
    BadMesh,
    /// A file ends before the contents that its header announces.
    Truncated,
    /// A file includes itself.
    Recursion,
    /// The scene has more triangles, nesting or pixels than the limits allow.
    Limit,
    /// The scene uses a feature that linelit does not support.
    Unsupported,
    /// Something is allowed but probably not intended.
    Suspicious,
}

/// An error that ended the loading of a scene.
///
/// `Display` prints it on several lines as rustc does: the message, the file with line and column,
/// the line itself with a caret, and advice.
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

/// A warning about something in a file that was left out, replaced, or is probably not intended. It
/// prints itself as a [`SceneError`] does and has the same methods.
#[derive(Clone, Debug)]
pub struct Warning {
    warning: SceneError,
    repeats: usize,
}

/// A message with its location.
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
    /// Creates an error without a location.
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

    /// Adds the location; the label is printed next to the caret.
    pub fn at(mut self, location: Location<'_>, label: impl Into<String>) -> Self {
        self.0.place = Some(location.place());
        self.0.label = label.into();
        self
    }

    /// Adds a file as a whole as the location.
    pub fn in_file(mut self, name: &str) -> Self {
        self.0.place = Some(Place {
            file: name.into(),
            position: Position::File,
        });
        self
    }

    /// Adds advice, on a line of its own.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }

    /// Adds the nearest known name as advice, if there is one.
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

    /// Sets the first word of the message, `error` or `warning`.
    fn with_severity(mut self, severity: &'static str) -> Self {
        self.0.severity = severity;
        self
    }

    /// Returns the kind of the error.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// Returns the message without location and advice, on one line.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// Returns the name of the file, if it is known.
    pub fn file(&self) -> Option<&str> {
        self.0.place.as_ref().map(|p| &*p.file)
    }

    /// Returns the line, counted from one; `None` for binary files and for files as a whole.
    pub fn line(&self) -> Option<usize> {
        self.line_column().map(|p| p.0)
    }

    /// Returns the column in characters, counted from one; `None` for binary files and for files as
    /// a whole.
    pub fn column(&self) -> Option<usize> {
        self.line_column().map(|p| p.1)
    }

    /// Returns the line and the column, both counted from one.
    fn line_column(&self) -> Option<(usize, usize)> {
        match &self.0.place.as_ref()?.position {
            Position::Text(text) => Some((text.line, text.column)),
            Position::File | Position::Byte(_) => None,
        }
    }
}

impl Warning {
    /// Returns the number of times that the same message occurred; the location is the first one.
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
        // Print the message and the location, with the line of text.
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
        // Print advice and notes below, aligned with it.
        if let Some(help) = &self.help {
            write!(f, "\n{gutter} = help: {help}")?;
        }
        for note in &self.notes {
            write!(f, "\n{gutter} = note: {note}")?;
        }
        Ok(())
    }
}

/// A list of warnings. Each message is in it once, with the number of times that it occurred, and
/// there are at most 200 messages.
#[derive(Debug, Default)]
pub struct Warnings {
    strict: bool,
    list: Vec<Warning>,
    /// The position in the list of each message.
    index: HashMap<String, usize>,
    /// The number of warnings that were not added because the list was full.
    more: usize,
}

/// The largest number of different messages in the list.
const MAX_WARNINGS: usize = 200;

impl Warnings {
    /// Creates an empty list. If `strict`, each warning is an error.
    pub fn new(strict: bool) -> Self {
        Self {
            strict,
            ..Self::default()
        }
    }

    /// Adds a warning. `place` adds the location to it, and is only called for a new message. If
    /// the list is strict, the warning is returned as an error.
    pub fn warn(
        &mut self,
        kind: ErrorKind,
        message: impl Into<String>,
        place: impl FnOnce(SceneError) -> SceneError,
    ) -> Result<()> {
        // Count a message that is in the list, or that is too many.
        let message = message.into();
        if let Some(&i) = self.index.get(&message) {
            self.list[i].repeats += 1;
            return Ok(());
        }
        if self.list.len() >= MAX_WARNINGS {
            self.more += 1;
            return Ok(());
        }
        // Add a new one.
        let warning = place(SceneError::new(kind, message.clone()));
        if self.strict {
            return Err(warning.note("warnings are errors with `strict`"));
        }
        self.index.insert(message, self.list.len());
        self.add(warning);
        Ok(())
    }

    /// Appends a warning to the list.
    fn add(&mut self, warning: SceneError) {
        self.list.push(Warning {
            warning: warning.with_severity("warning"),
            repeats: 1,
        });
    }

    /// Returns the warnings, the last of which may say that there were more.
    pub(crate) fn into_list(mut self) -> Vec<Warning> {
        if self.more > 0 {
            let text = format!("{} more warnings are not shown", self.more);
            self.add(SceneError::new(ErrorKind::Suspicious, text));
        }
        self.list
    }
}

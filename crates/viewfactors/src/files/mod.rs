//! Readers of files with facets: View3D's `.vs3` and STL. Polygons stay polygons, and coordinates
//! keep all their digits.

mod stl;
mod vs3;

pub use stl::read as stl;
pub use vs3::read as vs3;

use std::fmt;
use std::str::FromStr;

/// The facets of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The corners of facets.
    pub vertices: Vec<[f64; 3]>,
    /// The numbers of each facet's vertices.
    pub polygons: Vec<Vec<u32>>,
    /// Where each facet is in the file; empty if the format does not say.
    pub places: Vec<Place>,
    /// The emittances of the facets that send and receive, if the file has them.
    pub emittances: Vec<f64>,
    /// The number of facets that send and receive, which are the first ones; the facets after them
    /// are obstructions, which only hide.
    pub senders: usize,
    /// Sentences about what the file says and the reader ignores.
    pub notes: Vec<String>,
}

/// A position in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of text, counted from one.
    Line(usize),
    /// A byte, counted from zero.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(number) => write!(f, "line {number}"),
            Self::Byte(offset) => write!(f, "byte {offset}"),
        }
    }
}

/// The reason why a file is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    /// Where in the file it is wrong.
    pub place: Place,
    /// A description of what is wrong there.
    pub what: String,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.what)
    }
}

impl std::error::Error for FileError {}

/// The largest number of characters of a word that a message shows.
const SHOWN: usize = 40;

/// A line of text, with the words that have not been read yet.
struct Line<'a> {
    number: usize,
    words: std::str::SplitAsciiWhitespace<'a>,
}

impl<'a> Line<'a> {
    /// The lines of a text that have words, each with its first word. Comments, which begin with
    /// one of the characters `comments`, are removed. Bytes that are not UTF-8 form words that no
    /// reader knows.
    fn all(text: &'a str, comments: &'static [char]) -> impl Iterator<Item = (&'a str, Self)> {
        text.lines().zip(1..).filter_map(move |(line, number)| {
            let text = line.split(comments).next().unwrap_or_default();
            let mut words = text.split_ascii_whitespace();
            Some((words.next()?, Self { number, words }))
        })
    }

    fn error(&self, what: impl Into<String>) -> FileError {
        let (place, what) = (Place::Line(self.number), what.into());
        FileError { place, what }
    }

    /// Parses the next word; `what` describes it in messages.
    fn read<T: FromStr>(&mut self, what: &str) -> Result<T, FileError> {
        let Some(word) = self.words.next() else {
            return Err(self.error(format!("expected {what}, the line ends")));
        };
        let shown: String = word.chars().take(SHOWN).collect();
        let wrong = |_| self.error(format!("expected {what}, found `{shown}`"));
        word.parse().map_err(wrong)
    }

    /// Parses the next word as a finite number.
    fn number(&mut self, what: &str) -> Result<f64, FileError> {
        let value: f64 = self.read(what)?;
        let is_finite = value.is_finite().then_some(value);
        is_finite.ok_or_else(|| self.error(format!("expected {what}, found {value}")))
    }

    /// Parses the next three words as a point.
    fn point(&mut self) -> Result<[f64; 3], FileError> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.number(&format!("the coordinate {axis}")));
        Ok([x?, y?, z?])
    }
}

/// Converts a count to a vertex number, if it fits.
fn number_of(count: usize, line: &Line<'_>) -> Result<u32, FileError> {
    u32::try_from(count).map_err(|_| line.error("more than 4,294,967,295 vertices"))
}

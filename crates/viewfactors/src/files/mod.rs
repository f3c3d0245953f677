//! Files of facets: View3D's `.vs3` and STL, with their polygons and all their digits.

mod stl;
mod vs3;

pub use stl::read as stl;
pub use vs3::read as vs3;

use std::fmt;
use std::str::FromStr;

/// The facets of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<[f64; 3]>,
    /// The numbers of each facet's vertices.
    pub polygons: Vec<Vec<u32>>,
    /// The place of each facet in the file; empty where the file has none.
    pub places: Vec<Place>,
    /// The emittances of the facets that send and receive, if the file has them. Facets behind
    /// these are obstructions.
    pub emittances: Vec<f64>,
    /// The number of facets that send and receive: the first ones. The others only hide.
    pub senders: usize,
    /// Sentences on what the file says and nobody heeds.
    pub notes: Vec<String>,
}

/// A place in a file.
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
    /// The place.
    pub place: Place,
    /// The words for what is wrong there.
    pub what: String,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.what)
    }
}

impl std::error::Error for FileError {}

/// The characters of a word that a message shows.
const SHOWN: usize = 40;

/// A line of text, with its words that have not been read.
struct Line<'a> {
    number: usize,
    words: std::str::SplitAsciiWhitespace<'a>,
}

impl<'a> Line<'a> {
    /// The lines of a text that have words, without comments, which begin with one of `comments`.
    /// Bytes that are no UTF-8 are no words that a reader knows.
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

    /// The next word as a number of some kind.
    fn read<T: FromStr>(&mut self, what: &str) -> Result<T, FileError> {
        let Some(word) = self.words.next() else {
            return Err(self.error(format!("expected {what}, the line ends")));
        };
        let shown: String = word.chars().take(SHOWN).collect();
        let wrong = |_| self.error(format!("expected {what}, found `{shown}`"));
        word.parse().map_err(wrong)
    }

    /// The next word as a finite number.
    fn number(&mut self, what: &str) -> Result<f64, FileError> {
        let value: f64 = self.read(what)?;
        let is_finite = value.is_finite().then_some(value);
        is_finite.ok_or_else(|| self.error(format!("expected {what}, found {value}")))
    }

    /// The next three words as a point.
    fn point(&mut self) -> Result<[f64; 3], FileError> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.number(&format!("the coordinate {axis}")));
        Ok([x?, y?, z?])
    }
}

/// A number of things as they are numbered.
fn number_of(count: usize, line: &Line<'_>) -> Result<u32, FileError> {
    u32::try_from(count).map_err(|_| line.error("more than 4,294,967,295 vertices"))
}

//! The lexer of OBJ and MTL files. A statement is a line of words; a backslash at its end continues
//! it on the next line, and `#` begins a comment.

use linelit_assembly::{ErrorKind, Result, Source, Span, shorten};
use linelit_geometry::stop;

/// A statement: its position and the positions of its words, of which the first is the keyword.
#[derive(Debug, Default)]
pub(super) struct Line {
    pub(super) span: Span,
    pub(super) words: Vec<Span>,
}

impl Line {
    /// Returns the text after the keyword, without the blanks around it, and its position. A name
    /// may contain blanks. If the text is empty, the position is the whole statement.
    pub(super) fn rest(&self, source: &Source) -> (String, Span) {
        match self.words.as_slice() {
            [_, first, .., last] => {
                let span = first.to(*last);
                (source.text(span), span)
            }
            [_, only] => (source.text(*only), *only),
            _ => (String::new(), self.span),
        }
    }
}

/// The statements of a file, without empty ones.
pub(super) struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Lines<'a> {
    /// Creates the statements of a file, after its byte order mark if it has one.
    pub(super) fn new(source: &'a Source) -> Self {
        let bom = source.bytes().starts_with(b"\xef\xbb\xbf");
        Self {
            bytes: source.bytes(),
            at: if bom { 3 } else { 0 },
        }
    }
}

impl<'a> Lines<'a> {
    /// Returns the statements whose line begins with a keyword; other lines are not split into
    /// words.
    pub(super) fn that_begin_with(
        source: &'a Source,
        keyword: &'a [u8],
    ) -> impl Iterator<Item = Line> {
        let bytes = source.bytes();
        let mut at = 0;
        let starts = bytes.split(|b| *b == b'\n').filter_map(move |line| {
            let start = at;
            at += line.len() + 1;
            line.trim_ascii_start()
                .starts_with(keyword)
                .then_some(start)
        });
        starts.filter_map(move |at| Self { bytes, at }.next())
    }
}

impl Iterator for Lines<'_> {
    type Item = Line;

    fn next(&mut self) -> Option<Line> {
        stop::check();
        let mut line = Line::default();
        loop {
            // Collect words up to the end of a line that has any.
            match self.bytes.get(self.at) {
                None | Some(b'\n' | b'\r') if !line.words.is_empty() => {
                    line.span = line.words[0].to(line.words[line.words.len() - 1]);
                    return Some(line);
                }
                None => return None,
                // Skip a comment.
                Some(b'#') => {
                    let rest = &self.bytes[self.at..];
                    let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
                    self.at += end.unwrap_or(rest.len());
                }
                // Continue on the next line after a backslash.
                Some(b'\\')
                    if matches!(self.bytes.get(self.at + 1), None | Some(b'\n' | b'\r')) =>
                {
                    let crlf = self.bytes[self.at..].starts_with(b"\\\r\n");
                    self.at += if crlf { 3 } else { 2 };
                    self.at = self.at.min(self.bytes.len());
                }
                Some(b) if b.is_ascii_whitespace() => self.at += 1,
                Some(_) => {
                    let rest = &self.bytes[self.at..];
                    // Read a word. It may contain backslashes, but ends before one at a line's end.
                    let end = (1..rest.len()).find(|&i| {
                        rest[i].is_ascii_whitespace()
                            || (rest[i] == b'\\' && matches!(rest.get(i + 1), Some(b'\n' | b'\r')))
                    });
                    let end = self.at + end.unwrap_or(rest.len());
                    line.words.push(Span::new(self.at, end));
                    self.at = end;
                }
            }
        }
    }
}

/// Reads the first `N` numbers of a statement, which may have more.
pub(super) fn numbers<const N: usize>(
    source: &Source,
    keyword: Span,
    words: &[Span],
) -> Result<[f64; N]> {
    let mut values = [0.0; N];
    for (k, value) in values.iter_mut().enumerate() {
        let Some(span) = words.get(k) else {
            let word = source.text(keyword);
            let message = format!("`{word}` has {k} numbers, expected {N}");
            return Err(source.error(ErrorKind::Syntax, message, keyword, "too few numbers"));
        };
        *value = number(source, *span)?;
    }
    Ok(values)
}

/// Reads a number of a magnitude that `f32` can represent.
pub(super) fn number(source: &Source, span: Span) -> Result<f64> {
    let text = std::str::from_utf8(&source.bytes()[span.start..span.end]);
    let value = text.ok().and_then(|t| t.parse::<f64>().ok());
    let shown = || shorten(&source.text(span));
    match value {
        // Larger numbers could overflow in computations before the mesh is checked.
        Some(value) if value.abs() <= f64::from(f32::MAX) => Ok(value),
        Some(_) => {
            let message = format!("`{}` is not a finite number", shown());
            let at = source.at(span);
            Err(at.error(ErrorKind::OutOfRange, message, "expected a finite number"))
        }
        None => {
            let message = format!("`{}` is not a number", shown());
            Err(source.error(ErrorKind::Syntax, message, span, "expected a number"))
        }
    }
}

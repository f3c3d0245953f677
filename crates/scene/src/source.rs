//! The text of a file and places in it.

use std::sync::{Arc, OnceLock};

/// A half-open range of bytes in a [`Source`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) start: usize,
    pub(crate) end: usize,
}

impl Span {
    pub(crate) const fn new(start: usize, end: usize) -> Self {
        Self { start, end }
    }

    /// From the start of `self` to the end of `other`.
    pub(crate) const fn to(self, other: Self) -> Self {
        Self::new(self.start, other.end)
    }
}

/// One file in memory, with its name for messages.
#[derive(Debug)]
pub(crate) struct Source {
    name: Arc<str>,
    bytes: Vec<u8>,
    line_starts: OnceLock<Vec<usize>>,
}

/// Where a message points: a file and, if known, a place in it.
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
    pub(crate) fn new(name: impl Into<Arc<str>>, bytes: Vec<u8>) -> Arc<Self> {
        Arc::new(Self {
            name: name.into(),
            bytes,
            line_starts: OnceLock::new(),
        })
    }

    pub(crate) fn name(&self) -> &Arc<str> {
        &self.name
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The text under a span, with bytes that are not UTF-8 replaced.
    pub(crate) fn text(&self, span: Span) -> String {
        let end = span.end.min(self.bytes.len());
        String::from_utf8_lossy(&self.bytes[span.start.min(end)..end]).into_owned()
    }

    /// The place of a span, for a message.
    pub(crate) fn place(&self, span: Span) -> Place {
        Place {
            file: Arc::clone(&self.name),
            position: Position::Text(Box::new(self.text_place(span))),
        }
    }

    /// `file:line:column` of the start of a span.
    pub(crate) fn short(&self, span: Span) -> String {
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

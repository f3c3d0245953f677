//! The lexer of pbrt text, which splits a file into words, strings and brackets with their
//! positions.

use linelit_assembly::{ErrorKind, Result, SceneError, Source, Span, shorten};
use linelit_geometry::stop;
use std::sync::Arc;

/// The kind of a token; its text is the part of the file at its span.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TokenKind {
    /// A directive, a number, `true` or `false`.
    Word,
    /// A string; the span includes the quotes.
    Quoted,
    /// `[`
    Open,
    /// `]`
    Close,
}

/// A token with its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Token {
    pub(crate) kind: TokenKind,
    pub(crate) span: Span,
}

/// Reads one file token by token, with one token of look-ahead.
#[derive(Debug)]
pub(crate) struct Lexer {
    source: Arc<Source>,
    position: usize,
    peeked: Option<Option<Token>>,
}

/// Returns whether a byte ends a word.
const fn ends_word(byte: u8) -> bool {
    byte.is_ascii_whitespace() || matches!(byte, b'"' | b'[' | b']' | b'#')
}

impl Lexer {
    /// Creates a lexer at the beginning of a file, after its byte order mark if it has one.
    pub(crate) fn new(source: Arc<Source>) -> Self {
        let bom = source.bytes().starts_with(b"\xef\xbb\xbf");
        Self {
            source,
            position: if bom { 3 } else { 0 },
            peeked: None,
        }
    }

    /// Creates a lexer that begins at a given position (an offset in bytes) in a file.
    pub(crate) fn from_offset(source: Arc<Source>, position: usize) -> Self {
        Self {
            source,
            position,
            peeked: None,
        }
    }

    /// Returns the file that is read.
    pub(crate) fn source(&self) -> &Arc<Source> {
        &self.source
    }

    /// Creates an error about the text at a span.
    pub(crate) fn error(
        &self,
        kind: ErrorKind,
        message: impl Into<String>,
        span: Span,
        label: impl Into<String>,
    ) -> SceneError {
        self.source.error(kind, message, span, label)
    }

    /// Returns the empty span after the last byte of the file.
    pub(crate) fn end(&self) -> Span {
        let n = self.source.bytes().len();
        Span::new(n, n)
    }

    /// Returns the next token, which is not consumed; `None` at the end of the file.
    pub(crate) fn peek(&mut self) -> Result<Option<Token>> {
        if let Some(token) = self.peeked {
            return Ok(token);
        }
        let token = self.scan()?;
        self.peeked = Some(token);
        Ok(token)
    }

    /// Consumes the next token; `None` at the end of the file.
    pub(crate) fn next(&mut self) -> Result<Option<Token>> {
        stop::check();
        match self.peeked.take() {
            Some(token) => Ok(token),
            None => self.scan(),
        }
    }

    /// Returns the bytes of a token that is a word.
    pub(crate) fn word(&self, token: Token) -> &[u8] {
        &self.source.bytes()[token.span.start..token.span.end]
    }

    /// Reads the first token at or after the current position; `None` at the end of the file.
    fn scan(&mut self) -> Result<Option<Token>> {
        // Skip blanks and comments.
        let bytes = self.source.bytes();
        loop {
            match bytes.get(self.position) {
                None => return Ok(None),
                Some(b'#') => {
                    let rest = &bytes[self.position..];
                    let skip = rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
                    self.position += skip.unwrap_or(rest.len());
                }
                Some(b) if b.is_ascii_whitespace() => self.position += 1,
                Some(_) => break,
            }
        }
        // Read a bracket, a string or a word.
        let start = self.position;
        let kind = match bytes[start] {
            b'[' => TokenKind::Open,
            b']' => TokenKind::Close,
            b'"' => return self.scan_string(start).map(Some),
            _ => TokenKind::Word,
        };
        self.position += match kind {
            TokenKind::Word => {
                let rest = &bytes[start..];
                rest.iter()
                    .position(|b| ends_word(*b))
                    .unwrap_or(rest.len())
            }
            _ => 1,
        };
        let span = Span::new(start, self.position);
        Ok(Some(Token { kind, span }))
    }

    /// Reads a string that begins with the quote at `start` and ends on the same line.
    fn scan_string(&mut self, start: usize) -> Result<Token> {
        let bytes = self.source.bytes();
        let mut i = start + 1;
        loop {
            match bytes.get(i) {
                Some(b'"') => break,
                Some(b'\\') => i += 2,
                None | Some(b'\n') => {
                    let span = Span::new(start, i.min(bytes.len()));
                    let label = "no closing `\"` before the end of the line";
                    return Err(self.error(ErrorKind::Syntax, "unterminated string", span, label));
                }
                Some(_) => i += 1,
            }
        }
        self.position = i + 1;
        Ok(Token {
            kind: TokenKind::Quoted,
            span: Span::new(start, self.position),
        })
    }

    /// Returns the contents of a string token, with its escapes resolved.
    pub(crate) fn unquote(&self, token: Token) -> Result<String> {
        let inner = &self.source.bytes()[token.span.start + 1..token.span.end - 1];
        let text = std::str::from_utf8(inner).map_err(|_| {
            let (message, label) = ("a string is not UTF-8", "these bytes are no UTF-8 text");
            self.error(ErrorKind::Syntax, message, token.span, label)
        })?;
        // Resolve escapes.
        if !text.contains('\\') {
            return Ok(text.to_owned());
        }
        let mut out = String::with_capacity(text.len());
        let mut chars = text.chars();
        while let Some(c) = chars.next() {
            if c != '\\' {
                out.push(c);
                continue;
            }
            match chars.next() {
                Some('n') => out.push('\n'),
                Some('r') => out.push('\r'),
                Some('t') => out.push('\t'),
                Some(other @ ('\\' | '"' | '\'')) => out.push(other),
                // Keep other backslashes: pbrt-v3 files have Windows paths with single ones.
                Some(other) => out.extend(['\\', other]),
                None => out.push('\\'),
            }
        }
        Ok(out)
    }

    /// Returns the value of a word that must be a finite number.
    pub(crate) fn number(&self, token: Token) -> Result<f64> {
        let word = self.word(token);
        let starts_like_one = word
            .first()
            .is_some_and(|b| b.is_ascii_digit() || matches!(b, b'-' | b'+' | b'.'));
        let value = std::str::from_utf8(word).ok();
        let (kind, what) = match value.and_then(|t| t.parse::<f64>().ok()) {
            Some(value) if value.is_finite() && starts_like_one => return Ok(value),
            Some(_) => (ErrorKind::OutOfRange, "a finite number"),
            None => (ErrorKind::Syntax, "a number"),
        };
        let shown = shorten(&self.source.text(token.span));
        let message = format!("`{shown}` is not {what}");
        Err(self.error(kind, message, token.span, format!("expected {what}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(text: &str) -> Vec<String> {
        let mut lexer = Lexer::new(Source::new("t", text.as_bytes().to_vec()));
        let mut out = Vec::new();
        while let Some(token) = lexer.next().unwrap() {
            out.push(lexer.source().text(token.span));
        }
        out
    }

    #[test]
    fn splits_words_strings_and_brackets() {
        assert_eq!(
            tokens("Shape\"a b\"[1 -2.5e-007]# rest\r\n\"x\"\t.5"),
            [
                "Shape",
                "\"a b\"",
                "[",
                "1",
                "-2.5e-007",
                "]",
                "\"x\"",
                ".5"
            ]
        );
        assert_eq!(tokens("\u{feff}A"), ["A"]);
        assert!(tokens(" # only a comment").is_empty());
    }

    #[test]
    fn strings_have_escapes_and_must_end() {
        let lexer = |t: &str| Lexer::new(Source::new("t", t.as_bytes().to_vec()));
        let mut l = lexer(r#""a\"b\\c\d""#);
        let token = l.next().unwrap().unwrap();
        assert_eq!(l.unquote(token).unwrap(), r#"a"b\c\d"#);
        assert!(lexer("\"abc\n\"").next().is_err());
        assert!(lexer("\"abc\\").next().is_err());
    }

    #[test]
    fn numbers_are_finite() {
        for (text, want) in [
            ("1e-007", Some(1e-7)),
            (".5", Some(0.5)),
            ("-0", Some(0.0)),
            ("5.", Some(5.0)),
            ("nan", None),
            ("inf", None),
            ("1e999", None),
            ("0x10", None),
            ("--1", None),
        ] {
            let mut l = Lexer::new(Source::new("t", text.as_bytes().to_vec()));
            let token = l.next().unwrap().unwrap();
            assert_eq!(l.number(token).ok(), want, "{text}");
        }
    }
}

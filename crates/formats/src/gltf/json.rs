//! JSON with the place of every value, for messages.

use crate::diagnostics::{ErrorKind, Result, SceneError, Source, Span};

/// A value and where it stands.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) value: Value,
    pub(super) span: Span,
}

#[derive(Clone, Debug)]
pub(super) enum Value {
    Null,
    Bool(bool),
    Number(f64),
    String(String),
    Array(Vec<Node>),
    Object(Vec<(String, Node)>),
}

impl Value {
    /// What it is, for messages.
    pub(super) const fn kind(&self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Bool(_) => "a boolean",
            Self::Number(_) => "a number",
            Self::String(_) => "a string",
            Self::Array(_) => "an array",
            Self::Object(_) => "an object",
        }
    }
}

/// Arrays and objects inside each other; ordinary files have about six.
const MAX_DEPTH: usize = 64;

/// Reads one value, which must be all there is.
pub(super) fn parse(source: &Source) -> Result<Node> {
    let bom = source.bytes().starts_with(b"\xef\xbb\xbf");
    let mut reader = Reader {
        source,
        at: if bom { 3 } else { 0 },
    };
    let node = reader.value(0)?;
    reader.blanks();
    // GLB pads its JSON with blanks, some writers with zeros.
    let rest = &source.bytes()[reader.at..];
    match rest.iter().position(|b| *b != 0) {
        None => Ok(node),
        Some(k) => Err(reader.error(
            reader.at + k,
            "the JSON goes on behind its end",
            "expected nothing",
        )),
    }
}

struct Reader<'a> {
    source: &'a Source,
    at: usize,
}

impl Reader<'_> {
    fn error(&self, at: usize, message: &str, label: &str) -> SceneError {
        SceneError::new(ErrorKind::Syntax, message).at(self.source, Span::new(at, at + 1), label)
    }

    fn peek(&self) -> Option<u8> {
        self.source.bytes().get(self.at).copied()
    }

    fn blanks(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\n' | b'\r')) {
            self.at += 1;
        }
    }

    fn value(&mut self, depth: usize) -> Result<Node> {
        self.blanks();
        let start = self.at;
        if depth > MAX_DEPTH {
            return Err(self.error(start, "the JSON is nested too deeply", "one level too many"));
        }
        let value = match self.peek() {
            None => return Err(self.error(start, "the JSON ends early", "expected a value")),
            Some(b'{') => self.object(depth)?,
            Some(b'[') => self.array(depth)?,
            Some(b'"') => Value::String(self.string()?),
            Some(_) => self.word()?,
        };
        Ok(Node {
            value,
            span: Span::new(start, self.at),
        })
    }

    /// A number, `true`, `false` or `null`.
    fn word(&mut self) -> Result<Value> {
        let rest = &self.source.bytes()[self.at..];
        let is_word = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'+' | b'-' | b'.' | b'_');
        let length = rest.iter().position(|b| !is_word(b)).unwrap_or(rest.len());
        let start = self.at;
        self.at += length;
        let text = std::str::from_utf8(&rest[..length]).unwrap_or("");
        let looks_numeric = text.starts_with(|c: char| c.is_ascii_digit() || c == '-');
        match text {
            "null" => Ok(Value::Null),
            "true" => Ok(Value::Bool(true)),
            "false" => Ok(Value::Bool(false)),
            _ => match text.parse::<f64>() {
                Ok(number) if looks_numeric && number.is_finite() => Ok(Value::Number(number)),
                _ => {
                    let shown = self
                        .source
                        .text(Span::new(start, start + length.clamp(1, 40)));
                    let message = format!("`{shown}` is no JSON value");
                    let span = Span::new(start, start + length.max(1));
                    Err(SceneError::new(ErrorKind::Syntax, message).at(
                        self.source,
                        span,
                        "expected a value",
                    ))
                }
            },
        }
    }

    fn array(&mut self, depth: usize) -> Result<Value> {
        self.at += 1;
        let mut list = Vec::new();
        self.blanks();
        if self.peek() == Some(b']') {
            self.at += 1;
            return Ok(Value::Array(list));
        }
        loop {
            list.push(self.value(depth + 1)?);
            if self.ends(b']')? {
                return Ok(Value::Array(list));
            }
        }
    }

    fn object(&mut self, depth: usize) -> Result<Value> {
        self.at += 1;
        let mut list = Vec::new();
        self.blanks();
        if self.peek() == Some(b'}') {
            self.at += 1;
            return Ok(Value::Object(list));
        }
        loop {
            self.blanks();
            if self.peek() != Some(b'"') {
                return Err(self.error(
                    self.at,
                    "a JSON object without a key",
                    "expected a key in quotes",
                ));
            }
            let key = self.string()?;
            self.blanks();
            if self.peek() != Some(b':') {
                return Err(self.error(self.at, "a JSON key without a value", "expected `:`"));
            }
            self.at += 1;
            list.push((key, self.value(depth + 1)?));
            if self.ends(b'}')? {
                return Ok(Value::Object(list));
            }
        }
    }

    /// Behind an element: a comma (false) or the end (true).
    fn ends(&mut self, end: u8) -> Result<bool> {
        self.blanks();
        let found = self.peek();
        self.at += 1;
        if found == Some(end) {
            Ok(true)
        } else if found == Some(b',') {
            Ok(false)
        } else {
            let label = format!("expected `,` or `{}`", char::from(end));
            let message = if found.is_none() {
                "the JSON ends early"
            } else {
                "the JSON is broken"
            };
            Err(self.error(self.at - 1, message, &label))
        }
    }

    fn string(&mut self) -> Result<String> {
        let start = self.at;
        let bytes = self.source.bytes();
        let mut out = Vec::new();
        let mut i = start + 1;
        loop {
            match bytes.get(i) {
                None | Some(b'\n') => {
                    return Err(self.error(start, "a JSON string is not closed", "opened here"));
                }
                Some(b'"') => break,
                Some(b'\\') => {
                    i += 1;
                    let escaped = match bytes.get(i) {
                        Some(b'n') => b'\n',
                        Some(b't') => b'\t',
                        Some(b'r') => b'\r',
                        Some(b'b') => 8,
                        Some(b'f') => 12,
                        Some(b'u') => {
                            let digits = bytes
                                .get(i + 1..i + 5)
                                .and_then(|d| std::str::from_utf8(d).ok());
                            let code = digits.and_then(|d| u32::from_str_radix(d, 16).ok());
                            let Some(code) = code else {
                                return Err(self.error(
                                    i,
                                    "a broken escape in a JSON string",
                                    "expected four digits",
                                ));
                            };
                            // Halves of pairs become the replacement character: names only.
                            let c = char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER);
                            out.extend(c.encode_utf8(&mut [0; 4]).as_bytes());
                            i += 5;
                            continue;
                        }
                        Some(other) => *other,
                        None => continue,
                    };
                    out.push(escaped);
                    i += 1;
                }
                Some(other) => {
                    out.push(*other);
                    i += 1;
                }
            }
        }
        self.at = i + 1;
        Ok(String::from_utf8_lossy(&out).into_owned())
    }
}

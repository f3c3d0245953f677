//! A small JSON reader (RFC 8259) for test data; no writer, no serde.

use std::fmt;

/// A JSON value.
#[derive(Clone, Debug, PartialEq)]
pub enum Json {
    /// `null`
    Null,
    /// `true` or `false`
    Bool(bool),
    /// A number, correctly rounded.
    Number(f64),
    /// A string, unescaped.
    Text(String),
    /// An array.
    Array(Vec<Self>),
    /// An object, in file order; the first of equal keys counts.
    Object(Vec<(String, Self)>),
}

/// Why a text is not JSON.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JsonError {
    /// The byte at which reading stopped.
    pub offset: usize,
    /// What was expected there.
    pub expected: &'static str,
}

impl fmt::Display for JsonError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "byte {}: expected {}", self.offset, self.expected)
    }
}

impl std::error::Error for JsonError {}

/// Deeper nesting is refused rather than risking the stack.
const MAX_DEPTH: usize = 64;

impl Json {
    /// Reads one value that fills the whole text.
    ///
    /// # Errors
    /// At the first byte that fits no JSON grammar, or beyond 64 levels of nesting.
    pub fn parse(text: &str) -> Result<Self, JsonError> {
        let mut reader = Reader { text, at: 0 };
        let value = reader.value(0)?;
        reader.space();
        if reader.at == text.len() {
            Ok(value)
        } else {
            reader.fail("the end of the text")
        }
    }

    /// The member `key` of an object.
    pub fn get(&self, key: &str) -> Option<&Self> {
        match self {
            Self::Object(members) => members.iter().find(|(k, _)| k == key).map(|(_, v)| v),
            _ => None,
        }
    }

    /// The elements of an array.
    pub fn array(&self) -> Option<&[Self]> {
        match self {
            Self::Array(elements) => Some(elements),
            _ => None,
        }
    }

    /// The text of a string.
    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// A number, or a string that reads as one (rounded to `f64`; magnitudes below its range become
    /// 0).
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(x) => Some(*x),
            Self::Text(text) => text.parse().ok(),
            _ => None,
        }
    }

    /// An array of N numbers.
    pub fn numbers<const N: usize>(&self) -> Option<[f64; N]> {
        let elements: Option<Vec<f64>> = self.array()?.iter().map(Self::number).collect();
        elements?.try_into().ok()
    }
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
}

impl Reader<'_> {
    fn fail<T>(&self, expected: &'static str) -> Result<T, JsonError> {
        Err(JsonError {
            offset: self.at,
            expected,
        })
    }

    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    fn space(&mut self) {
        self.at += self.rest().len()
            - self
                .rest()
                .trim_start_matches([' ', '\t', '\n', '\r'])
                .len();
    }

    /// Takes `token` if it comes next (after white space).
    fn take(&mut self, token: &str) -> bool {
        self.space();
        let found = self.rest().starts_with(token);
        if found {
            self.at += token.len();
        }
        found
    }

    fn value(&mut self, depth: usize) -> Result<Json, JsonError> {
        if depth > MAX_DEPTH {
            return self.fail("less nesting");
        }
        self.space();
        match self.rest().bytes().next() {
            Some(b'{') => self.object(depth),
            Some(b'[') => self.array(depth),
            Some(b'"') => Ok(Json::Text(self.string()?)),
            Some(b'-' | b'0'..=b'9') => self.number(),
            _ if self.take("null") => Ok(Json::Null),
            _ if self.take("true") => Ok(Json::Bool(true)),
            _ if self.take("false") => Ok(Json::Bool(false)),
            _ => self.fail("a value"),
        }
    }

    fn object(&mut self, depth: usize) -> Result<Json, JsonError> {
        let mut members = Vec::new();
        self.take("{");
        if self.take("}") {
            return Ok(Json::Object(members));
        }
        loop {
            self.space();
            let key = self.string()?;
            if !self.take(":") {
                return self.fail("':'");
            }
            members.push((key, self.value(depth + 1)?));
            if self.take("}") {
                return Ok(Json::Object(members));
            }
            if !self.take(",") {
                return self.fail("',' or '}'");
            }
        }
    }

    fn array(&mut self, depth: usize) -> Result<Json, JsonError> {
        let mut elements = Vec::new();
        self.take("[");
        if self.take("]") {
            return Ok(Json::Array(elements));
        }
        loop {
            elements.push(self.value(depth + 1)?);
            if self.take("]") {
                return Ok(Json::Array(elements));
            }
            if !self.take(",") {
                return self.fail("',' or ']'");
            }
        }
    }

    fn number(&mut self) -> Result<Json, JsonError> {
        let len = self
            .rest()
            .bytes()
            .take_while(|b| matches!(b, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E'))
            .count();
        match self.rest()[..len].parse() {
            Ok(x) => {
                self.at += len;
                Ok(Json::Number(x))
            }
            Err(_) => self.fail("a number"),
        }
    }

    fn string(&mut self) -> Result<String, JsonError> {
        if !self.rest().starts_with('"') {
            return self.fail("a string");
        }
        self.at += 1;
        let mut out = String::new();
        loop {
            let Some(c) = self.rest().chars().next() else {
                return self.fail("'\"'");
            };
            self.at += c.len_utf8();
            match c {
                '"' => return Ok(out),
                '\\' => out.push(self.escape()?),
                c if c < ' ' => return self.fail("no control character"),
                c => out.push(c),
            }
        }
    }

    /// The character after a backslash; surrogate pairs are not needed for test data and refused.
    fn escape(&mut self) -> Result<char, JsonError> {
        let Some(c) = self.rest().chars().next() else {
            return self.fail("an escape");
        };
        self.at += c.len_utf8();
        match c {
            '"' | '\\' | '/' => Ok(c),
            'n' => Ok('\n'),
            't' => Ok('\t'),
            'r' => Ok('\r'),
            'b' => Ok('\u{8}'),
            'f' => Ok('\u{c}'),
            'u' => {
                let code = self
                    .rest()
                    .get(..4)
                    .and_then(|hex| u32::from_str_radix(hex, 16).ok());
                match code.and_then(char::from_u32) {
                    Some(c) => {
                        self.at += 4;
                        Ok(c)
                    }
                    None => self.fail("four hexadecimal digits of a character"),
                }
            }
            _ => self.fail("an escape"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn reads_all_kinds() {
        let json = Json::parse(
            r#" {"a": [1, -2.5e-3, "x\u00e9\n"], "b": {"c": null}, "d": true, "e": [], "f": {}} "#,
        )
        .unwrap();
        let a = json.get("a").unwrap().array().unwrap();
        assert_eq!(a[1], Json::Number(-2.5e-3));
        assert_eq!(a[2].text(), Some("xé\n"));
        assert_eq!(json.get("b").unwrap().get("c"), Some(&Json::Null));
        assert_eq!(json.get("d"), Some(&Json::Bool(true)));
        assert_eq!(json.get("nothing"), None);
    }

    #[test]
    fn refuses_what_is_not_json() {
        for bad in [
            "",
            "{",
            "[1,]",
            "{\"a\" 1}",
            "nul",
            "\"open",
            "1 2",
            "[1e]",
            "{1:2}",
            "\"\\q\"",
            "\"\\ud800\"",
        ] {
            assert!(Json::parse(bad).is_err(), "{bad}");
        }
        assert_eq!(Json::parse("[1, x]").unwrap_err().offset, 4);
        assert!(Json::parse(&"[".repeat(1000)).is_err());
    }

    proptest! {
        #[test]
        fn never_panics(text in any::<String>()) {
            let _ = Json::parse(&text);
        }

        #[test]
        fn numbers_round_trip(x in crate::strategies::finite()) {
            prop_assert_eq!(Json::parse(&format!("{x:?}")).unwrap(), Json::Number(x));
        }
    }
}

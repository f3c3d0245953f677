//! Reference vectors: files of cases with exact inputs and 25-digit results.
//!
//! `{"schema": …, "version": …, "digits": …, "cases": [{…}, …]}`; JSON numbers are exact `f64`
//! inputs, strings are results computed from the exact binary inputs and rounded to `digits`
//! digits.

use crate::json::{Json, JsonError};
use crate::precise::Precise;

/// One file of cases.
#[derive(Clone, Debug, PartialEq)]
pub struct Vectors {
    /// Which function the cases are about.
    pub schema: String,
    /// Significant digits of the results.
    pub digits: f64,
    /// The cases, in file order.
    pub cases: Vec<Case>,
}

/// One case: named inputs and results.
///
/// The accessors panic with the case's number and the missing name: the files are part of the test.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Position in the file, from 0.
    pub index: usize,
    fields: Json,
}

impl Vectors {
    /// Reads a file's text.
    ///
    /// ```
    /// use linelit_testkit::vectors::Vectors;
    /// let file = r#"{"schema":"demo","version":1,"digits":25,
    ///     "cases":[{"tag":"random","x":0.5,"y":"0.25"}]}"#;
    /// let vectors = Vectors::parse(file)?;
    /// let case = &vectors.cases[0];
    /// assert_eq!(case.number("x") * case.number("x"), case.number("y"));
    /// # Ok::<(), linelit_testkit::json::JsonError>(())
    /// ```
    ///
    /// # Errors
    /// If the text is not JSON or lacks `schema` or `cases`.
    pub fn parse(text: &str) -> Result<Self, JsonError> {
        let json = Json::parse(text)?;
        let missing = |expected| JsonError {
            offset: 0,
            expected,
        };
        let schema = json
            .get("schema")
            .and_then(Json::text)
            .ok_or(missing("a schema"))?
            .to_owned();
        let cases = json
            .get("cases")
            .and_then(Json::array)
            .ok_or(missing("cases"))?;
        let cases = cases
            .iter()
            .enumerate()
            .map(|(index, fields)| Case {
                index,
                fields: fields.clone(),
            })
            .collect();
        Ok(Self {
            schema,
            digits: json.get("digits").and_then(Json::number).unwrap_or(0.0),
            cases,
        })
    }
}

impl Case {
    fn field<'a, T>(&'a self, name: &str, read: impl Fn(&'a Json) -> Option<T>) -> T {
        let value = self.fields.get(name).and_then(read);
        value.unwrap_or_else(|| {
            panic!(
                "case {}: no usable {name:?} in {:?}",
                self.index, self.fields
            )
        })
    }

    /// Whether the case has this field at all.
    pub fn has(&self, name: &str) -> bool {
        self.fields.get(name).is_some()
    }

    /// The raw value of a field.
    pub fn json(&self, name: &str) -> &Json {
        self.field(name, Some)
    }

    /// The kind of case, e.g. "random" or the name of a degeneracy; "" without one.
    pub fn tag(&self) -> &str {
        self.fields.get("tag").and_then(Json::text).unwrap_or("")
    }

    /// A text field.
    pub fn text(&self, name: &str) -> &str {
        self.field(name, Json::text)
    }

    /// A truth value.
    pub fn flag(&self, name: &str) -> bool {
        self.field(name, |json| match json {
            Json::Bool(b) => Some(*b),
            _ => None,
        })
    }

    /// An input exactly, or a result rounded to `f64`.
    pub fn number(&self, name: &str) -> f64 {
        self.field(name, Json::number)
    }

    /// A result to all its digits (or an input exactly), beyond the range of `f64` too.
    pub fn precise(&self, name: &str) -> Precise {
        self.field(name, |json| match json {
            Json::Text(text) => Precise::parse(text).ok(),
            Json::Number(x) if x.is_finite() => Some(crate::real::Real::new(*x)),
            _ => None,
        })
    }

    /// A vector, e.g. a corner or a direction.
    pub fn vec3(&self, name: &str) -> [f64; 3] {
        self.field(name, Json::numbers)
    }

    /// A list of points of N coordinates, e.g. the corners of a polygon or interval ends.
    pub fn points<const N: usize>(&self, name: &str) -> Vec<[f64; N]> {
        self.field(name, |json| {
            json.array()?.iter().map(Json::numbers).collect()
        })
    }

    /// |got − want| / max(|want|, scale) for the result `name`; infinite when `got` is not finite.
    pub fn error(&self, name: &str, got: f64, scale: f64) -> f64 {
        self.precise(name).scaled_error(got, scale)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the reader must be exact")]
mod tests {
    use super::*;

    const FILE: &str = r#"{"schema":"demo","version":1,"digits":25,"cases":[
        {"tag": "random", "p": [0.1, -2.0, 1e-5], "empty": false, "verts": [[0, 1, 2], [3, 4, 5]],
         "I": "0.3333333333333333333333333", "tiny": "2.05e-60462", "dir": ["0.5", "1", "-2e-3"]},
        {"tag": "grazing"}]}"#;

    #[test]
    fn reads_the_schema() {
        let vectors = Vectors::parse(FILE).unwrap();
        assert_eq!(
            (vectors.schema.as_str(), vectors.digits, vectors.cases.len()),
            ("demo", 25.0, 2)
        );
        let case = &vectors.cases[0];
        assert_eq!(case.vec3("p"), [0.1, -2.0, 1e-5]);
        assert_eq!(case.vec3("dir"), [0.5, 1.0, -2e-3]);
        assert_eq!(case.points::<3>("verts")[1], [3.0, 4.0, 5.0]);
        assert!(!case.flag("empty"));
        assert_eq!(case.number("tiny"), 0.0);
        assert!(case.error("I", 1.0 / 3.0, 0.0) < 0.5 * f64::EPSILON);
        assert!(case.error("I", 0.334, 0.0) > 1e-3);
        assert!(case.error("tiny", 0.0, 1.0) < 1e-300);
        assert_eq!(vectors.cases[1].tag(), "grazing");
        assert!(!vectors.cases[1].has("p"));
    }

    #[test]
    #[should_panic(expected = "case 1: no usable \"p\"")]
    fn names_what_is_missing() {
        Vectors::parse(FILE).unwrap().cases[1].vec3("p");
    }
}

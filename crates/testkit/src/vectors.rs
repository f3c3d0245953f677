//! Reference vectors: files of cases with exact inputs and 25-digit results.
//!
//! `{"schema": …, "version": …, "digits": …, "cases": [{…}, …]}`; JSON numbers are exact `f64`
//! inputs, strings are results computed from the exact binary inputs and rounded to `digits`
//! digits. Closed forms and techniques are tested against the files in `vectors/` of this crate.

use crate::precise::Precise;
use serde_json::Value;

/// The cases of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Vectors {
    /// The name of the function that the cases test.
    pub schema: String,
    /// The cases, in file order.
    pub cases: Vec<Case>,
}

/// A case: named inputs and results.
///
/// The accessors panic with the case's number and the missing name: the files are part of the test.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The position in the file, from 0.
    pub index: usize,
    fields: Value,
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
    /// # Ok::<(), String>(())
    /// ```
    ///
    /// # Errors
    /// If the text is not JSON or lacks `schema` or `cases`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let json: Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
        let schema = json["schema"].as_str().ok_or("expected a schema")?;
        let cases = json["cases"].as_array().ok_or("expected cases")?.iter();
        let case = |(index, fields): (usize, &Value)| Case {
            index,
            fields: fields.clone(),
        };
        Ok(Self {
            schema: schema.to_owned(),
            cases: cases.enumerate().map(case).collect(),
        })
    }
}

/// Reads a number, or a string that represents one (rounded to `f64`; magnitudes below its range
/// become 0).
fn number(json: &Value) -> Option<f64> {
    json.as_f64().or_else(|| json.as_str()?.parse().ok())
}

/// Reads a list of N numbers.
fn numbers<const N: usize>(json: &Value) -> Option<[f64; N]> {
    let elements: Option<Vec<f64>> = json.as_array()?.iter().map(number).collect();
    elements?.try_into().ok()
}

impl Case {
    /// Returns a field that `read` understands.
    fn field<'a, T>(&'a self, name: &str, read: impl Fn(&'a Value) -> Option<T>) -> T {
        let value = self.fields.get(name).and_then(read);
        value.unwrap_or_else(|| {
            let Self { index, fields } = self;
            panic!("case {index}: no usable {name:?} in {fields}")
        })
    }

    /// Returns the kind of the case, such as "random" or the name of a degeneracy; "" if there is
    /// none.
    pub fn tag(&self) -> &str {
        self.fields["tag"].as_str().unwrap_or("")
    }

    /// Returns a text.
    pub fn text(&self, name: &str) -> &str {
        self.field(name, Value::as_str)
    }

    /// Returns a truth value.
    pub fn flag(&self, name: &str) -> bool {
        self.field(name, Value::as_bool)
    }

    /// Returns an input exactly, or a result rounded to `f64`.
    pub fn number(&self, name: &str) -> f64 {
        self.field(name, number)
    }

    /// Returns a result to all its digits, also beyond the range of `f64`.
    pub fn precise(&self, name: &str) -> Precise {
        self.field(name, |json| Precise::parse(json.as_str()?).ok())
    }

    /// Returns a vector, such as a corner or a direction.
    pub fn vec3(&self, name: &str) -> [f64; 3] {
        self.field(name, numbers)
    }

    /// Returns a list of points of N coordinates, such as the corners of a polygon or the ends of
    /// intervals.
    pub fn points<const N: usize>(&self, name: &str) -> Vec<[f64; N]> {
        self.field(name, |json| json.as_array()?.iter().map(numbers).collect())
    }

    /// Returns |got − want| / max(|want|, scale) for the result `name`; infinite when `got` is not
    /// finite.
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
        assert_eq!((vectors.schema.as_str(), vectors.cases.len()), ("demo", 2));
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
    }

    #[test]
    #[should_panic(expected = "case 1: no usable \"p\"")]
    fn names_what_is_missing() {
        Vectors::parse(FILE).unwrap().cases[1].vec3("p");
    }
}

//! Shared by the integration tests: the reference vectors.

pub(crate) mod reference;

use linelit_geometry::DVec3;

/// One case of a vector file: a line of JSON whose values are numbers, strings holding numbers, or
/// nested lists of them.
pub(crate) struct Case<'a>(&'a str);

impl<'a> Case<'a> {
    /// All cases of a file.
    pub(crate) fn all(file: &'a str) -> impl Iterator<Item = Case<'a>> {
        file.lines()
            .filter(|l| l.contains("\"tag\""))
            .map(|l| Case(l.trim().trim_end_matches(',')))
    }

    fn raw(&self, key: &str) -> &'a str {
        let name = format!("\"{key}\": ");
        let start = self
            .0
            .find(&name)
            .unwrap_or_else(|| panic!("no {key} in {}", self.0))
            + name.len();
        let rest = &self.0[start..];
        let end = rest.find(", \"").map(|first| {
            // A comma before a quote ends the value unless a list of strings is still open.
            if rest.starts_with('[') {
                rest.find(']').map_or(first, |close| {
                    if rest[close..].starts_with("]]") || !rest.starts_with("[[") {
                        close + 1
                    } else {
                        rest.find("]]").unwrap_or(close) + 2
                    }
                })
            } else {
                first
            }
        });
        rest[..end.unwrap_or(rest.len())].trim_end_matches('}')
    }

    pub(crate) fn text(&self, key: &str) -> &'a str {
        self.raw(key).trim_matches('"')
    }

    pub(crate) fn numbers(&self, key: &str) -> Vec<f64> {
        self.raw(key)
            .split(',')
            .map(|s| s.trim_matches(|c| " []\"".contains(c)))
            .filter(|s| !s.is_empty())
            .map(|s| s.parse().unwrap_or_else(|e| panic!("{key}: {e}: {s}")))
            .collect()
    }

    pub(crate) fn number(&self, key: &str) -> f64 {
        self.numbers(key)[0]
    }

    pub(crate) fn point(&self, key: &str) -> DVec3 {
        let n = self.numbers(key);
        DVec3::new(n[0], n[1], n[2])
    }
}

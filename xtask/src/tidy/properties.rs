//! The rule about property tests: a long run is long for all of them.

use super::House;
use crate::source;

/// Where a configuration says how many cases; what follows must not be a number of its own.
const SET_BY: [&str; 2] = ["cases:", "with_cases("];

pub(super) fn cases_are_scaled(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in &house.sources {
        // Tests within shipped files count, too.
        let code = source::code_only(&file.text);
        if !code.contains("ProptestConfig") {
            continue;
        }
        for (start, word) in SET_BY.iter().flat_map(|word| code.match_indices(word)) {
            let value = code[start + word.len()..].trim_start();
            let own = value.starts_with(|c: char| c.is_ascii_digit());
            if own
                || value
                    .chars()
                    .take_while(|c| c.is_uppercase() || *c == '_')
                    .count()
                    > 1
            {
                let line = code[..start].matches('\n').count() + 1;
                let path = &file.path;
                problems.push(format!(
                    "{path}:{line}: a number of cases that `--long` does not reach; say cases(…) of linelit-testkit"
                ));
            }
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_cases_are_seen() {
        let found = |text: &str| {
            let text = format!("#[cfg(test)] mod tests {{\n{text}\n}}");
            cases_are_scaled(&House::of("crates/mis/src/x.rs", &text)).len()
        };
        assert_eq!(found("ProptestConfig { cases: 64, ..x }"), 1);
        assert_eq!(found("ProptestConfig {\n    cases:\n 64, ..x }"), 1);
        assert_eq!(found("ProptestConfig { cases: CASES, ..x }"), 1);
        assert_eq!(found("ProptestConfig::with_cases(64)"), 1);
        assert_eq!(found("ProptestConfig::with_cases(cases(64))"), 0);
        assert_eq!(found("ProptestConfig { cases: cases(64), ..x }"), 0);
        assert_eq!(found("// ProptestConfig { cases: 64 }"), 0);
        // Tables of another kind.
        assert_eq!(found("let cases: [u8; 2] = [64, 65];"), 0);
    }
}

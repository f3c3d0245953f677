//! Rules about Rust files that neither clippy nor the compiler checks: which lints a crate turns
//! on, and what examples and tests say. The methods, types and macros that libraries must not use
//! are in `clippy.toml`.

use super::{House, Member, Source};

/// The crates that do no I/O, start no thread, do not allocate per sample and cannot fail.
const PURE: &str = "elementary simd geometry samplers lights bsdf shading mis";

/// The crates that compute a pixel.
const PIXEL_PATH: &str = "elementary simd geometry samplers lights selection bsdf shading visibility mis penumbra estimators direct integrator";

/// The crate of vendor intrinsics. The workspace's lints deny `unsafe_code` there, and one file
/// allows it with a reason; all other crates forbid it.
const KERNELS: &str = "simd";

/// Returns whether a list of words, separated by blanks, contains this word.
fn is_one_of(list: &str, owner: &str) -> bool {
    list.split(' ').any(|name| name == owner)
}

/// Checks that each library turns on the lints against side effects, and the pure ones also their
/// own lints.
pub(super) fn lints(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in house.libraries() {
        let on = |lints: &str| format!("#![cfg_attr(not(test), warn({lints}))]");
        let owner = file.owner.as_str();
        let mut wanted = vec![match owner {
            // The crate of a program.
            "cli" => on("clippy::unwrap_used"),
            _ => on("clippy::disallowed_methods, clippy::unwrap_used"),
        }];
        if !is_one_of(KERNELS, owner) {
            wanted.push("#![forbid(unsafe_code)]".to_owned());
        }
        if is_one_of(PURE, owner) {
            wanted.push(match owner {
                // Its lanes are f32.
                "simd" => on("clippy::disallowed_macros"),
                // Its module `stop` has a thread-local variable.
                "geometry" => on("clippy::disallowed_types"),
                _ => on("clippy::disallowed_types, clippy::disallowed_macros"),
            });
            wanted.push(on("clippy::panic, clippy::unreachable"));
        }
        let missing = wanted.iter().filter(|line| !file.text.contains(*line));
        problems.extend(missing.map(|line| format!("{}: lacks {line}", file.path)));
    }
    problems
}

/// Checks that in the crates that compute a pixel `Result` is returned only by constructors
/// (`try_…`, or returning `Result<Self, _>`) and by parsers of names (`FromStr`).
pub(super) fn fallibility(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    let path = house
        .sources
        .iter()
        // Leave out `stop.rs`, whose `Result` is for callers that catch the end of stopped work,
        // and the queries of visible parts, which no pixel makes.
        .filter(|s| is_one_of(PIXEL_PATH, &s.owner))
        .filter(|s| !s.path.ends_with("geometry/src/stop.rs"))
        .filter(|s| !s.path.ends_with("direct/src/visible.rs"));
    for file in path {
        for (start, _) in file.code.match_indices("pub fn ") {
            let signature = &file.code[start + "pub fn ".len()..];
            let signature = signature.split(['{', ';']).next().unwrap_or_default();
            let returned = signature.rsplit_once("->").map_or("", |(_, r)| r);
            let constructor = signature.starts_with("try_") || returned.contains("Result<Self");
            if returned.contains("Result") && !constructor {
                let line = file.code[..start].lines().count().max(1);
                let why = "a Result; in the path of a pixel only constructors can fail";
                problems.push(format!("{}:{line}: {why}", file.path));
            }
        }
    }
    problems
}

/// Checks the lines of all Rust files for forbidden text.
pub(super) fn lines(house: &House) -> Vec<String> {
    let ignored = |line: &str| {
        let line = line.trim_start();
        line.starts_with("#[ignore") && !line.starts_with("#[ignore = \"long: ")
    };
    // The number of cases is in a field of `ProptestConfig` or in `with_cases`.
    let own_cases = |line: &str| {
        let field = line.contains("ProptestConfig {") || line.trim_start().starts_with("cases: ");
        let set = if field { "cases: " } else { "with_cases(" };
        let value = line.split_once(set).map_or("", |(_, value)| value);
        value.starts_with(|c: char| c.is_ascii_digit() || c.is_ascii_uppercase())
    };
    // Rustfmt does not wrap comments. Rows of tables cannot be wrapped.
    let wide = |line: &str| {
        let text = line.trim_start();
        let row = text.starts_with("//! |") || text.starts_with("/// |");
        text.starts_with("//") && !(row && text.ends_with('|')) && line.chars().count() > 100
    };
    let mut problems = Vec::new();
    for file in &house.sources {
        let why = "an ignored test says `long: …` why (and runs with --long)";
        problems.extend(file.complain(ignored, why));
        problems.extend(file.complain(wide, "a comment beyond column 100"));
        if file.text.contains("ProptestConfig") {
            let why = "a number of cases that `--long` does not reach; say cases(…) of testkit";
            problems.extend(file.complain(own_cases, why));
        }
    }
    problems
}

/// Checks that each library shows an example, on its front page or in the README that the page
/// includes. (`missing_docs` checks that it has a front page.)
pub(super) fn crate_pages(house: &House) -> Vec<String> {
    let silent = house.libraries().filter(|file| {
        let readme = house.text(&format!("crates/{}/README.md", file.owner));
        let included = file.text.contains("include_str!(\"../README.md\")");
        let shown = |line: &str| line.trim_start_matches("//! ").starts_with("```");
        let front = file.text.lines().take_while(|l| l.starts_with("//!"));
        !(front.into_iter().any(shown) || included && readme.lines().any(shown))
    });
    silent
        .map(|file| format!("{}: the front page shows no example", file.path))
        .collect()
}

/// Checks that examples of a published library use no other crate of ours, so that a reader needs
/// one line in the manifest. Types in signatures have to be re-exported, or the examples would not
/// compile.
pub(super) fn one_dependency(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for Member { owner, .. } in house.members.iter().filter(|m| m.is_published()) {
        let path = format!("crates/{owner}/README.md");
        let page = Source::new(&path, house.text(&path));
        let own = format!("use linelit_{owner}::");
        let another = |line: &str| {
            let example = line.trim_start_matches(['/', '!', ' ']);
            example.starts_with("use linelit_") && !example.starts_with(&own)
        };
        let why = "an example that needs another crate than its own";
        problems.extend(page.complain(another, why));
        let shipped = house.sources.iter().filter(|s| !s.code.is_empty());
        for file in shipped.filter(|s| s.owner == *owner) {
            let in_doc = |line: &str| line.trim_start().starts_with("//") && another(line);
            problems.extend(file.complain(in_doc, why));
        }
    }
    problems
}

/// The names of parameters that are angles.
const ANGLES: &str = "angle half_angle angles theta phi azimuth elevation rotation fov turn";

/// Checks that each parameter of a public function that is an angle has its unit in its name:
/// `angle_rad`, `fov_degrees`.
pub(super) fn angles(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    let published = house.members.iter().filter(|m| m.is_published());
    let owners: Vec<_> = published.map(|m| m.owner.as_str()).collect();
    for file in house.sources.iter().filter(|s| owners.contains(&&*s.owner)) {
        for head in ["pub fn ", "pub const fn "] {
            for (start, _) in file.code.match_indices(head) {
                let signature = file.code[start..].split(['{', ';']).next();
                let words = signature
                    .unwrap_or_default()
                    .split(['(', ',', '[', ' ', '\n']);
                let named = words.filter_map(|word| word.strip_suffix([':', ']']));
                for name in named.filter(|name| is_one_of(ANGLES, name)) {
                    let line = file.code[..start].lines().count().max(1);
                    let why = "an angle in radians or degrees? Name it so";
                    problems.push(format!("{}:{line}: `{name}`: {why}", file.path));
                }
            }
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::super::Rule;
    use super::*;

    /// Returns the number of problems that a rule finds in a crate's file.
    fn found(rule: Rule, path: &str, text: &str) -> usize {
        rule(&House::of(&format!("crates/{path}"), text)).len()
    }

    /// Each rule finds a violation.
    #[test]
    fn rules_bite() {
        let fails = "pub fn a(&self) -> Result<f64, E> {";
        let hidden = format!("// {fails}\n#[cfg(test)]\nmod tests {{\n{fails}\n}}");
        let constructors = "pub fn try_new() -> Result<A, B> {}\npub fn a() -> Result<Self, B> {}";
        // Written such that this file does not violate the rule.
        let cases = |text: &str| text.replace('@', "ProptestConfig").replace('#', "cases");
        for (rule, path, text, count) in [
            (fallibility as Rule, "mis/src/x.rs", fails.to_owned(), 1),
            (fallibility, "mis/src/x.rs", hidden, 0),
            (fallibility, "mis/src/x.rs", constructors.to_owned(), 0),
            (lines, "mis/src/x.rs", format!("// {}", "a".repeat(98)), 1),
            (lines, "mis/src/x.rs", "    #[ignore = \"slow\"]".into(), 1),
            (lines, "mis/src/x.rs", cases("@ { #: 64, ..x }"), 1),
            (lines, "mis/src/x.rs", cases("@ {\n #: CASES,\n ..x }"), 1),
            (lines, "mis/src/x.rs", cases("@::with_#(64)"), 1),
            (lines, "mis/src/x.rs", cases("@::with_#(#(64))"), 0),
            (lines, "mis/src/x.rs", cases("@ { #: #(64), ..x }"), 0),
            (crate_pages, "mis/src/lib.rs", "//! Weights.".into(), 1),
            (lints, "mis/src/lib.rs", "//! Weights.".into(), 4),
            (lints, "film/src/lib.rs", "//! Weights.".into(), 2),
            (lints, "simd/src/lib.rs", "//! Weights.".into(), 3),
        ] {
            assert_eq!(found(rule, path, &text), count, "{path}: {text}");
        }
    }

    #[test]
    fn angles_have_units() {
        let text = "pub fn a(angle: f64) {\npub const fn b(\n    x: f64,\n    phi: f64,\n) {\n\
            pub fn c(angle_rad: f64, alphi: f64) {\nfn d(theta: f64) {";
        let mut house = House::of("crates/mis/src/x.rs", text);
        let (owner, manifest) = ("mis".to_owned(), "[package]\n".to_owned());
        house.members.push(Member { owner, manifest });
        assert_eq!(angles(&house).len(), 2);
    }

    #[test]
    fn examples_need_one_dependency() {
        let text = "/// use linelit_mis::a;\n//! use linelit_lights::a;\nuse linelit_lights::c;\n";
        let mut house = House::of("crates/mis/src/x.rs", text);
        let manifest = "[package]\n".to_owned();
        let owner = "mis".to_owned();
        house.members.push(Member { owner, manifest });
        assert_eq!(one_dependency(&house).len(), 1);
        house.members[0].manifest += "publish = false\n";
        assert!(one_dependency(&house).is_empty());
    }
}

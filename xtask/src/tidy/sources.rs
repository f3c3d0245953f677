//! Rules about Rust files that neither clippy nor the compiler has: which lints a crate turns on,
//! who may make exceptions, and a few words. Methods, types and macros that libraries do without
//! are in `clippy.toml`.

use super::manifests::name;
use super::{House, Source, has_word};

/// Crates that do no I/O, start no thread, do not allocate per sample and cannot fail.
const PURE: &str = "elementary simd geometry samplers lights spheres bsdf shading mis";

/// The crates in the path of a pixel.
const PIXEL_PATH: &str = "elementary simd geometry samplers lights spheres selection bsdf shading visibility mis penumbra estimators integrator";

/// The crate of vendor intrinsics: the workspace's lints deny `unsafe_code` there, one file allows
/// it with a reason. In all others it is forbidden.
const KERNELS: &str = "simd";

fn is_one_of(list: &str, owner: &str) -> bool {
    list.split(' ').any(|name| name == owner)
}

/// Each library turns on the lints that keep it without effects, and the pure ones those of theirs.
pub(super) fn lints(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in house.libraries() {
        let on = |lints: &str| format!("#![cfg_attr(not(test), warn({lints}))]");
        let owner = file.owner.as_str();
        let mut wanted = vec![match owner {
            // A program.
            "cli" => on("clippy::unwrap_used"),
            _ => on("clippy::disallowed_methods, clippy::unwrap_used"),
        }];
        if !is_one_of(KERNELS, owner) {
            wanted.push("#![forbid(unsafe_code)]".to_owned());
        }
        if is_one_of(PURE, owner) {
            wanted.push(match owner {
                // Lanes are f32.
                "simd" => on("clippy::disallowed_macros"),
                _ => on("clippy::disallowed_types, clippy::disallowed_macros"),
            });
            wanted.push(on("clippy::panic, clippy::unreachable"));
        }
        let missing = wanted.iter().filter(|line| !file.text.contains(*line));
        problems.extend(missing.map(|line| format!("{}: lacks {line}", file.path)));
    }
    problems
}

/// Files and folders that may except themselves from what `clippy.toml` disallows; each says why.
const EXCEPTIONS: &str = "assembly/src/diagnostics/source.rs film/src/atomic.rs \
    geometry/src/intervals/tree.rs geometry/src/vector.rs lights/src/image.rs lights/src/line/by_texture.rs lights/src/polygon/region.rs \
    papers/src/claims/ papers/src/peters_table1.rs \
    papers/src/shirley.rs plan/src/durable.rs \
    plan/src/run.rs plan/src/status.rs samplers/src/kind.rs scenes/src/library.rs \
    bsdf/src/facet_cosine.rs study/src/engine/ study/src/scene_study/ study/src/memory.rs study/src/tables.rs \
    testkit/src/";

pub(super) fn exceptions(house: &House) -> Vec<String> {
    let why = "an exception from clippy.toml; tidy's list says who may make one";
    let others = house.sources.iter().filter(|source| {
        let path = source.path.strip_prefix("crates/").unwrap_or_default();
        !path.ends_with("/lib.rs") && !EXCEPTIONS.split(' ').any(|room| path.starts_with(room))
    });
    let disallowed =
        |line: &str| line.trim_start().starts_with("#") && line.contains("clippy::disallowed_");
    others
        .flat_map(|s| s.complain(&s.code, disallowed, why))
        .collect()
}

/// Types of other people's crates stay out of public APIs, but for glam's.
pub(super) fn foreign_types(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for member in &house.members {
        let known: Vec<String> = member
            .section("dependencies")
            .map(|l| name(l).replace('-', "_"))
            .collect();
        let exported = |line: &str| {
            let path = line
                .trim_start()
                .strip_prefix("pub use ")
                .unwrap_or_default();
            let first = path
                .split("::")
                .next()
                .unwrap_or_default()
                .trim_end_matches(';');
            first != "glam" && !first.starts_with("linelit_") && known.iter().any(|k| k == first)
        };
        let why = "types of other people's crates stay out of public APIs";
        let own = house.sources.iter().filter(|s| s.owner == member.owner);
        problems.extend(own.flat_map(|s| s.complain(&s.code, exported, why)));
    }
    problems
}

/// In the path of a pixel `Result` comes only from constructors (`try_…`, or returning
/// `Result<Self, _>`) and from reading names (`FromStr`).
pub(super) fn fallibility(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    let path = house
        .sources
        .iter()
        .filter(|s| is_one_of(PIXEL_PATH, &s.owner));
    for file in path {
        for (start, _) in file.code.match_indices("pub fn ") {
            let signature = file.code[start + 7..]
                .split(['{', ';'])
                .next()
                .unwrap_or_default();
            let returned = signature.rsplit_once("->").map_or("", |(_, r)| r);
            let constructor = signature.starts_with("try_") || returned.contains("Result<Self");
            if returned.contains("Result") && !constructor {
                let line = file.code[..start].lines().count().max(1);
                let name = signature.split(['(', '<']).next().unwrap_or_default();
                let why = "returns a Result; in the path of a pixel only constructors can fail";
                problems.push(format!("{}:{line}: `{name}` {why}", file.path));
            }
        }
    }
    problems
}

pub(super) fn unfinished_work(house: &House) -> Vec<String> {
    // Split, to not find themselves.
    let unfinished = [
        concat!("TO", "DO"),
        concat!("FIX", "ME"),
        concat!("XX", "X"),
    ];
    let marked = |line: &str| unfinished.iter().any(|word| has_word(line, word));
    let ignored = |line: &str| {
        let line = line.trim_start();
        line.starts_with("#[ignore") && !line.starts_with("#[ignore = \"long: ")
    };
    let mut problems = Vec::new();
    for file in &house.sources {
        let why = "unfinished; finish it or open an issue";
        problems.extend(file.complain(&file.text, marked, why));
        let why = "an ignored test says `long: …` why (and runs with --long)";
        problems.extend(file.complain(&file.text, ignored, why));
    }
    problems
}

/// A long run is long for all properties: their numbers of cases are `cases(n)` of testkit.
pub(super) fn cases_are_scaled(house: &House) -> Vec<String> {
    let own = |line: &str| {
        let field = line.contains("ProptestConfig {") || line.trim_start().starts_with("cases: ");
        let set = if field { "cases: " } else { "with_cases(" };
        let value = line.split_once(set).map_or("", |(_, value)| value);
        value.starts_with(|c: char| c.is_ascii_digit() || c.is_ascii_uppercase())
    };
    let why = "a number of cases that `--long` does not reach; say cases(…) of linelit-testkit";
    let set = |s: &&Source| s.text.contains("ProptestConfig");
    let files = house.sources.iter().filter(set);
    files.flat_map(|s| s.complain(&s.text, own, why)).collect()
}

/// Files end at line 700, comments at column 100: rustfmt wraps none. Rows of tables cannot be.
pub(super) fn layout(house: &House) -> Vec<String> {
    let wide = |line: &str| {
        let text = line.trim_start();
        let row = text.starts_with("//! |") || text.starts_with("/// |");
        let row = row && text.ends_with('|');
        text.starts_with("//") && !row && line.chars().count() > 100
    };
    let mut problems = Vec::new();
    for file in &house.sources {
        let lines = file.text.lines().count();
        if lines > 700 {
            problems.push(format!("{}: {lines} lines, beyond 700", file.path));
        }
        problems.extend(file.complain(&file.text, wide, "a comment beyond column 100"));
    }
    problems
}

/// Each library shows an example, in its front page or the README that the page includes. (That it
/// has a page, `missing_docs` sees.)
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

/// Examples of a published library name no other crate of ours: who reads them needs one line in
/// their manifest, and what signatures name is re-exported, or the examples would not compile.
pub(super) fn one_dependency(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for file in &house.sources {
        let own = format!("linelit_{}", file.owner);
        let other = |line: &str| {
            let doc = line.trim_start();
            let doc = doc.strip_prefix("///").or_else(|| doc.strip_prefix("//!"));
            doc.is_some_and(|line| names_another(line, &own))
        };
        let why = "an example that needs another crate than its own";
        if !file.code.is_empty() && house.is_published(&file.owner) {
            problems.extend(file.complain(&file.text, other, why));
        }
    }
    for member in &house.members {
        let path = format!("crates/{}/README.md", member.owner);
        let own = format!("linelit_{}", member.owner);
        let text = house.text(&path);
        let lines = text.lines().enumerate();
        let others = lines.filter(|(_, line)| names_another(line, &own));
        if house.is_published(&member.owner) {
            problems
                .extend(others.map(|(i, _)| {
                    format!("{path}:{}: an example that needs another crate", i + 1)
                }));
        }
    }
    problems
}

/// Whether a line of an example uses a crate of ours but `own`.
fn names_another(line: &str, own: &str) -> bool {
    let used = line.trim_start().strip_prefix("use ").unwrap_or_default();
    let used = used.split("::").next().unwrap_or_default();
    used.starts_with("linelit_") && used != own
}

#[cfg(test)]
mod tests {
    use super::super::{Member, Rule};
    use super::*;

    /// What a rule says of a file of a crate's.
    fn found(rule: Rule, owner: &str, text: &str) -> usize {
        rule(&House::of(&format!("crates/{owner}/src/x.rs"), text)).len()
    }

    /// Each rule sees the offence it is for, and nothing in comments and tests.
    #[test]
    fn rules_bite() {
        let cases: [(Rule, &str, &str); 6] = [
            (exceptions, "mis", "#[allow(clippy::disallowed_types)]"),
            (fallibility, "mis", "pub fn a(&self) -> Result<f64, E> {"),
            (layout, "mis", &"a\n".repeat(701)),
            (layout, "mis", &format!("// {}", "a".repeat(98))),
            (unfinished_work, "mis", concat!("// TO", "DO: more")),
            (unfinished_work, "mis", "    #[ignore = \"slow\"]"),
        ];
        for (i, (rule, owner, text)) in cases.into_iter().enumerate() {
            assert_eq!(found(rule, owner, text), 1, "{text}");
            // What follows is about text, not code.
            let hidden = format!("// {text}\n#[cfg(test)]\nmod tests {{\n{text}\n}}");
            assert!(i > 1 || found(rule, owner, &hidden) == 0, "{hidden}");
        }
        let page = |rule: Rule, owner: &str| {
            rule(&House::of(
                &format!("crates/{owner}/src/lib.rs"),
                "//! Weights.",
            ))
            .len()
        };
        assert_eq!(page(crate_pages, "mis"), 1);
        assert_eq!(
            [page(lints, "mis"), page(lints, "film"), page(lints, "simd")],
            [4, 2, 3]
        );
    }

    #[test]
    fn rules_let_the_right_ones_in() {
        let constructors = "pub fn try_new() -> Result<A, B> {}\npub fn a() -> Result<Self, B> {}";
        assert_eq!(found(fallibility, "mis", constructors), 0);
        assert_eq!(found(layout, "mis", &"a\n".repeat(700)), 0);
    }

    #[test]
    fn examples_need_one_dependency() {
        let mut house = House::of("crates/mis/src/x.rs", "/// use linelit_mis::a;\n");
        let manifest = "[package]\n".to_owned();
        let owner = "mis".to_owned();
        house.members.push(Member { owner, manifest });
        assert!(one_dependency(&house).is_empty());
        let text = "//! use linelit_lights::a;\n/// use linelit_mis::b;\nuse linelit_lights::c;\n";
        house.sources = House::of("crates/mis/src/x.rs", text).sources;
        assert_eq!(one_dependency(&house).len(), 1);
        house.members[0].manifest += "publish = false\n";
        assert!(one_dependency(&house).is_empty());
    }

    #[test]
    fn numbers_of_cases_are_seen() {
        // Spelled so that this file does not accuse itself.
        let spelled = |text: &str| text.replace('@', "ProptestConfig").replace('#', "cases");
        let seen = |text: &str| found(cases_are_scaled, "mis", &spelled(text));
        assert_eq!(seen("@ { #: 64, ..x }"), 1);
        assert_eq!(seen("@ {\n    #: CASES,\n ..x }"), 1);
        assert_eq!(seen("@::with_#(64)"), 1);
        assert_eq!(seen("@::with_#(#(64))"), 0);
        assert_eq!(seen("@ { #: #(64), ..x }"), 0);
        // Tables of another kind.
        assert_eq!(seen("@; let sizes: [u8; 2] = [64, 65];"), 0);
    }
}

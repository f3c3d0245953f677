//! The ratchet: figures of how large and how tangled the house is, which only rise with a reason.
//!
//! `xtask/ratchet.txt` has the last ones. Whoever lowers a figure lowers the file (`cargo xtask
//! ratchet`); a change that needs more raises it by hand, and its commit says what that buys and
//! what went for it. Two figures are kept:
//!
//! - `code ROOM`: the lines of `src` of each crate and of xtask that are neither blank, nor a
//!   comment, nor unit tests at the end of a file;
//! - `circle ROOM`: the largest set of files of one crate that need each other, through re-exports,
//!   too.

use super::{House, Source};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

const FILE: &str = "xtask/ratchet.txt";

type Figures = BTreeMap<String, usize>;

/// Figures that are above those in the file, or below without having lowered it.
pub(super) fn may_only_fall(house: &House) -> Vec<String> {
    let (last, now) = (last(house), figures(house));
    let names: BTreeSet<&String> = last.keys().chain(now.keys()).collect();
    let changed = names.into_iter().filter_map(|name| {
        let [last, now] = [&last, &now].map(|figures| figures.get(name).copied().unwrap_or(0));
        let what = match now.cmp(&last) {
            std::cmp::Ordering::Greater => "a commit that raises it says what for",
            std::cmp::Ordering::Less => "lower the file: cargo xtask ratchet",
            std::cmp::Ordering::Equal => return None,
        };
        Some(format!("{FILE}: {name} is {now}, was {last}; {what}"))
    });
    changed.collect()
}

/// Writes the figures that fell, and returns how many.
pub(super) fn lower(house: &House, root: &Path) -> Result<usize, String> {
    let (last, now) = (last(house), figures(house));
    let fallen =
        |(name, figure): &(&String, &usize)| now.get(*name).is_none_or(|now| now < *figure);
    let lowered = last.iter().filter(fallen).count();
    let mut text = String::new();
    for (name, figure) in &last {
        let figure = now.get(name).map_or(0, |now| *now.min(figure));
        if figure > 0 {
            text += &format!("{name} {figure}\n");
        }
    }
    fs::write(root.join(FILE), text).map_err(|e| format!("{FILE}: {e}"))?;
    Ok(lowered)
}

fn last(house: &House) -> Figures {
    let text = house.text(FILE);
    let lines = text.lines().filter_map(|line| line.rsplit_once(' '));
    lines
        .filter_map(|(name, figure)| Some((name.to_owned(), figure.parse().ok()?)))
        .collect()
}

fn figures(house: &House) -> Figures {
    let mut figures = Figures::new();
    let mut crates = BTreeMap::<&str, Vec<&Source>>::new();
    for file in house.sources.iter().filter(|file| file.module().is_some()) {
        let code = figures.entry(format!("code {}", file.owner)).or_default();
        *code += code_lines(&file.text);
        crates.entry(&file.owner).or_default().push(file);
    }
    for (owner, files) in crates {
        figures.insert(format!("circle {owner}"), largest_circle(&files));
    }
    figures.retain(|_, figure| *figure > 0);
    figures
}

/// The lines of a file that are neither blank nor a comment, up to the unit tests at its end.
fn code_lines(text: &str) -> usize {
    let is_body = |at: &usize| text[*at..].lines().nth(2).is_some_and(|l| l.ends_with('{'));
    let mut tests = text.match_indices("\n#[cfg(test)]\nmod ").map(|(at, _)| at);
    let end = tests.find(is_body).unwrap_or(text.len());
    let lines = text[..end].lines().map(str::trim_start);
    lines
        .filter(|line| !line.is_empty() && !line.starts_with("//"))
        .count()
}

/// The size of the largest set of files that all lead to each other; 0 if none does.
fn largest_circle(files: &[&Source]) -> usize {
    let modules: BTreeMap<String, &Source> = files
        .iter()
        .filter_map(|file| Some((file.module()?, *file)))
        .collect();
    let exports = exports(modules.get("").map_or("", |root| &root.code));
    // The longest part of a path that is a module.
    let module_of = |path: &str| {
        let mut known = path;
        while !known.is_empty() && !modules.contains_key(known) {
            known = known.rsplit_once("::").map_or("", |(parent, _)| parent);
        }
        (!known.is_empty()).then(|| known.to_owned())
    };
    let find = |path: &str| {
        let exported = || module_of(exports.get(path.split("::").next()?)?);
        module_of(path).or_else(exported)
    };
    let arrows: BTreeMap<&str, BTreeSet<String>> = modules
        .iter()
        .filter(|(module, _)| !module.is_empty())
        .map(|(module, file)| {
            let parent = module.rsplit_once("::").map_or("", |(parent, _)| parent);
            let within = paths(&file.code, "super::").map(|path| format!("{parent}::{path}"));
            let all = paths(&file.code, "crate::").chain(within);
            let found = all.filter_map(|path| find(path.trim_start_matches("::")));
            (module.as_str(), found.filter(|to| to != module).collect())
        })
        .collect();
    let reached = |from: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from.to_owned()]);
        while let Some(module) = open.pop() {
            let next = arrows.get(module.as_str()).into_iter().flatten();
            open.extend(next.filter(|to| seen.insert((*to).clone())).cloned());
        }
        seen
    };
    let all: BTreeMap<&str, BTreeSet<String>> =
        arrows.keys().map(|from| (*from, reached(from))).collect();
    let circle = |(from, to): (&&str, &BTreeSet<String>)| {
        let back = |to: &&String| all.get(to.as_str()).is_some_and(|t| t.contains(*from));
        to.iter().filter(back).count()
    };
    all.iter().map(circle).max().unwrap_or(0)
}

/// The module in which each name lies that a front page exports.
fn exports(code: &str) -> BTreeMap<String, String> {
    let uses = code
        .match_indices("pub use ")
        .chain(code.match_indices("pub(crate) use "));
    let names = uses.flat_map(|(at, word)| expand(&code[at + word.len()..]));
    let split = |path: String| {
        let path = path.trim_start_matches("crate::");
        let (module, name) = path.rsplit_once("::")?;
        Some((name.to_owned(), module.to_owned()))
    };
    names.filter_map(split).collect()
}

/// The paths behind each `start`, those in braces one by one.
fn paths(code: &str, start: &str) -> impl Iterator<Item = String> {
    code.match_indices(start)
        .filter(|(at, _)| !code[..*at].ends_with("::"))
        .flat_map(|(at, word)| expand(&code[at + word.len()..]))
}

/// The path at the beginning of a text, and all of its branches: `a::{b, c::d}` is `a::b` and
/// `a::c::d`.
fn expand(text: &str) -> Vec<String> {
    let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let text = text.trim_start();
    let head = &text[..text.find(|c: char| !is_path(c)).unwrap_or(text.len())];
    let Some(inside) = text[head.len()..].strip_prefix('{') else {
        return vec![head.trim_end_matches(':').to_owned()];
    };
    let step = |c: char| i32::from(c == '{') - i32::from(c == '}');
    let (mut outside, mut depth) = (0, 0);
    let end = inside.find(|c| {
        outside -= step(c);
        outside > 0
    });
    let parts = inside[..end.unwrap_or(inside.len())].split(|c| {
        depth += step(c);
        c == ',' && depth == 0
    });
    let named = parts.filter(|part| !part.trim().is_empty());
    let branches = named.flat_map(expand);
    branches.map(|path| format!("{head}{path}")).collect()
}

impl Source {
    /// The module that a file below `src` is, `a::b`; the front page and the program are none.
    fn module(&self) -> Option<String> {
        let path = self.path.strip_suffix(".rs")?;
        let path = path.trim_start_matches("crates/").split_once('/')?.1;
        let path = path.strip_prefix("src/")?.trim_end_matches("/mod");
        Some(match path {
            "lib" | "main" => String::new(),
            path => path.replace('/', "::"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(text: &str, name: &str) -> usize {
        let house = House::of("crates/visibility/src/x.rs", text);
        figures(&house).get(name).copied().unwrap_or(0)
    }

    #[test]
    fn code_is_counted_without_comments_and_tests() {
        let text = "//! A page.\n\nfn a() {\n    // A step.\n}\n\n#[cfg(test)]\nmod tests {\n}\n";
        assert_eq!(figure(text, "code visibility"), 2);
        let outside = "fn a() {}\n#[cfg(test)]\nmod tests;\nfn b() {}\n";
        assert_eq!(figure(outside, "code visibility"), 4);
    }

    #[test]
    fn circles_are_found_through_exports_and_braces() {
        assert_eq!(
            expand("a::{b, c::{d, e as f}, g};"),
            ["a::b", "a::c::d", "a::c::e", "a::g"]
        );
        let file =
            |path: &str, text: &str| Source::new(&format!("crates/mis/src/{path}"), text.into());
        let mut house = House::of("crates/mis/src/lib.rs", "pub use a::{Kind, Other};\n");
        house.sources.push(file("a.rs", "use crate::b::mend;\n"));
        house
            .sources
            .push(file("b/mod.rs", "use super::c::Thing;\n"));
        house.sources.push(file("c.rs", "use crate::{d, Kind};\n"));
        house.sources.push(file("d.rs", "fn d() {}\n"));
        assert_eq!(figures(&house).get("circle mis"), Some(&3));
    }

    #[test]
    fn what_rises_is_named_and_what_falls_is_written() {
        let root = std::env::temp_dir().join(format!("linelit-ratchet-{}", std::process::id()));
        fs::create_dir_all(root.join("xtask")).unwrap();
        let mut house = House::of("crates/mis/src/x.rs", "a\nb\n");
        house.root.clone_from(&root);
        fs::write(root.join(FILE), "circle mis 3\ncode mis 1\ntall 4\n").unwrap();
        assert_eq!(may_only_fall(&house).len(), 3);
        assert_eq!(lower(&house, &root), Ok(2));
        assert_eq!(house.text(FILE), "code mis 1\n");
        assert_eq!(may_only_fall(&house).len(), 1);
        fs::remove_dir_all(root).unwrap();
    }
}

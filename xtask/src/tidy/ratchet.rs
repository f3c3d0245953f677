//! The ratchet: figures for the size of the crates and for how much their files depend on each
//! other, which may rise only with a reason.
//!
//! `xtask/ratchet.txt` has the last figures. A change that lowers a figure also lowers the file
//! (`cargo xtask ratchet`); a change that needs more raises it by hand, and the body of its commit
//! says what that buys and what was removed for it. There are two kinds of figures:
//!
//! - `code CRATE`: the lines of `src` of each crate and of xtask that are neither blank, nor a
//!   comment, nor unit tests at the end of a file;
//! - `circle CRATE`: the largest set of files of one crate that need each other, by `crate::…`,
//!   `super::…`, names that the front page re-exports, and a module's own children; links in docs
//!   count.

use super::{House, Source, before_tests};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The file of the last figures.
const FILE: &str = "xtask/ratchet.txt";

/// Figures by name.
type Figures = BTreeMap<String, usize>;

/// Returns a problem for each figure that is above the figure in the file, or below it without the
/// file having been lowered.
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

/// Writes the figures that fell to the file, and returns how many fell.
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

/// Returns the figures in the file.
fn last(house: &House) -> Figures {
    let text = house.text(FILE);
    let lines = text.lines().filter_map(|line| line.rsplit_once(' '));
    lines
        .filter_map(|(name, figure)| Some((name.to_owned(), figure.parse().ok()?)))
        .collect()
}

/// Computes the current figures.
fn figures(house: &House) -> Figures {
    let mut figures = Figures::new();
    let mut crates = BTreeMap::<&str, Vec<&Source>>::new();
    for file in house.sources.iter().filter(|file| file.module().is_some()) {
        let code = figures.entry(format!("code {}", file.owner)).or_default();
        *code += code_lines(&file.text);
        // The files of this program may need each other in circles.
        if file.owner != "xtask" {
            crates.entry(&file.owner).or_default().push(file);
        }
    }
    for (owner, files) in crates {
        figures.insert(format!("circle {owner}"), largest_circle(&files));
    }
    figures.retain(|_, figure| *figure > 0);
    figures
}

/// Counts the lines of a file that are neither blank nor a comment, up to the unit tests at its
/// end.
fn code_lines(text: &str) -> usize {
    let lines = before_tests(text).lines().map(str::trim);
    lines
        .filter(|line| !line.is_empty() && !line.starts_with("//"))
        .count()
}

/// Returns the size of the largest set of files that all lead to each other; 0 if no file leads
/// back to itself.
///
/// Each module has arrows to the modules that its paths name. Two modules are in one circle if each
/// can be reached from the other along arrows.
fn largest_circle(files: &[&Source]) -> usize {
    // Docs count, because a link in them is a path; tests do not.
    let text = |file: &&Source| {
        file.text
            .split("#[cfg(test)]\nmod")
            .next()
            .map(str::to_owned)
    };
    let modules: BTreeMap<String, String> = files
        .iter()
        .filter_map(|file| Some((file.module()?, text(file)?)))
        .collect();
    let exports = exports(modules.get("").map_or("", |root| root));
    // A path leads to its longest prefix that is a module, or to the module that exports its name.
    let find = |path: &str| {
        let ends = path.rmatch_indices("::").map(|(end, _)| &path[..end]);
        let known = [path].into_iter().chain(ends).map(str::to_owned);
        let exported = || exports.get(path.split("::").next()?).cloned();
        let found = known.into_iter().find(|path| modules.contains_key(path));
        found.or_else(|| exported().filter(|module| modules.contains_key(module)))
    };
    // Find the arrows of each module: its paths, and its uses of its own children.
    let mut arrows = BTreeMap::<&str, BTreeSet<String>>::new();
    for (module, text) in modules.iter().filter(|(module, _)| !module.is_empty()) {
        let parent = module.rsplit_once("::").map_or("", |(parent, _)| parent);
        let within = paths(text, "super").into_iter();
        let within = within.map(|path| format!("{parent}::{path}"));
        let all = paths(text, "crate").into_iter().chain(within);
        let found = all.filter_map(|path| find(path.trim_start_matches("::")));
        let children = modules.keys().filter(|other| {
            let child = other.strip_prefix(module.as_str());
            let child = child.and_then(|child| child.strip_prefix("::"));
            child.is_some_and(|child| !child.contains("::") && names_child(text, child))
        });
        let all = found.chain(children.cloned());
        arrows.insert(module, all.filter(|to| to != module).collect());
    }
    // Count, for each module, the modules that it reaches and that reach it.
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

/// Returns whether a module's code, without comments, has a path that begins with this child of it.
fn names_child(text: &str, child: &str) -> bool {
    let lines = text.lines().filter(|line| !line.trim().starts_with("//"));
    let starts = |line: &str| {
        let mut places = line.match_indices(child);
        places.any(|(at, _)| {
            line[at + child.len()..].starts_with("::")
                && !line[..at].ends_with(|c| is_of_word(c) || c == ':')
        })
    };
    lines.into_iter().any(starts)
}

/// Returns the module of each name that a front page exports.
fn exports(text: &str) -> BTreeMap<String, String> {
    let uses = text
        .match_indices("pub use ")
        .chain(text.match_indices("pub(crate) use "));
    let mut exports = BTreeMap::new();
    for (at, word) in uses {
        let path = &text[at + word.len()..];
        let path = path.strip_prefix("crate::").unwrap_or(path);
        let is_of_module = |c: char| c.is_ascii_lowercase() || c == '_' || c == ':';
        let end = path.find(|c| !is_of_module(c)).unwrap_or(path.len());
        // The names follow the last `::` before a name or braces.
        let split = path[..end].rmatch_indices("::").find_map(|(at, _)| {
            let names = &path[at + 2..];
            let inside = names.strip_prefix('{').and_then(|n| n.split_once('}'));
            let names = inside.map_or(word_of(names), |(inside, _)| inside);
            (at > 0 && !names.is_empty()).then_some((&path[..at], names))
        });
        let (module, names) = split.unwrap_or_default();
        for name in names.split(|c| !is_of_word(c)).filter(|n| !n.is_empty()) {
            exports.insert(name.to_owned(), module.to_owned());
        }
    }
    exports
}

/// Returns the paths that follow each `head::`; of names in braces, each makes a path. Nested
/// braces lose their prefix: `a::{b, c::{d}}` gives `a::b`, `a::c` and `a::d`.
fn paths(text: &str, head: &str) -> Vec<String> {
    let (mut found, mut start) = (Vec::new(), 0);
    let head = format!("{head}::");
    while let Some(at) = text[start..].find(&head).map(|at| start + at) {
        start = at + head.len();
        if text[..at].ends_with(is_of_word) {
            continue;
        }
        // Walk along `a::b::` to the last place at which a name or braces stand.
        let (mut last, mut next) = (start, start);
        loop {
            let end = next + word_of(&text[next..]).len();
            if end > next || braces(&text[next..]).is_some() {
                last = next;
            }
            if end == next || !text[end..].starts_with("::") {
                break;
            }
            next = end + 2;
        }
        let (prefix, rest) = (&text[start..last], &text[last..]);
        let names = braces(rest).unwrap_or(word_of(rest));
        start = last + names.len();
        let names = names.split(|c| !is_of_word(c) && c != ':');
        let names = names.map(|name| name.trim_matches(':'));
        let named = names.filter(|name| !name.is_empty());
        found.extend(named.map(|name| format!("{prefix}{name}")));
    }
    found
}

/// Returns the braces at the beginning of a text with their content; `None` if there are no braces,
/// or they contain more than one further level of braces.
fn braces(text: &str) -> Option<&str> {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        match depth {
            0 => return (at > 0).then(|| &text[..=at]),
            1 | 2 => {}
            _ => return None,
        }
    }
    None
}

/// Returns the word at the beginning of a text.
fn word_of(text: &str) -> &str {
    &text[..text.find(|c| !is_of_word(c)).unwrap_or(text.len())]
}

/// Returns whether a character can be part of a name.
fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

impl Source {
    /// Returns the module that a file below `src` is, `a::b`, which is empty for the front page and
    /// the program.
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
            paths(
                "crate::a::{b, c::{d, e as f}, g}; crate::h::K; x_crate::y",
                "crate"
            ),
            [
                "a::b", "a::c", "a::d", "a::e", "a::as", "a::f", "a::g", "h::K"
            ]
        );
        assert_eq!(paths("use super::super::a::*;", "super"), ["super::a"]);
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

//! The public functions and types of a crate, read from its sources, for tests that must call every
//! one of them.
#![allow(
    clippy::disallowed_methods,
    reason = "reads the sources that a test is held to"
)]

use std::path::{Path, PathBuf};

/// Returns the names of the public functions and types in the `.rs` files under a folder, each with
/// its file: the names that follow `pub fn`, `pub const fn`, `pub struct` or `pub enum` at the
/// beginning of a line.
///
/// # Panics
/// If the folder or a file cannot be read.
pub fn functions(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut out = Vec::new();
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries {
        let path = entry.unwrap_or_else(|e| panic!("{e}")).path();
        if path.is_dir() {
            out.extend(functions(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path)
                .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            out.extend(names(&text).map(|name| (path.clone(), name)));
        }
    }
    out.sort();
    out
}

/// Returns the names of public functions and types in a text.
fn names(text: &str) -> impl Iterator<Item = String> + '_ {
    text.lines().filter_map(|line| {
        let line = line.trim_start();
        let rest = ["pub fn ", "pub const fn ", "pub struct ", "pub enum "]
            .into_iter()
            .find_map(|start| line.strip_prefix(start))?;
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_')?;
        Some(rest[..end].to_owned())
    })
}

/// Returns the public functions and types under a folder that the text of a test does not mention,
/// except those in `exempt`. A function is mentioned by `name(`, `name::<` or, if it is passed as a
/// value, `::name`. (Methods of equal names are not distinguished.)
pub fn missing(folder: &Path, test: &str, exempt: &[&str]) -> Vec<String> {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let called = |name: &str| {
        test.match_indices(name).any(|(at, _)| {
            let (before, after) = (&test[..at], &test[at + name.len()..]);
            let whole = !before.ends_with(word) && !after.starts_with(word);
            let is_type = name.starts_with(char::is_uppercase);
            let is_call = after.starts_with('(') || after.starts_with("::<");
            whole && (is_type || is_call || before.ends_with("::"))
        })
    };
    functions(folder)
        .into_iter()
        .filter(|(_, name)| !exempt.contains(&name.as_str()) && !called(name))
        .map(|(path, name)| format!("{}: {name}", path.display()))
        .collect()
}

/// Returns a file of the repository that contains the crate in `folder`
/// (`env!("CARGO_MANIFEST_DIR")`), or `None` if there is no repository, as in a package, whose
/// tests then skip that file.
///
/// # Panics
/// If there is a repository that does not have that file.
pub fn page(folder: &str, path: &str) -> Option<String> {
    let root = Path::new(folder).join("../..");
    if !root.join("crates").is_dir() {
        return None;
    }
    let path = root.join(path);
    let text = std::fs::read_to_string(&path);
    Some(text.unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_is_public() {
        let source = "pub fn one() {}\n pub const fn two<T>() {}\npub(crate) fn three() {}\npub struct Four<T>(T);";
        assert_eq!(names(source).collect::<Vec<_>>(), ["one", "two", "Four"]);
    }

    #[test]
    fn pages_are_in_the_repository_or_nowhere() {
        let folder = env!("CARGO_MANIFEST_DIR");
        let repository = Path::new(folder).join("../../crates").is_dir();
        let found = page(folder, "crates/testkit/README.md");
        assert_eq!(
            found.is_some_and(|t| t.contains("# linelit-testkit")),
            repository
        );
        assert_eq!(page(&format!("{folder}/src"), "README.md"), None);
    }

    #[test]
    fn this_module_has_three() {
        let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let here = |text: &str| {
            let all = missing(&src, text, &[]);
            all.iter().filter(|m| m.contains("public.rs")).count()
        };
        assert_eq!(here(""), 3);
        assert_eq!(here("functions(x); not_missing(y)"), 2);
        assert_eq!(here("map(public::functions); missing::<T>(y); page(z)"), 0);
    }
}

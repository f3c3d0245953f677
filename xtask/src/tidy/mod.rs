//! The house rules as tests: what `docs/architecture.md` calls invariants, checked on the text of
//! the repository.
//!
//! Each rule is a function from the [`House`] to a list of problems, each with its place.

mod manifests;
mod properties;
mod repository;
mod sources;

use crate::manifest::{self, Manifest};
use crate::source;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the rules look at.
pub(crate) struct House {
    root: PathBuf,
    members: Vec<Manifest>,
    sources: Vec<Source>,
    tracked: Vec<String>,
}

/// One Rust file below `crates/` or `xtask/`.
struct Source {
    /// Relative to the root, with `/`.
    path: String,
    /// Folder name of the crate, such as `geometry`.
    owner: String,
    /// Whether it is part of the library or program itself (`src/`), not of tests, benches or
    /// examples.
    shipped: bool,
    /// As it stands in the file.
    text: String,
    /// Without comments, literals and (for shipped files) tests.
    code: String,
}

/// Everything that breaks a house rule; empty when the house is tidy.
pub(crate) fn problems(root: &Path) -> Vec<String> {
    let house = House::read(root);
    let mut all = Vec::new();
    for rule in [
        manifests::dependency_table,
        manifests::hygiene,
        manifests::unused_workspace_dependencies,
        manifests::one_of_each,
        sources::foreign_names,
        sources::effects,
        sources::fallibility,
        sources::heap,
        sources::numbers,
        sources::no_dyn_in_the_pixel_loop,
        sources::unsafe_stays_in_its_rooms,
        sources::unfinished_work,
        sources::size,
        sources::comments,
        sources::crate_pages,
        properties::cases_are_scaled,
        repository::machine_paths,
        repository::documents,
        repository::links,
        repository::scenes,
    ] {
        all.extend(rule(&house));
    }
    all.sort();
    all.dedup();
    all
}

impl House {
    fn read(root: &Path) -> Self {
        let members = manifest::members(root);
        let mut files = Vec::new();
        for member in &members {
            walk(&member.folder, &mut files);
        }
        files.retain(|f| f.extension().is_some_and(|e| e == "rs"));
        let sources = files
            .iter()
            .filter_map(|file| Source::read(root, file))
            .collect();
        Self {
            root: root.to_path_buf(),
            members,
            sources,
            tracked: tracked(root),
        }
    }

    /// Shipped files of these crates.
    fn shipped<'a>(&'a self, crates: &'a [&'a str]) -> impl Iterator<Item = &'a Source> {
        self.sources
            .iter()
            .filter(|s| s.shipped && crates.contains(&s.owner.as_str()))
    }
}

impl Source {
    fn read(root: &Path, file: &Path) -> Option<Self> {
        let text = fs::read_to_string(file).ok()?;
        Some(Self::new(&relative(root, file), text))
    }

    fn new(path: &str, text: String) -> Self {
        let mut parts = path.split('/');
        let first = parts.next().unwrap_or_default();
        let owner = if first == "crates" {
            parts.next().unwrap_or_default()
        } else {
            first
        };
        let shipped = parts.next() == Some("src") && !path.ends_with("/tests.rs");
        let code = source::code_only(&text);
        let code = if shipped {
            source::without_tests(&code)
        } else {
            code
        };
        Self {
            path: path.to_owned(),
            owner: owner.to_owned(),
            shipped,
            text,
            code,
        }
    }

    /// One problem for each line with the word.
    fn complain(&self, word: &str, why: &str) -> Vec<String> {
        let lines = source::lines_with(&self.code, word);
        lines
            .into_iter()
            .map(|line| format!("{}:{line}: `{word}`: {why}", self.path))
            .collect()
    }
}

/// All files below a folder, but for build output.
fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    for path in paths {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if path.is_dir() && !matches!(name.as_str(), "target" | "out" | ".git") {
            walk(&path, files);
        } else if path.is_file() {
            files.push(path);
        }
    }
}

/// Files under version control; without git, all files.
fn tracked(root: &Path) -> Vec<String> {
    let listed = Command::new("git")
        .arg("-C")
        .arg(root)
        .args(["ls-files", "-z"])
        .output();
    match listed {
        Ok(output) if output.status.success() && !output.stdout.is_empty() => {
            String::from_utf8_lossy(&output.stdout)
                .split('\0')
                .filter(|s| !s.is_empty())
                .map(str::to_owned)
                .collect()
        }
        _ => {
            let mut files = Vec::new();
            walk(root, &mut files);
            files.iter().map(|f| relative(root, f)).collect()
        }
    }
}

fn relative(root: &Path, file: &Path) -> String {
    let path = file.strip_prefix(root).unwrap_or(file);
    path.components()
        .map(|c| c.as_os_str().to_string_lossy())
        .collect::<Vec<_>>()
        .join("/")
}

#[cfg(test)]
impl House {
    /// A house of one file, to try rules on.
    fn of(path: &str, text: &str) -> Self {
        Self {
            root: PathBuf::new(),
            members: Vec::new(),
            sources: vec![Source::new(path, text.to_owned())],
            tracked: Vec::new(),
        }
    }
}

//! The house rules as tests: the invariants in `docs/architecture.md` that no lint can check.
//!
//! Each rule is a function from the [`House`] to a list of problems, each with its position.

mod manifests;
mod ratchet;
mod repository;
mod sources;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The files that the rules check.
pub(crate) struct House {
    root: PathBuf,
    /// The files that are under version control or untracked but not ignored, relative to the root,
    /// with `/`.
    files: Vec<String>,
    pub(crate) members: Vec<Member>,
    sources: Vec<Source>,
}

/// A crate of the workspace.
pub(crate) struct Member {
    /// The name of the crate's folder, such as `geometry`.
    pub(crate) owner: String,
    manifest: String,
}

/// A Rust file.
struct Source {
    path: String,
    /// The folder of the crate that the file belongs to.
    owner: String,
    text: String,
    /// The code of files below `src`, without comments and tests; empty for other files.
    code: String,
}

/// A rule, which returns the problems that it finds.
type Rule = fn(&House) -> Vec<String>;

/// Returns all violations of the house rules; none if the house is tidy.
pub(crate) fn problems(root: &Path) -> Vec<String> {
    let house = match House::read(root) {
        Ok(house) => house,
        Err(problem) => return vec![problem],
    };
    let rules: [Rule; 18] = [
        manifests::dependency_table,
        manifests::hygiene,
        manifests::unused_workspace_dependencies,
        manifests::feature_tables,
        sources::lints,
        sources::fallibility,
        sources::lines,
        sources::crate_pages,
        sources::one_dependency,
        sources::angles,
        repository::machine_paths,
        repository::licences,
        repository::links,
        repository::guide,
        repository::promises,
        repository::figures,
        repository::hidden_lines,
        ratchet::may_only_fall,
    ];
    let mut all: Vec<String> = rules.iter().flat_map(|rule| rule(&house)).collect();
    all.sort();
    all.dedup();
    all
}

/// Lowers the ratchet's figures to their current values, and returns how many fell.
pub(crate) fn lower_ratchet(root: &Path) -> Result<usize, String> {
    ratchet::lower(&House::read(root)?, root)
}

impl House {
    /// Reads the files of the repository.
    pub(crate) fn read(root: &Path) -> Result<Self, String> {
        // List the files by git.
        let list = "ls-files -z --cached --others --exclude-standard".split(' ');
        let listed = Command::new("git").current_dir(root).args(list).output();
        let listed = listed.ok().filter(|o| o.status.success());
        let listed = listed.ok_or("`git ls-files` does not say which files are ours")?;
        let mut files: Vec<String> = String::from_utf8_lossy(&listed.stdout)
            .split_terminator('\0')
            // Removed files are listed until the removal is committed.
            .filter(|path| root.join(path).exists())
            .map(str::to_owned)
            .collect();
        files.sort();
        // Read the manifests and the Rust files.
        let text = |path: &String| fs::read_to_string(root.join(path)).unwrap_or_default();
        let members = files.iter().filter_map(|path| {
            let folder = path.strip_suffix("/Cargo.toml")?;
            let owner = folder.trim_start_matches("crates/").to_owned();
            let manifest = text(path);
            (!owner.contains('/')).then_some(Member { owner, manifest })
        });
        let rust = files.iter().filter(|path| path.ends_with(".rs"));
        Ok(Self {
            members: members.collect(),
            sources: rust.map(|path| Source::new(path, text(path))).collect(),
            root: root.to_path_buf(),
            files,
        })
    }

    /// Returns the text of a file; empty if it is not text.
    fn text(&self, path: &str) -> String {
        fs::read_to_string(self.root.join(path)).unwrap_or_default()
    }

    /// Returns the packages that are published on crates.io.
    pub(crate) fn published(&self) -> impl Iterator<Item = &str> {
        let members = self.members.iter().filter(|m| m.is_published());
        members.map(Member::package)
    }

    /// Returns the packages that are only for this repository.
    pub(crate) fn unpublished(&self) -> impl Iterator<Item = &str> {
        let members = self.members.iter().filter(|m| !m.is_published());
        members.map(Member::package)
    }

    /// Returns the version of all crates.
    pub(crate) fn version(&self) -> String {
        let text = self.text("Cargo.toml");
        quoted(section(&text, "workspace.package"), "version").to_owned()
    }

    /// Returns the front pages (`lib.rs`) of all libraries for Rust.
    fn libraries(&self) -> impl Iterator<Item = &Source> {
        let is_apart = |s: &Source| {
            let mut members = self.members.iter();
            members.any(|m| m.owner == s.owner && m.is_apart())
        };
        let pages = self.sources.iter();
        pages.filter(move |s| s.path.ends_with("/src/lib.rs") && !is_apart(s))
    }
}

impl Member {
    /// Returns whether the crate is a workspace of its own and not a member of ours, as the builder
    /// of Python's packages needs.
    fn is_apart(&self) -> bool {
        self.manifest.lines().any(|line| line == "[workspace]")
    }

    /// Returns the lines of a section of the manifest, without comments.
    fn section<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a str> {
        section(&self.manifest, name)
    }

    /// Returns whether the crate is published on crates.io.
    pub(crate) fn is_published(&self) -> bool {
        !self.section("package").any(|l| l == "publish = false")
    }

    /// Returns `package.name`.
    pub(crate) fn package(&self) -> &str {
        quoted(self.section("package"), "name")
    }

    /// Returns the features, except `default`.
    pub(crate) fn features(&self) -> Vec<&str> {
        let lines = self.section("features");
        let names = lines.filter_map(|line| Some(line.split_once(" = ")?.0));
        names.filter(|name| *name != "default").collect()
    }
}

/// Returns the text in quotes after a key, from the first line that begins with the key; empty if
/// there is no such line.
fn quoted<'a>(mut lines: impl Iterator<Item = &'a str>, key: &str) -> &'a str {
    let of_key = |line: &'a str| line.strip_prefix(key)?.strip_prefix(" = ");
    lines.find_map(of_key).unwrap_or("").trim_matches('"')
}

/// Returns the lines of the sections of a manifest whose header ends with this name, without
/// comments.
fn section<'a>(manifest: &'a str, name: &'a str) -> impl Iterator<Item = &'a str> {
    let mut inside = false;
    manifest.lines().map(str::trim).filter(move |line| {
        if line.starts_with('[') {
            let header = line.trim_matches(['[', ']']);
            inside = header == name || header.ends_with(&format!(".{name}"));
            return false;
        }
        inside && !line.is_empty() && !line.starts_with('#')
    })
}

impl Source {
    fn new(path: &str, text: String) -> Self {
        let mut parts = path.trim_start_matches("crates/").split('/');
        let owner = parts.next().unwrap_or_default().to_owned();
        let shipped = parts.next() == Some("src") && !path.ends_with("/tests.rs");
        let code = if shipped {
            code_of(&text)
        } else {
            String::new()
        };
        Self {
            path: path.to_owned(),
            owner,
            text,
            code,
        }
    }

    /// Returns a problem with its position and the reason `why` for each line of the file in which
    /// `holds` is true.
    fn complain(&self, holds: impl Fn(&str) -> bool, why: &str) -> Vec<String> {
        let lines = self
            .text
            .lines()
            .enumerate()
            .filter(|(_, line)| holds(line));
        lines
            .map(|(i, _)| format!("{}:{}: {why}", self.path, i + 1))
            .collect()
    }
}

/// Returns a file up to its module of tests (which is the last item: clippy's
/// `items_after_test_module`).
fn before_tests(text: &str) -> &str {
    let opens_module = |line: &str| {
        let line = line.trim_start().trim_start_matches("pub(crate) ");
        let name = line.trim_start_matches("pub ").strip_prefix("mod ");
        name.is_some_and(|name| name.contains('{'))
    };
    let (mut length, mut before) = (0, None);
    for line in text.split_inclusive('\n') {
        if let Some(before) = before.filter(|_| opens_module(line)) {
            return &text[..before];
        }
        before = (line.trim() == "#[cfg(test)]").then_some(length);
        length += line.len();
    }
    text
}

/// Returns a file up to its module of tests, with each line up to its comment.
fn code_of(text: &str) -> String {
    let lines = before_tests(text).lines();
    let code = lines.flat_map(|line| line.split("//").next());
    code.flat_map(|line| [line, "\n"]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    impl House {
        /// Returns a house with one file, for tests of rules.
        pub(super) fn of(path: &str, text: &str) -> Self {
            Self {
                root: PathBuf::new(),
                files: Vec::new(),
                members: Vec::new(),
                sources: vec![Source::new(path, text.to_owned())],
            }
        }
    }

    #[test]
    fn code_is_without_comments_and_tests() {
        let text = "a // b\n#[cfg(test)]\nuse c;\nd\n#[cfg(test)]\nmod tests {\n e\n}\n";
        assert_eq!(code_of(text), "a \n#[cfg(test)]\nuse c;\nd\n");
    }

    #[test]
    fn manifests_are_read() {
        let manifest = "[package]\nname = \"x\"\n[dependencies]\n# why\nfoo.workspace = true\n\
            [target.'cfg(unix)'.dependencies]\nbar = 1\n[dev-dependencies]\nbaz = 1\n\
            [features]\ndefault = []\nsimd = [\n    \"foo/simd\",\n]\n";
        let known: Vec<_> = section(manifest, "dependencies").collect();
        assert_eq!(known, ["foo.workspace = true", "bar = 1"]);
        let (owner, manifest) = ("x".to_owned(), manifest.to_owned());
        assert_eq!(Member { owner, manifest }.features(), ["simd"]);
    }
}

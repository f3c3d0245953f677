//! Tells the program from which commit it is built, by the environment variable `LINELIT_COMMIT`.

#![allow(
    clippy::print_stdout,
    reason = "this is how a build script talks to cargo"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The paths that the program is built from, as git's pathspecs. Changes elsewhere do not mark the
/// build as changed.
const SOURCES: &str = "Cargo.toml Cargo.lock crates/*/src/* crates/*/Cargo.toml crates/cli/build.rs \
    :(exclude)crates/workshop";

fn main() {
    let package = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let commit = of_checkout(&package).or_else(|| of_package(&package));
    let commit = commit.unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=LINELIT_COMMIT={commit}");
    println!("cargo::rerun-if-changed=build.rs");
}

/// Returns, in a clone of the repository, the commit, with a mark if sources differ from it; `None`
/// elsewhere. A package that was unpacked inside some other repository is not a clone.
fn of_checkout(package: &Path) -> Option<String> {
    let root = package.parent()?.parent()?;
    if git(package, &["rev-parse", "--show-prefix"])? != "crates/cli/" {
        return None;
    }
    // Build again when another commit is checked out or made: git notes this in its log, or if it
    // keeps no log, in these files.
    let branch = git(root, &["symbolic-ref", "--quiet", "HEAD"]).unwrap_or_default();
    for name in ["HEAD", "logs/HEAD", &branch, "packed-refs"] {
        if let Some(path) = git(root, &["rev-parse", "--git-path", name]) {
            watch(&root.join(path));
        }
    }
    // Build again when a source changes.
    for folder in fs::read_dir(root.join("crates")).ok()?.flatten() {
        if folder.file_name() == "workshop" {
            continue;
        }
        watch(&folder.path().join("src"));
        watch(&folder.path().join("Cargo.toml"));
    }
    watch(&root.join("Cargo.toml"));
    watch(&root.join("Cargo.lock"));
    // Mark the commit if sources differ from it.
    let hash = git(root, &["rev-parse", "--short=12", "HEAD"])?;
    let mut status = vec!["status", "--porcelain", "--"];
    status.extend(SOURCES.split_whitespace());
    Some(match git(root, &status)?.as_str() {
        "" => hash,
        _ => format!("{hash}+changes"),
    })
}

/// Returns, in a package, the commit that cargo noted there; `None` elsewhere.
fn of_package(package: &Path) -> Option<String> {
    let noted = package.join(".cargo_vcs_info.json");
    watch(&noted);
    let text = fs::read_to_string(noted).ok()?;
    let hash = text.split_once("\"sha1\": \"")?.1.get(..12)?;
    let changes = if text.contains("\"dirty\": true") {
        "+changes"
    } else {
        ""
    };
    Some(format!("{hash}{changes}"))
}

/// Makes cargo run this script again when a file, or one in a folder, changes.
fn watch(path: &Path) {
    if path.exists() {
        println!("cargo::rerun-if-changed={}", path.display());
    }
}

/// Returns the output of git, if it is installed and succeeds.
fn git(folder: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .current_dir(folder)
        .args(arguments)
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim_end().to_owned())
}

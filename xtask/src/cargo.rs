//! Functions that start cargo, and the programs that cargo builds.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns the repository's root folder.
pub(crate) fn root() -> PathBuf {
    let own =
        std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    Path::new(&own)
        .parent()
        .map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// Returns the folder where cargo puts its output.
pub(crate) fn target() -> PathBuf {
    let folder = std::env::var_os("CARGO_TARGET_DIR");
    folder.map_or_else(|| root().join("target"), PathBuf::from)
}

/// Returns a command of the cargo that runs this program, with these arguments.
pub(crate) fn cargo<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments);
    // Cargo set these variables for this program; they would make nested builds look changed.
    command
        .env_remove("CARGO_MANIFEST_DIR")
        .env_remove("CARGO_PKG_NAME")
        .env_remove("CARGO_PKG_VERSION");
    command
}

/// Runs a command to its end. Statuses 0, 1 and 2 are passed on; anything else (a panic, a signal,
/// a failed build) becomes 1.
pub(crate) fn status(command: &mut Command) -> u8 {
    match command.status() {
        Ok(status) => match status.code() {
            Some(0) => 0,
            Some(2) => 2,
            _ => 1,
        },
        Err(error) => {
            eprintln!(
                "error: cannot start {}: {error}",
                command.get_program().display()
            );
            1
        }
    }
}

/// Returns a cargo command that builds a part of a crate with optimization. The command prints
/// nothing, except for the first build, which takes a minute or two.
fn release(verb: &str, package: &str) -> Command {
    let mut run = cargo([verb, "--release", "--manifest-path"]);
    run.arg(root().join("Cargo.toml"));
    if target().join("release").exists() {
        run.arg("--quiet");
    }
    run.args(["-p", &format!("linelit-{package}")]);
    run
}

/// Runs a program or example of a crate in the caller's working folder; `target` are the arguments
/// that name it.
pub(crate) fn run(package: &str, target: &[&str], arguments: &[String]) -> u8 {
    let mut run = release("run", package);
    status(run.args(target).arg("--").args(arguments))
}

/// Builds a program of a crate with optimization, as its users do.
pub(crate) fn build(package: &str, target: &[&str]) -> u8 {
    status(release("build", package).args(target))
}

/// Runs a test of a crate as a program, with its arguments as the lines of `LINELIT_ARGUMENTS`.
/// Arguments that are files become absolute paths.
pub(crate) fn written(package: &str, target: &str, test: &str, arguments: &[String]) -> u8 {
    let whole = |word: &String| std::fs::canonicalize(word).map_or(word.into(), PathBuf::into);
    let words: Vec<std::ffi::OsString> = arguments.iter().map(whole).collect();
    let mut run = release("test", package);
    run.env("LINELIT_ARGUMENTS", words.join("\n".as_ref()));
    status(run.args(["--test", target, "--", "--ignored", "--nocapture", test]))
}

/// Runs a criterion bench of a crate.
pub(crate) fn criterion(package: &str, bench: &str, rest: &[String]) -> u8 {
    let file = format!("crates/{package}/benches/{bench}.rs");
    if !root().join(&file).exists() {
        eprintln!("error: there is no {file}");
        return 2;
    }
    let package = format!("linelit-{package}");
    status(cargo(["bench", "-p", &package, "--bench", bench, "--"]).args(rest))
}

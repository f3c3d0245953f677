//! Starting cargo, and the programs that cargo builds.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The repository's root folder.
pub(crate) fn root() -> PathBuf {
    let own =
        std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    Path::new(&own)
        .parent()
        .map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// The cargo that runs us, with an argument list begun.
pub(crate) fn cargo<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments);
    // Variables that cargo set for this program would make nested builds look changed.
    command
        .env_remove("CARGO_MANIFEST_DIR")
        .env_remove("CARGO_PKG_NAME")
        .env_remove("CARGO_PKG_VERSION");
    command
}

/// Runs to the end; 0, 1 and 2 are handed through, anything else (a panic, a signal, a failed
/// build) is 1.
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

/// A program of a crate with its arguments, built with optimisation; in the caller's working
/// folder.
pub(crate) fn program(package: &str, name: &str, arguments: &[String]) -> u8 {
    let mut run = start(package);
    run.args(["--bin", name, "--"]).args(arguments);
    status(&mut run)
}

/// An example program of a crate, built with optimisation.
pub(crate) fn example(package: &str, name: &str, rest: &[String]) -> u8 {
    let mut run = start(package);
    run.args(["--example", name, "--"]).args(rest);
    status(&mut run)
}

/// One of the workshop's tables of closed forms and techniques, which build without the renderer.
pub(crate) fn table(name: &str, rest: &[String]) -> u8 {
    let mut run = start("workshop");
    run.args(["--no-default-features", "--example", name, "--"]);
    status(run.args(rest))
}

/// A criterion bench of a crate.
pub(crate) fn criterion(package: &str, bench: &str, rest: &[String]) -> u8 {
    if !root()
        .join("crates")
        .join(package)
        .join("benches")
        .join(format!("{bench}.rs"))
        .exists()
    {
        eprintln!("error: there is no crates/{package}/benches/{bench}.rs");
        return 2;
    }
    let package = format!("linelit-{package}");
    let mut run = cargo(["bench", "-p", &package, "--bench", bench, "--"]);
    status(run.args(rest))
}

/// `cargo run --release` of a crate; silent, except for the first build, which takes a minute or
/// two.
fn start(package: &str) -> Command {
    let manifest = root().join("Cargo.toml");
    let mut run = cargo(["run", "--release"]);
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    if target.join("release").join("linelit").exists()
        || target.join("release").join("linelit.exe").exists()
    {
        run.arg("--quiet");
    }
    run.arg("--manifest-path")
        .arg(manifest)
        .args(["-p", &format!("linelit-{package}")]);
    run
}

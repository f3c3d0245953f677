//! The packages that crates.io would get: their tests, and a renderer that depends on nothing but
//! them.

use crate::cargo;
use crate::tidy::House;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Packs all published crates, without building them.
pub(crate) fn package() -> Vec<String> {
    of_all(&[
        "package",
        "--workspace",
        "--no-verify",
        "--allow-dirty",
        "--quiet",
    ])
}

/// Does with all published crates all that publishing does, but for the last step: they are built
/// from their packages, and crates.io is asked whether it has them.
pub(crate) fn publish() -> Vec<String> {
    of_all(&[
        "publish",
        "--workspace",
        "--dry-run",
        "--allow-dirty",
        "--quiet",
    ])
}

/// A command of cargo's on the published crates.
fn of_all(words: &[&'static str]) -> Vec<String> {
    let mut command = cargo::cargo(words.iter().copied());
    command.current_dir(cargo::root());
    match House::read(&cargo::root()) {
        Ok(house) => command.args(house.unpublished().map(|p| format!("--exclude={p}"))),
        Err(problem) => return vec![problem],
    };
    run(command).err().into_iter().collect()
}

/// Compiles the tests of the packages, unpacked, and runs `xtask/outside` on them, copied out of
/// the workspace.
pub(crate) fn outside() -> Vec<String> {
    try_outside().err().into_iter().collect()
}

fn try_outside() -> Result<(), String> {
    let house = House::read(&cargo::root())?;
    let target = cargo::target();
    let place = target.join("outside");
    let version = house.version();
    let mut manifest = read(&cargo::root().join("xtask/outside/Cargo.toml"))?;
    manifest += "\n[patch.crates-io]\n";
    if place.exists() {
        fs::remove_dir_all(&place).map_err(|e| format!("{}: {e}", place.display()))?;
    }
    let source = place.join("src");
    fs::create_dir_all(&source).map_err(|e| format!("{}: {e}", source.display()))?;
    for package in house.published() {
        let packed = target.join(format!("package/{package}-{version}.crate"));
        let mut tar = Command::new("tar");
        tar.arg("-xzf").arg(packed).arg("-C").arg(&place);
        run(tar)?;
        manifest += &format!("{package} = {{ path = \"{package}-{version}\" }}\n");
    }
    write(&place.join("Cargo.toml"), &manifest)?;
    let main = read(&cargo::root().join("xtask/outside/src/main.rs"))?;
    write(&source.join("main.rs"), &main)?;
    let in_place = |words: &str| {
        let mut command = cargo::cargo(words.split(' '));
        command.current_dir(&place).env_remove("CARGO_TARGET_DIR");
        run(command)
    };
    // All members: the packages are, since they lie within.
    in_place("check --quiet --workspace --tests --all-features")?;
    in_place("run --release --quiet")
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

fn run(mut command: Command) -> Result<(), String> {
    match cargo::status(&mut command) {
        0 => Ok(()),
        _ => Err(format!("failed: {command:?}")),
    }
}

//! The packages that crates.io would get, and a renderer that depends on nothing but them.

use crate::cargo;
use crate::tidy::House;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Packs all published crates, without building them.
pub(crate) fn package() -> Vec<String> {
    let mut command = cargo::cargo(["package", "--workspace", "--no-verify", "--allow-dirty"]);
    command.arg("--quiet").current_dir(cargo::root());
    match House::read(&cargo::root()) {
        Ok(house) => command.args(house.unpublished().map(|p| format!("--exclude={p}"))),
        Err(problem) => return vec![problem],
    };
    run(command).err().into_iter().collect()
}

/// Runs `xtask/outside`, copied out of the workspace, on the packages, unpacked.
pub(crate) fn outside() -> Vec<String> {
    try_outside().err().into_iter().collect()
}

fn try_outside() -> Result<(), String> {
    let house = House::read(&cargo::root())?;
    let folder = std::env::var_os("CARGO_TARGET_DIR");
    let target = folder.map_or_else(|| cargo::root().join("target"), PathBuf::from);
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
    let mut engine = cargo::cargo(["run", "--release", "--quiet"]);
    engine.current_dir(&place).env_remove("CARGO_TARGET_DIR");
    run(engine)
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

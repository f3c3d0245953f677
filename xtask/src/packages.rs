//! Checks of the packages that would be published on crates.io: their tests, and a renderer that
//! depends only on them.

use crate::cargo;
use crate::tidy::House;
use std::fs;
use std::io;
use std::process::Command;

/// Packs all published crates without building them.
pub(crate) fn package() -> Result<(), String> {
    of_all("package --workspace --no-verify --allow-dirty --quiet")
}

/// Does everything that publishing does for all published crates, except for the last step: the
/// crates are built from their packages, and crates.io is queried for their versions.
pub(crate) fn publish() -> Result<(), String> {
    of_all("publish --workspace --dry-run --allow-dirty --quiet")
}

/// Runs a cargo command on the published crates.
fn of_all(words: &str) -> Result<(), String> {
    let house = House::read(&cargo::root())?;
    let mut command = cargo::cargo(words.split(' '));
    command.current_dir(cargo::root());
    command.args(house.unpublished().map(|p| format!("--exclude={p}")));
    run(command)
}

/// Compiles the tests of the unpacked packages, and runs `xtask/outside`, copied out of the
/// workspace, on them.
pub(crate) fn outside() -> Result<(), String> {
    let house = House::read(&cargo::root())?;
    let place = cargo::target().join("outside");
    let template = cargo::root().join("xtask/outside");
    let failed = |e: io::Error| format!("{}: {e}", place.display());
    // Copy the program into an empty folder.
    let _ = fs::remove_dir_all(&place);
    fs::create_dir_all(place.join("src")).map_err(failed)?;
    fs::copy(template.join("src/main.rs"), place.join("src/main.rs")).map_err(failed)?;
    // Unpack the packages next to it, and make its manifest use them.
    let mut manifest = fs::read_to_string(template.join("Cargo.toml")).map_err(failed)?;
    manifest += "\n[patch.crates-io]\n";
    let version = house.version();
    for package in house.published() {
        let packed = cargo::target().join(format!("package/{package}-{version}.crate"));
        let mut tar = Command::new("tar");
        tar.arg("-xzf").arg(packed).arg("-C").arg(&place);
        run(tar)?;
        manifest += &format!("{package} = {{ path = \"{package}-{version}\" }}\n");
    }
    fs::write(place.join("Cargo.toml"), manifest).map_err(failed)?;
    // Compile the tests of all packages, which lie within the folder and are therefore members of
    // its workspace, and run the program.
    let in_place = |words: &str| {
        let mut command = cargo::cargo(words.split(' '));
        command.current_dir(&place).env_remove("CARGO_TARGET_DIR");
        run(command)
    };
    in_place("check --quiet --workspace --tests --all-features")?;
    in_place("run --release --quiet")
}

/// Runs a command that must succeed.
fn run(mut command: Command) -> Result<(), String> {
    match cargo::status(&mut command) {
        0 => Ok(()),
        _ => Err(format!("failed: {command:?}")),
    }
}

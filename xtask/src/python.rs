//! `cargo xtask test python`: builds, installs and tests the Python wheel.

use crate::cargo;
use std::path::Path;
use std::process::Command;

/// The Python packages that are needed for building and testing.
const PACKAGES: &str = "maturin>=1.16,<2 numpy pytest mypy matplotlib nbclient ipykernel";

/// Creates a virtual environment below `target`, builds the wheel in it, and runs its tests.
pub(crate) fn test() -> Result<(), String> {
    let root = cargo::root();
    let (package, environment) = (root.join("crates/python"), root.join("target/python"));
    // Find a Python.
    let system = ["python3", "python"].into_iter().find(|name| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|version| version.status.success())
    });
    let Some(system) = system else {
        let why = "there is no python3: its tests did not run";
        // Without Python the tests are skipped on a developer's machine, but not in continuous
        // integration.
        return match std::env::var_os("CI") {
            Some(_) => Err(why.to_owned()),
            None => {
                eprintln!("   {why}");
                Ok(())
            }
        };
    };
    // Create the environment, and install the packages.
    let folder = if cfg!(windows) { "Scripts" } else { "bin" };
    let python = environment.join(folder).join("python");
    if !python.exists() {
        run(Command::new(system).args(["-m", "venv"]).arg(&environment))?;
    }
    let pip = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ];
    run(Command::new(&python).args(pip).args(PACKAGES.split(' ')))?;
    // Build the wheel, check types, and run the tests.
    let maturin = ["-m", "maturin", "develop", "--profile", "quick", "--quiet"];
    let mypy = ["-m", "mypy", "python/linelit"];
    let inside = |arguments: &[&str]| run(inside(&python, &package, &environment).args(arguments));
    inside(&maturin)?;
    inside(&mypy)?;
    inside(&["-m", "pytest", "--quiet"])
}

/// Returns a command of the environment's Python in the folder of the package.
fn inside(python: &Path, package: &Path, environment: &Path) -> Command {
    let mut command = Command::new(python);
    command.current_dir(package).env("VIRTUAL_ENV", environment);
    // One of the tests builds an example.
    command.env("CARGO_TARGET_DIR", environment.join("target"));
    command
}

/// Runs a command that must succeed.
fn run(command: &mut Command) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(format!("failed: {command:?}")),
        Err(error) => Err(format!("cannot start {command:?}: {error}")),
    }
}

//! Running the tool as a user does.
#![allow(dead_code, reason = "each test takes what it needs")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The tool with these arguments, run to its end.
pub(crate) fn linelit(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_linelit"))
        .args(arguments)
        .output()
        .unwrap()
}

/// A folder for a test's files.
pub(crate) fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("linelit-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

/// What a program printed.
pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A path as an argument.
pub(crate) fn path(p: &Path) -> &str {
    p.to_str().unwrap()
}

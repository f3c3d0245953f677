//! Running the tool as a user does.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_linelit");

/// The tool with these arguments, run to its end.
pub(crate) fn linelit(arguments: &[&str]) -> Output {
    Command::new(PROGRAM).args(arguments).output().unwrap()
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

/// What is in a folder, by name.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Arguments that render the Cornell box with one sample.
pub(crate) fn small_render<'a>(image: &'a Path, resolution: &'a str) -> Vec<&'a str> {
    let mut arguments = vec!["render", "cornell-box", "-o", path(image)];
    arguments.extend(["--samples", "1", "--resolution", resolution]);
    arguments
}

/// Arguments of the smallest study of one scene.
pub(crate) fn small_study<'a>(scene: &'a str, out: &'a Path) -> Vec<&'a str> {
    let mut arguments = vec!["converge", scene, "--out", path(out)];
    arguments.extend(["--samples", "1,4", "--trials", "2", "--pixels", "4x4"]);
    arguments.extend(["--smallest", "--samplers", "stratified"]);
    arguments.extend(["--estimators", "point-area,line-analytic"]);
    arguments
}

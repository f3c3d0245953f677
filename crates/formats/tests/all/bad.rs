//! Tests of error messages and warnings: every broken scene in `tests/bad` must fail with exactly
//! the message in the `.expected` file next to it, and every odd scene in `tests/odd` must load
//! with the warnings in its `.expected` file.
//!
//! With `LINELIT_BLESS=1` in the environment the messages are written instead of compared; read
//! them before committing.

use linelit_formats::LoadOptions;
use std::path::{Path, PathBuf};

/// Lists the scene files of a folder, sorted by name. Those of glTF are left out if the reader was
/// built without that format.
fn scenes(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the folder is part of the repository");
    let mut list: Vec<PathBuf> = entries
        .map(|e| e.expect("readable").path())
        .filter(|p| {
            let extension = p.extension().and_then(|e| e.to_str());
            let has_gltf = cfg!(feature = "gltf");
            matches!(extension, Some("pbrt" | "obj"))
                || (has_gltf && matches!(extension, Some("gltf" | "glb")))
        })
        .collect();
    list.sort();
    list
}

/// Compares a message with the `.expected` file next to a scene, or writes that file.
fn check(path: &Path, got: &str) -> Result<(), String> {
    let beside = path.with_extension("expected");
    if std::env::var_os("LINELIT_BLESS").is_some() {
        std::fs::write(&beside, format!("{got}\n")).expect("the folder is writable");
        return Ok(());
    }
    let want = std::fs::read_to_string(&beside).unwrap_or_default();
    if want.trim_end() == got.trim_end() {
        return Ok(());
    }
    Err(format!(
        "{}\n--- got\n{got}\n--- expected\n{want}\n",
        path.display()
    ))
}

#[test]
fn broken_scenes_say_what_is_wrong_and_where() {
    let list = scenes("tests/bad");
    assert!(list.len() >= 90, "only {} broken scenes found", list.len());
    let failures: Vec<String> = list
        .iter()
        .filter_map(|path| {
            let got = match linelit_formats::load(path, &LoadOptions::default()) {
                Ok(_) => "it loads".to_owned(),
                Err(error) => error.to_string(),
            };
            check(path, &got).err()
        })
        .collect();
    assert!(failures.is_empty(), "{}", failures.concat());
}

#[test]
fn odd_scenes_load_with_warnings_and_fail_when_strict() {
    let list = scenes("tests/odd");
    assert!(list.len() >= 10, "only {} odd scenes found", list.len());
    let strict = LoadOptions {
        strict: true,
        ..LoadOptions::default()
    };
    let mut failures = Vec::new();
    for path in &list {
        let got = match linelit_formats::load(path, &LoadOptions::default()) {
            Ok(loaded) => {
                let warnings: Vec<String> =
                    loaded.warnings.iter().map(ToString::to_string).collect();
                warnings.join("\n\n")
            }
            Err(error) => error.to_string(),
        };
        failures.extend(check(path, &got).err());
        let error = linelit_formats::load(path, &strict)
            .map(drop)
            .map_err(|e| e.to_string());
        let first = got
            .lines()
            .next()
            .unwrap_or("")
            .replace("warning: ", "error: ");
        if !error.as_ref().is_err_and(|e| e.starts_with(&first)) {
            failures.push(format!("{}: strict gives {error:?}\n", path.display()));
        }
    }
    assert!(failures.is_empty(), "{}", failures.concat());
}

//! The pages that people read first: their commands run, and their pictures exist.

use crate::common::folder;
use linelit_scenes::BuiltIn;
use std::path::{Path, PathBuf};
use std::process::Command;

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs")
}

/// The contents of fenced blocks in this language.
fn blocks(page: &str, language: &str) -> Vec<String> {
    let fence = format!("```{language}\n");
    let after = page.split(&fence).skip(1);
    after
        .map(|rest| rest.split("\n```").next().unwrap_or(rest).to_owned())
        .collect()
}

/// The guide's shell commands run, one after the other in one folder.
#[test]
#[cfg(unix)]
fn the_guides_commands_run() {
    let dir = folder("guide");
    let page = std::fs::read_to_string(docs().join("guide.md")).unwrap();
    let blocks = blocks(&page, "sh");
    assert_eq!(blocks.len(), 3, "{blocks:?}");
    let program = Path::new(env!("CARGO_BIN_EXE_linelit")).parent().unwrap();
    let path = std::env::var("PATH").unwrap_or_default();
    for block in blocks {
        let output = Command::new("sh")
            .args(["-euc", &block])
            .current_dir(&*dir)
            .env("PATH", format!("{}:{path}", program.display()))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{block}\n{said}");
        assert!(!said.contains("warning"), "{block}\n{said}");
    }
    let table = std::fs::read(dir.join("table.exr")).unwrap();
    let points = std::fs::read(dir.join("points.exr")).unwrap();
    assert_ne!(table, points);
}

/// The gallery shows every built-in scene, with the description that `list scenes` prints.
#[test]
fn the_gallery_is_complete() {
    let page = std::fs::read_to_string(docs().join("gallery.md")).unwrap();
    for BuiltIn { name, about, .. } in BuiltIn::ALL {
        let row = format!("| ![{name}](pictures/{name}.png) | `{name}` | {about} |");
        assert!(page.contains(&row), "{row}");
    }
    let rows = page.matches("](pictures/").count();
    assert_eq!(rows, BuiltIn::ALL.len());
}

/// Every picture that a page shows exists, and every existing picture is shown.
#[test]
fn pictures_are_there_and_shown() {
    let mut shown: Vec<String> = Vec::new();
    for (page, prefix) in [
        ("../README.md", "](docs/pictures/"),
        ("gallery.md", "](pictures/"),
    ] {
        let text = std::fs::read_to_string(docs().join(page)).unwrap();
        let names = text.split(prefix).skip(1);
        shown.extend(names.filter_map(|rest| Some(rest.split_once(')')?.0.to_owned())));
    }
    shown.sort();
    let files = std::fs::read_dir(docs().join("pictures")).unwrap();
    let mut kept: Vec<String> = files
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    kept.sort();
    assert_eq!(shown, kept);
}

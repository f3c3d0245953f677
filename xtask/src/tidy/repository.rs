//! Rules about the repository as a whole.

use super::House;
use std::fs;

/// Folders of one machine; split so that this file does not accuse itself.
const MACHINE: [&str; 5] = [
    concat!("/wo", "rk/"),
    concat!("/t", "mp/"),
    concat!("/ro", "ot/"),
    concat!("/ho", "me/"),
    concat!("/Us", "ers/"),
];

/// Files that are data, not text of ours.
const BINARY: [&str; 8] = ["png", "exr", "pfm", "ply", "bin", "ico", "gz", "svg"];

pub(super) fn machine_paths(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for path in &house.tracked {
        if BINARY.iter().any(|e| path.ends_with(&format!(".{e}"))) {
            continue;
        }
        let Ok(text) = fs::read_to_string(house.root.join(path)) else {
            continue;
        };
        for (i, line) in text.lines().enumerate() {
            if MACHINE.iter().any(|folder| names_root_folder(line, folder)) {
                problems.push(format!("{path}:{}: names a folder of one machine", i + 1));
            }
        }
    }
    problems
}

/// Whether `folder` stands in the line as an absolute path, not as the middle of a longer one or of
/// a URL.
fn names_root_folder(line: &str, folder: &str) -> bool {
    let middle =
        |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '_' | '/' | '}' | ')' | '*');
    line.match_indices(folder)
        .any(|(i, _)| !line[..i].ends_with(middle))
}

/// What a visitor expects to find.
const EXPECTED: [&str; 9] = [
    "README.md",
    "CHANGELOG.md",
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "docs/architecture.md",
    "docs/accuracy.md",
    "docs/studies.md",
    ".ci/run",
    "Cargo.lock",
];

pub(super) fn documents(house: &House) -> Vec<String> {
    let mut problems: Vec<String> = EXPECTED
        .iter()
        .filter(|path| !house.root.join(path).is_file())
        .map(|path| format!("{path} is missing"))
        .collect();
    let architecture =
        fs::read_to_string(house.root.join("docs/architecture.md")).unwrap_or_default();
    for member in &house.members {
        let folder = member
            .folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if folder != "xtask" && !member.folder.join("README.md").is_file() {
            problems.push(format!("crates/{folder}/README.md is missing"));
        }
        if !architecture.is_empty() && !architecture.contains(&folder) {
            problems.push(format!("docs/architecture.md does not mention {folder}"));
        }
    }
    problems
}

/// Relative links in Markdown lead somewhere.
pub(super) fn links(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for path in house.tracked.iter().filter(|p| p.ends_with(".md")) {
        let file = house.root.join(path);
        let Ok(text) = fs::read_to_string(&file) else {
            continue;
        };
        let folder = file.parent().unwrap_or(&house.root);
        for (i, line) in text.lines().enumerate() {
            for target in targets(line) {
                let plain = target.split('#').next().unwrap_or_default();
                let local = !plain.is_empty() && !plain.contains(':') && !plain.starts_with('<');
                if local && !folder.join(plain).exists() {
                    problems.push(format!(
                        "{path}:{}: the link to {target} leads nowhere",
                        i + 1
                    ));
                }
            }
        }
    }
    problems
}

/// The targets of `[text](target)` in a line, outside code spans.
fn targets(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (i, _) in line.match_indices("](") {
        let in_code = line[..i].matches('`').count() % 2 == 1;
        let target = line[i + 2..].split(')').next().unwrap_or_default();
        if !in_code && line[i + 2..].contains(')') {
            found.push(target.split(' ').next().unwrap_or_default());
        }
    }
    found
}

/// Each built-in scene comes with a small and a large light.
pub(super) fn scenes(house: &House) -> Vec<String> {
    let scene =
        |p: &&String| p.starts_with("scenes/") && p.ends_with(".pbrt") && !p.contains(".geometry.");
    let mut problems = Vec::new();
    for path in house.tracked.iter().filter(scene) {
        let twin = match (
            path.strip_suffix("-small.pbrt"),
            path.strip_suffix("-large.pbrt"),
        ) {
            (Some(base), _) => format!("{base}-large.pbrt"),
            (_, Some(base)) => format!("{base}-small.pbrt"),
            _ => continue,
        };
        if !house.tracked.contains(&twin) {
            problems.push(format!("{path} has no twin {twin}"));
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machine_paths_are_absolute() {
        let folder = MACHINE[0];
        assert!(names_root_folder(&format!("see {folder}main"), folder));
        assert!(names_root_folder(&format!("\"{folder}x\""), folder));
        assert!(!names_root_folder(&format!("docs{folder}x"), folder));
        assert!(!names_root_folder(
            &format!("https://example.org{folder}x"),
            folder
        ));
    }

    #[test]
    fn link_targets() {
        assert_eq!(
            targets("a [b](c.md) and [d](e.md#f \"t\"), not `[x](y)`"),
            ["c.md", "e.md#f"]
        );
        assert!(targets("f[i](x").is_empty());
    }
}

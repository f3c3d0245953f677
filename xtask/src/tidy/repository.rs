//! Rules about the repository as a whole: paths, licences, links, and pages that must agree.

use super::House;

/// The names of root folders that exist on a single machine only. They are written without slashes,
/// so that this file does not violate the rule itself.
const MACHINE: [&str; 5] = ["work", "tmp", "root", "home", "Users"];

/// The endings of files that are data and not text.
const BINARY: [&str; 8] = ["png", "exr", "pfm", "ply", "bin", "ico", "gz", "svg"];

/// Checks that no file names a folder of a single machine.
pub(super) fn machine_paths(house: &House) -> Vec<String> {
    let text = |path: &&String| !BINARY.iter().any(|e| path.ends_with(&format!(".{e}")));
    let mut problems = Vec::new();
    for path in house.files.iter().filter(text) {
        for (i, line) in house.text(path).lines().enumerate() {
            if MACHINE.iter().any(|folder| names_root_folder(line, folder)) {
                problems.push(format!("{path}:{}: names a folder of one machine", i + 1));
            }
        }
    }
    problems
}

/// Returns whether `folder` occurs in the line as an absolute path, and not in the middle of a
/// longer path or of a URL.
fn names_root_folder(line: &str, folder: &str) -> bool {
    let middle =
        |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '_' | '/' | '}' | ')' | '*');
    line.match_indices(&format!("/{folder}/"))
        .any(|(i, _)| !line[..i].ends_with(middle))
}

/// Checks that each package has the licences, as symbolic links, whose targets cargo packages.
pub(super) fn licences(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for member in house.members.iter().filter(|m| m.owner != "xtask") {
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let path = format!("crates/{}/{licence}", member.owner);
            let text = house.text(&path);
            // A checkout without symbolic links has files with the target's path.
            let link = text == format!("../../{licence}");
            if !link && (text.is_empty() || text != house.text(licence)) {
                problems.push(format!("{path}: not the licence of the repository"));
            }
        }
    }
    problems
}

/// Checks that README's table of figures is the one that `cargo xtask figures` wrote.
pub(super) fn figures(house: &House) -> Vec<String> {
    let [shown, written] = ["README.md", "docs/figures.md"].map(|path| {
        let text = house.text(path);
        let table = text.split_once("<!-- figures -->\n");
        let table = table.and_then(|(_, rest)| rest.split_once("<!-- end of figures -->"));
        table.map(|(table, _)| table.to_owned())
    });
    match shown == written && shown.is_some() {
        true => Vec::new(),
        false => vec!["README.md: its figures are not those of docs/figures.md".to_owned()],
    }
}

/// Checks that Rust code on pages has no hidden lines, so that it compiles when it is copied.
pub(super) fn hidden_lines(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for path in ["README.md", "docs/guide.md"] {
        let (text, mut in_rust) = (house.text(path), false);
        for (i, line) in text.lines().enumerate() {
            in_rust = match line.strip_prefix("```") {
                Some(language) => language == "rust",
                None => in_rust,
            };
            if in_rust && line.starts_with("# ") {
                problems.push(format!("{path}:{}: a hidden line of Rust", i + 1));
            }
        }
    }
    problems
}

/// The address of the repository's files.
const OURS: &str = "https://github.com/linelit/linelit/blob/HEAD/";

/// Checks that the front page of each published library, as docs.rs shows it, has a link to the
/// guide.
pub(super) fn guide(house: &House) -> Vec<String> {
    let link = format!("({OURS}docs/guide.md)");
    let published = house.members.iter().filter(|m| m.is_published());
    let lost = published.filter(|member| {
        let [readme, page] = ["README.md", "src/lib.rs"]
            .map(|file| house.text(&format!("crates/{}/{file}", member.owner)));
        let included = page.contains("include_str!(\"../README.md\")");
        !(readme.contains(&link) && (included || page.contains(&link)))
    });
    lost.map(|m| format!("crates/{}: its page does not lead to the guide", m.owner))
        .collect()
}

/// Checks that the tests and commands in the last column of `docs/promises.md` exist: `name` is a
/// function, `cargo xtask test STEP` a step, and `rustc` and `doctest` need no name.
pub(super) fn promises(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    // Read all tests, in which names are looked up.
    let ends = [".rs", ".py"];
    let files = house
        .files
        .iter()
        .filter(|f| ends.iter().any(|e| f.ends_with(e)));
    let texts: Vec<_> = files.map(|file| house.text(file)).collect();
    let is_function = |name: &str| {
        let heads = [format!("fn {name}("), format!("def {name}(")];
        texts
            .iter()
            .any(|t| heads.iter().any(|head| t.contains(head)))
    };
    // Look up each word in code font of the last column.
    for (i, line) in house.text("docs/promises.md").lines().enumerate() {
        let cell = line.strip_suffix(" |").and_then(|l| l.rsplit_once(" | "));
        for word in cell
            .map_or("", |(_, cell)| cell)
            .split('`')
            .skip(1)
            .step_by(2)
        {
            let is_held = match word.strip_prefix("cargo xtask test ") {
                Some(step) => crate::USAGE.contains(step),
                None => is_function(word) || word.contains(' '),
            };
            if !is_held {
                problems.push(format!("docs/promises.md:{}: no test `{word}`", i + 1));
            }
        }
    }
    problems
}

/// Checks that relative links in Markdown files have a target.
pub(super) fn links(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for path in house.files.iter().filter(|p| p.ends_with(".md")) {
        let folder = house.root.join(path).with_file_name("");
        let text = house.text(path);
        for (i, line) in text.lines().enumerate() {
            for target in targets(line) {
                let plain = target.split('#').next().unwrap_or_default();
                // Pages on docs.rs refer to our files by their address.
                if let Some(ours) = plain.strip_prefix(OURS)
                    && !house.root.join(ours).exists()
                {
                    problems.push(format!("{path}:{}: there is no {ours}", i + 1));
                }
                let local = !plain.is_empty() && !plain.contains(':') && !plain.starts_with('<');
                if local && path.starts_with("crates/") && plain.contains("../") {
                    problems.push(format!("{path}:{}: {target} is in no package", i + 1));
                }
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

/// Returns the targets of `[text](target)` in a line, outside code spans.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machine_paths_are_absolute() {
        let named = |text: &str| names_root_folder(&text.replace('@', concat!("/t", "mp/")), "tmp");
        assert!(named("see @main") && named("\"@x\""));
        assert!(!named("docs@x") && !named("https://example.org@x"));
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

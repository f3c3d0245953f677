//! The public signatures of the published crates, kept in `docs/api`, so that a change of one is
//! seen when it is made.
//!
//! They are read from the sources: `pub` is public here, since the workspace's lint
//! `unreachable_pub` lets nothing else be. Not seen: which of the traits Send, Sync and Unpin a
//! type has by itself, what other people's macros make, and values of constants.

mod items;
mod tokens;

use crate::tidy::House;
use items::Items;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The signatures of a crate, as its file holds them.
struct Snapshot {
    file: PathBuf,
    text: String,
}

fn snapshots(root: &Path) -> Result<Vec<Snapshot>, Vec<String>> {
    let house = House::read(root).map_err(|problem| vec![problem])?;
    let mut snapshots = Vec::new();
    for member in house.members.iter().filter(|m| m.is_published()) {
        let items = Items::of_crate(&root.join("crates").join(&member.owner).join("src/lib.rs"));
        if !items.problems.is_empty() {
            return Err(items.problems);
        }
        let package = member.package();
        let head = format!("# {package}, its public signatures. `cargo xtask api` writes this.\n");
        let lines = items.into_lines();
        snapshots.push(Snapshot {
            file: root.join(format!("docs/api/{package}.txt")),
            text: head + &lines.join("\n") + "\n",
        });
    }
    Ok(snapshots)
}

/// What differs from the files in `docs/api`.
pub(crate) fn problems(root: &Path) -> Vec<String> {
    let snapshots = match snapshots(root) {
        Ok(snapshots) => snapshots,
        Err(problems) => return problems,
    };
    let mut problems = Vec::new();
    for snapshot in snapshots {
        let kept = std::fs::read_to_string(&snapshot.file).unwrap_or_default();
        let name = snapshot
            .file
            .file_stem()
            .unwrap_or_default()
            .display()
            .to_string();
        problems.extend(changes(&kept, &snapshot.text).map(|change| format!("{name} {change}")));
    }
    if !problems.is_empty() {
        problems.push("public signatures changed; if that is meant: cargo xtask api".to_owned());
    }
    problems
}

/// Lines that are gone, and lines that are new.
fn changes<'a>(kept: &'a str, now: &'a str) -> impl Iterator<Item = String> {
    let [kept, now] = [kept, now].map(|text| text.lines().collect::<BTreeSet<_>>());
    let gone: Vec<_> = kept
        .difference(&now)
        .map(|line| format!("- {line}"))
        .collect();
    let new: Vec<_> = now
        .difference(&kept)
        .map(|line| format!("+ {line}"))
        .collect();
    gone.into_iter().chain(new)
}

/// Writes the files in `docs/api`; how many changed.
pub(crate) fn write(root: &Path) -> Result<usize, Vec<String>> {
    let mut changed = 0;
    for Snapshot { file, text } in snapshots(root)? {
        if std::fs::read_to_string(&file).is_ok_and(|kept| kept == text) {
            continue;
        }
        let folder = file.with_file_name("");
        let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&file, text));
        written.map_err(|error| vec![format!("{}: {error}", file.display())])?;
        changed += 1;
    }
    Ok(changed)
}

#[cfg(test)]
mod tests {
    #[test]
    fn changes_have_both_sides() {
        let found: Vec<_> = super::changes("a\nb\n", "b\nc\n").collect();
        assert_eq!(found, ["- a", "+ c"]);
    }
}

//! Rules about the dependencies between crates, and about their manifests.

use super::{House, Member, section};
use std::collections::BTreeSet;

/// Returns the name of a dependency from its line, which must have the form `name.workspace = true`
/// or `name = { workspace = true, … }`.
fn name(line: &str) -> &str {
    line.split(['.', ' ', '=']).next().unwrap_or_default()
}

/// Checks that the table of crates in `docs/architecture.md` agrees with the manifests: our crates
/// are in the last column but one, other crates in the last.
pub(super) fn dependency_table(house: &House) -> Vec<String> {
    let page = house.text("docs/architecture.md");
    let mut problems = Vec::new();
    for member in &house.members {
        let owner = &member.owner;
        // Read the last two cells of the crate's row.
        let row = page
            .lines()
            .find_map(|l| l.strip_prefix(&format!("| `{owner}` |")));
        let cells: Vec<&str> = row.unwrap_or("").trim_matches('|').split('|').collect();
        let last_two = cells[cells.len().saturating_sub(2)..].iter();
        let names = last_two.flat_map(|cell| cell.trim().split(", "));
        let said: BTreeSet<&str> = names.filter(|n| !["–", ""].contains(n)).collect();
        // Compare them with the manifest.
        let known = member.section("dependencies").map(name);
        let known: BTreeSet<&str> = known
            .map(|n| n.strip_prefix("linelit-").unwrap_or(n))
            .collect();
        let at = format!("docs/architecture.md: the row of {owner}");
        problems.extend(known.difference(&said).map(|n| format!("{at} lacks {n}")));
        problems.extend(said.difference(&known).map(|n| format!("{at} has {n}")));
        if row.is_none() {
            problems.push(format!("{at} is missing"));
        }
    }
    problems
}

/// The keys that crates.io requires of a published crate.
const WANTED: &str = "description readme license repository keywords categories rust-version";

/// Checks that each manifest uses the workspace's lints and versions, writes each dependency in one
/// line, and has all keys that crates.io requires.
pub(super) fn hygiene(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for member in &house.members {
        let mut complain = |what: String| problems.push(format!("{}: {what}", member.owner));
        let shared = !member.is_apart();
        if shared && member.section("lints").next() != Some("workspace = true") {
            complain("[lints] workspace = true is missing".to_owned());
        }
        for line in dependencies(member).filter(|_| shared) {
            // A dependency of the tests that is published after this crate has only a path.
            let is_later = line.contains(".path = \"../");
            if !line.contains("workspace = true") && !is_later {
                complain(format!("`{line}`: versions stand in the root manifest"));
            }
        }
        if member.manifest.contains("dependencies.") {
            complain("a dependency is one line, not a table".to_owned());
        }
        let published = member.is_published();
        for key in WANTED.split(' ') {
            if published && !member.section("package").any(|line| name(line) == key) {
                complain(format!("package.{key} is missing, crates.io wants it"));
            }
        }
    }
    problems
}

/// Returns the lines of all dependencies.
fn dependencies(member: &Member) -> impl Iterator<Item = &str> {
    let sections = ["dependencies", "dev-dependencies", "build-dependencies"];
    sections.into_iter().flat_map(|s| member.section(s))
}

/// Checks that each dependency of the workspace is used by a crate.
pub(super) fn unused_workspace_dependencies(house: &House) -> Vec<String> {
    let text = house.text("Cargo.toml");
    let used: BTreeSet<&str> = house
        .members
        .iter()
        .flat_map(dependencies)
        .map(name)
        .collect();
    section(&text, "workspace.dependencies")
        .map(name)
        .filter(|n| !used.contains(n))
        .map(|n| format!("Cargo.toml: nobody uses the workspace dependency {n}"))
        .collect()
}

/// Checks the tables of features on the front pages of crates: a table has one row for each feature
/// of the manifest, marks the default ones, and names the modules that the feature turns on.
pub(super) fn feature_tables(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for member in &house.members {
        let page = house.text(&format!("crates/{}/README.md", member.owner));
        let Some((_, table)) = page.split_once("\n| feature |") else {
            continue;
        };
        let at = format!("crates/{}/README.md", member.owner);
        // Read the rows, and compare them with the features.
        let rows = table.lines().skip(2).take_while(|l| l.starts_with('|'));
        let rows: Vec<_> = rows.filter_map(|l| l[1..].split_once('|')).collect();
        let defaults = member
            .section("features")
            .find(|l| l.starts_with("default = "));
        let cell = |feature: &str| {
            let is_default = defaults.is_some_and(|l| l.contains(&format!("\"{feature}\"")));
            format!(
                " `{feature}` {}",
                if is_default { "(default) " } else { "" }
            )
        };
        let wanted: BTreeSet<_> = member.features().into_iter().map(cell).collect();
        let found: BTreeSet<_> = rows.iter().map(|(name, _)| (*name).to_owned()).collect();
        let differing = wanted.symmetric_difference(&found);
        problems.extend(differing.map(|f| format!("{at}: the row of the feature{f}differs")));
        // Check that the row of each feature names its modules: `#[cfg(feature = "x")] pub use
        // linelit_y as y;`
        let lib = house.text(&format!("crates/{}/src/lib.rs", member.owner));
        for (guard, item) in lib.lines().zip(lib.lines().skip(1)) {
            let module = item.strip_suffix(';').and_then(|i| i.rsplit_once(" as "));
            let (true, Some((_, module))) = (guard.starts_with("#[cfg("), module) else {
                continue;
            };
            for feature in guard.split("feature = \"").skip(1) {
                let feature = feature.split('"').next().unwrap_or_default();
                let row = rows.iter().find(|(name, _)| *name == cell(feature));
                if !row.is_some_and(|(_, text)| text.contains(&format!("`{module}`"))) {
                    problems.push(format!("{at}: the row of `{feature}` lacks `{module}`"));
                }
            }
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn manifests_are_held_to_the_rules() {
        let manifest = "[package]\nname = \"x\"\n[dependencies]\nglam = \"1\"\n";
        let mut house = House::of("crates/x/src/lib.rs", "");
        house.members.push(Member {
            owner: "x".to_owned(),
            manifest: manifest.to_owned(),
        });
        // The lints, the dependency with its own version, and the keys that crates.io requires.
        assert_eq!(hygiene(&house).len(), 2 + WANTED.split(' ').count());
        // The page is missing, and with it the row and glam in it.
        assert_eq!(dependency_table(&house).len(), 2);
    }
}

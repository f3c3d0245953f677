//! Rules about who depends on whom, and what a manifest says.

use super::{House, Member, section};
use std::collections::BTreeSet;

/// What any crate may use in its tests and benches, beside what it knows anyway: scenes and
/// pictures to ask queries about, the lobes that shading's transformed cosines are fitted to, and
/// random numbers of a renderer that is none of ours.
const FOR_TESTS: &str = "linelit-testkit linelit-scenes linelit-bsdf linelit-film linelit-lights \
    proptest criterion rand rand_pcg rayon rustix sobol_burley";

/// Crates that end in images: their tests may look at the whole way.
const WHOLE_WAY: [&str; 3] = ["integrator", "papers", "cli"];

/// The name of a dependency from its line, which all are: `name.workspace = true`, or
/// `name = { workspace = true, … }`.
pub(super) fn name(line: &str) -> &str {
    line.split(['.', ' ', '=']).next().unwrap_or_default()
}

/// What the table of crates in `docs/architecture.md` says is what the manifests say: crates of
/// ours in the last column but one, those of others in the last.
pub(super) fn dependency_table(house: &House) -> Vec<String> {
    let page = house.text("docs/architecture.md");
    let mut problems = Vec::new();
    for member in &house.members {
        let owner = &member.owner;
        let row = page
            .lines()
            .find(|l| l.starts_with(&format!("| `{owner}` |")));
        let Some(row) = row else {
            problems.push(format!(
                "docs/architecture.md: no row for {owner} in the table"
            ));
            continue;
        };
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let last_two = cells[cells.len().saturating_sub(2)..].iter();
        let said: BTreeSet<&str> = last_two
            .flat_map(|cell| cell.split(", "))
            .filter(|n| *n != "–")
            .collect();
        let known = |section| {
            let lines = member.section(section).map(name);
            lines.map(|n| n.strip_prefix("linelit-").unwrap_or(n))
        };
        let known: BTreeSet<&str> = known("dependencies").collect();
        let (more, less) = (known.difference(&said), said.difference(&known));
        let page = "docs/architecture.md";
        problems.extend(more.map(|n| format!("{owner} depends on {n}; {page} does not say so")));
        problems.extend(less.map(|n| format!("{page}: {owner} does not depend on {n}")));
        for line in member.section("dev-dependencies") {
            let n = name(line);
            let ours = n.strip_prefix("linelit-");
            let whole_way = WHOLE_WAY.contains(&owner.as_str()) && ours.is_some();
            if !known.contains(ours.unwrap_or(n))
                && !FOR_TESTS.split(' ').any(|t| t == n)
                && !whole_way
            {
                problems.push(format!("{owner}: may not depend on {n}, not even in tests"));
            }
        }
    }
    problems
}

/// What is for this repository alone: tools, and what leans on the papers' numbers.
const UNPUBLISHED: [&str; 4] = ["papers", "cli", "workshop", "xtask"];

/// What crates.io wants of a published crate.
const WANTED: &str = "description readme license repository keywords categories rust-version";

pub(super) fn hygiene(house: &House) -> Vec<String> {
    let mut problems = Vec::new();
    for member in &house.members {
        let mut complain = |what: String| problems.push(format!("{}: {what}", member.owner));
        if member.section("lints").next() != Some("workspace = true") {
            complain("[lints] workspace = true is missing".to_owned());
        }
        for line in dependencies(member) {
            if !line.contains("workspace = true") {
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
        if UNPUBLISHED.contains(&member.owner.as_str()) == published {
            let alone = UNPUBLISHED.join(", ");
            complain(format!(
                "publish = false belongs to {alone}, and to them alone"
            ));
        }
    }
    problems
}

fn dependencies(member: &Member) -> impl Iterator<Item = &str> {
    let sections = ["dependencies", "dev-dependencies", "build-dependencies"];
    sections.into_iter().flat_map(|s| member.section(s))
}

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
        // Lints, a version of its own, all that crates.io wants.
        assert_eq!(hygiene(&house).len(), 2 + WANTED.split(' ').count());
        // There is no page to say anything.
        assert_eq!(dependency_table(&house).len(), 1);
    }
}

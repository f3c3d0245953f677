//! Rules about other people's packages: their licences, and one version of each. What they may be
//! stands in `deny.toml`, for these rules and for cargo-deny.

use super::{House, section};
use crate::cargo;
use std::collections::{BTreeMap, BTreeSet};

/// The quoted texts of a list in a section of `deny.toml`, the first of each line.
fn listed<'a>(deny: &'a str, name: &'a str, list: &'a str) -> impl Iterator<Item = &'a str> {
    let begin = format!("{list} = [");
    let mut lines = section(deny, name).skip_while(move |line| *line != begin);
    lines.next();
    let inside = lines.take_while(|line| *line != "]");
    inside.filter_map(|line| line.split('"').nth(1))
}

/// Each package has one version, but for those that are let be.
pub(super) fn one_of_each(house: &House) -> Vec<String> {
    let deny = house.text("deny.toml");
    let skipped: BTreeSet<&str> = listed(&deny, "bans", "skip").collect();
    let lock = house.text("Cargo.lock");
    let mut count = BTreeMap::<&str, usize>::new();
    for name in lock.lines().filter_map(|l| l.strip_prefix("name = \"")) {
        *count.entry(name.trim_end_matches('"')).or_default() += 1;
    }
    let several = |name: &&str| count.get(name).is_some_and(|count| *count > 1);
    let more = count.keys().filter(|n| several(n) && !skipped.contains(*n));
    let more = more.map(|name| format!("Cargo.lock: {} versions of {name}", count[name]));
    let less = skipped.iter().filter(|name| !several(name));
    let less = less.map(|name| format!("deny.toml: there are no two versions of {name}"));
    more.chain(less).collect()
}

/// Each package that is built here, also for tests, can be had under a licence of the list.
pub(super) fn licences(house: &House) -> Vec<String> {
    let deny = house.text("deny.toml");
    let allowed: BTreeSet<&str> = listed(&deny, "licenses", "allow").collect();
    let mut tree = cargo::cargo(["tree", "--workspace", "--locked", "--quiet"]);
    tree.args([
        "--prefix=none",
        "--edges=normal,build,dev",
        "--format={p}|{l}|",
    ]);
    let output = match tree.current_dir(&house.root).output() {
        Ok(output) if output.status.success() => output,
        Ok(output) => return vec![String::from_utf8_lossy(&output.stderr).trim().to_owned()],
        Err(error) => return vec![format!("cannot start cargo tree: {error}")],
    };
    let text = String::from_utf8_lossy(&output.stdout);
    let packages: BTreeSet<_> = text.lines().filter_map(package).collect();
    let bad = packages.iter().filter(|(_, l)| !is_allowed(l, &allowed));
    bad.map(|(name, licence)| format!("{name}: deny.toml does not allow its licence, `{licence}`"))
        .collect()
}

/// A package and its licence from a line of cargo's tree.
fn package(line: &str) -> Option<(&str, &str)> {
    let mut parts = line.split('|');
    Some((parts.next()?.split(" (").next()?, parts.next()?))
}

/// Whether an SPDX expression, of at most one level of parentheses, offers an allowed licence for
/// each of its parts.
fn is_allowed(expression: &str, allowed: &BTreeSet<&str>) -> bool {
    let one = |licence: &str| allowed.contains(licence.trim());
    let all = |part: &str| part.split(" AND ").all(one);
    let any = |part: &str| part.replace('/', " OR ").split(" OR ").any(all);
    match expression.split_once(')') {
        Some((first, second)) => {
            let or = second.trim_start().starts_with("OR ");
            let second = second.trim_start().trim_start_matches("OR ");
            let second = second.trim_start_matches("AND ");
            let both = [any(first.trim_start_matches('(')), any(second)];
            if or {
                both[0] || both[1]
            } else {
                both[0] && both[1]
            }
        }
        None => any(expression),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licences_are_read() {
        let allowed = BTreeSet::from(["MIT", "Zlib", "Unicode-3.0"]);
        let allowed = |licence| is_allowed(licence, &allowed);
        assert!(allowed("MIT") && allowed("Apache-2.0 OR MIT") && allowed("Unlicense/MIT"));
        assert!(allowed("(MIT OR Apache-2.0) AND Unicode-3.0") && allowed("MIT AND Zlib"));
        assert!(allowed("(GPL-3.0 AND MIT) OR Zlib"));
        assert!(!allowed("GPL-3.0") && !allowed("") && !allowed("MIT AND GPL-3.0"));
        assert!(!allowed("(MIT OR Apache-2.0) AND GPL-3.0"));
        assert!(!allowed("Apache-2.0 WITH LLVM-exception"));
    }

    #[test]
    fn lists_and_lines_are_read() {
        let deny =
            "[bans]\nskip = [\n # why\n { crate = \"a\", reason = \"b\" },\n \"c\",\n]\nx = [\n";
        assert_eq!(listed(deny, "bans", "skip").collect::<Vec<_>>(), ["a", "c"]);
        let line = "a v1.0 (proc-macro)|MIT| (*)";
        assert_eq!(package(line), Some(("a v1.0", "MIT")));
        assert_eq!(package(""), None);
    }
}

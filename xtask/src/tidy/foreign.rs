//! The rule about other people's packages: one version of each, but for those that `deny.toml`
//! skips. Their licences are held to that file by cargo-deny.

use super::{House, section};
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_read() {
        let deny =
            "[bans]\nskip = [\n # why\n { crate = \"a\", reason = \"b\" },\n \"c\",\n]\nx = [\n";
        assert_eq!(listed(deny, "bans", "skip").collect::<Vec<_>>(), ["a", "c"]);
    }
}

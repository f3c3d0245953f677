//! This module writes `docs/accuracy-lights.md`: backward errors of linear lights, by a search for
//! the worst and compared with the printed algorithms, and errors of solid angles.
//!
//! `cargo xtask accuracy [--check] [--quick] [--cases=N] [--keep-search]`: N random starts of the
//! search (10⁶ if not given; Peters 2021, §3.4 took 28 billion); `--check` compares with the
//! committed table instead of writing and fails when a row is worse; `--quick` takes a twentieth of
//! the inputs; `--keep-search` keeps the committed rows of the search, which takes minutes, and
//! writes the others anew.
#![allow(clippy::print_stdout, reason = "what is written is printed as well")]

use crate::accuracy;
use linelit_testkit::program::arguments;
use std::path::Path;

const HEAD: &str = include_str!("../accuracy-head.md");

#[test]
#[ignore = "long: by itself it checks a twentieth of the inputs"]
fn write() {
    let arguments = arguments(&["--check", "--quick"]);
    let flag = |name: &str| arguments.iter().any(|a| a == name);
    let cases = arguments.iter().find_map(|a| a.strip_prefix("--cases="));
    let cases: u64 = cases.map_or(1_000_000, |n| n.parse().expect("a number of starts"));
    let share = if flag("--quick") { 20 } else { 1 };
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join("docs/accuracy-lights.md");
    let committed = std::fs::read_to_string(&path).expect("the page");
    let keep = flag("--keep-search");
    let mut rows = if keep {
        Vec::new()
    } else {
        accuracy::in_double(cases / share)
    };
    rows.extend(accuracy::beside_printed(1_000_000 / share));
    rows.extend(accuracy::near_the_plane(1_000 / share));
    let mut table = accuracy::table(&rows);
    if keep {
        let searched = committed
            .lines()
            .filter(|l| l.starts_with("| projected solid angle, f64"));
        let kept: String = searched.map(|l| format!("{l}\n")).collect();
        let head_end = table.match_indices('\n').nth(1).map_or(0, |(at, _)| at + 1);
        table.insert_str(head_end, &kept);
    }
    println!("{table}");
    if flag("--check") {
        let worse = accuracy::regressions(&rows, &committed);
        assert!(worse.is_empty(), "{}", worse.join("\n"));
    } else {
        std::fs::write(&path, format!("{HEAD}\n{table}")).expect("the page");
    }
}

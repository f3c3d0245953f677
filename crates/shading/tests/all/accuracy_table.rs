//! This module measures every integral against double-double arithmetic, domain by domain, and
//! writes the table and plots of `docs/accuracy.md`.
//!
//! `cargo xtask accuracy [--check] [--quick | --share=N] [--only=GROUP]`: `--check` compares with
//! the table there instead of writing and fails when a row is worse; `--quick` takes a hundredth of
//! the inputs, `--share=N` the N-th part; `--only=GROUP` one of the groups (0 to 6).
#![allow(clippy::print_stdout, reason = "what is written is printed as well")]

use crate::accuracy::{self, Row};
use crate::{accuracy_report as report, lobe_rows, solid_rows};
use linelit_testkit::program::arguments;
use std::path::Path;

const HEAD: &str = include_str!("../accuracy-head.md");

#[test]
#[ignore = "long: by itself it checks a hundredth of the inputs"]
fn write() {
    let arguments = arguments(&["--check", "--quick"]);
    let flag = |name: &str| arguments.iter().any(|a| a == name);
    let after = |name: &str| arguments.iter().find_map(|a| a.strip_prefix(name));
    let usual = if flag("--quick") { 100 } else { 1 };
    let share = after("--share=").map_or(usual, |n| n.parse().expect("a share of the inputs"));
    let mut report = Report::default();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join("docs");
    let only = after("--only=");
    for (index, (group, count)) in GROUPS.into_iter().enumerate() {
        if only.is_none_or(|only| only == index.to_string()) {
            let rows = group(count / share);
            report
                .add(&rows, &folder, flag("--check"))
                .expect("the pages");
        }
    }
    assert!(report.worse.is_empty(), "{}", report.worse.join("\n"));
    if !flag("--check") {
        let text = format!(
            "{HEAD}\n{}{}\n## Error over condition\n\n{}",
            report::HEADER,
            report.table,
            report.plots
        );
        let text = text.trim_end().to_owned() + "\n";
        std::fs::write(folder.join("accuracy.md"), text).expect("the page");
    }
}

/// A function that returns the rows of some integrals, given the number of inputs for each.
type Group = fn(usize) -> Vec<Row>;

/// The functions and their numbers of inputs, one group after the other, so that a million samples
/// of each function need not be stored at once.
const GROUPS: [(Group, usize); 7] = [
    (accuracy::lines, 112_000),
    (accuracy::polygons, 144_000),
    (lobe_rows::phong_lines, 100_000),
    (lobe_rows::gaussians, 100_000),
    (lobe_rows::quadratures, 126_000),
    (solid_rows::solid_angles, 112_000),
    (solid_rows::ltc, 144_000),
];

/// What is known so far.
#[derive(Default)]
struct Report {
    table: String,
    plots: String,
    worse: Vec<String>,
}

impl Report {
    /// Rows of whole functions: into the table, and as plots unless they are only checked.
    fn add(&mut self, rows: &[Row], folder: &Path, check: bool) -> std::io::Result<()> {
        let lines = report::lines(rows);
        print!("{lines}");
        self.table += &lines;
        if check {
            let committed = std::fs::read_to_string(folder.join("accuracy.md")).unwrap_or_default();
            self.worse.extend(accuracy::regressions(rows, &committed));
            return Ok(());
        }
        let mut functions: Vec<&str> = rows.iter().map(|r| r.function).collect();
        functions.dedup();
        for function in functions {
            let name = format!("accuracy-{}.svg", function.replace("::", "-"));
            self.plots += &format!("![{function}]({name})\n\n");
            std::fs::write(folder.join(name), report::plot(function, rows))?;
        }
        Ok(())
    }
}

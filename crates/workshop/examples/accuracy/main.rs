//! Measures every integral against double-double arithmetic, domain by domain, and writes the table
//! and plots of `docs/accuracy.md`.
//!
//! `accuracy [--check] [--quick | --share=N] [--only=GROUP] [DIR]`: DIR is the folder of the
//! documents, `docs` by default; `--check` compares with the table there instead of writing and
//! exits 1 when a row is worse; `--quick` takes a hundredth of the inputs, `--share=N` the N-th
//! part; `--only=GROUP` one of the groups (0 to 8).
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "printing is what the program is for"
)]

#[path = "../../../shading/tests/all/accuracy.rs"]
mod accuracy;
#[path = "../../../shading/tests/all/lobe_oracle.rs"]
mod lobe_oracle;
#[path = "../../../shading/tests/all/lobe_rows.rs"]
mod lobe_rows;
#[path = "../../../shading/tests/all/naive.rs"]
mod naive;
#[path = "../../../shading/tests/all/oracle.rs"]
mod oracle;
#[path = "../../../shading/tests/all/polygon_oracle.rs"]
mod polygon_oracle;
mod report;
#[path = "../../../shading/tests/all/solid_rows.rs"]
mod solid_rows;

use accuracy::Row;
use std::path::Path;
use std::process::ExitCode;

const HEAD: &str = include_str!("../accuracy-head.md");

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let flag = |name: &str| arguments.iter().any(|a| a == name);
    let folder = arguments
        .iter()
        .find(|a| !a.starts_with("--"))
        .map_or("docs", String::as_str);
    let part = arguments.iter().find_map(|a| a.strip_prefix("--share="));
    let share = match part.map(str::parse::<usize>) {
        None if flag("--quick") => 100,
        None => 1,
        Some(Ok(share @ 1..)) => share,
        Some(_) => {
            eprintln!("usage: accuracy [--check] [--quick | --share=N] [--only=GROUP] [DIR]");
            return ExitCode::from(2);
        }
    };
    let mut report = Report::default();
    let folder = Path::new(folder);
    let only = arguments.iter().find_map(|a| a.strip_prefix("--only="));
    for (index, (group, count)) in GROUPS.into_iter().enumerate() {
        if only.is_some_and(|only| only != index.to_string()) {
            continue;
        }
        let rows = group(count / share);
        if let Err(error) = report.add(&rows, folder, flag("--check")) {
            eprintln!("{}: {error}", folder.display());
            return ExitCode::FAILURE;
        }
    }
    if flag("--check") {
        for line in &report.worse {
            eprintln!("{line}");
        }
        return if report.worse.is_empty() {
            ExitCode::SUCCESS
        } else {
            ExitCode::FAILURE
        };
    }
    let text = format!(
        "{HEAD}\n{}{}\n## Error over condition\n\n{}",
        report::HEADER,
        report.table,
        report.plots
    );
    let path = folder.join("accuracy.md");
    match std::fs::write(&path, text.trim_end().to_owned() + "\n") {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            ExitCode::FAILURE
        }
    }
}

/// Rows of some functions with so many inputs each.
type Group = fn(usize) -> Vec<Row>;

/// The functions and their numbers of inputs, one group after the other: a million samples of each
/// function need not be kept at once.
const GROUPS: [(Group, usize); 9] = [
    (accuracy::lines, 112_000),
    (accuracy::polygons, 144_000),
    (lobe_rows::phong_lines, 100_000),
    (lobe_rows::gaussians, 100_000),
    (lobe_rows::cosine_lobes, 112_000),
    (lobe_rows::quadratures, 126_000),
    (lobe_rows::phong_polygons, 112_000),
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

//! Measures every integral against double-double arithmetic, domain by domain, and writes the table
//! and plots of `docs/accuracy.md`.
//!
//! `accuracy [--check] [--quick] [DIR]`: DIR is the folder of the documents, `docs` by default;
//! `--check` compares with the table there instead of writing and exits 1 when a row is worse;
//! `--quick` takes a twentieth of the inputs.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "printing is what the program is for"
)]

#[path = "../tests/common/accuracy.rs"]
mod accuracy;
#[path = "../tests/common/naive.rs"]
mod naive;
#[path = "../tests/common/oracle.rs"]
mod oracle;
#[path = "../tests/common/report.rs"]
mod report;

use std::path::Path;
use std::process::ExitCode;

const HEAD: &str = include_str!("accuracy-head.md");

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let flag = |name: &str| arguments.iter().any(|a| a == name);
    let folder = arguments
        .iter()
        .find(|a| !a.starts_with("--"))
        .map_or("docs", String::as_str);
    let share = if flag("--quick") { 20 } else { 1 };
    let mut rows = accuracy::lines(120_000 / share);
    rows.extend(accuracy::polygons(170_000 / share));
    rows.extend(accuracy::lobes(20_000 / share));
    let path = Path::new(folder).join("accuracy.md");
    let table = report::table(&rows);
    println!("{table}");
    if flag("--check") {
        let committed = std::fs::read_to_string(&path).unwrap_or_default();
        let worse = accuracy::regressions(&rows, &committed);
        for line in &worse {
            eprintln!("{line}");
        }
        return if worse.is_empty() {
            ExitCode::SUCCESS
        } else {
            ExitCode::FAILURE
        };
    }
    let mut text = format!("{HEAD}\n{table}\n## Error over condition\n\n");
    let mut functions: Vec<&str> = rows.iter().map(|r| r.function).collect();
    functions.dedup();
    for function in functions {
        let name = format!("accuracy-{}.svg", function.replace("::", "-"));
        text += &format!("![{function}]({name})\n\n");
        if let Err(error) =
            std::fs::write(Path::new(folder).join(name), report::plot(function, &rows))
        {
            eprintln!("{folder}: {error}");
            return ExitCode::FAILURE;
        }
    }
    match std::fs::write(&path, text.trim_end().to_owned() + "\n") {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            ExitCode::FAILURE
        }
    }
}

//! Writes `docs/accuracy-lights.md`: backward errors of linear lights, in `f64` by a search for the
//! worst and in `f32`, and errors of solid angles in `f32`.
//!
//! `accuracy_lights [--check] [--quick] [--cases N] [DIR]`: DIR is the folder of the documents,
//! `docs` by default; N random starts of the search in `f64` (10⁶ if not given; Peters 2021, §3.4
//! took 28 billion); `--check` compares with the committed table instead of writing and exits 1
//! when a row is worse; `--quick` takes a twentieth of the inputs; `--keep-search` keeps the
//! committed rows of the search in `f64`, which takes minutes, and writes the others anew.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "printing is what the program is for"
)]

#[path = "../../lights/tests/all/accuracy.rs"]
mod accuracy;
#[path = "../../lights/tests/all/peters_as_printed.rs"]
mod peters_as_printed;
#[path = "../../lights/tests/all/precise.rs"]
mod precise;

use std::path::Path;
use std::process::ExitCode;

const HEAD: &str = include_str!("accuracy-lights-head.md");

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let flag = |name: &str| arguments.iter().any(|a| a == name);
    let after = |name: &str| arguments.iter().skip_while(|a| *a != name).nth(1);
    let cases: u64 = after("--cases")
        .and_then(|n| n.parse().ok())
        .unwrap_or(1_000_000);
    let folder = arguments
        .iter()
        .find(|a| !a.starts_with("--") && Some(*a) != after("--cases"))
        .map_or("docs", String::as_str);
    let share = if flag("--quick") { 20 } else { 1 };
    let path = Path::new(folder).join("accuracy-lights.md");
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let keep = flag("--keep-search");
    let mut rows = if keep {
        Vec::new()
    } else {
        accuracy::in_double(cases / share)
    };
    rows.extend(accuracy::in_single(1_000_000 / share));
    rows.extend(accuracy::solid_angles(100_000 / share));
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
        for line in &worse {
            eprintln!("{line}");
        }
        return ExitCode::from(u8::from(!worse.is_empty()));
    }
    match std::fs::write(&path, format!("{HEAD}\n{table}")) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            ExitCode::FAILURE
        }
    }
}

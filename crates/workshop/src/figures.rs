//! `figures`: measures the table of README by one command, and writes its page.

use crate::args::FiguresArgs;
use crate::equal_time::{Curve, contest_of};
use anyhow::Result;
use linelit_cli::output::Output;
use linelit_film::write_atomically;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;

/// The relative mean squared error that every method has to reach.
const ERROR: f64 = 1e-4;

/// The scenes, with a few words about each. In the last one, lines are slower at equal error.
const SCENES: [(&str, &str); 6] = [
    ("cornell-box-large", "two blocks, a large light"),
    ("grid-planes-large", "crossed grids of bars"),
    ("triangle-soup-small", "a thousand loose triangles"),
    ("plates", "glossy plates, four lights"),
    ("spheres", "closed meshes of 10⁴ triangles"),
    ("colonnade-large", "a quarter of a million triangles, dense"),
];

/// The columns of the table, each with its estimators, the best of which counts. Points come first,
/// without and with a shaft.
const COLUMNS: [(&str, &[&str]); 5] = [
    ("shadow rays", &["point-area", "point-solid-angle"]),
    (
        "points in a shaft",
        &[
            "point-area[visibility=shaft]",
            "point-solid-angle[visibility=shaft]",
        ],
    ),
    ("`line-analytic`", &["line-analytic"]),
    ("`hybrid`", &["hybrid"]),
    ("`exact`", &["exact"]),
];

/// Measures all scenes by all methods, and writes the page.
pub(crate) fn run(args: &FiguresArgs, out: &mut Output) -> Result<()> {
    let mut page = format!(
        "# The figures of README\n\nWritten by `cargo xtask figures` on {}, at commit {}, on {}: one thread, 32 × 24 \
         pixels, the least time of {} rounds.\n\n<!-- figures -->\n| µs per shading point to reach a relative MSE of 10⁻⁴ |",
        said(&["date", "+%F"]),
        said(&["git", "rev-parse", "--short", "HEAD"]),
        processor(),
        args.rounds,
    );
    for (heading, _) in COLUMNS {
        write!(page, " {heading} |")?;
    }
    writeln!(page, "\n|---|{}", "---:|".repeat(COLUMNS.len()))?;
    for (scene, about) in SCENES {
        let estimators = COLUMNS.iter().flat_map(|(_, list)| list.iter().copied());
        let curves = contest_of(scene, estimators, args.rounds, &args.read)?;
        let row = row(&curves);
        writeln!(out, "{scene} {row}")?;
        writeln!(page, "| `{scene}`: {about} |{row}")?;
    }
    page.push_str("<!-- end of figures -->\n");
    write_atomically(&args.out, page.as_bytes())?;
    Ok(())
}

/// Returns the times of a scene as a row, with the least in bold and a dash where the error is not
/// reached.
fn row(curves: &[Curve]) -> String {
    let mut curves = curves.iter();
    let times = COLUMNS.map(|(_, list)| {
        let of_column = curves.by_ref().take(list.len());
        let times = of_column.filter_map(|curve| curve.time_to(ERROR));
        times.reduce(f64::min)
    });
    let least = times.into_iter().flatten().reduce(f64::min);
    let cell = |time: Option<f64>| match time {
        None => " – |".to_owned(),
        Some(time) if least.map(short) == Some(short(time)) => format!(" **{}** |", short(time)),
        Some(time) => format!(" {} |", short(time)),
    };
    times.map(cell).concat()
}

/// Formats a time with two or three digits.
fn short(time: f64) -> String {
    match time {
        ..1.0 => format!("{time:.2}"),
        ..10.0 => format!("{time:.1}"),
        _ => format!("{time:.0}"),
    }
}

/// Returns the output of a program, or `unknown`.
pub(crate) fn said(words: &[&str]) -> String {
    let output = Command::new(words[0]).args(&words[1..]).output();
    let text = output.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    text.ok()
        .filter(|text| !text.is_empty())
        .unwrap_or_else(|| "unknown".to_owned())
}

/// Returns the name of the processor, where the system reports it.
pub(crate) fn processor() -> String {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(
        || std::env::consts::ARCH.to_owned(),
        |(_, name)| name.to_owned(),
    )
}

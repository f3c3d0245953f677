//! `linelit list`: prints the names that other commands accept.

use super::methods;
use crate::args::{ListArgs, Listed};
use crate::output::{Output, OutputError};
use crate::words::about_sampler;
use anyhow::Result;
use clap::ValueEnum as _;
use linelit_estimators::Technique;
use linelit_samplers::SamplerKind;
use linelit_scenes::BuiltIn;
use linelit_study::scene_study::about;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// A name and what it means, in a line.
#[derive(Clone, Debug, Serialize)]
struct Row {
    name: &'static str,
    about: &'static str,
    /// The processor seconds that a study takes, where they are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    cpu_seconds: Option<f64>,
}

/// Prints the names of the requested kind, or of all kinds.
pub fn run(args: &ListArgs, out: &mut Output) -> Result<()> {
    match args.what {
        Some(what) if args.json => writeln!(out, "{}", json(what)?)?,
        Some(what) => print(what, "", out)?,
        None if args.json => {
            let all = Listed::value_variants().iter();
            let row = |what: &Listed| Ok((heading(*what), json(*what)?));
            let all: BTreeMap<String, Value> = all.map(row).collect::<serde_json::Result<_>>()?;
            writeln!(out, "{}", serde_json::to_string(&all)?)?;
        }
        None => {
            for (k, what) in Listed::value_variants().iter().enumerate() {
                writeln!(out, "{}{}:", if k > 0 { "\n" } else { "" }, heading(*what))?;
                print(*what, "  ", out)?;
            }
        }
    }
    Ok(())
}

fn json(what: Listed) -> serde_json::Result<Value> {
    match what {
        Listed::Methods => serde_json::to_value(methods::all()),
        _ => serde_json::to_value(rows(what)),
    }
}

fn heading(what: Listed) -> String {
    let value = what.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

fn print(what: Listed, indent: &str, out: &mut Output) -> Result<(), OutputError> {
    for line in lines(what) {
        writeln!(out, "{indent}{line}")?;
    }
    Ok(())
}

/// Returns the lines about names of a kind: each has the name, the cost of a study, and what the
/// name means.
fn lines(what: Listed) -> Vec<String> {
    if what == Listed::Methods {
        return methods::lines();
    }
    let rows = rows(what);
    let width = rows.iter().map(|row| row.name.len()).max().unwrap_or(0);
    let line = |row: &Row| {
        let cost = match (what, row.cpu_seconds) {
            (Listed::Studies, Some(seconds)) => format!("{:>8} CPU  ", about_seconds(seconds)),
            (Listed::Studies, None) => format!("{:>8} CPU  ", "?"),
            _ => String::new(),
        };
        format!("{:width$}  {cost}{}", row.name, row.about)
    };
    rows.iter().map(line).collect()
}

/// Returns the list of studies, with the cost of each, one study in a line.
pub(super) fn studies() -> String {
    lines(Listed::Studies).join("\n")
}

/// Formats a time as seconds, minutes or hours, with about two digits.
fn about_seconds(seconds: f64) -> String {
    if seconds < 99.5 {
        format!("{seconds:.0} s")
    } else if seconds < 5970.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}

fn rows(what: Listed) -> Vec<Row> {
    let row = |(name, about)| Row {
        name,
        about,
        cpu_seconds: None,
    };
    let study = |(name, about)| Row {
        cpu_seconds: linelit_papers::processor_seconds(name),
        ..row((name, about))
    };
    match what {
        Listed::Scenes => BuiltIn::ALL.map(|s| row((s.name, s.about))).to_vec(),
        Listed::Studies => linelit_papers::studies().map(study).collect(),
        Listed::Estimators => {
            let row = |technique: Technique| row((technique.name(), about(&technique)));
            Technique::all().map(row).collect()
        }
        Listed::Samplers => {
            let samplers = SamplerKind::ALL.map(|kind| row((kind.name(), about_sampler(kind))));
            samplers.to_vec()
        }
        // Methods have columns of their own.
        Listed::Methods => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_studies_cost_is_said_to_two_digits() {
        let said = [3.4, 99.4, 100.0, 5400.0, 9000.0].map(about_seconds);
        assert_eq!(said, ["3 s", "99 s", "2 min", "90 min", "2.5 h"]);
        assert!(studies().lines().all(|line| line.contains(" CPU  ")));
    }

    #[test]
    fn everything_is_said_in_a_line_of_its_own() {
        for what in Listed::value_variants() {
            let mut seen = std::collections::BTreeSet::new();
            for Row { name, about, .. } in rows(*what) {
                let long = about.chars().count();
                assert!((10..=90).contains(&long), "{name}: {about}");
                assert!(seen.insert(name) && seen.insert(about), "{name}: {about}");
            }
        }
    }
}

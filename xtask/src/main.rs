//! The developers' tools: `cargo xtask COMMAND`.
//!
//! This program has no dependencies and links no crate of the renderer; it starts `cargo` and the
//! programs of the crates. The users' commands, listed in [`PROGRAM`], are passed to the `linelit`
//! program word for word; the developers' commands are listed in [`USAGE`].
//!
//! Exit status: 0 done, 1 failed, 2 usage.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a command-line tool talks to its user"
)]

mod cargo;
mod packages;
mod python;
mod suite;
mod tidy;

use std::io::Write as _;
use std::process::ExitCode;

/// The commands of the `linelit` program, each with a line about it. A test of the program (`help`
/// of the crate `cli`) checks that this list is complete.
const PROGRAM: &str = include_str!("program.txt");

/// The commands of the developers, for the help.
const USAGE: &str = "\
the workshop:
  test [--long [--seed N]] [STEP…]
                            everything that must hold; --long adds the long tests, on new random cases unless
                            N says which; STEP… runs only these:
                            fmt tidy clippy package test doctest doc features long outside
                            and, by name alone, publish (cargo publish --dry-run of all crates; asks crates.io),
                            python (builds the wheel in an environment of its own; asks PyPI)
  bench WHAT [--scene PATH] [--json]
                            measure speed; WHAT is visibility, equal-time or CRATE/BENCH for a criterion bench,
                            speed --against PROGRAM, the seconds of pictures compared with an older linelit, or
                            choice [--against PROGRAM], error × time of hybrid over the best other method's
  ratchet                   lower the figures of xtask/ratchet.txt to what they are now
  accuracy                  worst errors of the closed forms and of samples, as docs/accuracy*.md
  pixels [WORD…]            hashes of rendered pixels, to compare two programs; only lines with all words
  vectors DIR               hold the closed forms to the reference vectors in DIR
  pictures [--check]        draw the pictures of README and gallery, or say which of the gallery are old
  figures                   measure the table of README, and write docs/figures.md
  check-references DIR      hold renders to the reference images below DIR
  load-all DIR              load and render every scene file below DIR
  fuzz [--minutes N] [--seed S]
                            mutated scenes of all formats for N minutes (30), on a new seed unless told
  fit-ltc [tables | page]   fit linearly transformed cosines afresh and hold the tables and docs/accuracy-ltc.md
                            to it, or write them

exit status: 0 done, 1 failed, 2 usage";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((command, rest)) = arguments.split_first() else {
        return usage("no command given");
    };
    // Run the test of both crates, even if it fails in the first; the larger status counts.
    let tables = |name| ["shading", "lights"].map(|of| cargo::written(of, "all", name, rest));
    let status = match command.as_str() {
        "help" | "-h" | "--help" => {
            // A reader that closes the pipe early has read enough.
            writeln!(std::io::stdout(), "{}", help()).ok();
            0
        }
        of_program if programs().any(|name| name == of_program) => {
            cargo::run("cli", &["--bin", "linelit"], &arguments)
        }
        "check-references" | "load-all" | "pictures" | "figures" => {
            cargo::run("workshop", &["--bin", "workshop"], &arguments)
        }
        "bench" => match rest.split_first() {
            None => return usage("bench needs to know WHAT to measure"),
            Some((what, more)) => match what.split_once('/') {
                Some((package, bench)) => cargo::criterion(package, bench, more),
                None if ["speed", "choice"].contains(&what.as_str()) => {
                    match cargo::build("cli", &["--bin", "linelit"]) {
                        0 => cargo::run("workshop", &["--bin", "workshop"], &arguments),
                        failed => failed,
                    }
                }
                None => cargo::run("workshop", &["--bin", "workshop"], &arguments),
            },
        },
        "vectors" if rest.is_empty() => return usage("vectors needs a folder"),
        "vectors" => tables("vectors::print").into_iter().fold(0, u8::max),
        "accuracy" => tables("accuracy_table::write").into_iter().fold(0, u8::max),
        "pixels" => cargo::run("integrator", &["--example", "pixels"], rest),
        "fit-ltc" => cargo::written("bsdf", "fits", "fit::fit", rest),
        "ratchet" => match tidy::lower_ratchet(&cargo::root()) {
            Ok(lowered) => {
                println!("{lowered} figures of xtask/ratchet.txt lowered");
                0
            }
            Err(problem) => {
                eprintln!("error: {problem}");
                1
            }
        },
        "fuzz" | "test" => {
            let run = match command == "fuzz" {
                true => suite::fuzz,
                false => suite::run,
            };
            match run(rest) {
                Ok(status) => status,
                Err(unknown) => return usage(&unknown),
            }
        }
        other => return usage(&format!("unknown command `{other}`")),
    };
    ExitCode::from(status)
}

/// Returns the names of the program's commands.
fn programs() -> impl Iterator<Item = &'static str> {
    PROGRAM.lines().filter_map(|line| line.split(' ').next())
}

/// Returns the help.
fn help() -> String {
    let mut text = "usage: cargo xtask COMMAND [ARGUMENTS]\n\nthe linelit program (same words as \
                    `linelit COMMAND`, see `cargo xtask COMMAND --help`):\n"
        .to_owned();
    text.extend(PROGRAM.lines().map(|line| format!("  {line}\n")));
    format!("{text}\n{USAGE}")
}

/// Prints a usage error with the help, and returns its exit status.
fn usage(problem: &str) -> ExitCode {
    eprintln!("error: {problem}\n\n{}", help());
    ExitCode::from(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The commands in the match of `main`, read from its source, are the commands of the help.
    #[test]
    fn help_names_every_command_and_no_other() {
        let arms = include_str!("main.rs").lines().filter(|line| {
            let depth = line.len() - line.trim_start().len();
            depth == 8 && line.trim_start().starts_with('"') && line.contains('"')
        });
        let before_arrow = arms.filter_map(|line| line.split("=>").next());
        let done: BTreeSet<_> = before_arrow
            .flat_map(|line| line.split('"').skip(1).step_by(2))
            .filter(|word| !["help", "-h", "--help"].contains(word))
            .collect();
        let listed = USAGE.lines().filter_map(|line| line.strip_prefix("  "));
        let listed = listed.filter(|line| !line.starts_with(' '));
        let listed: BTreeSet<_> = listed.filter_map(|line| line.split(' ').next()).collect();
        assert_eq!(done, listed);
        assert!(programs().all(|name| !done.contains(name)));
        assert!(help().contains(&format!("\n  {}", PROGRAM.lines().next().unwrap_or("?"))));
    }
}

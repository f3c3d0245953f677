//! `cargo xtask test`: everything that must hold, step by step, timed and summed up.

use crate::{cargo, manifest, tidy};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The steps by name, in the order in which they run: quick ones first.
const STEPS: [&str; 8] = [
    "fmt", "tidy", "clippy", "test", "doctest", "doc", "features", "long",
];

/// Which steps to run.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Selection {
    steps: Vec<&'static str>,
    /// What the long tests draw their random cases from; a new one each time unless given.
    seed: Option<u64>,
}

impl Selection {
    /// Reads `[--long] [--seed N] [STEP…]`.
    pub(crate) fn parse(arguments: &[String]) -> Result<Self, String> {
        let (mut long, mut seed) = (false, None);
        let mut named = Vec::new();
        let mut arguments = arguments.iter();
        while let Some(argument) = arguments.next() {
            match STEPS.iter().find(|step| **step == argument.as_str()) {
                Some(step) => named.push(*step),
                None if argument == "--long" => long = true,
                None if argument == "--seed" => {
                    let number = arguments.next().and_then(|n| n.parse().ok());
                    seed = Some(number.ok_or("--seed needs a whole number")?);
                }
                None => return Err(format!("unknown step `{argument}`")),
            }
        }
        let chosen = |step: &&&str| match (**step, named.is_empty()) {
            ("long", _) => long || named.contains(&"long"),
            (_, true) => true,
            (name, false) => named.contains(&name),
        };
        let steps: Vec<_> = STEPS.iter().filter(chosen).copied().collect();
        if seed.is_some() && !steps.contains(&"long") {
            return Err("--seed is for the long tests; add --long".to_owned());
        }
        Ok(Self { steps, seed })
    }
}

/// What became of one step.
struct Outcome {
    name: String,
    problems: Vec<String>,
    time: Duration,
}

/// Runs the selected steps, all of them whatever fails; 0 if all passed, else 1.
pub(crate) fn run(selection: &Selection) -> u8 {
    let mut outcomes = Vec::new();
    let seed = selection.seed.unwrap_or_else(new_seed);
    for step in &selection.steps {
        for (name, work) in expand(step, seed) {
            eprintln!("\n== {name}");
            let begin = Instant::now();
            let problems = work();
            problems.iter().for_each(|p| eprintln!("   {p}"));
            outcomes.push(Outcome {
                name,
                problems,
                time: begin.elapsed(),
            });
        }
    }
    let status = summary(&outcomes);
    if selection.steps.contains(&"long") {
        println!("the long tests again, on the same cases: cargo xtask test --seed {seed} long");
    }
    status
}

/// A seed that no run had before.
fn new_seed() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    // Nanoseconds of 500 years fit; a clock before 1970 costs the newness only.
    now.map_or(0, |t| {
        t.as_secs() * 1_000_000_000 + u64::from(t.subsec_nanos())
    })
}

type Work = Box<dyn FnOnce() -> Vec<String>>;

/// A step's parts, each with its name.
fn expand(step: &str, seed: u64) -> Vec<(String, Work)> {
    let one = |name: &str, command: Command| vec![(name.to_owned(), checked(command))];
    match step {
        "fmt" => one(
            "rustfmt",
            cargo::cargo(["fmt", "--all", "--check", "--", "-l"]),
        ),
        "tidy" => vec![(
            "tidy: the house rules".to_owned(),
            Box::new(|| tidy::problems(&cargo::root())) as Work,
        )],
        "clippy" => one(
            "clippy, all targets",
            quiet(
                &["clippy", "--workspace", "--all-targets", "--keep-going"],
                &["-D", "warnings"],
            ),
        ),
        "test" => one("tests", same_cases(tests(&["--examples"], &[]))),
        "doctest" => one(
            "doctests",
            quiet(&["test", "--workspace", "--no-fail-fast", "--doc"], &[]),
        ),
        "doc" => {
            let mut doc = quiet(&["doc", "--workspace", "--no-deps"], &[]);
            doc.env("RUSTDOCFLAGS", "-D warnings");
            one("rustdoc", doc)
        }
        "features" => feature_combinations(),
        "long" => vec![
            (
                format!("long tests, seed {seed}"),
                checked(new_cases(tests(&["--release"], &["--ignored"]), seed)),
            ),
            (
                format!("properties on new cases, seed {seed}"),
                checked(new_cases(tests(&["--release"], &[]), seed)),
            ),
        ],
        _ => Vec::new(),
    }
}

/// `cargo test` on all that is not documentation.
fn tests(more: &[&str], after: &[&str]) -> Command {
    let everything = [
        "test",
        "--workspace",
        "--no-fail-fast",
        "--lib",
        "--bins",
        "--tests",
    ];
    quiet(&[&everything, more].concat(), after)
}

/// The variable that proptest takes its seed from.
const PROPERTY_SEED: &str = "PROPTEST_RNG_SEED";

/// The same random cases on every run, so that a failure is the change's and can be had again: new
/// ones are for the long tests. Whoever sets the variable has their own.
fn same_cases(mut command: Command) -> Command {
    if std::env::var_os(PROPERTY_SEED).is_none() {
        command.env(PROPERTY_SEED, "20160301");
    }
    command
}

/// Sixteen times the usual number of random cases, for properties that say how many they usually
/// take as well (the tests' `cases(n)` scales by this over 256), and from this seed, which loops of
/// random numbers take as well; a failing case prints itself, smallest form first.
fn new_cases(mut command: Command, seed: u64) -> Command {
    command.env("PROPTEST_CASES", "4096");
    command.env(PROPERTY_SEED, seed.to_string());
    command.env("LINELIT_FUZZ_SEED", seed.to_string());
    command
}

/// Mutated scenes for some minutes: the long test of fuzzing, with the assertions of other tests.
pub(crate) fn fuzz(words: &[String]) -> Result<u8, String> {
    let mut minutes = "30".to_owned();
    let mut seed = None;
    let mut rest = words.iter();
    while let Some(word) = rest.next() {
        let number = rest.next().filter(|n| n.parse::<u64>().is_ok());
        let number = number.ok_or_else(|| format!("`{word}` of fuzz takes a number"))?;
        match word.as_str() {
            "--minutes" => minutes.clone_from(number),
            "--seed" => seed = Some(number),
            other => return Err(format!("fuzz has no `{other}`")),
        }
    }
    let mut command = cargo::cargo(["test", "--package", "linelit-cli", "--test", "fuzz"]);
    command
        .args(["--", "--ignored", "--nocapture"])
        .current_dir(cargo::root())
        .env("LINELIT_FUZZ_MINUTES", minutes)
        .envs(seed.map(|seed| ("LINELIT_FUZZ_SEED", seed)));
    Ok(cargo::status(&mut command))
}

/// `cargo ARGUMENTS --quiet -- AFTER` on the whole workspace.
fn quiet(arguments: &[&str], after: &[&str]) -> Command {
    let mut command = cargo::cargo(arguments.iter().copied());
    command.arg("--quiet");
    if !after.is_empty() {
        command.arg("--").args(after);
    }
    command
}

/// Runs a command, passes on what it prints, and remembers the lines that say what failed.
fn checked(mut command: Command) -> Work {
    Box::new(move || {
        command
            .current_dir(cargo::root())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) => return vec![format!("cannot start {}: {error}", shown(&command))],
        };
        let streams = (child.stdout.take(), child.stderr.take());
        let mut found: Vec<String> = std::thread::scope(|scope| {
            let out = scope.spawn(move || streams.0.map_or_else(Vec::new, listen));
            let err = scope.spawn(move || streams.1.map_or_else(Vec::new, listen));
            [out, err]
                .into_iter()
                .flat_map(|t| t.join().unwrap_or_default())
                .collect()
        });
        if child.wait().is_ok_and(|status| status.success()) {
            return Vec::new();
        }
        found.sort();
        found.dedup();
        found.insert(0, format!("failed: {}", shown(&command)));
        found
    })
}

/// Prints a stream line by line; returns what failed according to it.
fn listen(stream: impl Read) -> Vec<String> {
    let lines = BufReader::new(stream).lines().map_while(Result::ok);
    let mut found = Vec::new();
    for line in lines {
        eprintln!("{line}");
        found.extend(failure(&line));
    }
    found
}

/// The failure that a line of rustfmt, rustc, clippy or a test names, if any.
fn failure(line: &str) -> Option<String> {
    let line = line.trim();
    let test = line
        .strip_prefix("---- ")
        .and_then(|l| l.strip_suffix(" stdout ----"));
    if let Some(test) = test {
        return Some(format!("test {test}"));
    }
    // What rustfmt would change it lists, as bare paths.
    let path = Path::new(line);
    if path.is_absolute() && path.extension().is_some_and(|e| e == "rs") && !line.contains(' ') {
        let inside = path.strip_prefix(cargo::root()).unwrap_or(path);
        return Some(format!("not formatted: {}", inside.display()));
    }
    let compiles = line.starts_with("error: could not compile")
        || line.starts_with("error: could not document");
    let reruns = line.starts_with("error: test failed, to rerun")
        || line.starts_with("error: doctest failed");
    (compiles || reruns).then(|| line.trim_start_matches("error: ").to_owned())
}

fn shown(command: &Command) -> String {
    let words = command.get_args().map(|a| a.to_string_lossy().into_owned());
    format!("cargo {}", words.collect::<Vec<_>>().join(" "))
}

/// Each crate with features: none of them, each alone, all of them. Defaults and the absence of
/// features are what the other steps build.
fn feature_combinations() -> Vec<(String, Work)> {
    let mut steps = Vec::new();
    for found in manifest::members(&cargo::root()) {
        let features: Vec<&String> = found.features.iter().filter(|f| *f != "default").collect();
        if features.is_empty() {
            continue;
        }
        let mut sets = vec![String::new()];
        sets.extend(features.iter().map(|f| (*f).clone()));
        if features.len() > 1 {
            sets.push(
                features
                    .iter()
                    .map(|f| f.as_str())
                    .collect::<Vec<_>>()
                    .join(","),
            );
        }
        for set in sets {
            let mut check = quiet(
                &[
                    "check",
                    "--all-targets",
                    "--no-default-features",
                    "-p",
                    &found.name,
                ],
                &[],
            );
            check
                .args(["--features", &set])
                .env("RUSTFLAGS", "-D warnings");
            steps.push((
                format!("features of {}: [{set}]", found.name),
                checked(check),
            ));
        }
    }
    steps
}

/// The table of steps, what failed, and the plain line that scripts look for.
fn summary(outcomes: &[Outcome]) -> u8 {
    println!("\n{:>8}  step", "seconds");
    for outcome in outcomes {
        let verdict = if outcome.problems.is_empty() {
            ""
        } else {
            "  FAILED"
        };
        println!(
            "{:>8.1}  {}{verdict}",
            outcome.time.as_secs_f64(),
            outcome.name
        );
    }
    let failed: Vec<&Outcome> = outcomes.iter().filter(|o| !o.problems.is_empty()).collect();
    if !failed.is_empty() {
        println!("\nwhat failed:");
    }
    for outcome in &failed {
        for problem in &outcome.problems {
            println!("  {}: {problem}", outcome.name);
        }
    }
    println!(
        "\n{} passed, {} failed",
        outcomes.len() - failed.len(),
        failed.len()
    );
    u8::from(!failed.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(words: &[&str]) -> Result<Vec<&'static str>, String> {
        let words: Vec<String> = words.iter().map(|w| (*w).to_owned()).collect();
        Selection::parse(&words).map(|s| s.steps)
    }

    #[test]
    fn failures_are_named() {
        let named = |line: &str| failure(line).unwrap_or_default();
        assert_eq!(named("---- a::b stdout ----"), "test a::b");
        let file = cargo::root().join("x.rs");
        assert_eq!(named(&file.to_string_lossy()), "not formatted: x.rs");
        assert!(
            named("error: could not compile `x` (lib) due to 2 previous errors")
                .starts_with("could")
        );
        assert!(named("error: test failed, to rerun pass `-p x --lib`").contains("-p x"));
        assert!(failure("test a ... ok").is_none());
    }

    #[test]
    fn long_runs_are_new_and_can_be_had_again() {
        let environment = |command: &Command| -> Vec<(String, String)> {
            let text = |s: &std::ffi::OsStr| s.to_string_lossy().into_owned();
            let set = command.get_envs();
            set.filter_map(|(k, v)| Some((text(k), text(v?)))).collect()
        };
        let set = environment(&new_cases(Command::new("cargo"), 12));
        assert!(set.contains(&("PROPTEST_CASES".to_owned(), "4096".to_owned())));
        assert!(set.contains(&(PROPERTY_SEED.to_owned(), "12".to_owned())));
        let first = new_seed();
        std::thread::sleep(Duration::from_millis(20));
        assert!(new_seed() > first);
    }

    #[test]
    fn selections() {
        assert_eq!(parse(&[]).unwrap(), STEPS[..7]);
        assert_eq!(parse(&["--long"]).unwrap(), STEPS);
        assert_eq!(parse(&["tidy", "fmt"]).unwrap(), ["fmt", "tidy"]);
        assert_eq!(parse(&["--seed", "7", "long"]).unwrap(), ["long"]);
        let words = ["--long", "--seed", "7"].map(str::to_owned);
        assert_eq!(Selection::parse(&words).unwrap().seed, Some(7));
        assert!(parse(&["--long", "--seed"]).is_err() && parse(&["--seed", "x", "long"]).is_err());
        // Nothing that runs would take it.
        assert!(parse(&["--seed", "7"]).is_err() && parse(&["--seed", "7", "test"]).is_err());
        assert_eq!(parse(&["long"]).unwrap(), ["long"]);
        assert!(parse(&["--fast"]).is_err());
        assert!(fuzz(&["--minutes".to_owned()]).is_err());
        assert!(fuzz(&["--hours".to_owned(), "1".to_owned()]).is_err());
    }
}

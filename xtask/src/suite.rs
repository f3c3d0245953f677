//! `cargo xtask test`: runs all checks step by step, with times and a summary.

use crate::tidy::{self, House};
use crate::{cargo, packages, python};
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The steps by name, in the order in which they run: quick ones first.
const STEPS: [&str; 12] = [
    "fmt", "tidy", "clippy", "package", "test", "doctest", "doc", "features", "long", "outside",
    "publish", "python",
];

/// The steps that run only with `--long`, or when they are named on the command line.
const LONG: [&str; 2] = ["long", "outside"];

/// The steps that run only when they are named on the command line: one needs crates.io, the other
/// Python and its package index.
const NAMED: [&str; 2] = ["publish", "python"];

/// The steps to run, and the seed of random cases.
struct Selection {
    steps: Vec<&'static str>,
    /// The seed of the long tests' random cases; a new one each time unless it is given.
    seed: Option<u64>,
}

impl Selection {
    /// Parses `[--long] [--seed N] [STEP…]`.
    fn parse(arguments: &[String]) -> Result<Self, String> {
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
        // Choose the steps: the usual ones, or the named ones, and the long ones with `--long`.
        let chosen = |step: &&&str| {
            let usual = named.is_empty() && !LONG.contains(step) && !NAMED.contains(step);
            usual || named.contains(step) || long && LONG.contains(step)
        };
        let steps: Vec<_> = STEPS.iter().filter(chosen).copied().collect();
        if seed.is_some() && !steps.contains(&"long") {
            return Err("--seed is for the long tests; add --long".to_owned());
        }
        Ok(Self { steps, seed })
    }
}

/// The result of one step.
struct Outcome {
    name: String,
    problems: Vec<String>,
    time: Duration,
}

/// Runs all selected steps, even after one has failed. Returns 0 if all passed, otherwise 1. An
/// error is a mistake in the arguments.
pub(crate) fn run(arguments: &[String]) -> Result<u8, String> {
    let selection = Selection::parse(arguments)?;
    let mut outcomes = Vec::new();
    let mut beside: Vec<JoinHandle<Outcome>> = Vec::new();
    let seed = selection.seed.unwrap_or_else(new_seed);
    // Run the parts one after another; some run next to those that follow.
    for step in &selection.steps {
        for part in expand(step, seed) {
            if part.beside {
                beside.push(thread::spawn(|| part.run()));
            } else {
                outcomes.push(part.run());
            }
        }
    }
    // Wait for the parts that still run, and print the summary.
    let panicked = "a step that nobody waits for does not panic";
    outcomes.extend(beside.into_iter().map(|step| step.join().expect(panicked)));
    let status = summary(&outcomes);
    if selection.steps.contains(&"long") {
        println!("the long tests again, on the same cases: cargo xtask test --seed {seed} long");
    }
    Ok(status)
}

/// Returns a new seed for each run, from the time.
fn new_seed() -> u64 {
    // Nanoseconds of 500 years fit into the seed; if the clock is before 1970, the seed is not new.
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.map_or(0, |t| u64::try_from(t.as_nanos()).unwrap_or(0))
}

/// The function that runs a part of a step, and returns its problems.
type Work = Box<dyn FnOnce() -> Vec<String> + Send>;

/// A part of a step.
struct Part {
    name: String,
    work: Work,
    /// Whether the parts that follow may run at the same time.
    beside: bool,
}

impl Part {
    fn new(name: impl Into<String>, work: Work) -> Self {
        Self {
            name: name.into(),
            work,
            beside: false,
        }
    }

    /// Runs the part, and times it.
    fn run(self) -> Outcome {
        eprintln!("\n== {}", self.name);
        let begin = Instant::now();
        let problems = (self.work)();
        problems.iter().for_each(|p| eprintln!("   {p}"));
        Outcome {
            name: self.name,
            problems,
            time: begin.elapsed(),
        }
    }
}

/// Returns the parts of a step.
fn expand(step: &str, seed: u64) -> Vec<Part> {
    let one = |name: &str, command| vec![Part::new(name, checked(command))];
    let packed = |name: &str, work: fn() -> Result<(), String>| {
        let problems = move || work().err().into_iter().collect();
        vec![Part::new(name, Box::new(problems))]
    };
    match step {
        "fmt" => one("rustfmt", quiet("fmt --all --check", "-l")),
        "tidy" => {
            let rules = || tidy::problems(&cargo::root());
            vec![Part::new("tidy: the house rules", Box::new(rules))]
        }
        "clippy" => {
            let all = quiet(
                "clippy --workspace --all-targets --keep-going",
                "-D warnings",
            );
            one("clippy, all targets", all)
        }
        "package" => packed("packages of published crates", packages::package),
        // Test programs run one after another, and each ends with its longest test alone on one
        // core: the steps that follow use the other. Other examples and benches were compiled by
        // clippy.
        "test" => {
            let modules = "--lib --bins --example engine --example blue_noise_tile";
            let all = format!("{modules} --tests");
            let run = |name, what| Part::new(name, checked(same_cases(tests(what, ""))));
            let mut parts = one("tests: building", tests(&format!("{all} --no-run"), ""));
            parts.push(Part {
                beside: true,
                ..run("tests of crates, beside the following", "--test *")
            });
            parts.push(run("tests of modules", modules));
            parts
        }
        "doctest" => one(
            "doctests",
            quiet("test --workspace --no-fail-fast --doc", ""),
        ),
        "doc" => {
            let mut doc = quiet("doc --workspace --no-deps", "");
            doc.env("RUSTDOCFLAGS", "-D warnings");
            one("rustdoc", doc)
        }
        "features" => feature_combinations(),
        "long" => {
            let all = "--lib --bins --tests --release";
            let long = new_cases(tests(all, "--ignored"), seed);
            let properties = new_cases(tests(all, ""), seed);
            let properties_name = format!("properties on new cases, seed {seed}");
            vec![
                Part::new(format!("long tests, seed {seed}"), checked(long)),
                Part::new(properties_name, checked(properties)),
            ]
        }
        "outside" => packed(
            "tests of the packages, and a renderer outside on them",
            packages::outside,
        ),
        "publish" => packed("publishing, but for the last step", packages::publish),
        "python" => packed("Python: the wheel and its tests", python::test),
        _ => Vec::new(),
    }
}

/// Returns `cargo test` on some targets of all crates.
fn tests(targets: &str, after: &str) -> Command {
    quiet(&format!("test --workspace --no-fail-fast {targets}"), after)
}

/// The environment variable that proptest takes its seed from.
const PROPERTY_SEED: &str = "PROPTEST_RNG_SEED";

/// Makes a command use the same random cases on every run, so that a failure is due to the change
/// and can be repeated: only long tests use new cases. A seed that is already set is kept.
fn same_cases(mut command: Command) -> Command {
    if std::env::var_os(PROPERTY_SEED).is_none() {
        command.env(PROPERTY_SEED, "20160301");
    }
    command
}

/// Makes a command use sixteen times the usual number of random cases, from this seed. The larger
/// number also applies to properties that state their own number of cases (the tests' `cases(n)`
/// scales it by 4096/256) and to loops of random numbers. A failing case is printed in its smallest
/// form.
fn new_cases(mut command: Command, seed: u64) -> Command {
    command.env("PROPTEST_CASES", "4096");
    // Sixteen times as many cases may be rejected, too; the default is 1,024.
    command.env("PROPTEST_MAX_GLOBAL_REJECTS", "16384");
    command.env(PROPERTY_SEED, seed.to_string());
    command.env("LINELIT_FUZZ_SEED", seed.to_string());
    command
}

/// Runs the long fuzzing test for some minutes: mutated scenes, with the assertions of the other
/// tests.
pub(crate) fn fuzz(words: &[String]) -> Result<u8, String> {
    let mut command = cargo::cargo(["test", "--package", "linelit-cli", "--test", "fuzz"]);
    command.args(["--", "--ignored", "--nocapture"]);
    command
        .current_dir(cargo::root())
        .env("LINELIT_FUZZ_MINUTES", "30");
    for pair in words.chunks(2) {
        let variable = match pair[0].as_str() {
            "--minutes" => "LINELIT_FUZZ_MINUTES",
            "--seed" => "LINELIT_FUZZ_SEED",
            other => return Err(format!("fuzz has no `{other}`")),
        };
        let number = pair.get(1).filter(|n| n.parse::<u64>().is_ok());
        let number = number.ok_or_else(|| format!("`{}` of fuzz takes a number", pair[0]))?;
        command.env(variable, number);
    }
    Ok(cargo::status(&mut command))
}

/// Returns `cargo ARGUMENTS --quiet -- AFTER` on the whole workspace.
fn quiet(arguments: &str, after: &str) -> Command {
    let mut command = cargo::cargo(arguments.split_whitespace());
    command
        .args(["--quiet", "--"])
        .args(after.split_whitespace());
    command
}

/// Returns the work that runs a command, passes on its output, and lists the tests that failed
/// according to the output.
fn checked(mut command: Command) -> Work {
    Box::new(move || {
        command.current_dir(cargo::root()).stdout(Stdio::piped());
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) => return vec![format!("cannot start {command:?}: {error}")],
        };
        let mut found = vec![format!("failed: {command:?}")];
        let lines = child.stdout.take().map(|out| BufReader::new(out).lines());
        for line in lines.into_iter().flatten().map_while(Result::ok) {
            println!("{line}");
            // Only names of tests are collected; messages of compilers and rustfmt are already on
            // the terminal.
            let test = line.strip_prefix("---- ");
            let test = test.and_then(|l| l.strip_suffix(" stdout ----"));
            found.extend(test.map(|name| format!("test {name}")));
        }
        if child.wait().is_ok_and(|status| status.success()) {
            return Vec::new();
        }
        found.dedup();
        found
    })
}

/// Returns the checks of each crate with features: without any, with each alone, and with all of
/// them. (The other steps build with the defaults.) They run clippy as the step before, since
/// another way of denying warnings would compile all dependencies again.
fn feature_combinations() -> Vec<Part> {
    let house = match House::read(&cargo::root()) {
        Ok(house) => house,
        Err(problem) => return vec![Part::new("features", Box::new(|| vec![problem]))],
    };
    let mut steps = Vec::new();
    for member in &house.members {
        let features = member.features();
        if features.is_empty() {
            continue;
        }
        // List the sets of features.
        let mut sets: BTreeSet<String> = features.iter().map(|f| (*f).to_owned()).collect();
        sets.extend([String::new(), features.join(",")]);
        for set in sets {
            let name = format!("features of {}: [{set}]", member.owner);
            // With all features, tests are checked as well; otherwise only the library and its
            // programs.
            let is_all = !set.is_empty() && set == features.join(",");
            let targets = if is_all { "--all-targets" } else { "" };
            let alone = format!("clippy {targets} --no-default-features");
            let check = format!("{alone} -p {} --features={set}", member.package());
            steps.push(Part::new(name, checked(quiet(&check, "-D warnings"))));
        }
    }
    steps
}

/// Prints the table of steps, the problems, and the plain line that scripts look for; returns the
/// exit status.
fn summary(outcomes: &[Outcome]) -> u8 {
    // The times.
    println!("\n{:>8}  step", "seconds");
    for step in outcomes {
        let verdict = if step.problems.is_empty() {
            ""
        } else {
            "  FAILED"
        };
        println!("{:>8.1}  {}{verdict}", step.time.as_secs_f64(), step.name);
    }
    // The problems.
    let failed: Vec<_> = outcomes.iter().filter(|o| !o.problems.is_empty()).collect();
    if !failed.is_empty() {
        println!("\nwhat failed:");
    }
    for step in &failed {
        step.problems
            .iter()
            .for_each(|p| println!("  {}: {p}", step.name));
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
    fn long_runs_are_new_and_can_be_had_again() {
        let command = new_cases(Command::new("cargo"), 12);
        let set = |name: &str| {
            let mut set = command.get_envs();
            set.find_map(|(key, value)| (key == name).then_some(value?))
        };
        assert_eq!(set("PROPTEST_CASES"), Some("4096".as_ref()));
        assert_eq!(set(PROPERTY_SEED), Some("12".as_ref()));
        let first = new_seed();
        assert!((0..1_000_000).any(|_| new_seed() > first));
    }

    #[test]
    fn selections() {
        assert_eq!(parse(&[]).unwrap(), STEPS[..8]);
        assert_eq!(parse(&["--long"]).unwrap(), STEPS[..10]);
        assert_eq!(parse(&["publish"]).unwrap(), ["publish"]);
        assert_eq!(parse(&["python"]).unwrap(), ["python"]);
        assert_eq!(parse(&["tidy", "fmt"]).unwrap(), ["fmt", "tidy"]);
        assert_eq!(parse(&["--seed", "7", "long"]).unwrap(), ["long"]);
        let words = ["--long", "--seed", "7"].map(str::to_owned);
        assert_eq!(Selection::parse(&words).unwrap().seed, Some(7));
        assert!(parse(&["--long", "--seed"]).is_err() && parse(&["--seed", "x", "long"]).is_err());
        // No selected step would use it.
        assert!(parse(&["--seed", "7"]).is_err() && parse(&["--seed", "7", "test"]).is_err());
        assert_eq!(parse(&["long"]).unwrap(), ["long"]);
        assert!(parse(&["--fast"]).is_err());
        // The help names every step.
        let usual = format!("\n  {0:26}{1}\n", "", STEPS[..10].join(" "));
        assert!(crate::USAGE.contains(&usual), "{usual}");
        for named in NAMED {
            assert!(crate::USAGE.contains(&format!(" {named} (")), "{named}");
        }
        assert!(fuzz(&["--minutes".to_owned()]).is_err());
        assert!(fuzz(&["--hours".to_owned(), "1".to_owned()]).is_err());
    }
}

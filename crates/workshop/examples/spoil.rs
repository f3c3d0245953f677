//! Finds what no test checks: it spoils closed forms, densities and weights one after the other in
//! a copy of the repository, runs tests, and reports which test noticed each, and which were not
//! noticed.
//!
//! ```text
//! cargo run --release -p linelit-workshop --no-default-features --example spoil -- \
//!     [--table FILE] [--in FOLDER] [WORD…]
//! ```
//!
//! The copy is made in a new temporary folder that is removed at the end, or in FOLDER, which is
//! not removed, so that less is compiled the next time. The table (`examples/spoilings` by default)
//! has one paragraph for each way to spoil something; only paragraphs whose command, file and name
//! contain all words are tried. Its lines:
//!
//! ```text
//! # a remark
//! $ the command that has to fail, for all paragraphs from here on
//! > the file, for all paragraphs from here on
//! the name of what is spoiled
//! - a text that stands in the file exactly once, of one line or several
//! + what stands in its place; {} is the factor 1 + 1e-6, {1e-4} another one, {1} a switch to 2
//! ```
//!
//! A paragraph without a name belongs to the one before. In place of `$` a table of claims has `?`
//! and a command that prints claims with their verdicts, as `linelit converge claims --json` does.
//! It runs twice without spoiling: claims that differ between these runs are flickering, and are
//! ignored. Then each row lists the claims whose verdict changed, and the end lists the claims that
//! no spoiling changed. Paragraphs without factors are spoiled in all runs of such a table.
//!
//! All paragraphs with factors are built at once, and an environment variable selects the factor
//! that is not one; a function for this is added to the copy's crates. A paragraph without factors
//! is built separately. Every command must succeed at first without spoiling. Exit status: 0 if
//! every spoiling was noticed, or every claim changed; 1 if not; 2 if the table does not fit.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program")]

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;
use std::{env, fs, io};

/// The environment variable that holds the number of the factor that is not one.
const VARIABLE: &str = "LINELIT_SPOILED";

/// One way to spoil something.
#[derive(Clone, Debug, Default)]
struct Spoiling {
    command: String,
    /// Whether the command prints claims, whose verdicts have to change.
    judges: bool,
    /// Whether this spoiling belongs to the paragraph before, and is applied together with it.
    continues: bool,
    file: String,
    name: String,
    text: String,
    replacement: String,
}

impl Spoiling {
    /// Returns the replacement, with each {} replaced by a call of the copy's function, and the
    /// number of these calls.
    fn replaced(&self, number: usize) -> (String, usize) {
        let (mut out, mut count) = (String::new(), 0);
        let mut rest = self.replacement.as_str();
        while let Some((before, after)) = rest.split_once('{') {
            let told = after.split_once('}').and_then(|(inside, left)| {
                let by = if inside.is_empty() { "1e-6" } else { inside };
                by.parse::<f64>().ok().map(|by| (by, left))
            });
            out.push_str(before);
            rest = match told {
                Some((by, left)) => {
                    count += 1;
                    write!(out, "crate::spoiled({number}, {by:e})").expect("a string");
                    left
                }
                None => {
                    out.push('{');
                    after
                }
            };
        }
        (out + rest, count)
    }

    /// Puts the replacement into the copy.
    fn apply(&self, number: usize, root: &Path) -> Result<(), String> {
        let path = root.join(&self.file);
        let whole = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", self.file))?;
        let found = whole.matches(&self.text).count();
        if found != 1 {
            let Self { file, name, .. } = self;
            return Err(format!(
                "{file}: {name}: the text stands there {found} times, not once"
            ));
        }
        let whole = whole.replacen(&self.text, &self.replaced(number).0, 1);
        fs::write(&path, whole).map_err(|e| format!("{}: {e}", self.file))
    }

    /// Returns the root file of the crate that the file belongs to.
    fn library(&self) -> Option<String> {
        let end = self.file.find("/src/")?;
        Some(format!("{}/src/lib.rs", &self.file[..end]))
    }
}

/// Reads the paragraphs of a table.
fn read_table(text: &str) -> Result<Vec<Spoiling>, String> {
    let (mut all, mut next) = (Vec::new(), Spoiling::default());
    for (number, line) in text.lines().chain([""]).enumerate() {
        let joined = |text: &str, more: &str| match text {
            "" => more.to_owned(),
            _ => format!("{text}\n{more}"),
        };
        match line.split_at_checked(2) {
            // An empty line ends a paragraph. Command and file remain for the next one.
            _ if line.trim().is_empty() => {
                if !next.text.is_empty() {
                    next.continues = next.name.is_empty();
                    if next.continues {
                        let before = all.last().map(|s: &Spoiling| s.name.clone());
                        next.name = before.ok_or_else(|| format!("line {number}: no name"))?;
                    }
                    all.push(next.clone());
                } else if !next.name.is_empty() {
                    return Err(format!("line {number}: {} has no text", next.name));
                }
                next.name.clear();
                next.text.clear();
                next.replacement.clear();
            }
            Some(("# ", _)) => {}
            Some((mark @ ("$ " | "? "), command)) => {
                command.clone_into(&mut next.command);
                next.judges = mark == "? ";
            }
            Some(("> ", file)) => file.clone_into(&mut next.file),
            Some(("- ", text)) => next.text = joined(&next.text, text),
            Some(("+ ", text)) => next.replacement = joined(&next.replacement, text),
            _ => line.clone_into(&mut next.name),
        }
    }
    Ok(all)
}

/// Copies all files that git knows of the repository.
fn copy(from: &Path, to: &Path) -> io::Result<()> {
    if to.exists() {
        fs::remove_dir_all(to)?;
    }
    let listed = Command::new("git")
        .args([
            "ls-files",
            "-z",
            "--cached",
            "--others",
            "--exclude-standard",
        ])
        .current_dir(from)
        .output()?;
    for name in String::from_utf8_lossy(&listed.stdout).split_terminator('\0') {
        let (source, target) = (from.join(name), to.join(name));
        if source.is_file() {
            fs::create_dir_all(target.parent().unwrap_or(to))?;
            fs::copy(source, target)?;
        }
    }
    Ok(())
}

/// Adds the function that returns factors to the crates of some files.
fn add_function(root: &Path, spoilings: &[(usize, Spoiling)]) -> io::Result<()> {
    let libraries: BTreeSet<String> = spoilings.iter().filter_map(|(_, s)| s.library()).collect();
    for library in libraries {
        let path = root.join(library);
        let text = format!(
            "{}\n#[allow(missing_docs, dead_code, clippy::all)]\n\
             pub(crate) fn spoiled(number: u32, by: f64) -> f64 {{\n    \
             static NUMBER: std::sync::OnceLock<u32> = std::sync::OnceLock::new();\n    \
             let told = || std::env::var(\"{VARIABLE}\").ok().and_then(|n| n.parse().ok());\n    \
             let on = *NUMBER.get_or_init(|| told().unwrap_or(u32::MAX)) == number;\n    \
             if on {{ 1.0 + by }} else {{ 1.0 }}\n}}\n",
            fs::read_to_string(&path)?
        );
        fs::write(&path, text)?;
    }
    Ok(())
}

/// The end of a command.
enum Ended {
    Well,
    /// It failed, with the first test that failed, or the last line.
    Failed(String),
}

/// Runs a command in the copy until it ends or its first test has failed.
fn run(command: &str, root: &Path, target: &Path, number: usize) -> io::Result<Ended> {
    let mut shell = Command::new("sh");
    // For `kill` below; elsewhere tests run on after the first that has failed.
    #[cfg(unix)]
    // Make a process group for `kill` below. Elsewhere tests continue after the first failure.
    std::os::unix::process::CommandExt::process_group(&mut shell, 0);
    let mut child = shell
        .args(["-c", &format!("{command} 2>&1")])
        .current_dir(root)
        .env("CARGO_TARGET_DIR", target)
        .env(VARIABLE, number.to_string())
        // A case that failed once must not help to find the next spoiling.
        .env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "true")
        .env("PROPTEST_MAX_SHRINK_ITERS", "0")
        .env("RUST_BACKTRACE", "0")
        .stdout(Stdio::piped())
        .spawn()?;
    // Read its output up to the first test that failed.
    let mut last = String::new();
    if let Some(out) = child.stdout.take() {
        for line in BufReader::new(out).split(b'\n') {
            let line = String::from_utf8_lossy(&line?).trim().to_owned();
            let failed = line
                .strip_prefix("test ")
                .and_then(|l| l.strip_suffix("FAILED"));
            if let Some(test) = failed.and_then(|l| l.split(" ... ").next().map(str::to_owned)) {
                // End the whole group, since cargo does not end its tests.
                let group = format!("-{}", child.id());
                Command::new("kill").args(["--", &group]).status()?;
                child.wait()?;
                return Ok(Ended::Failed(test.replace(" - should panic", "")));
            }
            if !line.is_empty() {
                last = line;
            }
        }
    }
    Ok(match child.wait()?.success() {
        true => Ended::Well,
        false => Ended::Failed(last),
    })
}

/// Returns the verdicts that a command prints, by claim.
fn verdicts(
    command: &str,
    root: &Path,
    target: &Path,
    number: usize,
) -> Result<BTreeMap<String, String>, String> {
    // The command may fail: a verdict may contradict the record.
    let run = Command::new("sh")
        .args(["-c", command])
        .current_dir(root)
        .env("CARGO_TARGET_DIR", target)
        .env(VARIABLE, number.to_string())
        .output()
        .map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&run.stdout);
    let (mut all, mut id) = (BTreeMap::new(), "");
    for line in text.lines() {
        let value = |key| {
            line.trim()
                .strip_prefix(key)?
                .trim_matches([' ', ','])
                .get(1..)
        };
        if let Some(found) = value("\"id\":") {
            id = found.trim_end_matches('"');
        } else if let Some(found) = value("\"verdict\":") {
            all.insert(id.to_owned(), found.trim_end_matches('"').to_owned());
        }
    }
    if all.is_empty() {
        let why = String::from_utf8_lossy(&run.stderr);
        return Err(format!("{command} prints no claims: {why}"));
    }
    Ok(all)
}

/// Spoils each of some spoilings that are in one copy, prints which claims changed their verdict,
/// and returns the claims that never did.
fn turn_all(
    command: &str,
    root: &Path,
    target: &Path,
    spoilings: &[(usize, Spoiling)],
) -> Result<Vec<String>, String> {
    let verdicts = |number| verdicts(command, root, target, number);
    // Leave out claims whose verdict differs between two runs without spoiling.
    let (mut right, again) = (verdicts(0)?, verdicts(0)?);
    right.retain(|id, verdict| {
        let is_steady = again.get(id) == Some(verdict);
        if !is_steady {
            println!("flickering: {id} ({verdict})");
        }
        is_steady && !verdict.starts_with("not measurable")
    });
    // How much each claim changed: 0 for not at all, 1 for to or from consistent, 2 for a
    // contradiction.
    let mut far: BTreeMap<&String, u8> = right.keys().map(|id| (id, 0)).collect();
    println!("| spoiled | turned | claims | time |\n|---|---:|---|---:|");
    // Spoil, and compare the verdicts.
    for (number, spoiling) in spoilings.iter().filter(|(_, s)| !s.continues) {
        let start = Instant::now();
        let found = verdicts(*number)?;
        let mut turned = Vec::new();
        for (id, old) in &right {
            let Some(new) = found.get(id).filter(|new| *new != old) else {
                continue;
            };
            turned.push(format!("{id} ({old}, now {new})"));
            let contradicts = old != "consistent" && new != "consistent";
            far.entry(id)
                .and_modify(|f| *f = (*f).max(1 + u8::from(contradicts)));
        }
        let (name, seconds) = (&spoiling.name, start.elapsed().as_secs_f64());
        let (count, list) = (turned.len(), turned.join("; "));
        println!("| {name} | {count} | {list} | {seconds:.0} s |");
    }
    // Print the claims that changed only to or from consistent.
    let those = |wanted: u8| far.iter().filter(move |(_, far)| **far == wanted);
    for (id, _) in those(1) {
        println!("to or from consistent alone: {id} ({})", right[*id]);
    }
    let never = those(0).map(|(id, _)| format!("{id} ({})", right[*id]));
    Ok(never.collect())
}

/// Spoils each of some spoilings that are in one copy, prints what noticed each, and returns those
/// that nothing noticed.
fn try_all(root: &Path, target: &Path, spoilings: &[(usize, Spoiling)]) -> io::Result<Vec<String>> {
    let mut survivors = Vec::new();
    for (number, spoiling) in spoilings.iter().filter(|(_, s)| !s.continues) {
        let start = Instant::now();
        let ended = run(&spoiling.command, root, target, *number)?;
        let seconds = start.elapsed().as_secs_f64();
        let place = spoiling
            .file
            .trim_start_matches("crates/")
            .replace("/src/", "/");
        let by = match &ended {
            Ended::Failed(test) => test,
            Ended::Well => "NOTHING",
        };
        println!("| {place} | {} | {by} | {seconds:.0} s |", spoiling.name);
        if matches!(ended, Ended::Well) {
            survivors.push(format!("{}: {}", spoiling.file, spoiling.name));
        }
    }
    Ok(survivors)
}

/// Tries all spoilings of a table whose texts contain all words, and returns those that nothing
/// noticed.
fn spoil(table: &Path, folder: &Path, words: &[String]) -> Result<Vec<String>, String> {
    let told = |e: io::Error| e.to_string();
    let home = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .canonicalize()
        .map_err(told)?;
    // Read the table, and number its spoilings.
    let text = fs::read_to_string(table).map_err(|e| format!("{}: {e}", table.display()))?;
    let has_all = |s: &Spoiling| {
        let all = format!("{} {} {}", s.command, s.file, s.name);
        let always = s.judges && s.replaced(0).1 == 0;
        always || words.iter().all(|word| all.contains(word.as_str()))
    };
    let all: Vec<Spoiling> = read_table(&text)?.into_iter().filter(has_all).collect();
    let mut number = 0;
    let numbered = all.into_iter().map(|s| {
        number += usize::from(!s.continues);
        (number, s)
    });
    // Spoilings with factors share one copy.
    let (together, alone): (Vec<_>, Vec<_>) = numbered.partition(|(_, s)| s.replaced(0).1 > 0);
    let (root, target) = (folder.join("copy"), folder.join("target"));
    copy(&home, &root).map_err(told)?;
    add_function(&root, &together).map_err(told)?;
    for (number, spoiling) in &together {
        spoiling.apply(*number, &root)?;
    }
    // If claims are judged, spoilings without factors are always on.
    let commands: BTreeSet<&str> = together
        .iter()
        .chain(&alone)
        .map(|(_, s)| s.command.as_str())
        .collect();
    if let Some((_, Spoiling { command, .. })) = together.iter().find(|(_, s)| s.judges) {
        for (number, always) in &alone {
            always.apply(*number, &root)?;
        }
        return turn_all(command, &root, &target, &together);
    }
    // Every command must succeed without spoiling.
    for command in commands {
        if let Ended::Failed(why) = run(command, &root, &target, 0).map_err(told)? {
            return Err(format!(
                "{command} fails with nothing spoiled: {why} ({})",
                root.display()
            ));
        }
    }
    println!("| file | spoiled | noticed by | time |\n|---|---|---|---:|");
    // Try the spoilings with factors, then each of the others in a fresh copy.
    let mut survivors = try_all(&root, &target, &together).map_err(told)?;
    for one in alone {
        copy(&home, &root).map_err(told)?;
        one.1.apply(one.0, &root)?;
        survivors.extend(try_all(&root, &target, &[one]).map_err(told)?);
    }
    Ok(survivors)
}

/// Reads the command line, and removes the temporary copy at the end.
fn main() -> ExitCode {
    // Read the options.
    let mut words: Vec<String> = env::args().skip(1).collect();
    let mut option = |name: &str| {
        let at = words.iter().position(|word| word == name)?;
        (at + 1 < words.len()).then(|| PathBuf::from(words.drain(at..at + 2).nth(1).expect("two")))
    };
    let (table, kept) = (option("--table"), option("--in"));
    let own = || Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/spoilings");
    let new = || env::temp_dir().join(format!("linelit-spoil-{}", std::process::id()));
    let folder = kept.clone().unwrap_or_else(new);
    // Try the spoilings, and remove the copy.
    let result = spoil(&table.unwrap_or_else(own), &folder, &words);
    if kept.is_none()
        && folder.exists()
        && let Err(e) = fs::remove_dir_all(&folder)
    {
        eprintln!("{}: {e}", folder.display());
    }
    // Print what was not noticed.
    match result {
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
        Ok(survivors) if survivors.is_empty() => ExitCode::SUCCESS,
        Ok(survivors) => {
            println!("\n{} of them nothing noticed:", survivors.len());
            survivors.iter().for_each(|s| println!("{s}"));
            ExitCode::FAILURE
        }
    }
}

//! Loads every scene below a folder, each in a process of its own, and prints a line per file:
//! `cargo run --release -p linelit-scene --example load-all -- DIR`.
//!
//! A file passes if it loads or is refused with an error. It fails if the loader panics, takes
//! longer than a minute, or more than 1 GiB. Exit status: 0 all pass, 1 one failed, 2 usage.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a command-line program"
)]

use linelit_scene::{Format, LoadOptions, Scene};
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

const TIME_LIMIT: Duration = Duration::from_secs(60);
const MEMORY_LIMIT_KIB: u64 = 1 << 20;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [flag, file] if flag == "--one" => load_one(file),
        [folder] if !folder.starts_with('-') => load_all(Path::new(folder)),
        _ => {
            eprintln!("usage: load-all DIR");
            ExitCode::from(2)
        }
    }
}

/// Loads one file and prints what came out, and the most memory that it took, in KiB.
fn load_one(file: &str) -> ExitCode {
    let result = Scene::load(file, &LoadOptions::default());
    println!("{}", peak_memory_kib().unwrap_or(0));
    match result {
        Ok(loaded) => println!(
            "ok: {} triangles, {} lights, {} warnings",
            loaded.scene.triangles.len(),
            loaded.scene.lights.len(),
            loaded.warnings.len()
        ),
        Err(error) => println!("{error}"),
    }
    ExitCode::SUCCESS
}

/// The high-water mark of this process, where the system tells.
fn peak_memory_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_ascii_whitespace().nth(1)?.parse().ok()
}

fn load_all(folder: &Path) -> ExitCode {
    let mut files = Vec::new();
    collect(folder, &mut files);
    files.sort();
    if files.is_empty() {
        eprintln!("no scenes below {}", folder.display());
        return ExitCode::FAILURE;
    }
    let mut failures = 0;
    for file in &files {
        let verdict = in_child(file);
        failures += usize::from(verdict.is_err());
        let text = match verdict {
            Ok(text) => text,
            Err(text) => format!("FAILED: {text}"),
        };
        println!("{}: {text}", file.display());
    }
    println!("{} files, {failures} failed", files.len());
    ExitCode::from(u8::from(failures > 0))
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    for path in entries.filter_map(|e| e.ok().map(|e| e.path())) {
        if path.is_dir() && !path.is_symlink() {
            collect(&path, files);
        } else if let Some(extension) = path.extension().and_then(|e| e.to_str())
            && Format::from_extension(extension).is_some()
        {
            files.push(path);
        }
    }
}

/// The line for one file; an error if it must not happen.
fn in_child(file: &Path) -> Result<String, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let mut child = Command::new(program)
        .arg("--one")
        .arg(file)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| e.to_string())?;
    wait(&mut child)?;
    let (mut out, mut err) = (String::new(), String::new());
    if let (Some(o), Some(e)) = (&mut child.stdout, &mut child.stderr) {
        o.read_to_string(&mut out).map_err(|e| e.to_string())?;
        e.read_to_string(&mut err).map_err(|e| e.to_string())?;
    }
    let (memory, text) = out.split_once('\n').ok_or_else(|| {
        let panic = err
            .lines()
            .find(|l| l.contains("panicked"))
            .unwrap_or("died");
        panic.to_owned()
    })?;
    let memory: u64 = memory.parse().unwrap_or(0);
    if memory > MEMORY_LIMIT_KIB {
        return Err(format!("took {} MiB", memory / 1024));
    }
    // The error's first two lines: what and where.
    let lines: Vec<&str> = text.lines().take(2).map(str::trim).collect();
    Ok(lines.join(" "))
}

/// Waits for the end within the time limit.
fn wait(child: &mut Child) -> Result<(), String> {
    let start = Instant::now();
    loop {
        match child.try_wait().map_err(|e| e.to_string())? {
            Some(_) => return Ok(()),
            None if start.elapsed() > TIME_LIMIT => {
                let killed = child.kill().and_then(|()| child.wait());
                return Err(format!("took more than a minute ({killed:?})"));
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    }
}

//! `load-all`: loads and renders every scene file below a folder, each in a process of its own.
//!
//! A file passes if it loads and renders, or is refused with an error. It fails if the process
//! panics or dies, takes longer than the limit, or more memory than the limit. Where the system
//! reports it (Linux), processor time counts, so that a busy machine does not make files fail.

use crate::args::LoadAllArgs;
use anyhow::{Context, Result, bail};
use indicatif::ProgressBar;
use linelit_cli::output::{Output, note};
use linelit_film::Tile;
use linelit_formats::{Format, LoadOptions, SceneError};
use linelit_integrator::{Renderer, Settings};
use linelit_study::memory::kib;
use linelit_study::scene_study;
use serde::{Deserialize, Serialize};
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The size of the picture that is rendered of each file.
const PICTURE: [u32; 2] = [32, 18];
/// The number of light samples per shading point and light.
const SAMPLES: u32 = 2;
/// The largest number of pairs of pixel and light that are rendered: files with many lights get
/// fewer pixels.
const MAX_PAIRS: usize = 1 << 20;
/// The largest number of triangles of a file that fits into the memory of a process. The loader
/// refuses larger scenes with its own error.
const MAX_TRIANGLES: usize = 2 << 20;
/// The most memory that a process may take, in KiB.
const MAX_KIB: u64 = 1 << 20;
/// The ticks per second in `/proc/PID/stat`: 100 on all usual platforms of Linux.
const TICKS: f64 = 100.0;
/// The factor by which the wall time of a process may exceed the limit on its processor time, as it
/// may wait for other processes.
const PATIENCE: f64 = 12.0;

/// The report of a child process on its file, as one line of JSON.
#[derive(Debug, Serialize, Deserialize)]
struct Outcome {
    file: String,
    /// The counts, or the error.
    result: std::result::Result<Counts, String>,
    /// The peak memory of the process in KiB, if the system reports it; else 0.
    peak_kib: u64,
}

/// The contents of a file that was loaded.
#[derive(Debug, Serialize, Deserialize)]
struct Counts {
    triangles: usize,
    lights: usize,
    warnings: usize,
}

/// Loads and renders every scene file below a folder, and prints a line per file.
pub(crate) fn run(args: &LoadAllArgs, out: &mut Output) -> Result<()> {
    // This is a child process.
    if args.one {
        writeln!(out, "{}", serde_json::to_string(&attempt(&args.dir))?)?;
        return Ok(());
    }
    // Find the files.
    let mut files = Vec::new();
    collect(&args.dir, &mut files);
    files.sort();
    if files.is_empty() {
        bail!("no scene files below {}", args.dir.display());
    }
    // Start a process for each.
    let mut failures = 0;
    for file in &files {
        let name = file.strip_prefix(&args.dir).unwrap_or(file).display();
        match in_child(file, args.seconds) {
            Ok(outcome) if args.json => writeln!(out, "{}", serde_json::to_string(&outcome)?)?,
            Ok(outcome) => writeln!(out, "{name}: {}", line(&outcome.result))?,
            Err(problem) => {
                failures += 1;
                writeln!(out, "{name}: FAILED: {problem:#}")?;
            }
        }
    }
    if failures > 0 {
        bail!("{failures} of {} files failed", files.len());
    }
    note(format_args!("{} files, none failed", files.len()));
    Ok(())
}

/// Returns the line about a file that passed.
fn line(result: &std::result::Result<Counts, String>) -> String {
    let several = |n: usize, what: &str| {
        let plural = if n == 1 { "" } else { "s" };
        format!("{n} {what}{plural}")
    };
    match result {
        Ok(c) => format!(
            "ok, {}, {}, {}",
            several(c.triangles, "triangle"),
            several(c.lights, "light"),
            several(c.warnings, "warning")
        ),
        // Print the message and the position; an excerpt is shown to those who load the file by
        // itself.
        Err(error) => {
            let mut lines = error.lines().map(str::trim);
            let what = lines.next().unwrap_or("error");
            let location = lines.next().and_then(|l| l.strip_prefix("--> "));
            location.map_or_else(|| what.to_owned(), |at| format!("{what} ({at})"))
        }
    }
}

/// Adds all files below a folder whose names end like a scene's; a path that is no folder is added
/// as it is.
fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    if !path.is_dir() {
        files.push(path.to_owned());
        return;
    }
    let Ok(entries) = std::fs::read_dir(path) else {
        return;
    };
    for path in entries.filter_map(|e| e.ok().map(|e| e.path())) {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        // Links to folders are not followed, as they may lead in circles.
        let descend = path.is_dir() && !path.is_symlink();
        if descend || (path.is_file() && Format::from_extension(extension).is_some()) {
            collect(&path, files);
        }
    }
}

/// Loads and renders one file. The child process runs this.
fn attempt(file: &Path) -> Outcome {
    let result = load_and_render(file).map_err(|e| e.to_string());
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    Outcome {
        file: file.display().to_string(),
        result,
        peak_kib: kib(&status, "VmHWM:").unwrap_or(0),
    }
}

/// Loads a file and renders a small picture of it.
fn load_and_render(file: &Path) -> std::result::Result<Counts, SceneError> {
    let options = LoadOptions {
        max_triangles: MAX_TRIANGLES,
        ..LoadOptions::default()
    };
    let loaded = linelit_formats::load(file, &options)?;
    let mut scene = loaded.scene;
    let (triangles, lights) = (scene.triangles.len(), scene.lights.len());
    if lights == 0 {
        linelit_formats::add_framing_light(&mut scene);
    }
    // Use fewer pixels if there are many lights.
    let pixels = (PICTURE[0] * PICTURE[1]) as usize;
    let coarse = (pixels * scene.lights.len()).div_ceil(MAX_PAIRS).max(1);
    #[allow(
        clippy::cast_possible_truncation,
        reason = "at most the side of the picture"
    )]
    let side = |n: u32| (f64::from(n) / (coarse as f64).sqrt()).ceil().max(1.0) as u32;
    let [width, height] = PICTURE.map(side);
    scene.set_resolution(width, height);
    // Render, and check that all values are finite.
    let settings = Settings {
        samples: SAMPLES,
        ..Settings::default()
    };
    let renderer = Renderer::new(&scene);
    let window = Tile::whole(width, height);
    let (image, _) = scene_study::render(&renderer, &settings, window, &ProgressBar::hidden());
    let finite = image.mean().iter().all(|v| v.is_finite());
    assert!(finite, "the picture of {} is not finite", file.display());
    Ok(Counts {
        triangles,
        lights,
        warnings: loaded.warnings.len(),
    })
}

/// Returns the report of a child process on a file, or an error if the process failed or exceeded a
/// limit.
fn in_child(file: &Path, seconds: f64) -> Result<Outcome> {
    let program = std::env::current_exe().context("finding the program itself")?;
    let mut child = Command::new(program)
        .args(["load-all", "--one"])
        .arg(file)
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("starting a process for the file")?;
    // Wait for it, or end it when it exceeds a limit.
    let watched = watch(&mut child, seconds);
    if watched.is_err() {
        child.kill().context("ending the process")?;
    }
    let output = child.wait_with_output().context("waiting for the end")?;
    watched?;
    // Read its report, or why it panicked.
    let text = String::from_utf8_lossy(&output.stdout);
    let Ok(outcome) = serde_json::from_str::<Outcome>(text.trim()) else {
        let noise = String::from_utf8_lossy(&output.stderr);
        let mut lines = noise.lines().skip_while(|l| !l.contains("panicked"));
        match (lines.next(), lines.next()) {
            (Some(place), Some(what)) => bail!("{place} {what}"),
            _ => bail!("the process died: {}", output.status),
        }
    };
    if outcome.peak_kib > MAX_KIB {
        bail!("took {} MiB", outcome.peak_kib >> 10);
    }
    Ok(outcome)
}

/// Waits until a process ends, or exceeds a limit.
fn watch(child: &mut Child, seconds: f64) -> Result<()> {
    let start = Instant::now();
    let folder = PathBuf::from(format!("/proc/{}", child.id()));
    while child.try_wait().context("watching the process")?.is_none() {
        let wall = start.elapsed().as_secs_f64();
        let used = processor_seconds(&folder).unwrap_or(wall);
        if used > seconds || wall > PATIENCE * seconds {
            bail!("took more than {seconds} s");
        }
        let status = std::fs::read_to_string(folder.join("status")).unwrap_or_default();
        if let Some(held) = kib(&status, "VmRSS:")
            && held > MAX_KIB
        {
            bail!("took more than {} MiB", MAX_KIB >> 10);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(())
}

/// Returns the seconds that a process has run, in user and kernel mode.
fn processor_seconds(folder: &Path) -> Option<f64> {
    let mut text = String::new();
    let mut file = std::fs::File::open(folder.join("stat")).ok()?;
    file.read_to_string(&mut text).ok()?;
    // The name in parentheses may contain anything; user and system time are the 12th and 13th
    // field after it.
    let (_, numbers) = text.rsplit_once(')')?;
    let mut numbers = numbers.split_ascii_whitespace().skip(11);
    let mut ticks = || numbers.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS)
}

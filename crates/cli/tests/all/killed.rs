//! The program killed at any moment: each file is complete, and either old or new.
#![cfg(unix)]
#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use crate::common::{PROGRAM, folder, names, small_render, small_study, succeeded};
use linelit_samplers::{Sampler, SamplerKind};
use rustix::process::{Pid, Signal, kill_process};
use std::fs;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// How often each command is killed.
const KILLS: u32 = 8;

fn start(arguments: &[&str]) -> Child {
    let mut command = Command::new(PROGRAM);
    command.args(arguments);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().unwrap()
}

/// Kills a process with one of the two signals. It may have ended by itself before; with the
/// gentler signal, studies finish their current units.
fn end(mut child: Child, kind: u32) {
    let signal = if kind.is_multiple_of(2) {
        Signal::KILL
    } else {
        Signal::TERM
    };
    let pid = Pid::from_child(&child);
    kill_process(pid, signal).unwrap();
    let status = child.wait().unwrap();
    let by = status.signal();
    let later = signal == Signal::TERM && status.code() == Some(75);
    assert!(
        status.success() || later || by == Some(signal.as_raw()),
        "{status}"
    );
}

/// Returns whether a temporary file of the process `writer` for `name` has contents. While the
/// process only tests whether it can write, the file is empty.
fn is_writing(folder: &Path, name: &str, writer: u32) -> bool {
    let start = format!(".{name}.{writer}-");
    fs::read_dir(folder).is_ok_and(|entries| {
        entries.flatten().any(|entry| {
            let found = entry.file_name();
            let found = found.to_string_lossy();
            found.starts_with(&start)
                && found.ends_with(".tmp")
                && entry.metadata().is_ok_and(|m| m.len() > 0)
        })
    })
}

/// Runs a command again and again and kills it, at random moments and while it writes each of the
/// files. `check` examines the remaining files each time.
fn kill_often(arguments: &[&str], folder: &Path, files: &[&str], check: impl Fn()) {
    let whole = Instant::now();
    succeeded(arguments);
    let whole = whole.elapsed();
    check();
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    let seed = now.as_secs();
    println!("{arguments:?}: {whole:?}, seed {seed}");
    let moments = Sampler::new(SamplerKind::Independent, seed).points([0, 0], 0, KILLS);
    for k in 0..KILLS {
        let child = start(arguments);
        sleep(whole.mul_f64(1.2 * moments.get_1d(k)));
        end(child, k);
        check();
    }
    let mut hit = 0;
    for (k, file) in (0..KILLS).zip(files.iter().cycle()) {
        let mut child = start(arguments);
        while !is_writing(folder, file, child.id()) {
            if child.try_wait().unwrap().is_some() {
                break;
            }
        }
        if child.try_wait().unwrap().is_none() {
            hit += 1;
            end(child, k);
        }
        check();
    }
    println!("killed while writing: {hit} of {KILLS}");
    // The next run removes temporary files.
    succeeded(arguments);
    check();
    let temporary = |name: &String| name.ends_with(".tmp") || name.ends_with("-lock");
    assert!(!names(folder).iter().any(temporary), "{:?}", names(folder));
}

#[test]
fn a_killed_render_leaves_the_old_picture_or_the_new_one() {
    let dir = folder("killed-render");
    let image = dir.join("a.exr");
    let arguments = small_render(&image, "160x160");
    let seeded = |seed| [&arguments[..], &["--seed", seed]].concat();
    succeeded(&seeded("1"));
    let old = fs::read(&image).unwrap();
    let new_arguments = seeded("2");
    let other = dir.join("b.exr");
    succeeded(&new_arguments);
    fs::rename(&image, &other).unwrap();
    let new = fs::read(&other).unwrap();
    assert!(old != new);
    fs::write(&image, &old).unwrap();
    kill_often(&new_arguments, &dir, &["a.exr"], || {
        let left = fs::read(&image).unwrap();
        assert!(left == old || left == new);
        fs::write(&image, &old).unwrap();
    });
    assert_eq!(names(&dir), ["a.exr", "b.exr"]);
}

#[test]
fn a_killed_study_leaves_whole_files() {
    let dir = folder("killed-study");
    let arguments = small_study("cornell-box", &dir);
    let plots = dir.join("plots");
    let whole = || {
        let read = |name: &str| fs::read_to_string(dir.join(name)).unwrap();
        let study: serde_json::Value = serde_json::from_str(&read("results.json")).unwrap();
        assert_eq!(study["rows"].as_array().unwrap().len(), 4);
        for (name, lines) in [("results.csv", 5), ("slopes.csv", 3)] {
            let table = read(name);
            assert!(
                table.ends_with('\n') && table.lines().count() == lines,
                "{table}"
            );
        }
        assert!(read("report.html").ends_with("</html>"));
        for plot in names(&plots).iter().filter(|n| !n.starts_with('.')) {
            let text = fs::read_to_string(plots.join(plot)).unwrap();
            assert!(text.trim_end().ends_with("</svg>"), "{plot}");
        }
    };
    let files = ["report.html", "results.csv", "results.json", "slopes.csv"];
    kill_often(&arguments, &dir, &files, whole);
    assert_eq!(names(&plots).len(), 3);
    let left = names(&dir);
    assert_eq!(left[..2], [".linelit-files", "plots"]);
    assert_eq!(left[2..], files);
}

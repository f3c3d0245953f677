//! Functions that run the tool as a user does, which all tests share.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, OnceLock};

/// Returns a command of the program.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_linelit");

/// Runs the tool with these arguments to its end.
pub(crate) fn linelit(arguments: &[&str]) -> Output {
    Command::new(PROGRAM).args(arguments).output().unwrap()
}

/// Returns the output of the tool with these arguments; it must succeed.
pub(crate) fn succeeded(arguments: &[&str]) -> Output {
    let output = linelit(arguments);
    let said = text(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    output
}

/// A folder for a test's files.
pub(crate) fn folder(name: &str) -> Folder {
    let dir = std::env::temp_dir().join(format!("linelit-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    Folder(dir)
}

/// A folder that is deleted with this value.
pub(crate) struct Folder(PathBuf);

impl Deref for Folder {
    type Target = PathBuf;

    fn deref(&self) -> &PathBuf {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Returns the output of a program as text.
pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A path as an argument.
pub(crate) fn path(p: &Path) -> &str {
    p.to_str().unwrap()
}

/// Returns the contents of the files in a folder, by name.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Arguments that render the Cornell box with one sample.
pub(crate) fn small_render<'a>(image: &'a Path, resolution: &'a str) -> Vec<&'a str> {
    let mut arguments = vec!["render", "cornell-box", "-o", path(image)];
    arguments.extend(["--samples", "1", "--resolution", resolution]);
    arguments
}

/// Arguments of the smallest study of one scene.
pub(crate) fn small_study<'a>(scene: &'a str, out: &'a Path) -> Vec<&'a str> {
    let mut arguments = vec!["converge", scene, "--out", path(out)];
    arguments.extend(["--samples", "1,4", "--trials", "2", "--pixels", "4x4"]);
    arguments.extend(["--smallest", "--samplers", "stratified"]);
    arguments.extend(["--estimators", "point-area,line-analytic"]);
    arguments
}

/// Counts the complete parts in the folder of a plan.
#[cfg(unix)]
pub(crate) fn parts(plan: &Path) -> usize {
    let entries = std::fs::read_dir(plan.join("parts"));
    let names = entries.into_iter().flatten().flatten();
    names
        .filter(|entry| entry.path().extension().is_some_and(|e| e == "part"))
        .count()
}

/// Starts a command that computes units of a plan, and ends it by a signal once another part was
/// written.
#[cfg(unix)]
pub(crate) fn signalled(words: &[&str], plan: &Path, signal: rustix::process::Signal) -> Output {
    use rustix::process::{Pid, kill_process};
    let before = parts(plan);
    let mut command = Command::new(PROGRAM);
    command
        .args(words)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    while parts(plan) <= before && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    kill_process(Pid::from_child(&child), signal).unwrap();
    child.wait_with_output().unwrap()
}

/// Arguments of a study whose measurements with one sample take a moment. Its measurements with
/// 65536 samples take, according to a pilot of a second, many times a budget of a minute.
pub(crate) fn late_study(out: &Path) -> Vec<&str> {
    let words = "converge cornell-box --smallest --threads 1 --pixels 8x8 --trials 1000 \
                 --samples 1,65536 --samplers stratified --estimators point-area,point-solid-angle \
                 --time-budget 60 --json --out";
    words
        .split(' ')
        .filter(|word| !word.is_empty())
        .chain([path(out)])
        .collect()
}

/// The output of a named study at its smallest size, and the folder that it wrote.
#[derive(Debug)]
pub(crate) struct Smallest {
    pub(crate) said: String,
    pub(crate) folder: PathBuf,
}

/// Runs a named study at its smallest size on one thread, when the first test needs it. Some
/// studies take seconds, and several tests read their results.
pub(crate) fn smallest(name: &'static str) -> &'static Smallest {
    static RUNS: Mutex<BTreeMap<&str, &OnceLock<Smallest>>> = Mutex::new(BTreeMap::new());
    let mut runs = RUNS.lock().unwrap();
    let run: &'static OnceLock<Smallest> = runs
        .entry(name)
        .or_insert_with(|| Box::leak(Box::default()));
    // Other studies may run at the same time.
    drop(runs);
    run.get_or_init(|| {
        // It is unknown which test reads it last: the folder stays, and the next run overwrites it.
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
            .join("smallest")
            .join(name);
        let mut arguments = vec!["converge", name];
        if name == "salesin-fig9" {
            // The only study that needs a scene.
            arguments.push("cornell-box-small");
        }
        arguments.extend([
            "--smallest",
            "--fresh",
            "--threads",
            "1",
            "--out",
            path(&folder),
        ]);
        let output = linelit(&arguments);
        assert!(output.status.success(), "{name}: {}", text(&output.stderr));
        Smallest {
            said: text(&output.stdout),
            folder,
        }
    })
}

/// A document in the folder of a study.
pub(crate) fn read(folder: &Path, file: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(folder.join(file)).unwrap();
    serde_json::from_str(&text).unwrap()
}

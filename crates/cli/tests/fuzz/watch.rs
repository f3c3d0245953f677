//! The limits of an attempt, five seconds on the processor and a gibibyte, which another thread
//! watches; and the handling of attempts that exceed them, or panic.

use super::corpus::Case;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The seconds on the processor after which an attempt counts as a hang.
const SECONDS: f64 = 5.0;
/// The most memory that the whole process may hold during an attempt, in KiB.
const MOST_KIB: u64 = 1 << 20;

/// The watch on one thread.
pub(crate) struct Watch {
    task: PathBuf,
    running: Arc<Mutex<Option<Running>>>,
}

struct Running {
    case: Case,
    start: f64,
}

/// Returns the seconds that a thread has run, where the system reports it; otherwise wall time.
fn seconds(task: &Path) -> f64 {
    let text = fs::read_to_string(task.join("schedstat")).unwrap_or_default();
    let nanoseconds = text
        .split_ascii_whitespace()
        .next()
        .and_then(|n| n.parse().ok());
    nanoseconds.map_or_else(|| CLOCK.elapsed().as_secs_f64(), |n: f64| n * 1e-9)
}

static CLOCK: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);

/// Returns a value of `/proc/self/status` in KiB.
fn kib(key: &str) -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix(key));
    let number = line.and_then(|l| l.split_ascii_whitespace().next());
    number.and_then(|n| n.parse().ok()).unwrap_or(0)
}

impl Watch {
    /// Watches the calling thread until the process ends.
    pub(crate) fn new() -> Self {
        let task = fs::read_link("/proc/thread-self").unwrap_or_default();
        let task = Path::new("/proc").join(task);
        let running: Arc<Mutex<Option<Running>>> = Arc::default();
        let (of_thread, shared) = (task.clone(), Arc::clone(&running));
        std::thread::spawn(move || {
            loop {
                std::thread::sleep(Duration::from_millis(100));
                let running = shared.lock().unwrap_or_else(PoisonError::into_inner);
                let Some(running) = running.as_ref() else {
                    continue;
                };
                let over = seconds(&of_thread) - running.start > SECONDS;
                let large = kib("VmRSS:") > MOST_KIB;
                if over || large {
                    let what = if over { "a hang" } else { "too much memory" };
                    // The thread cannot be stopped, therefore the process is.
                    eprintln!("{what}: {}", keep(&running.case));
                    std::process::exit(101);
                }
            }
        });
        Self { task, running }
    }

    /// Runs an attempt, and returns the problem if there is one.
    pub(crate) fn run(&self, case: &Case, attempt: impl FnOnce()) -> Option<String> {
        // The process's memory is measured for all of its threads together, so that attempts take
        // turns.
        static TURN: Mutex<()> = Mutex::new(());
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let set = |running| *self.running.lock().unwrap_or_else(PoisonError::into_inner) = running;
        // Reset the peak memory.
        let marked = fs::write("/proc/self/clear_refs", "5").is_ok();
        set(Some(Running {
            case: case.clone(),
            start: seconds(&self.task),
        }));
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(attempt));
        set(None);
        if outcome.is_err() {
            return Some(format!("a panic: {}", keep(case)));
        }
        let most = kib("VmHWM:");
        (marked && most > MOST_KIB).then(|| format!("{most} KiB: {}", keep(case)))
    }
}

/// Stores the files of a case, and returns where.
fn keep(case: &Case) -> String {
    let finds = Path::new(env!("CARGO_TARGET_TMPDIR")).join("finds");
    let free = (0..10_000)
        .map(|k| finds.join(k.to_string()))
        .find(|p| !p.exists());
    let Some(folder) = free else {
        return "not kept, there are too many".to_owned();
    };
    match fs::create_dir_all(&folder) {
        Ok(()) => case.write(&folder).display().to_string(),
        Err(error) => format!("not kept: {error}"),
    }
}

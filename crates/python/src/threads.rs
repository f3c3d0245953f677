//! Long calls: without the interpreter's lock, on threads of their own, until Ctrl-C.

use crate::errors::value_error;
use linelit::geometry::stop::{self, Stopped};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::{Cell, RefCell};
use std::process;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often the calling thread checks whether a signal such as Ctrl-C has arrived.
const LOOK: Duration = Duration::from_millis(50);

/// Items of which a call is short: waking other threads would take longer.
const SHORT: usize = 64;

/// Threads for one call at a time, which may be told to stop.
struct Crew {
    /// The number that was asked for; zero for one thread a core.
    threads: usize,
    pool: ThreadPool,
    stop: Arc<AtomicBool>,
}

/// Crews without a call, and the process that their threads are in: a forked child has none of
/// them. It is locked by whoever has the interpreter's lock alone, so no fork finds it locked.
static IDLE: Mutex<(u32, Vec<Crew>)> = Mutex::new((0, Vec::new()));

impl Crew {
    /// An idle crew, or a new one.
    fn take(threads: Option<usize>) -> PyResult<Self> {
        if let Some(threads) = threads
            && !(1..=1024).contains(&threads)
        {
            return Err(value_error(format!(
                "threads is {threads}, and needs 1 to 1024"
            )));
        }
        let threads = threads.unwrap_or(0);
        let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
        let (process, crews) = &mut *idle;
        if *process != process::id() {
            // What is left of a parent's cannot even be dropped, which would wake its threads.
            std::mem::forget(std::mem::take(crews));
            *process = process::id();
        }
        if let Some(k) = crews.iter().position(|crew| crew.threads == threads) {
            return Ok(crews.swap_remove(k));
        }
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let ask = move |_| {
            let flag = Arc::clone(&flag);
            stop::ask(Some(Rc::new(move || flag.load(Ordering::Relaxed))));
        };
        let built = ThreadPoolBuilder::new().num_threads(threads);
        let built = built.start_handler(ask).build();
        Ok(Self {
            threads,
            pool: built.map_err(|e| value_error(format!("threads: {e}")))?,
            stop,
        })
    }

    /// Waits for the next call.
    fn put_back(self) {
        self.stop.store(false, Ordering::Relaxed);
        let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
        idle.1.push(self);
    }
}

/// Does work on threads of its own, without the interpreter's lock, while this thread looks for
/// signals and calls `told` now and then; an error of either stops the work. The work may take what
/// only this call has: when this returns, it has ended.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
    mut told: impl FnMut(Python<'_>) -> PyResult<()> + Send,
) -> PyResult<T> {
    let crew = Crew::take(threads)?;
    let watch = || {
        crew.pool.in_place_scope(|scope| {
            let (sender, ended) = channel();
            // A panic drops the sender; the scope hands it on.
            scope.spawn(move |_| drop(sender.send(stop::catch(work))));
            loop {
                match ended.recv_timeout(LOOK) {
                    Ok(found) => return Ok(found.ok()),
                    Err(RecvTimeoutError::Disconnected) => return Ok(None),
                    Err(RecvTimeoutError::Timeout) => {}
                }
                let looked = Python::attach(|py| py.check_signals().and_then(|()| told(py)));
                if looked.is_err() {
                    crew.stop.store(true, Ordering::Relaxed);
                }
                looked?;
            }
        })
    };
    let found: PyResult<Option<T>> = py.detach(watch);
    crew.put_back();
    // Nobody but this thread stops the work, and then there is an error.
    let found = found?.ok_or_else(|| value_error("the work was stopped"))?;
    told(py)?;
    Ok(found)
}

/// The pieces of work that are done, of all; counted by the work's threads.
#[derive(Default)]
pub(crate) struct Done {
    pub(crate) done: AtomicUsize,
    pub(crate) all: AtomicUsize,
}

impl Done {
    /// Tells a function of Python of each piece that is done, and how many there are.
    pub(crate) fn tell<'a>(
        &'a self,
        progress: Option<&'a Py<PyAny>>,
    ) -> impl FnMut(Python<'_>) -> PyResult<()> + Send + 'a {
        let mut told = 0;
        move |py| {
            let [done, all] = [&self.done, &self.all].map(|n| n.load(Ordering::Relaxed));
            if let Some(progress) = progress {
                while told < done {
                    told += 1;
                    progress.call1(py, (told, all))?;
                }
            }
            Ok(())
        }
    }
}

/// Does work in this thread, without the interpreter's lock, and looks for signals meanwhile. The
/// work must not share itself out: outside of a pool rayon has one of its own, which a fork breaks.
pub(crate) fn alone<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let watch = || {
        let (next, error) = (Cell::new(Instant::now() + LOOK), Rc::default());
        let found: Rc<RefCell<Option<PyErr>>> = Rc::clone(&error);
        let look = move || {
            if Instant::now() < next.get() {
                return false;
            }
            *found.borrow_mut() = Python::attach(|py| py.check_signals()).err();
            next.set(Instant::now() + LOOK);
            found.borrow().is_some()
        };
        let before = stop::ask(Some(Rc::new(look)));
        let ended = stop::catch(work);
        stop::ask(before);
        ended.map_err(|Stopped| error.take())
    };
    let ended = py.detach(watch);
    ended.map_err(|error| error.unwrap_or_else(|| value_error("the work was stopped")))
}

/// Does work with a number of items: on threads of its own, unless it is short. Ctrl-C ends it.
pub(crate) fn detached<T: Send>(
    py: Python<'_>,
    items: usize,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    match items <= SHORT && threads.is_none_or(|threads| (1..=1024).contains(&threads)) {
        true => alone(py, work),
        false => watched(py, threads, work, |_| Ok(())),
    }
}

//! How long calls run: without the interpreter's lock, on threads of their own, and so that Ctrl-C
//! stops them.
//!
//! Work queries now and then whether it should stop (`linelit::geometry::stop`), and unwinds if so.
//! Long work runs on a pool of threads, while the calling thread waits and checks for signals every
//! 50 ms ([`watched`]). Short work runs in the calling thread, where each such query checks for
//! signals ([`alone`]). Pools are used again by later calls ([`WorkerPool`]).

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

/// The time after which the calling thread checks again whether a signal such as Ctrl-C has
/// arrived.
const LOOK: Duration = Duration::from_millis(50);

/// The largest number of items of work for which a call runs in the calling thread: waking other
/// threads would take longer.
const SHORT: usize = 64;

/// A pool of threads that serves one call at a time and can be stopped.
struct WorkerPool {
    /// The number of threads that calls request; zero means one thread for each core.
    threads: usize,
    pool: ThreadPool,
    /// The flag that is set to make work on the pool's threads unwind.
    stop: Arc<AtomicBool>,
}

/// The idle pools, and the process that their threads belong to: after a fork, the child has the
/// memory of the pools but not their threads. The mutex is locked only by threads that hold the
/// interpreter's lock, so that no fork finds it locked.
static IDLE: Mutex<(u32, Vec<WorkerPool>)> = Mutex::new((0, Vec::new()));

impl WorkerPool {
    /// Takes an idle pool with this number of threads, or starts a new one.
    fn take(threads: Option<usize>) -> PyResult<Self> {
        // Check the number of threads.
        if let Some(threads) = threads
            && !(1..=1024).contains(&threads)
        {
            return Err(value_error(format!(
                "threads is {threads}, and needs 1 to 1024"
            )));
        }
        let threads = threads.unwrap_or(0);
        // Look for an idle pool of this process.
        let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
        let (process, crews) = &mut *idle;
        if *process != process::id() {
            // After a fork, leak the parent's pools: dropping them would try to wake their threads.
            std::mem::forget(std::mem::take(crews));
            *process = process::id();
        }
        if let Some(k) = crews.iter().position(|crew| crew.threads == threads) {
            return Ok(crews.swap_remove(k));
        }
        // Start a new pool, whose threads look at its flag when work queries whether to stop.
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

    /// Puts the pool back among the idle ones, ready for the next call.
    fn put_back(self) {
        self.stop.store(false, Ordering::Relaxed);
        let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
        idle.1.push(self);
    }
}

/// Does work on a pool of threads without the interpreter's lock. Meanwhile this thread checks for
/// signals and calls `told` every 50 ms, and stops the work if either fails. The work may borrow
/// from the caller: it has ended when this function returns.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
    mut told: impl FnMut(Python<'_>) -> PyResult<()> + Send,
) -> PyResult<T> {
    let crew = WorkerPool::take(threads)?;
    let watch = || {
        crew.pool.in_place_scope(|scope| {
            // Start the work. If it panics, the sender is dropped, and the scope passes the panic
            // on when it ends.
            let (sender, ended) = channel();
            scope.spawn(move |_| drop(sender.send(stop::catch(work))));
            // Wait for its end, and check for signals meanwhile.
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
    // Only this thread stops the work, and then `found` is already an error.
    let found = found?.ok_or_else(|| value_error("the work was stopped"))?;
    told(py)?;
    Ok(found)
}

/// The progress of a call: the number of pieces of work that are done, and the number of all
/// pieces, counted by the threads that do the work.
#[derive(Default)]
pub(crate) struct Done {
    pub(crate) done: AtomicUsize,
    pub(crate) all: AtomicUsize,
}

impl Done {
    /// Returns a function for [`watched`] that calls Python's `progress` once for each piece that
    /// has been done, with the number of pieces done and the number of all.
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

/// Does work in this thread without the interpreter's lock, and checks for signals every 50 ms when
/// the work asks whether to stop. The work must not use rayon: outside of a [`WorkerPool`], that
/// means rayon's global pool, whose threads a forked child does not have.
pub(crate) fn alone<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let watch = || {
        // Make the query whether to stop check for signals, at most every 50 ms.
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
        // Do the work, and restore the thread's former query.
        let before = stop::ask(Some(Rc::new(look)));
        let ended = stop::catch(work);
        stop::ask(before);
        ended.map_err(|Stopped| error.take())
    };
    let ended = py.detach(watch);
    ended.map_err(|error| error.unwrap_or_else(|| value_error("the work was stopped")))
}

/// Does work of this number of items: in this thread if there are few ([`alone`]), else on a pool
/// of threads ([`watched`]). Ctrl-C stops both.
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

//! Long calls: on so many threads, without the interpreter's lock, in batches that Ctrl-C ends.

use crate::errors::value_error;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::collections::BTreeMap;
use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Batches grow until they take so long: the time that Ctrl-C may wait.
const BATCH: Duration = Duration::from_millis(100);
/// The size of the first batch.
const FIRST: usize = 4096;

/// Pools by their number of threads, each made once.
static POOLS: Mutex<BTreeMap<usize, Arc<ThreadPool>>> = Mutex::new(BTreeMap::new());

/// The pool of a number of threads; none for all cores, which share one pool.
pub(crate) fn pool(threads: Option<usize>) -> PyResult<Option<Arc<ThreadPool>>> {
    let Some(threads) = threads else {
        return Ok(None);
    };
    if !(1..=1024).contains(&threads) {
        return Err(value_error(format!(
            "threads is {threads}, and needs 1 to 1024"
        )));
    }
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pool) = pools.get(&threads) {
        return Ok(Some(Arc::clone(pool)));
    }
    let built = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = Arc::new(built.map_err(|e| value_error(format!("threads: {e}")))?);
    pools.insert(threads, Arc::clone(&pool));
    Ok(Some(pool))
}

/// Runs work in the pool, without the interpreter's lock.
pub(crate) fn detached<T: Send>(
    py: Python<'_>,
    pool: Option<&ThreadPool>,
    work: impl FnOnce() -> T + Send,
) -> T {
    py.detach(|| match pool {
        Some(pool) => pool.install(work),
        None => work(),
    })
}

/// Work in batches.
pub(crate) struct Batches {
    /// The pieces of work.
    pub(crate) count: usize,
    /// The pieces of the first batch.
    pub(crate) first: usize,
    pub(crate) threads: Option<usize>,
}

/// Batches of this many points, on so many threads.
pub(crate) const fn of_points(count: usize, threads: Option<usize>) -> Batches {
    Batches {
        count,
        first: FIRST,
        threads,
    }
}

/// Does pieces of work in batches, each a range of numbers, and looks for Ctrl-C between them;
/// `done` is told how many are done. Answers must not depend on the batches.
pub(crate) fn in_batches<E: Send>(
    py: Python<'_>,
    batches: &Batches,
    mut work: impl FnMut(Range<usize>) -> Result<(), E> + Send,
    error: impl Fn(E, usize) -> PyErr,
    mut done: impl FnMut(usize) -> PyResult<()>,
) -> PyResult<()> {
    let count = batches.count;
    let pool = pool(batches.threads)?;
    let (mut first, mut size) = (0, batches.first);
    while first < count {
        let range = first..count.min(first + size);
        let begin = Instant::now();
        detached(py, pool.as_deref(), || work(range.clone())).map_err(|e| error(e, first))?;
        first = range.end;
        // A batch grows while there is time for all of it.
        size = match begin.elapsed() {
            time if time < BATCH / 4 => size * 4,
            time if time > BATCH * 2 => (size / 2).max(1),
            _ => size,
        };
        py.check_signals()?;
        done(first)?;
    }
    Ok(())
}

/// Does work that has no batches on a thread of its own, in the pool of a number of threads, and
/// looks for Ctrl-C meanwhile, after which the work is told to stop.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let stop = AtomicBool::new(false);
    let run = || match pool {
        Some(pool) => pool.install(|| work(&stop)),
        None => work(&stop),
    };
    let watch = || {
        thread::scope(|scope| {
            // The end of the work drops the sender.
            let (sender, ended) = channel::<()>();
            let worker = scope.spawn(move || {
                let _sender = sender;
                run()
            });
            while ended.recv_timeout(BATCH) == Err(RecvTimeoutError::Timeout) {
                let asked = Python::attach(|py| py.check_signals());
                if asked.is_err() {
                    stop.store(true, Ordering::Relaxed);
                }
                asked?;
            }
            Ok(worker.join().unwrap_or_else(|panic| resume_unwind(panic)))
        })
    };
    py.detach(watch)
}

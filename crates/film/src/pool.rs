//! The division of work among the threads of the rayon pool in which the caller runs. Outside of a
//! pool everything runs in the caller's thread, where rayon itself would start its global pool.

use rayon::prelude::*;

/// Returns the number of threads that share the work.
pub(crate) fn threads() -> usize {
    rayon::current_thread_index().map_or(1, |_| rayon::current_num_threads())
}

/// Calls `f` for each item, and returns the results in the order of the items.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Send + Sync) -> Vec<R> {
    if rayon::current_thread_index().is_some() {
        items.par_iter().map(f).collect()
    } else {
        items.iter().map(f).collect()
    }
}

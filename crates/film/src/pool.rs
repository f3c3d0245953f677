//! Sharing out work among the threads of the rayon pool that the caller runs in; without one,
//! everything runs in the caller's thread. (Asked outside of a pool, rayon would start one.)

use rayon::prelude::*;

/// Threads that there are to share work among.
pub(crate) fn threads() -> usize {
    rayon::current_thread_index().map_or(1, |_| rayon::current_num_threads())
}

/// `f` of each item, in their order.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Send + Sync) -> Vec<R> {
    if rayon::current_thread_index().is_some() {
        items.par_iter().map(f).collect()
    } else {
        items.iter().map(f).collect()
    }
}

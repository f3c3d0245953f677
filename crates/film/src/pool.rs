//! Sharing out work among the threads of the rayon pool that the caller runs in; without one,
//! everything runs in the caller's thread. (Asked outside of a pool, rayon would start one.)

use rayon::prelude::*;

/// Threads that there are to share work among.
pub(crate) fn threads() -> usize {
    rayon::current_thread_index().map_or(1, |_| rayon::current_num_threads())
}

/// `f` of each item, in their order, with a state that is made at most once an item, and which must
/// not change what `f` returns.
pub(crate) fn map<T: Sync, S, R: Send>(
    items: &[T],
    state: impl Fn() -> S + Send + Sync,
    f: impl Fn(&mut S, &T) -> R + Send + Sync,
) -> Vec<R> {
    if rayon::current_thread_index().is_some() {
        return items.par_iter().map_init(state, f).collect();
    }
    let mut state = state();
    items.iter().map(|item| f(&mut state, item)).collect()
}

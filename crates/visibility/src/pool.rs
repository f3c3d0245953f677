//! Sharing out work among the threads of the pool that the caller runs in.
//!
//! A library starts no thread: whoever calls it from a thread of a rayon pool gives it that pool's
//! threads, and from any other thread everything runs there. (Asked outside of a pool, rayon
//! itself would start one for all processors.) What is shared out here gives the same bits however
//! it is shared out.

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

/// Whether the caller runs in a pool.
fn shared() -> bool {
    rayon::current_thread_index().is_some()
}

/// Runs both, at once if there are threads for it.
pub(crate) fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    if shared() {
        rayon::join(a, b)
    } else {
        (a(), b())
    }
}

/// Items made by `f` of their numbers, in order; by each thread no fewer than `least` at a time.
pub(crate) fn collect<T: Send>(
    count: usize,
    least: usize,
    f: &(impl Fn(usize) -> T + Sync),
) -> Vec<T> {
    if shared() {
        let numbers = (0..count).into_par_iter().with_min_len(least);
        numbers.map(f).collect()
    } else {
        (0..count).map(f).collect()
    }
}

/// Applies `f` to stretches of at most `size` items, with the index of the first of each, and
/// brings together what it returns, in order; `f` sees at least one stretch.
pub(crate) fn fold_stretches<T: Send, R: Send>(
    items: &mut [T],
    size: usize,
    f: &(impl Fn(usize, &mut [T]) -> R + Sync),
    both: &(impl Fn(R, R) -> R + Sync),
) -> R {
    fn go<T: Send, R: Send>(
        first: usize,
        items: &mut [T],
        size: usize,
        f: &(impl Fn(usize, &mut [T]) -> R + Sync),
        both: &(impl Fn(R, R) -> R + Sync),
    ) -> R {
        if items.len() <= size {
            return f(first, items);
        }
        let middle = (items.len() / size).div_ceil(2) * size;
        let (left, right) = items.split_at_mut(middle);
        let (left, right) = join(
            || go(first, left, size, f, both),
            || go(first + middle, right, size, f, both),
        );
        both(left, right)
    }
    go(0, items, size.max(1), f, both)
}

//! Sharing out work among the threads of the pool that the caller runs in.
//!
//! A library starts no thread: whoever calls it from a thread of a rayon pool gives it that pool's
//! threads, and from any other thread everything runs there. (Asked outside of a pool, rayon
//! itself would start one for all processors.) What is shared out here gives the same bits however
//! it is shared out.

use rayon::slice::ParallelSliceMut;

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

/// Sorts items of which no two are equal, so that there is but one order.
pub(crate) fn sort_distinct<T: Ord + Send>(items: &mut [T]) {
    if shared() {
        items.par_sort_unstable();
    } else {
        items.sort_unstable();
    }
}

/// Applies `f` to stretches of at most `size` items, with the index of the first of each.
pub(crate) fn for_stretches<T: Send>(
    items: &mut [T],
    size: usize,
    f: &(impl Fn(usize, &mut [T]) + Sync),
) {
    fn go<T: Send>(
        first: usize,
        items: &mut [T],
        size: usize,
        f: &(impl Fn(usize, &mut [T]) + Sync),
    ) {
        if items.len() <= size {
            f(first, items);
            return;
        }
        let middle = (items.len() / size).div_ceil(2) * size;
        let (left, right) = items.split_at_mut(middle);
        join(
            || go(first, left, size, f),
            || go(first + middle, right, size, f),
        );
    }
    go(0, items, size.max(1), f);
}

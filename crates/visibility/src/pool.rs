//! Distribution of work among the threads of the rayon pool that the caller runs in.
//!
//! A library starts no thread: called from a thread of a rayon pool it uses that pool's threads,
//! and called from any other thread it runs everything there. (Rayon itself, called from outside of
//! a pool, would start one for all processors.) Results have the same bits however the work is
//! distributed.

use linelit_geometry::stop;
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;
use std::ops::Range;

/// Whether there are no other threads to use.
pub(crate) fn is_alone() -> bool {
    rayon::current_thread_index().is_none() || rayon::current_num_threads() == 1
}

/// Runs both closures, in parallel if there are threads for it.
pub(crate) fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    stop::check();
    if is_alone() {
        (a(), b())
    } else {
        rayon::join(a, b)
    }
}

/// Collects `f(k)` for all `k < count`, in order; each task computes at least `least` items.
pub(crate) fn collect<T: Send>(
    count: usize,
    least: usize,
    f: &(impl Fn(usize) -> T + Sync),
) -> Vec<T> {
    let each = |k: usize| {
        if k.is_multiple_of(least) {
            stop::check();
        }
        f(k)
    };
    if is_alone() {
        (0..count).map(each).collect()
    } else {
        let numbers = (0..count).into_par_iter().with_min_len(least);
        numbers.map(each).collect()
    }
}

/// Applies `f` to consecutive ranges of at most `size` numbers that together cover `0..count`;
/// results are in order.
pub(crate) fn stretches<T: Send>(
    count: usize,
    size: usize,
    f: &(impl Fn(Range<usize>) -> T + Sync),
) -> Vec<T> {
    let stretch = |k: usize| f(k * size..count.min((k + 1) * size));
    collect(count.div_ceil(size), 1, &stretch)
}

/// Applies `f` to consecutive parts of `items` of at most `size` items, with the index of the first
/// item of each, and returns the results in order.
pub(crate) fn stretches_of<T: Send, R: Send>(
    items: &mut [T],
    size: usize,
    f: &(impl Fn(usize, &mut [T]) -> R + Sync),
) -> Vec<R> {
    let each = |(k, part): (usize, &mut [T])| {
        stop::check();
        f(k * size, part)
    };
    if is_alone() {
        items.chunks_mut(size).enumerate().map(each).collect()
    } else {
        items.par_chunks_mut(size).enumerate().map(each).collect()
    }
}

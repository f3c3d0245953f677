//! Distribution of work among the threads of the rayon pool that the caller runs in.
//!
//! A library starts no thread: called from a thread of a rayon pool it uses that pool's threads,
//! and called from any other thread it runs everything there. (Rayon itself, called from outside of
//! a pool, would start one for all processors.) Results are bit-identical however the work is
//! distributed.

use linelit_geometry::stop;
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;
use std::ops::Range;

/// Whether the calling thread is the only one that may be used.
pub(crate) fn is_alone() -> bool {
    rayon::current_thread_index().is_none() || rayon::current_num_threads() == 1
}

/// Runs both closures, in parallel if the pool has threads for that, and returns both results.
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

/// Divides `0..count` into consecutive ranges of at most `size` numbers, applies `f` to each range,
/// and returns the results in order.
pub(crate) fn stretches<T: Send>(
    count: usize,
    size: usize,
    f: &(impl Fn(Range<usize>) -> T + Sync),
) -> Vec<T> {
    let stretch = |k: usize| f(k * size..count.min((k + 1) * size));
    collect(count.div_ceil(size), 1, &stretch)
}

/// Divides `items` into consecutive slices of at most `size` items, applies `f` to each slice and
/// the index of its first item, and returns the results in order.
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

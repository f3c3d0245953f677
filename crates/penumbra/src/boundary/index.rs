//! [`Index`]: compact indices into the lists of a boundary.

use std::num::NonZeroU32;

/// An index into a list of fewer than 2³² − 1 items. It is stored plus one, so that
/// `Option<Index>` takes no more than its four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Index(NonZeroU32);

impl Index {
    #[inline]
    pub(super) fn new(i: usize) -> Self {
        Self(NonZeroU32::MIN.saturating_add(u32::try_from(i).unwrap_or(u32::MAX)))
    }

    #[inline]
    pub(super) fn get(self) -> usize {
        self.0.get() as usize - 1
    }

    /// Whether an index is present and equal to `i`, without a branch.
    #[inline]
    pub(super) fn is(index: Option<Self>, i: usize) -> bool {
        index.map_or(0, |index| index.0.get()) as usize == i + 1
    }
}

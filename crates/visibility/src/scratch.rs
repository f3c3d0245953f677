//! [`Scratch`]: the buffers that queries reuse, so that none allocates once the buffers have grown.

use crate::counters::Counters;
use crate::holes::filtered::PastScratch;
use crate::rays::ray::RayScratch;
use crate::rays::together::FanScratch;
use crate::shaft::dense::DenseScratch;
use crate::shaft::front::FrontScratch;
use crate::shaft::seen::ShaftState;
use crate::shaft::sweep::LineScratch;
use crate::silhouettes::outline::OutlineScratch;

/// The working memory and work counters of one thread's queries.
#[derive(Debug, Default)]
pub struct Scratch {
    /// The work that the queries through this scratch have done so far.
    pub counters: Counters,
    pub(crate) rays: RayScratch,
    pub(crate) fans: FanScratch,
    pub(crate) seen: ShaftState,
    pub(crate) lines: LineScratch,
    pub(crate) dense: DenseScratch,
    pub(crate) front: FrontScratch,
    pub(crate) outline: OutlineScratch,
    pub(crate) past_holes: Box<PastScratch>,
}

impl Scratch {
    /// Creates empty buffers.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets which triangles met the latest ray. Rays from the same point try those triangles
    /// first.
    ///
    /// Answers are the same with and without it, but [`Scratch::counters`] are not: if it is called
    /// before each estimate, the counters depend on that estimate alone, and not on what the thread
    /// did before.
    pub const fn forget_latest(&mut self) {
        self.rays.last = None;
    }
}

//! A workspace has the memory and the counters of one thread.

use linelit_direct::Counts;
use linelit_visibility::Hit;

/// Memory that is reused from point to point, and counters. Each thread needs its own. No result
/// depends on the results before it.
#[derive(Debug, Default)]
pub struct Workspace {
    /// The memory for the light at a point.
    pub(crate) direct: linelit_direct::Workspace,
    /// The surfaces that a few camera rays have met.
    pub(crate) hits: Vec<Option<Hit>>,
}

impl Workspace {
    /// A workspace with empty memory.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the counts so far, and resets them to zero.
    pub fn take_counts(&mut self) -> Counts {
        self.direct.take_counts()
    }
}

//! The memory of one thread.

use linelit_direct::Counts;
use linelit_visibility::Hit;

/// Reusable memory and counters; one for each thread. Only memory and counts outlive a shading
/// point.
#[derive(Debug, Default)]
pub struct Workspace {
    /// The memory for the light at a point.
    pub(crate) direct: linelit_direct::Workspace,
    /// The surfaces that a few camera rays meet.
    pub(crate) hits: Vec<Option<Hit>>,
}

impl Workspace {
    /// Empty memory.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The counts so far; counting starts again from zero.
    pub fn take_counts(&mut self) -> Counts {
        self.direct.take_counts()
    }
}

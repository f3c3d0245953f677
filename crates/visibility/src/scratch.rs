//! Buffers that queries reuse, so that none allocates once they have grown.

use crate::{counters::Counters, node::Child};

/// Working memory and work counters of one thread's queries.
#[derive(Debug, Default)]
pub struct Scratch {
    /// What the queries through this scratch have done so far.
    pub counters: Counters,
    /// Nodes still to visit.
    pub(crate) stack: Vec<Child>,
    /// Nodes and leaves still to visit and where the ray enters them.
    pub(crate) near_stack: Vec<(Child, f32)>,
    /// Triangles in the shaft: leaf × 8 + lane.
    pub(crate) slots: Vec<u32>,
}

impl Scratch {
    /// Empty buffers.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl Default for Child {
    fn default() -> Self {
        Self::node(0)
    }
}

//! Buffers that queries reuse, so that none allocates once they have grown.

use crate::{
    counters::Counters, merge::Slots, node::Child, project::FlatTriangles, sweep::Lines,
};
use linelit_geometry::intervals::Interval;

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
    /// Their images on the light's plane.
    pub(crate) flat: FlatTriangles,
    /// The lines of one direction.
    pub(crate) lines: Lines,
    /// What is hidden of each.
    pub(crate) slots_per_line: Slots,
    /// Ends of lines in the light's coordinates, and the lines' order.
    pub(crate) ends: Vec<([f64; 2], [f64; 2])>,
    pub(crate) keys: Vec<(f64, u32)>,
    /// Visible intervals and where each line's are.
    pub(crate) pieces: Vec<Interval>,
    pub(crate) spans: Vec<(usize, usize)>,
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

//! Buffers that queries reuse, so that none allocates once they have grown.

use crate::{
    block::{Ends, Lines},
    closed_mesh::ClearOfMesh,
    counters::Counters,
    crossings::Crossings,
    dense_shaft::{Covered, Waiting},
    fan::Directions,
    frame::{Light, LightFrame},
    front::{self, Front},
    holes::HolesScratch,
    merge::{Pieces, Slots},
    node::Child,
    outline::Silhouette,
    project::{Corners, FlatTriangles},
    silhouette::Lists,
    sweep::ReadyBlock,
};
use linelit_geometry::DVec3;

/// Working memory and work counters of one thread's queries.
#[derive(Debug, Default)]
pub struct Scratch {
    /// What the queries through this scratch have done so far.
    pub counters: Counters,
    /// Nodes still to visit, by their index.
    pub(crate) stack: Vec<u32>,
    /// Which of eight rays are to visit each.
    pub(crate) masks: Vec<u8>,
    /// Nodes and leaves still to visit and where the ray enters them.
    pub(crate) near_stack: Vec<(Child, f32)>,
    /// The same for eight rays: where the first of them enters, and which of them do.
    pub(crate) group_stack: Vec<(Child, f32, u8)>,
    /// Triangles that may have holes, by leaf × 8 + lane.
    pub(crate) found: Vec<u32>,
    /// What is asked of triangles with holes.
    pub(crate) holes: Option<Box<HolesScratch>>,
    /// Where the latest ray that met anything began, and the leaf of what it met.
    pub(crate) last: Option<(DVec3, Child)>,
    /// Rays that are traced together.
    pub(crate) fan: Box<Directions>,
    /// The latest light.
    pub(crate) light: Light,
    /// The light as seen from the shading point.
    pub(crate) frame: LightFrame,
    /// Triangles in the shaft.
    pub(crate) corners: Box<Corners>,
    /// Their images on the light's plane.
    pub(crate) flat: FlatTriangles,
    /// The same for lines of one direction.
    pub(crate) ready: Vec<ReadyBlock>,
    /// Closed meshes that need half their triangles only.
    pub(crate) clear_of: ClearOfMesh,
    /// The lines of one direction.
    pub(crate) lines: Lines,
    /// What is hidden of each.
    pub(crate) slots_per_line: Slots,
    /// Where lines are on the light, in the caller's order.
    pub(crate) ends: Ends,
    /// Visible pieces of eight lines.
    pub(crate) pieces: Pieces,
    /// Boxes of a dense shaft still to visit.
    pub(crate) waiting: Vec<Waiting>,
    /// Leaves that hide much of it.
    pub(crate) cover: Vec<Child>,
    /// Which parts of a dense shaft's lines are known to be hidden.
    pub(crate) covered: Covered,
    /// Where a dense shaft's lines cross silhouettes.
    pub(crate) crossings: Crossings,
    /// What the search for silhouettes goes through.
    pub(crate) lists: Lists,
    /// What is known of a dense shaft's cells.
    pub(crate) front: Front,
    /// The silhouettes before the light.
    pub(crate) silhouettes: Vec<Silhouette>,
    /// Boxes still to visit for them.
    pub(crate) front_waiting: Vec<front::Waiting>,
}

impl Scratch {
    /// Empty buffers.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets which triangles met the latest ray: rays from the same point try those first.
    ///
    /// Answers are the same with and without it. [`Scratch::counters`] are not: called before each
    /// estimate, they depend on that estimate alone, and not on what the thread did before.
    pub const fn forget_latest(&mut self) {
        self.last = None;
    }
}

impl Default for LightFrame {
    fn default() -> Self {
        Self::NONE
    }
}

impl Default for Light {
    fn default() -> Self {
        Self::NONE
    }
}

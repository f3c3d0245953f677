//! [`Counters`] of the work that queries do, as in Table 1 of Billen & Dutré.

use std::ops::AddAssign;

/// The work that the queries through one `Scratch` have done.
///
/// Testing one child of one node counts as one box test, testing one triangle of one leaf as one
/// triangle test, so that the figures can be compared with those of a tracer that tests one at a
/// time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Shadow and camera rays.
    pub rays: u64,
    /// Shafts set up: one per shading point and light.
    pub shafts: u64,
    /// Shafts that no triangle enters.
    pub empty_shafts: u64,
    /// Shafts whose light is hidden from the shading point as a whole.
    pub blocked_shafts: u64,
    /// Shafts whose light occluders hide in part.
    pub partial_shafts: u64,
    /// Shafts that were dense: too many triangles were found to store them, and lines walked the
    /// hierarchy themselves.
    pub dense_shafts: u64,
    /// Line samples whose visible part was queried.
    pub line_queries: u64,
    /// Points of a light tested against a shaft's candidates.
    pub shaft_points: u64,
    /// Bounding boxes tested.
    pub node_tests: u64,
    /// Triangles tested.
    pub triangle_tests: u64,
    /// Triangles found inside shafts, plus crossings of lines with the silhouettes of fine meshes.
    pub candidates: u64,
    /// Visible intervals returned.
    pub intervals: u64,
    /// Calls of filters, by rays and by lines that cross a triangle with holes.
    pub filtered: u64,
}

impl AddAssign for Counters {
    fn add_assign(&mut self, o: Self) {
        self.rays += o.rays;
        self.shafts += o.shafts;
        self.empty_shafts += o.empty_shafts;
        self.blocked_shafts += o.blocked_shafts;
        self.partial_shafts += o.partial_shafts;
        self.dense_shafts += o.dense_shafts;
        self.line_queries += o.line_queries;
        self.shaft_points += o.shaft_points;
        self.node_tests += o.node_tests;
        self.triangle_tests += o.triangle_tests;
        self.candidates += o.candidates;
        self.intervals += o.intervals;
        self.filtered += o.filtered;
    }
}

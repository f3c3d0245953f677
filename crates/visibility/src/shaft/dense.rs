//! Dense shafts, with more triangles between a point and a light than are stored, up to thousands.
//! This module finds the visible parts of their lines.
//!
//! A few neighbouring lines share a walk from front to back. Along each line, 64 bins record what
//! is surely hidden ([`bins`](crate::shaft::bins)); a box whose projection onto the light lies
//! between the lines, or only on hidden bins, is skipped with everything in it. Fine meshes are
//! left out of that walk, and what they hide is found by their silhouettes afterwards.

use crate::{
    bvh::Bvh,
    counters::Counters,
    node::Child,
    shaft::{
        bins::{Covered, Image, Images},
        cover::{Cover, Image as _, front_to_back, take_in},
        frame::LightFrame,
        project::FlatTriangles,
        seen::ShaftState,
        sweep::LineScratch,
    },
    silhouettes::{
        crossings::{Crossings, OfLines},
        silhouette::{Lists, Search},
    },
    walk::Waiting,
};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};

/// Buffers for the lines of a dense shaft.
#[derive(Debug, Default)]
pub(crate) struct DenseScratch {
    /// The nodes and leaves still to visit.
    waiting: Waiting<Image>,
    /// The leaves that hide much of the light, which are visited first.
    pub(crate) cover: Vec<Child>,
    /// The parts of the lines that are known to be hidden.
    covered: Covered,
    /// The crossings of the lines and silhouettes.
    pub(crate) crossings: Crossings,
    /// Buffers of the search for silhouettes.
    lists: Lists,
}

/// A few lines as the cover of a walk: which parts of them are hidden.
struct OfFew<'a> {
    covered: &'a mut Covered,
    lines: &'a mut LineScratch,
    /// The number of triangles, or of pieces of clipped triangles, that were recorded.
    candidates: u64,
}

impl<S: Simd> Cover<S> for OfFew<'_> {
    type Image = Image;
    const SEPARATE: bool = false;

    #[inline(always)]
    fn needs(&self, s: S, image: &Image) -> bool {
        self.covered.needs(s, image)
    }

    #[inline(always)]
    fn needs_any(&self, s: S, _: u8, images: &Images) -> u8 {
        self.covered.needs_any(s, images)
    }

    #[inline(always)]
    fn record(&mut self, s: S, flat: &mut FlatTriangles, _: usize) -> bool {
        let count = flat.count;
        self.candidates += count as u64;
        self.lines.sweep(s, flat);
        flat.clear();
        let LineScratch { lines, slots, .. } = &mut *self.lines;
        count == 0 || !self.covered.record(s, lines, slots)
    }
}

/// A query for the hidden parts of a few lines on a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DenseQuery {
    /// The box around the lines, in the hierarchy's coordinates.
    pub(crate) around: [DVec3; 2],
    /// The frame of the lines' coordinates.
    pub(crate) frame: LightFrame,
    /// The excluded triangles: the index of the first, and how many.
    pub(crate) exclude: (u32, u32),
    /// Whether fine surfaces are handled by their silhouettes.
    pub(crate) silhouettes: bool,
}

/// How much the walk of a dense shaft has found about the visibility of its lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answered {
    /// There is no answer, since the shaft has no [bounds](crate::shaft::bounds::ShaftBounds::new).
    Nothing,
    /// All lines are hidden as a whole.
    Hidden,
    /// The hidden parts of all lines are known.
    All,
    /// The hidden parts are known except in gaps; a ray has to decide whether each gap is visible.
    ByRays,
}

/// Finds the hidden parts of the few lines in `lines`, in the coordinates of their frame.
#[inline(always)]
fn dense_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    query: &DenseQuery,
    seen: &mut ShaftState,
    lines: &mut LineScratch,
    scratch: &mut DenseScratch,
    counters: &mut Counters,
) -> Answered {
    seen.flat.clear();
    let few = Some((&query.frame, query.around));
    let Some(mut look) = seen.look(s, bvh, query.exclude, few) else {
        return Answered::Nothing;
    };
    let look = &mut look;
    let hierarchy = &*bvh.hierarchy;
    let surfaces = Some(&hierarchy.surfaces).filter(|_| query.silhouettes);
    let DenseScratch {
        waiting,
        cover,
        covered,
        crossings,
        lists,
    } = scratch;
    // Start with the root, and in front of it the leaves that are known to hide much.
    lines.slots.reset(lines.lines.count);
    covered.start(s, &lines.lines);
    waiting.clear();
    let entry = |child| (child, 0.0, Image::ALL);
    waiting.push(entry(Child::node(0)));
    waiting.extend(cover.drain(..).map(entry));
    let mut few = OfFew {
        covered,
        lines,
        candidates: 0,
    };
    // First all triangles except fine surfaces, from front to back; then the triangles of surfaces
    // that have to be clipped, with the silhouettes of the others.
    let mut is_open = front_to_back(s, bvh, look, &mut few, surfaces, waiting, counters);
    if is_open && surfaces.is_some() {
        let search = Search::new(hierarchy, bvh.extent, &look.bounds, look.frame, look.point);
        let mut target = OfLines::new(few.covered, &few.lines.lines, crossings);
        search.walk(s, &mut target, lists, counters);
        counters.candidates += crossings.count() as u64;
        while is_open && let Some((leaf, which)) = lists.cut.pop() {
            let child = Child::leaf(leaf as usize, 8);
            look.keep(s, child, &hierarchy.leaves[leaf as usize], which);
            is_open = take_in(s, look, &mut few, false);
        }
        is_open = is_open && take_in(s, look, &mut few, true);
    }
    counters.candidates += few.candidates;
    if !is_open {
        return Answered::Hidden;
    }
    if surfaces.is_none() {
        return Answered::All;
    }
    // Cut the gaps that are still open at the silhouettes.
    let LineScratch { lines, slots, .. } = lines;
    crossings.cut_lines(lines, slots);
    Answered::ByRays
}

dispatch! {
    /// [`dense_kernel`] on an instruction set.
    pub(crate) fn dense = dense_kernel(bvh: &Bvh, query: &DenseQuery, seen: &mut ShaftState, lines: &mut LineScratch, scratch: &mut DenseScratch, counters: &mut Counters) -> Answered
}

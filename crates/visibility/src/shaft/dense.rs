//! Dense shafts: thousands of triangles between a point and a light.
//!
//! Their lines are answered a few neighbours at a time, each few by a walk of its own from front
//! to back. Along each line, 64 bins record what is hidden for sure; a box whose image lies
//! between the lines, or only on hidden bins, is skipped with all that is in it.

use crate::{
    bvh::Bvh,
    counters::Counters,
    node::Child,
    shaft::{
        bins::{Covered, Image, Images},
        cover::{Cover, Image as _, front_to_back, take_in},
        frame::LightFrame,
        project::FlatTriangles,
        seen::Seen,
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

/// Buffers for the few lines of a dense shaft.
#[derive(Debug, Default)]
pub(crate) struct DenseScratch {
    /// Boxes still to visit.
    waiting: Waiting<Image>,
    /// Leaves that hide much of it.
    pub(crate) cover: Vec<Child>,
    /// The parts of the lines that are known to be hidden.
    covered: Covered,
    /// The crossings of the lines and silhouettes.
    pub(crate) crossings: Crossings,
    /// Buffers of the search for silhouettes.
    lists: Lists,
}

/// The part of a few lines that is hidden.
struct OfFew<'a> {
    covered: &'a mut Covered,
    lines: &'a mut LineScratch,
    /// Triangles and pieces of them taken in.
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

/// A question about a few lines on a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DenseQuery {
    /// The box around them, in the hierarchy's coordinates.
    pub(crate) around: [DVec3; 2],
    /// The frame of the lines.
    pub(crate) frame: LightFrame,
    /// Excluded triangles: first and number.
    pub(crate) exclude: (u32, u32),
    /// Whether fine surfaces are looked at by their silhouettes.
    pub(crate) silhouettes: bool,
}

/// The state of the answer to the lines of a dense shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answered {
    /// No answer: there are no [bounds](crate::shaft::bounds::ShaftBounds::new).
    Nothing,
    /// All of them are hidden as a whole.
    Hidden,
    /// The hidden parts of them are known.
    All,
    /// A ray for each of the crossings' gaps tells what is hidden of that, too.
    ByRays,
}

/// Finds what hides the few lines in `lines`, in the coordinates of their frame.
#[inline(always)]
fn dense_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    query: &DenseQuery,
    seen: &mut Seen,
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
    // All triangles but those of surfaces, from front to back; then those that have to be cut.
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
    let LineScratch { lines, slots, .. } = lines;
    crossings.cut_lines(lines, slots);
    Answered::ByRays
}

dispatch! {
    /// Finds what hides the few lines of a dense shaft, on an instruction set.
    pub(crate) fn dense = dense_kernel(bvh: &Bvh, query: &DenseQuery, seen: &mut Seen, lines: &mut LineScratch, scratch: &mut DenseScratch, counters: &mut Counters) -> Answered
}

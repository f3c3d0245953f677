//! Dense shafts: thousands of triangles between a point and a light.
//!
//! Their lines are answered a few neighbours at a time, each few by a walk of its own from front
//! to back. Along each line, 64 bins record what is hidden for sure; a box whose image lies
//! between the lines, or only on hidden bins, is skipped with all that is in it. What is skipped
//! lies within what is hidden, so the visible pieces do not change by a bit.

use crate::{
    Occluders, Scratch, VisibleLines,
    block::Lines,
    bounds::ShaftBounds,
    closed_mesh::BackfaceFilter,
    crossings::OfLines,
    frame::LightFrame,
    merge::{self, Slots},
    node::{self, Child, Leaf, Node},
    project::{self, Corners},
    silhouette::Search,
    surfaces::NONE,
    sweep::{self, Lanes},
};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};

/// Most lines that share a walk.
pub(crate) const GROUP: usize = 8;

/// A line with this many intervals more than when they were last has them united, so that bins know
/// what they hide together. `docs/decisions/010-dense-shafts.md`.
const CROWDED: usize = 9;

/// Blocks of eight lines.
const BLOCKS: usize = GROUP / 8;

/// Where something may hide something: its image's bounds across, and the bins that it touches.
#[derive(Clone, Copy, Debug)]
struct Image {
    low: f32,
    high: f32,
    bins: u64,
}

impl Image {
    /// Everywhere.
    const ALL: Self = Self {
        low: f32::NEG_INFINITY,
        high: f32::INFINITY,
        bins: u64::MAX,
    };
}

/// A node or leaf still to visit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    child: Child,
    image: Image,
}

/// The images of eight boxes or triangles.
pub(crate) struct Images {
    low: Lanes<[f32; 8]>,
    high: Lanes<[f32; 8]>,
    bins: Lanes<[u64; 8]>,
}

impl Images {
    /// From bounds of p and of q.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(s: S, low: [S::F; 2], high: [S::F; 2]) -> Self {
        // Adding 2²³ rounds to an integer; less a half, that is at most one too low for a whole
        // number.
        let (zero, end) = (s.splat(0.0), s.splat(63.0));
        let half = s.splat(-0.5);
        let base = s.splat(8_388_608.0);
        let first = s.fma(low[1], s.splat(64.0), half);
        let first = s.min(s.max(first, zero), end) + base;
        let last = s.fma(high[1], s.splat(64.0), half);
        let last = s.min(s.max(last, zero), end) + base;
        let mut images = Self {
            low: Lanes([0.0; 8]),
            high: Lanes([0.0; 8]),
            bins: Lanes([0; 8]),
        };
        s.store(low[0], &mut images.low);
        s.store(high[0], &mut images.high);
        s.bin_masks(first, last, &mut images.bins);
        images
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Image {
        Image {
            low: self.low[lane],
            high: self.high[lane],
            bins: self.bins[lane],
        }
    }
}

/// Bins along the lines of a walk.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Covered {
    /// A bit for each bin that is not known to be hidden.
    open: [[u64; 8]; BLOCKS],
    /// Where the lines are across, at least and at most: rounded outward.
    low: [[f32; 8]; BLOCKS],
    high: [[f32; 8]; BLOCKS],
    /// How many of a line's kept intervals are recorded.
    recorded: [[u32; 8]; BLOCKS],
    /// From how many on they are united.
    crowded: [usize; BLOCKS],
    /// Blocks in use.
    blocks: usize,
}

/// The first `n` bins.
#[inline(always)]
fn first_bins(n: u64) -> u64 {
    if n >= 64 { u64::MAX } else { (1 << n) - 1 }
}

/// The bins that lie wholly inside an interval of q; a whole one may be missed.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn filled(low: f64, high: f64) -> u64 {
    let first = (low * 64.0).ceil().clamp(0.0, 64.0) as u64;
    let end = (high * 64.0).floor().clamp(0.0, 64.0) as u64;
    first_bins(end) & !first_bins(first)
}

impl Covered {
    /// Nothing hidden but what lies beyond the lines' ends.
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward")]
    fn start(&mut self, lines: &Lines) {
        self.blocks = lines.blocks.len();
        self.open = [[0; 8]; BLOCKS];
        self.recorded = [[0; 8]; BLOCKS];
        self.crowded = [CROWDED; BLOCKS];
        self.low = [[f32::INFINITY; 8]; BLOCKS];
        self.high = [[f32::NEG_INFINITY; 8]; BLOCKS];
        for line in 0..lines.count.min(GROUP) {
            let (k, lane) = (line / 8, line % 8);
            let block = &lines.blocks[k];
            // Across is −p.
            let p = -block.u[lane];
            self.low[k][lane] = (p as f32).next_down();
            self.high[k][lane] = (p as f32).next_up();
            self.open[k][lane] = !(filled(-1.0, block.from[lane]) | filled(block.to[lane], 2.0));
        }
    }

    /// Whether what has this image can hide anything that is not hidden yet.
    #[inline(always)]
    fn needs<S: Simd>(&self, s: S, image: &Image) -> bool {
        let mut needed = 0;
        for k in 0..self.blocks.min(BLOCKS) {
            needed |= s.le(s.splat(image.low), s.load(&self.high[k]))
                & s.le(s.load(&self.low[k]), s.splat(image.high))
                & s.intersects(&self.open[k], image.bins);
        }
        needed != 0
    }

    /// The same for eight images: a bit each.
    #[inline(always)]
    pub(crate) fn needs_any<S: Simd>(&self, s: S, images: &Images) -> u8 {
        let (low, high) = (s.load(&images.low), s.load(&images.high));
        let mut needed = 0;
        for k in 0..self.blocks.min(BLOCKS) {
            for line in 0..8 {
                needed |= s.le(low, s.splat(self.high[k][line]))
                    & s.le(s.splat(self.low[k][line]), high)
                    & s.intersects(&images.bins, self.open[k][line]);
            }
        }
        needed
    }

    /// Records what is known to be hidden of the lines; true if they are as a whole.
    #[inline(always)]
    fn record<S: Simd>(&mut self, s: S, lines: &mut Lines, slots: &mut Slots) -> bool {
        let mut open = 0;
        for (k, block) in lines.blocks.iter_mut().enumerate().take(BLOCKS) {
            if slots.most(k) >= self.crowded[k] {
                slots.unite(s, k, block);
                self.recorded[k] = [0; 8];
                self.crowded[k] = slots.most(k) + CROWDED;
            }
            self.hide(s, k, [s.dload(&block.run_lo), s.dload(&block.run_hi)]);
            let counts = slots.counts(k);
            let (mut first, mut end) = (u32::MAX, 0);
            for (recorded, count) in self.recorded[k].iter().zip(counts) {
                if recorded < count {
                    (first, end) = (first.min(*recorded), end.max(*count));
                }
            }
            for row in first..end {
                self.hide(s, k, slots.row(s, k, row));
            }
            self.recorded[k] = *counts;
            for bins in &self.open[k] {
                open |= bins;
            }
        }
        open == 0
    }

    /// Hides the bins that lie wholly inside an interval of each line of a block.
    #[inline(always)]
    fn hide<S: Simd>(&mut self, s: S, k: usize, [low, high]: [S::D; 2]) {
        // Adding 2⁵² rounds to an integer; half a bin inward, that is never too generous.
        let (zero, end) = (s.dsplat(0.0), s.dsplat(64.0));
        let (half, one) = (s.dsplat(0.5), s.dsplat(1.0));
        let base = s.dsplat(4_503_599_627_370_496.0);
        let first = low * end + half;
        let first = s.dmin(s.dmax(first, zero), end) + base;
        let last = high * end - half;
        let last = s.dmin(s.dmax(last, zero), end) + base;
        // From the first to the one before the last; none if that is none.
        let some = s.dlt(first, last);
        let first = s.select(some, one, first - base);
        let last = s.select(some, zero, last - base - one);
        let base = s.dsplat(8_388_608.0);
        let mut bins = Lanes([0; 8]);
        let (first, last) = (first + base, last + base);
        s.bin_masks(s.narrow(first), s.narrow(last), &mut bins);
        for (open, bins) in self.open[k].iter_mut().zip(&bins.0) {
            *open &= !bins;
        }
    }
}

/// Puts the boxes of a node that the shaft may meet on the stack, the nearest on top, and tells
/// which they are.
#[inline(always)]
fn push_boxes<S: Simd>(
    s: S,
    bounds: &ShaftBounds,
    node: &Node,
    found: u8,
    covered: &Covered,
    stack: &mut Vec<Waiting>,
) -> u8 {
    let (least, most) = bounds.extents(s, node);
    let [low, high] = ShaftBounds::images(s, &least, &most);
    let images = Images::new(s, low, high);
    let before = s.lt(s.splat(1e-6), least[2]);
    let needed = found & (!before | covered.needs_any(s, &images));
    for lane in node::deepest_first(s, least[2], needed) {
        let image = if before >> lane & 1 != 0 {
            images.get(lane)
        } else {
            Image::ALL
        };
        stack.push(Waiting {
            child: Child(node.child[lane]),
            image,
        });
    }
    needed
}

/// Keeps those triangles of a leaf whose image crosses a line where that is not hidden yet.
#[inline(always)]
fn push_triangles<S: Simd>(
    s: S,
    bounds: &ShaftBounds,
    leaf: &Leaf,
    (child, mask): (Child, u8),
    covered: &Covered,
    corners: &mut Corners,
    backfaces: &BackfaceFilter<'_>,
) {
    let vertices = bounds.vertices(s, leaf);
    let (before, inside, low, high) = bounds.triangle_images(s, &vertices);
    let images = Images::new(s, low, high);
    let mut needed = before & inside & covered.needs_any(s, &images) & mask;
    let behind = mask & !before;
    if behind != 0 {
        needed |= behind & bounds.within(s, &vertices);
    }
    needed &= bounds.included(s, leaf);
    if needed != 0 {
        let codes = backfaces.codes(child.index());
        let meshes = backfaces.any().then_some(&codes);
        corners.add(s, leaf, needed, &child.slots(), meshes);
    }
}

/// A shading point and a box around a few lines, in the hierarchy's coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DenseQuery {
    pub(crate) point: DVec3,
    pub(crate) lo: DVec3,
    pub(crate) hi: DVec3,
    /// Excluded triangles: first and number.
    pub(crate) exclude: (u32, u32),
    /// Whether fine surfaces are looked at by their silhouettes.
    pub(crate) silhouettes: bool,
}

/// How far the lines of a dense shaft are answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answered {
    /// Not at all: there are no [bounds](ShaftBounds::new).
    Nothing,
    /// They are hidden as a whole.
    Hidden,
    /// What is hidden of them is known.
    All,
    /// A ray for each of the crossings' gaps tells what is hidden of that, too.
    ByRays,
}

/// Finds what hides the few lines in `scratch.lines`, in the coordinates of `frame`.
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
fn dense_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    query: &DenseQuery,
    frame: &LightFrame,
    scratch: &mut Scratch,
) -> Answered {
    let Scratch {
        counters,
        corners,
        flat,
        ready,
        lines,
        slots_per_line,
        waiting: stack,
        covered,
        crossings,
        lists,
        clear_of,
        cover,
        ..
    } = scratch;
    let point = query.point;
    let around = [query.lo, query.hi];
    let bounds = ShaftBounds::new(s, occluders, point, around, frame, query.exclude);
    let Some(bounds) = &bounds else {
        return Answered::Nothing;
    };
    let hierarchy = &*occluders.hierarchy;
    let meshes = hierarchy.meshes();
    let backfaces = &mut BackfaceFilter::new(
        meshes,
        clear_of,
        point,
        around,
        frame.margins,
        query.exclude,
    );
    slots_per_line.reset(lines.count);
    covered.start(lines);
    corners.clear();
    lists.cut.clear();
    let surfaces = Some(&hierarchy.surfaces).filter(|_| query.silhouettes);
    stack.clear();
    stack.push(Waiting {
        child: Child::node(0),
        image: Image::ALL,
    });
    stack.extend(cover.drain(..).map(|child| Waiting {
        child,
        image: Image::ALL,
    }));
    // All triangles but those of surfaces, from front to back; then those that have to be cut.
    let mut looked_for = surfaces.is_none();
    loop {
        let next = stack.pop();
        if next.is_none() && corners.count == 0 && !looked_for {
            looked_for = true;
            let search = Search::new(hierarchy, occluders.extent, bounds, frame, point);
            let mut target = OfLines::new(covered, lines, crossings);
            search.walk(s, &mut target, lists, counters);
            counters.candidates += crossings.count() as u64;
        }
        let cut = if next.is_none() {
            lists.cut.pop()
        } else {
            None
        };
        if let Some((leaf, which)) = cut {
            let slots = Child::leaf(leaf as usize, 8).slots();
            let codes = backfaces.codes(leaf as usize);
            let leaf = &hierarchy.leaves[leaf as usize];
            corners.add(s, leaf, which, &slots, Some(&codes));
        }
        let is_last = next.is_none() && cut.is_none();
        if let Some(b) = &next {
            if !covered.needs(s, &b.image) {
                continue;
            }
            if b.child.is_leaf() {
                counters.triangle_tests += u64::from(b.child.count());
                let leaf = &hierarchy.leaves[b.child.index()];
                let mut mask = b.child.mask();
                if let Some(surfaces) = surfaces {
                    mask &= s.in_range(&surfaces.sides[b.child.index()][0], NONE, 1);
                }
                push_triangles(
                    s,
                    bounds,
                    leaf,
                    (b.child, mask),
                    covered,
                    corners,
                    backfaces,
                );
            } else {
                let node = &hierarchy.nodes[b.child.index()];
                counters.node_tests += u64::from(node.valid.count_ones());
                let mut found = bounds.boxes(s, node);
                if surfaces.is_some() {
                    found &= !node.all_fine;
                }
                let found = push_boxes(s, bounds, node, found, covered, stack);
                hierarchy.prefetch(s, node, found);
            }
        }
        // Eight triangles at a time, and what is left at the end.
        while corners.count >= 8 || (is_last && corners.count > 0) {
            let first = corners.count.saturating_sub(8);
            flat.clear();
            let left =
                project::project_some::<S, false>(s, corners, first, point, frame, flat, backfaces);
            corners.count = first;
            counters.candidates += flat.count as u64;
            if left.is_none() {
                // One triangle before all the lines: nothing is visible.
                return Answered::Hidden;
            }
            sweep::sweep_flat(s, flat, ready, lines, slots_per_line);
            if flat.count > 0 && covered.record(s, lines, slots_per_line) {
                return Answered::Hidden;
            }
        }
        if is_last && looked_for {
            break;
        }
    }
    if surfaces.is_none() {
        return Answered::All;
    }
    crossings.cut_lines(lines, slots_per_line);
    Answered::ByRays
}

/// Hands out the visible pieces of lines of which all that is hidden is known.
#[inline(always)]
fn finish_kernel<S: Simd>(s: S, scratch: &mut Scratch, out: &mut VisibleLines) {
    let Scratch {
        lines,
        slots_per_line,
        pieces,
        ..
    } = scratch;
    merge::finish(s, lines, slots_per_line, pieces, out);
}

dispatch! {
    /// Finds what hides the few lines of a dense shaft, on an instruction set.
    pub(crate) fn dense = dense_kernel(occluders: &Occluders, query: &DenseQuery, frame: &LightFrame, scratch: &mut Scratch) -> Answered
}
dispatch! {
    /// What is visible of the few lines of a dense shaft, on an instruction set.
    pub(crate) fn finish = finish_kernel(scratch: &mut Scratch, out: &mut VisibleLines) -> ()
}

//! Growing the binary tree from its root: triangles are split where the surface area heuristic
//! expects the least work.
//!
//! **Source**: Wald 2007, "On fast construction of SAH-based bounding volume hierarchies" (bins).
//! Few triangles are joined from their leaves instead ([`join`]). Time is n log n whatever the
//! input: a branch that gets deeper than four times the logarithm goes on by halving.

use super::{
    binary::{Binary, Bounds},
    index, reinsert,
};
use crate::pool;
use linelit_geometry::glam::{Vec3A, Vec3Swizzles, Vec4};

/// A triangle's box and number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    /// The fourth lane holds the bits of the number.
    lo: Vec4,
    hi: Vec4,
}

impl Reference {
    #[inline(always)]
    pub(super) fn new(bounds: &Bounds, id: u32) -> Self {
        let ([x, y, z], [u, v, w]) = (bounds.lo, bounds.hi);
        Self {
            lo: Vec4::new(x, y, z, f32::from_bits(id)),
            hi: Vec4::new(u, v, w, 0.0),
        }
    }

    fn id(&self) -> u32 {
        self.lo.w.to_bits()
    }

    /// Half of the middle: neither it nor the difference of two overflows.
    #[inline(always)]
    fn middle(&self) -> Vec4 {
        self.lo * 0.25 + self.hi * 0.25
    }
}

/// Bins along each axis.
const BINS: usize = 16;

/// Most triangles of which every split along the axes is tried.
const FEW: usize = 16;

/// Triangles that are enough to choose a split by: of more, every second, third… is looked at.
const SAMPLE: usize = 1 << 8;

/// Triangles of a subtree that is grown and improved in one piece, in the caches of one core.
pub(super) const BLOCK: usize = 1 << 16;

/// Triangles whose subtree is worth another thread.
const WORTH_SHARING: usize = 1 << 12;

/// The tree over some triangles, which it reorders; node 0 is the root.
pub(super) fn grow(references: &mut [Reference]) -> Vec<Binary> {
    let count = references.len();
    let mut nodes = vec![Binary::EMPTY; (2 * count).saturating_sub(1)];
    let levels = 4 * (usize::BITS - count.leading_zeros());
    let unit = unit(references);
    if let Some((root, rest)) = nodes.split_first_mut() {
        branch::<true>(
            references,
            root,
            rest,
            Place {
                at: 1,
                levels,
                unit,
            },
        );
    }
    if count > BLOCK {
        reinsert::improve_top(&mut nodes);
    }
    nodes
}

/// The power of two that brings coordinates near one, so that squares are within `f32`.
fn unit(references: &[Reference]) -> f32 {
    let extent = Extent::of(references);
    let largest = extent.lo.abs().max(extent.hi.abs());
    let exponent = largest.truncate().max_element().to_bits() >> 23;
    f32::from_bits(254_u32.saturating_sub(exponent).clamp(1, 254) << 23)
}

/// Where a subtree goes.
#[derive(Clone, Copy)]
struct Place {
    /// The number of the first node.
    at: usize,
    /// Levels after which it goes on by halving.
    levels: u32,
    unit: f32,
}

/// Grows what is below `root` into `nodes`. `BLOCKS`: in blocks, which are improved.
fn branch<const BLOCKS: bool>(
    references: &mut [Reference],
    root: &mut Binary,
    nodes: &mut [Binary],
    place: Place,
) {
    if BLOCKS && references.len() <= BLOCK {
        return block(references, root, nodes, place);
    }
    let extent = Extent::of(references);
    root.bounds = extent.bounds();
    if let [one] = references {
        root.first = one.id();
        root.tag = Binary::LEAF;
        return;
    }
    let middle = match references.len() {
        2 => 1,
        _ if place.levels == 0 => halve(references, &extent),
        few if few <= FEW => by_all(references, place.unit),
        _ => by_bins(references, &extent, place.unit),
    };
    root.first = index(place.at);
    root.tag = 0;
    let (left, right) = references.split_at_mut(middle);
    let (pair, rest) = nodes.split_at_mut(2);
    let (below_left, below_right) = rest.split_at_mut(2 * (left.len() - 1));
    let (first, second) = pair.split_at_mut(1);
    let below = |at: usize| Place {
        at,
        levels: place.levels.saturating_sub(1),
        ..place
    };
    let at_left = below(place.at + 2);
    let at_right = below(place.at + 2 + below_left.len());
    let share = left.len() + right.len() >= WORTH_SHARING;
    let mut left = || branch::<BLOCKS>(left, &mut first[0], below_left, at_left);
    let mut right = || branch::<BLOCKS>(right, &mut second[0], below_right, at_right);
    if share {
        pool::join(left, right);
    } else {
        left();
        right();
    }
}

/// Grows a subtree by itself, improves it and puts it in its place.
fn block(references: &mut [Reference], root: &mut Binary, nodes: &mut [Binary], place: Place) {
    let mut own = vec![Binary::EMPTY; nodes.len() + 1];
    if let Some((own_root, rest)) = own.split_first_mut() {
        branch::<false>(references, own_root, rest, Place { at: 1, ..place });
    }
    reinsert::improve(&mut own);
    for node in &mut own {
        if !node.is_leaf() {
            node.first += index(place.at) - 1;
        }
    }
    *root = own[0];
    nodes.copy_from_slice(&own[1..]);
}

/// The box of some triangles and that of their [`Reference::middle`]s; fourth lanes mean nothing.
struct Extent {
    lo: Vec4,
    hi: Vec4,
    middle_lo: Vec4,
    middle_hi: Vec4,
}

impl Extent {
    fn of(references: &[Reference]) -> Self {
        let (lo, hi) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        let mut extent = Self {
            lo,
            hi,
            middle_lo: lo,
            middle_hi: hi,
        };
        for r in references {
            let middle = r.middle();
            extent.lo = extent.lo.min(r.lo);
            extent.hi = extent.hi.max(r.hi);
            extent.middle_lo = extent.middle_lo.min(middle);
            extent.middle_hi = extent.middle_hi.max(middle);
        }
        extent
    }

    fn bounds(&self) -> Bounds {
        Bounds {
            lo: self.lo.truncate().to_array(),
            hi: self.hi.truncate().to_array(),
        }
    }
}

/// Half of a box's surface in units.
#[inline(always)]
fn half_area(lo: Vec4, hi: Vec4, unit: f32) -> f32 {
    let d = Vec3A::from_vec4(hi * unit - lo * unit);
    d.dot(d.yzx())
}

/// Two halves along the axis on which the triangles are spread most.
fn halve(references: &mut [Reference], extent: &Extent) -> usize {
    let spread = (extent.middle_hi - extent.middle_lo).truncate();
    let axis = spread.max_position();
    let middle = references.len() / 2;
    references.select_nth_unstable_by(middle, |a, b| {
        let (x, y) = (a.middle()[axis], b.middle()[axis]);
        x.total_cmp(&y).then(a.id().cmp(&b.id()))
    });
    middle
}

/// What a split is judged by: the expected work, and among equals the larger part.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Judged {
    cost: f32,
    larger: usize,
}

impl Judged {
    const WORST: Self = Self {
        cost: f32::INFINITY,
        larger: usize::MAX,
    };

    /// Of areas and numbers; nothing is less than an empty part, whose area is no number or
    /// infinite.
    #[inline(always)]
    fn new(left: (f32, usize), right: (f32, usize)) -> Self {
        #[allow(clippy::cast_precision_loss, reason = "a heuristic")]
        let part = |(area, count): (f32, usize)| area * count as f32;
        Self {
            cost: part(left) + part(right),
            larger: left.1.max(right.1),
        }
    }
}

/// The best split of a few triangles along an axis, which they are put in the order of.
fn by_all(references: &mut [Reference], unit: f32) -> usize {
    const MASK: u32 = 15;
    const { assert!(FEW == MASK as usize + 1) };
    let count = references.len().min(FEW);
    let mut own = [references[0]; FEW];
    own[..count].copy_from_slice(references);
    let mut best = (Judged::WORST, count / 2);
    let mut best_order = [0; FEW];
    for (k, place) in (0..).zip(&mut best_order) {
        *place = k;
    }
    for axis in 0..3 {
        // In the last bits which of the triangles it is.
        let mut order = [0_u32; FEW];
        for ((k, key), r) in (0..).zip(&mut order).zip(&*references) {
            *key = ascending(r.middle()[axis]) & !MASK | k;
        }
        order[..count].sort_unstable();
        let nth = |k: usize| &own[(order[k] & MASK) as usize];
        let mut behind = [0.0; FEW];
        let (mut lo, mut hi) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        for k in (1..count).rev() {
            lo = lo.min(nth(k).lo);
            hi = hi.max(nth(k).hi);
            behind[k] = half_area(lo, hi, unit);
        }
        let (mut lo, mut hi) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        let mut found = false;
        for (k, behind) in behind[..count].iter().enumerate().skip(1) {
            lo = lo.min(nth(k - 1).lo);
            hi = hi.max(nth(k - 1).hi);
            let judged = Judged::new((half_area(lo, hi, unit), k), (*behind, count - k));
            if judged < best.0 {
                best = (judged, k);
                found = true;
            }
        }
        if found {
            best_order = order;
        }
    }
    for (r, key) in references.iter_mut().zip(best_order) {
        *r = own[(key & MASK) as usize];
    }
    best.1
}

/// Bits in the order of the numbers that they stand for.
#[inline(always)]
fn ascending(x: f32) -> u32 {
    let bits = x.to_bits();
    bits ^ if bits >> 31 == 0 { 1 << 31 } else { u32::MAX }
}

/// Which bins a middle is in.
#[derive(Clone, Copy)]
struct Binning {
    lo: Vec4,
    scale: Vec4,
}

impl Binning {
    /// Bins of almost no width take all into the first.
    fn new(extent: &Extent) -> Self {
        let width = (extent.middle_hi - extent.middle_lo).max(Vec4::splat(f32::MIN_POSITIVE));
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let scale = Vec4::splat(BINS as f32 - 0.01) / width;
        Self {
            lo: extent.middle_lo,
            scale,
        }
    }

    /// The bins along all axes. Whole numbers, the nearest, are what is left beside 1.5 · 2²³.
    #[inline(always)]
    fn bins(self, middle: Vec4) -> [usize; 3] {
        let place = ((middle - self.lo) * self.scale - 0.5) + 12_582_912.0;
        let [x, y, z, _] = place.to_array();
        [x, y, z].map(|x| x.to_bits() as usize % BINS)
    }

    #[inline(always)]
    fn bin(self, middle: Vec4, axis: usize) -> usize {
        self.bins(middle)[axis]
    }
}

/// The boxes and numbers of the triangles in the bins of an axis.
#[derive(Clone, Copy)]
struct Bins {
    boxes: [(Vec4, Vec4); BINS],
    counts: [usize; BINS],
}

/// The best split between bins, or else halves; the triangles of the left part stand first
/// afterwards.
fn by_bins(references: &mut [Reference], extent: &Extent, unit: f32) -> usize {
    let binning = Binning::new(extent);
    let empty = (Vec4::INFINITY, Vec4::NEG_INFINITY);
    let mut bins = [Bins {
        boxes: [empty; BINS],
        counts: [0; BINS],
    }; 3];
    for r in references.iter().step_by(1 + references.len() / SAMPLE) {
        for (bins, k) in bins.iter_mut().zip(binning.bins(r.middle())) {
            let (lo, hi) = &mut bins.boxes[k];
            *lo = lo.min(r.lo);
            *hi = hi.max(r.hi);
            bins.counts[k] += 1;
        }
    }
    let mut best = (Judged::WORST, 0, 0);
    for (axis, Bins { boxes, counts }) in bins.iter().enumerate() {
        let mut behind = [(0.0, 0); BINS];
        let ((mut lo, mut hi), mut count) = (empty, 0);
        for k in (1..BINS).rev() {
            lo = lo.min(boxes[k].0);
            hi = hi.max(boxes[k].1);
            count += counts[k];
            behind[k] = (half_area(lo, hi, unit), count);
        }
        let ((mut lo, mut hi), mut count) = (empty, 0);
        for k in 1..BINS {
            lo = lo.min(boxes[k - 1].0);
            hi = hi.max(boxes[k - 1].1);
            count += counts[k - 1];
            let judged = Judged::new((half_area(lo, hi, unit), count), behind[k]);
            if judged < best.0 {
                best = (judged, axis, k);
            }
        }
    }
    let (_, axis, first) = best;
    let middle = partition(references, |r| binning.bin(r.middle(), axis) < first);
    if middle == 0 || middle == references.len() {
        return halve(references, extent);
    }
    middle
}

/// Puts what is on the left first, and gives its number; without branches that nobody foresees.
fn partition(references: &mut [Reference], left: impl Fn(&Reference) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..references.len() {
        let is_left = left(&references[i]);
        references.swap(middle, i);
        middle += usize::from(is_left);
    }
    middle
}

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
use linelit_geometry::glam::{Vec3, Vec3A, Vec3Swizzles, Vec4};

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

    /// The tree of this one.
    fn node(&self) -> Binary {
        Binary {
            bounds: Bounds {
                lo: self.lo.truncate().to_array(),
                hi: self.hi.truncate().to_array(),
            },
            first: self.id(),
            tag: Binary::LEAF,
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

/// The tree over some triangles, which it reorders; node 0 is the root. `extent` is the largest
/// absolute coordinate.
pub(super) fn grow(references: &mut [Reference], extent: f32) -> Vec<Binary> {
    let count = references.len();
    let mut nodes = pool::collect((2 * count).saturating_sub(1), WORTH_SHARING, &|_| {
        Binary::EMPTY
    });
    let place = Place {
        at: 1,
        levels: 4 * (usize::BITS - count.leading_zeros()),
        unit: unit(extent),
    };
    if let Some((root, rest)) = nodes.split_first_mut() {
        branch::<true>(references, root, rest, place);
    }
    if count > BLOCK {
        reinsert::improve_top(&mut nodes);
    }
    nodes
}

/// The power of two that brings coordinates near one, so that squares are within `f32`.
fn unit(extent: f32) -> f32 {
    let exponent = extent.to_bits() >> 23;
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
    if let [one] = references {
        *root = one.node();
        return;
    }
    let extent = Extent::of(references);
    let middle = match references.len() {
        2 => 1,
        _ if place.levels == 0 => halve(references, &extent),
        few if few <= FEW => by_all(references, &extent, place.unit),
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
    root.bounds = pair[0].bounds.union(&pair[1].bounds);
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

/// Triangles to choose a split by.
fn sample(references: &[Reference]) -> impl Iterator<Item = &Reference> {
    references.iter().step_by(1 + references.len() / SAMPLE)
}

/// The box of the [`Reference::middle`]s of a [`sample`]; fourth lanes mean nothing.
struct Extent {
    lo: Vec4,
    hi: Vec4,
}

impl Extent {
    fn of(references: &[Reference]) -> Self {
        let mut extent = Self {
            lo: Vec4::INFINITY,
            hi: Vec4::NEG_INFINITY,
        };
        for middle in sample(references).map(Reference::middle) {
            extent.lo = extent.lo.min(middle);
            extent.hi = extent.hi.max(middle);
        }
        extent
    }

    fn spread(&self) -> Vec3 {
        (self.hi - self.lo).truncate()
    }

    /// The axes on which the triangles are spread at least half as much as on any.
    fn axes(&self) -> impl Iterator<Item = usize> {
        let spread = self.spread();
        (0..3).filter(move |axis| spread[*axis] >= 0.5 * spread.max_element())
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
    let axis = extent.spread().max_position();
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
fn by_all(references: &mut [Reference], extent: &Extent, unit: f32) -> usize {
    const MASK: u32 = (1 << FEW.ilog2()) - 1;
    const { assert!(FEW.is_power_of_two()) };
    let count = references.len().min(FEW);
    let mut own = [references[0]; FEW];
    own[..count].copy_from_slice(references);
    let mut best = (Judged::WORST, count / 2);
    let mut best_order = [0; FEW];
    for (k, place) in (0..).zip(&mut best_order) {
        *place = k;
    }
    for axis in extent.axes() {
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

/// 1.5 · 2²³: beside it the nearest whole number is left, as last bits.
const WHOLE: f32 = 1.5 * (1_u32 << 23) as f32;

/// Which bins a middle is in.
#[derive(Clone, Copy)]
struct Binning {
    lo: Vec4,
    scale: Vec4,
}

impl Binning {
    /// Bins of almost no width take all into the first.
    fn new(extent: &Extent) -> Self {
        let width = (extent.hi - extent.lo).max(Vec4::splat(f32::MIN_POSITIVE));
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let scale = Vec4::splat(BINS as f32 - 0.01) / width;
        Self {
            lo: extent.lo,
            scale,
        }
    }

    /// The bins along all axes of what is within the extent.
    #[inline(always)]
    fn bins(self, middle: Vec4) -> [usize; 3] {
        let place = ((middle - self.lo) * self.scale - 0.5) + WHOLE;
        let [x, y, z, _] = place.to_array();
        [x, y, z].map(|x| x.to_bits() as usize % BINS)
    }

    /// Puts what is in the first bins of an axis first, and gives its number.
    fn partition<const AXIS: usize>(self, references: &mut [Reference], first: usize) -> usize {
        let lane = |v: Vec4| v.to_array()[AXIS];
        let (lo, scale) = (lane(self.lo), lane(self.scale));
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let end = WHOLE + first as f32;
        partition(references, |r| {
            let middle = lane(r.lo) * 0.25 + lane(r.hi) * 0.25;
            ((middle - lo) * scale - 0.5) + WHOLE < end
        })
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
    for r in sample(references) {
        for (bins, k) in bins.iter_mut().zip(binning.bins(r.middle())) {
            let (lo, hi) = &mut bins.boxes[k];
            *lo = lo.min(r.lo);
            *hi = hi.max(r.hi);
            bins.counts[k] += 1;
        }
    }
    let mut best = (Judged::WORST, 0, 0);
    for axis in extent.axes() {
        let Bins { boxes, counts } = &bins[axis];
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
    let middle = match axis {
        0 => binning.partition::<0>(references, first),
        1 => binning.partition::<1>(references, first),
        _ => binning.partition::<2>(references, first),
    };
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

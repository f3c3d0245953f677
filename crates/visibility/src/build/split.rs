//! Growing of the binary tree from its root: triangles are split where the surface area heuristic
//! expects the least work.
//!
//! Large sets are split between bins of the centres of the triangles' boxes, sets of up to 16 at
//! the best of all positions along the axes. The time is n log n for any input: a branch that
//! becomes deeper than four times the logarithm of the number of triangles is split into halves
//! from there on.
//!
//! **Source**: Wald 2007, "On fast construction of SAH-based bounding volume hierarchies" (bins).

use super::{
    binary::{Binary, Bounds},
    index, reinsert,
};
use crate::pool;
use linelit_geometry::glam::{Vec3, Vec3A, Vec3Swizzles, Vec4};
use linelit_geometry::stop;

/// A triangle's bounding box and its index, packed into two vectors of four lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    /// The lowest corner of the box, and `hi` the highest; the fourth lanes hold the lower and the
    /// upper bits of the index ([`lane`]).
    lo: Vec4,
    hi: Vec4,
}

/// Stores up to [`f32::MANTISSA_DIGITS`] − 1 bits as an `f32` of ordinary size, so that vector
/// operations on it, as a by-product of those on coordinates, run at full speed.
#[inline(always)]
fn lane(bits: u32) -> f32 {
    f32::from_bits(1.0_f32.to_bits() | bits)
}

impl Reference {
    /// The number of bits that a lane holds.
    const BITS: u32 = f32::MANTISSA_DIGITS - 1;
    const MASK: u32 = (1 << Self::BITS) - 1;

    #[inline(always)]
    pub(super) fn new(bounds: &Bounds, id: u32) -> Self {
        let ([x, y, z], [u, v, w]) = (bounds.lo, bounds.hi);
        Self {
            lo: Vec4::new(x, y, z, lane(id & Self::MASK)),
            hi: Vec4::new(u, v, w, lane(id >> Self::BITS)),
        }
    }

    /// Returns the leaf of the binary tree for this triangle.
    pub(super) fn node(&self) -> Binary {
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
        let [low, high] = [self.lo.w, self.hi.w].map(|lane| lane.to_bits() & Self::MASK);
        high << Self::BITS | low
    }

    /// Returns half of the centre of the box, so that neither the sum nor the difference of two of
    /// them overflows.
    #[inline(always)]
    fn middle(&self) -> Vec4 {
        self.lo * 0.25 + self.hi * 0.25
    }
}

/// The number of bins along each axis.
const BINS: usize = 16;

/// The largest number of triangles for which every split along the axes is tried.
const FEW: usize = BINS;

/// The number of triangles that are enough to choose a split; of larger sets only every second,
/// third… triangle is used.
const SAMPLE: usize = 1 << 8;

/// The largest number of triangles of a subtree that is grown and improved as a unit, in the caches
/// of one core.
pub(super) const BLOCK: usize = 1 << 16;

/// The number of triangles at which a subtree is large enough to be grown by another thread.
const WORTH_SHARING: usize = 1 << 12;

/// Grows the tree over some triangles, which it reorders; node 0 is the root. `extent` is the
/// largest absolute coordinate.
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

/// Returns the power of two that multiplies coordinates up to `extent` to be near one, so that
/// their squares are within the range of `f32`.
pub(super) fn unit(extent: f32) -> f32 {
    let exponent = extent.to_bits() >> 23;
    f32::from_bits(254_u32.saturating_sub(exponent).clamp(1, 254) << 23)
}

/// The position of a subtree in the list of nodes, and limits for growing it.
#[derive(Clone, Copy)]
struct Place {
    /// The index of the first node below the subtree's root.
    at: usize,
    /// The number of levels that may follow below the subtree's root before sets are only split
    /// into halves.
    levels: u32,
    unit: f32,
}

/// Grows the subtree below `root` into `nodes`. With `BLOCKS`, subtrees of up to [`BLOCK`]
/// triangles are grown and improved separately.
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
    // Choose a split, and reorder the triangles by it.
    let middle = match references.len() {
        2 => 1,
        _ if place.levels == 0 => halve(references),
        few if few <= FEW => by_all(references, place.unit),
        _ => by_bins(references, place.unit),
    };
    // Divide the memory for nodes: a pair of children, then all nodes below the left one, then
    // those below the right one.
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
    // Grow both subtrees, in parallel if they are large.
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

/// Grows a subtree separately, improves it, and copies it to its position.
fn block(references: &mut [Reference], root: &mut Binary, nodes: &mut [Binary], place: Place) {
    stop::check();
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

/// Returns the triangles that are used to choose a split: all of a small set, every second, third…
/// of a larger one.
fn sample(references: &[Reference]) -> impl Iterator<Item = &Reference> {
    references.iter().step_by(1 + references.len() / SAMPLE)
}

/// The bounding box of the [`Reference::middle`]s of a [`sample`]; its fourth lanes are
/// meaningless.
struct Extent {
    lo: Vec4,
    hi: Vec4,
}

impl Extent {
    /// Returns the bounding box of half the centres of a sample of the triangles' boxes.
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

    /// Returns the axes along which the triangles are spread at least half as much as along the
    /// widest axis.
    fn axes(&self) -> impl Iterator<Item = usize> {
        let spread = self.spread();
        (0..3).filter(move |axis| spread[*axis] >= 0.5 * spread.max_element())
    }
}

/// Returns half of a box's surface area, in units of `unit`⁻².
#[inline(always)]
fn half_area(lo: Vec4, hi: Vec4, unit: f32) -> f32 {
    let d = Vec3A::from_vec4(hi * unit - lo * unit);
    d.dot(d.yzx())
}

/// Splits the triangles into two halves along the axis on which they are spread most.
fn halve(references: &mut [Reference]) -> usize {
    let axis = Extent::of(references).spread().max_position();
    let middle = references.len() / 2;
    references.select_nth_unstable_by(middle, |a, b| {
        let (x, y) = (a.middle()[axis], b.middle()[axis]);
        x.total_cmp(&y).then(a.id().cmp(&b.id()))
    });
    middle
}

/// The measure by which splits are compared: the expected work, and for equal work the number of
/// triangles in the larger part. The work of a split with an empty part is infinite or not a
/// number, and never less than the work of another split.
type Judged = (f32, usize);

/// The measure that every possible split improves on.
const WORST: Judged = (f32::INFINITY, usize::MAX);

/// The lowest and the highest corner of the bounding box of some triangles, and their number.
type Part = ((Vec4, Vec4), usize);

/// The part without triangles.
const EMPTY: Part = ((Vec4::INFINITY, Vec4::NEG_INFINITY), 0);

/// Finds the best split of a row of `count` parts, at most 16. Returns its measure, and how many of
/// the parts are on its left.
#[inline(always)]
fn best_split(count: usize, unit: f32, part: impl Fn(usize) -> Part) -> (Judged, usize) {
    let and = |((lo, hi), sum): Part, k: usize| {
        let ((l, h), count) = part(k);
        ((lo.min(l), hi.max(h)), sum + count)
    };
    #[allow(clippy::cast_precision_loss, reason = "a heuristic")]
    let work = |((lo, hi), count): Part| half_area(lo, hi, unit) * count as f32;
    // Sweep from the right, and store the work of each right side; then from the left, and compare.
    let mut behind = [(0.0, 0); BINS];
    let mut sum = EMPTY;
    for k in (1..count.min(BINS)).rev() {
        sum = and(sum, k);
        behind[k] = (work(sum), sum.1);
    }
    let mut best = (WORST, count / 2);
    let mut sum = EMPTY;
    for (k, behind) in behind[..count.min(BINS)].iter().enumerate().skip(1) {
        sum = and(sum, k - 1);
        let split = (work(sum) + behind.0, sum.1.max(behind.1));
        if split < best.0 {
            best = (split, k);
        }
    }
    best
}

/// Tries all splits of a few triangles along the axes, and sorts the triangles along the best axis.
/// Returns how many of them are on the left of the best split.
fn by_all(references: &mut [Reference], unit: f32) -> usize {
    const MASK: u32 = (1 << FEW.ilog2()) - 1;
    const { assert!(FEW.is_power_of_two()) };
    let count = references.len().min(FEW);
    let mut own = [references[0]; FEW];
    own[..count].copy_from_slice(references);
    let mut best = (WORST, count / 2);
    let mut best_order: [u32; FEW] = std::array::from_fn(index);
    for axis in Extent::of(references).axes() {
        // Sort along the axis; the last bits of a key say which triangle it is.
        let mut order = [0_u32; FEW];
        for ((k, key), r) in (0..).zip(&mut order).zip(&*references) {
            *key = ascending(r.middle()[axis]) & !MASK | k;
        }
        order[..count].sort_unstable();
        let split = best_split(count, unit, |k| {
            let r = &own[(order[k] & MASK) as usize];
            ((r.lo, r.hi), 1)
        });
        if split.0 < best.0 {
            (best, best_order) = (split, order);
        }
    }
    // Apply the best order.
    for (r, key) in references.iter_mut().zip(best_order) {
        *r = own[(key & MASK) as usize];
    }
    best.1
}

/// Returns bits whose order as integers is the order of the numbers.
#[inline(always)]
fn ascending(x: f32) -> u32 {
    let bits = x.to_bits();
    bits ^ if bits >> 31 == 0 { 1 << 31 } else { u32::MAX }
}

/// 1.5 · 2²³. If a small number is added to it, the last bits of the sum are that number rounded to
/// an integer.
const WHOLE: f32 = 1.5 * (1_u32 << 23) as f32;

/// The mapping from the centres of triangles' boxes to bins, on all axes.
#[derive(Clone, Copy)]
struct Binning {
    lo: Vec4,
    scale: Vec4,
}

impl Binning {
    /// Creates the mapping for a bounding box of centres. On axes along which the box has almost no
    /// width, all centres are in the first bin.
    fn new(extent: &Extent) -> Self {
        let width = (extent.hi - extent.lo).max(Vec4::splat(f32::MIN_POSITIVE));
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let scale = Vec4::splat(BINS as f32 - 0.01) / width;
        Self {
            lo: extent.lo,
            scale,
        }
    }

    /// Returns the bin on each axis for the centre of a triangle's box, which has to be within the
    /// bounding box of the mapping.
    #[inline(always)]
    fn bins(self, middle: Vec4) -> [usize; 3] {
        let place = ((middle - self.lo) * self.scale - 0.5) + WHOLE;
        let [x, y, z, _] = place.to_array();
        [x, y, z].map(|x| x.to_bits() as usize % BINS)
    }

    /// Moves the triangles in the bins below `first` of an axis to the front, and returns their
    /// number.
    fn partition<const AXIS: usize>(self, references: &mut [Reference], first: usize) -> usize {
        let lane = |v: Vec4| v.to_array()[AXIS];
        let (lo, scale) = (lane(self.lo), lane(self.scale));
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let end = WHOLE + first as f32;
        let mut middle = 0;
        for i in 0..references.len() {
            let r = &references[i];
            let half = lane(r.lo) * 0.25 + lane(r.hi) * 0.25;
            let is_left = ((half - lo) * scale - 0.5) + WHOLE < end;
            // Swap without a branch, which could not be predicted.
            references.swap(middle, i);
            middle += usize::from(is_left);
        }
        middle
    }
}

/// Splits the triangles at the best boundary between bins, or into halves if there is none; moves
/// the triangles of the left part to the front, and returns their number.
fn by_bins(references: &mut [Reference], unit: f32) -> usize {
    let extent = Extent::of(references);
    let binning = Binning::new(&extent);
    let mut bins = [[EMPTY; BINS]; 3];
    // Sort a sample of the triangles into bins on the widest axes.
    let used: [bool; 3] = std::array::from_fn(|axis| extent.axes().any(|used| used == axis));
    for r in sample(references) {
        for (axis, k) in binning.bins(r.middle()).into_iter().enumerate() {
            if used[axis] {
                let ((lo, hi), count) = &mut bins[axis][k];
                *lo = lo.min(r.lo);
                *hi = hi.max(r.hi);
                *count += 1;
            }
        }
    }
    // Find the best boundary over these axes.
    let mut best = (WORST, 0, 0);
    for axis in extent.axes() {
        let (judged, first) = best_split(BINS, unit, |k| bins[axis][k]);
        if judged < best.0 {
            best = (judged, axis, first);
        }
    }
    let (_, axis, first) = best;
    let middle = match axis {
        0 => binning.partition::<0>(references, first),
        1 => binning.partition::<1>(references, first),
        _ => binning.partition::<2>(references, first),
    };
    // The split of a sample may leave one side empty.
    if middle == 0 || middle == references.len() {
        return halve(references);
    }
    middle
}

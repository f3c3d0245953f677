//! Growing the binary tree from its root: triangles are split where the surface area heuristic
//! expects the least work.
//!
//! **Source**: Wald 2007, "On fast construction of SAH-based bounding volume hierarchies" (bins).
//! Few triangles are joined from their leaves instead ([`join`]). Time is n log n whatever the
//! input: a branch that gets deeper than four times the logarithm goes on by halving.

use super::{
    binary::{Binary, Bounds, least, most},
    index, join, reinsert,
};
use crate::pool;

/// A triangle's box and number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    pub(super) bounds: Bounds,
    pub(super) id: u32,
}

/// Bins along each axis.
const BINS: usize = 16;

/// Triangles of a subtree that is grown and improved in one piece, in the caches of one core.
pub(super) const BLOCK: usize = 1 << 16;

/// Triangles whose subtree is worth another thread.
const WORTH_SHARING: usize = 1 << 12;

/// The tree over some triangles, which it reorders; node 0 is the root.
pub(super) fn grow(references: &mut [Reference]) -> Vec<Binary> {
    let count = references.len();
    let mut nodes = vec![Binary::EMPTY; (2 * count).saturating_sub(1)];
    let levels = usize::BITS - count.leading_zeros();
    if let Some((root, rest)) = nodes.split_first_mut() {
        branch::<true>(references, root, rest, 1, 4 * levels);
    }
    if count > BLOCK {
        reinsert::improve_top(&mut nodes);
    }
    nodes
}

/// Grows what is below `root` into `nodes`, the first of which is node `at`; after `levels` levels
/// by halving. `BLOCKS`: in blocks, which are improved.
fn branch<const BLOCKS: bool>(
    references: &mut [Reference],
    root: &mut Binary,
    nodes: &mut [Binary],
    at: usize,
    levels: u32,
) {
    if BLOCKS && references.len() <= BLOCK {
        return block(references, root, nodes, at, levels);
    }
    let extent = Extent::of(references);
    root.bounds = extent.bounds;
    if let [one] = references {
        root.first = one.id;
        root.tag = Binary::LEAF;
        return;
    }
    if references.len() <= join::FEW && join::join(references, root, nodes, at) {
        return;
    }
    let middle = match levels {
        0 => halve(references, &extent),
        _ => by_bins(references, &extent).unwrap_or_else(|| halve(references, &extent)),
    };
    root.first = index(at);
    root.tag = 0;
    let (left, right) = references.split_at_mut(middle);
    let (pair, rest) = nodes.split_at_mut(2);
    let (below_left, below_right) = rest.split_at_mut(2 * (left.len() - 1));
    let (first, second) = pair.split_at_mut(1);
    let at_right = at + 2 + below_left.len();
    let levels = levels.saturating_sub(1);
    let share = left.len() + right.len() >= WORTH_SHARING;
    let mut left = || branch::<BLOCKS>(left, &mut first[0], below_left, at + 2, levels);
    let mut right = || branch::<BLOCKS>(right, &mut second[0], below_right, at_right, levels);
    if share {
        pool::join(left, right);
    } else {
        left();
        right();
    }
}

/// Grows a subtree by itself, improves it and puts it in its place.
fn block(
    references: &mut [Reference],
    root: &mut Binary,
    nodes: &mut [Binary],
    at: usize,
    levels: u32,
) {
    let mut own = vec![Binary::EMPTY; nodes.len() + 1];
    if let Some((own_root, rest)) = own.split_first_mut() {
        branch::<false>(references, own_root, rest, 1, levels);
    }
    reinsert::improve(&mut own);
    for node in &mut own {
        if !node.is_leaf() {
            node.first += index(at) - 1;
        }
    }
    *root = own[0];
    nodes.copy_from_slice(&own[1..]);
}

/// The box of some triangles and that of the middles of their boxes.
struct Extent {
    bounds: Bounds,
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Extent {
    fn of(references: &[Reference]) -> Self {
        let mut extent = Self {
            bounds: Bounds::EMPTY,
            lo: Bounds::EMPTY.lo,
            hi: Bounds::EMPTY.hi,
        };
        for r in references {
            extent.bounds.extend(&r.bounds);
            for axis in 0..3 {
                let middle = r.bounds.middle(axis);
                extent.lo[axis] = least(extent.lo[axis], middle);
                extent.hi[axis] = most(extent.hi[axis], middle);
            }
        }
        extent
    }
}

/// Two halves along the axis on which the triangles are spread most.
fn halve(references: &mut [Reference], extent: &Extent) -> usize {
    let spread = |axis: usize| f64::from(extent.hi[axis]) - f64::from(extent.lo[axis]);
    let axis = (1..3).fold(0, |best, axis| {
        if spread(axis) > spread(best) {
            axis
        } else {
            best
        }
    });
    let middle = references.len() / 2;
    references.select_nth_unstable_by(middle, |a, b| order(a, b, axis));
    middle
}

/// By their middles along an axis, then by their numbers.
fn order(a: &Reference, b: &Reference, axis: usize) -> std::cmp::Ordering {
    let (x, y) = (a.bounds.middle(axis), b.bounds.middle(axis));
    x.total_cmp(&y).then(a.id.cmp(&b.id))
}

/// What a split is judged by: the expected work, and among equals the larger part.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Judged {
    cost: f64,
    larger: usize,
}

impl Judged {
    const WORST: Self = Self {
        cost: f64::INFINITY,
        larger: usize::MAX,
    };

    fn new(left: (&Bounds, usize), right: (&Bounds, usize)) -> Self {
        #[allow(clippy::cast_precision_loss, reason = "a heuristic")]
        let part = |(bounds, count): (&Bounds, usize)| bounds.half_area() * count as f64;
        Self {
            cost: part(left) + part(right),
            larger: left.1.max(right.1),
        }
    }
}

/// Which bin a middle is in.
#[derive(Clone, Copy)]
struct Binning {
    /// Half of the least middle, and bins for each half of the distance from it.
    lo: f32,
    scale: f32,
}

impl Binning {
    /// Halves do not overflow.
    fn new(extent: &Extent, axis: usize) -> Self {
        let lo = 0.5 * extent.lo[axis];
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let scale = BINS as f32 / (0.5 * extent.hi[axis] - lo);
        Self { lo, scale }
    }

    #[inline(always)]
    fn bin(self, middle: f32) -> usize {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative; what is NaN becomes zero, and what is too large the last bin"
        )]
        let bin = ((0.5 * middle - self.lo) * self.scale) as usize;
        bin.min(BINS - 1)
    }
}

/// The best split between bins, if there is any; the triangles of the left part stand first
/// afterwards.
fn by_bins(references: &mut [Reference], extent: &Extent) -> Option<usize> {
    let binning: [Binning; 3] = std::array::from_fn(|axis| Binning::new(extent, axis));
    let mut bins = [[(Bounds::EMPTY, 0_usize); BINS]; 3];
    for r in &*references {
        for axis in 0..3 {
            let (bounds, count) = &mut bins[axis][binning[axis].bin(r.bounds.middle(axis))];
            bounds.extend(&r.bounds);
            *count += 1;
        }
    }
    let mut best = (Judged::WORST, 0, 0);
    for (axis, bins) in bins.iter().enumerate() {
        let mut behind = [(Bounds::EMPTY, 0); BINS];
        let mut sum = (Bounds::EMPTY, 0);
        for (behind, (bounds, count)) in behind.iter_mut().zip(bins).rev() {
            sum.0.extend(bounds);
            sum.1 += count;
            *behind = sum;
        }
        let mut sum = (Bounds::EMPTY, 0);
        for k in 1..BINS {
            sum.0.extend(&bins[k - 1].0);
            sum.1 += bins[k - 1].1;
            if sum.1 == 0 || behind[k].1 == 0 {
                continue;
            }
            let judged = Judged::new((&sum.0, sum.1), (&behind[k].0, behind[k].1));
            if judged < best.0 {
                best = (judged, axis, k);
            }
        }
    }
    let (_, axis, first) = best;
    (first > 0).then(|| {
        let binning = binning[axis];
        partition(references, |r| binning.bin(r.bounds.middle(axis)) < first)
    })
}

/// Puts what is on the left first, and gives its number.
fn partition(references: &mut [Reference], left: impl Fn(&Reference) -> bool) -> usize {
    let (mut i, mut j) = (0, references.len());
    loop {
        while i < j && left(&references[i]) {
            i += 1;
        }
        while i < j && !left(&references[j - 1]) {
            j -= 1;
        }
        if i >= j {
            return i;
        }
        references.swap(i, j - 1);
        i += 1;
        j -= 1;
    }
}

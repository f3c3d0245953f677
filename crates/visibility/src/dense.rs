//! Dense shafts: thousands of triangles between a point and a light.
//!
//! Their lines are answered a few neighbours at a time, each few by a walk of its own from front
//! to back. Along each line, 64 bins record what is hidden for sure; a box whose image lies
//! between the lines, or only on hidden bins, is skipped with all that is in it. What is skipped
//! lies within what is hidden, so the visible pieces do not change by a bit.

use crate::{
    Occluders, Scratch, VisibleLines,
    block::Lines,
    dispatch::dispatch,
    frame::LightFrame,
    merge,
    node::{Child, Leaf, Node},
    project::{self, Corners},
    simd::Simd,
    sweep,
    traverse::ShaftBounds,
};
use linelit_geometry::DVec3;

/// Most lines that share a walk.
pub(crate) const GROUP: usize = 8;

/// A box still to visit: where it is nearest, and its image's bounds in (p, q).
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearBox {
    child: Child,
    depth: f32,
    low: [f32; 2],
    high: [f32; 2],
}

/// Bins along up to eight lines.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Covered {
    /// Where the lines are across, at least and at most: rounded outward.
    low: [[f32; 8]; GROUP / 8],
    high: [[f32; 8]; GROUP / 8],
    bins: [u64; GROUP],
}

/// The bins that an interval of q touches.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn touched(low: f32, high: f32) -> u64 {
    let first = (low * 64.0).clamp(0.0, 63.0) as u32;
    let last = (high * 64.0).clamp(0.0, 63.0) as u32;
    (u64::MAX << first) & (u64::MAX >> (63 - last))
}

/// The bins that lie wholly inside an interval of q.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn filled(low: f64, high: f64) -> u64 {
    let first = (low * 64.0).ceil().clamp(0.0, 64.0) as u32;
    let end = (high * 64.0).floor().clamp(0.0, 64.0) as u32;
    if first >= end {
        return 0;
    }
    (u64::MAX << first) & (u64::MAX >> (64 - end))
}

impl Covered {
    /// Nothing hidden but what lies beyond the lines' ends.
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward")]
    fn start(lines: &Lines) -> Self {
        let mut c = Self {
            low: [[f32::INFINITY; 8]; GROUP / 8],
            high: [[f32::NEG_INFINITY; 8]; GROUP / 8],
            bins: [u64::MAX; GROUP],
        };
        for line in 0..lines.count.min(GROUP) {
            let (block, lane) = (line / 8, line % 8);
            // Across is −p.
            let p = -lines.blocks[block].u[lane];
            c.low[block][lane] = (p as f32).next_down();
            c.high[block][lane] = (p as f32).next_up();
            c.bins[line] = filled(-1.0, lines.blocks[block].from[lane])
                | filled(lines.blocks[block].to[lane], 2.0);
        }
        c
    }

    /// Whether a box can hide anything that is not hidden yet.
    #[inline(always)]
    fn needs<S: Simd>(&self, s: S, b: &NearBox) -> bool {
        let bins = touched(b.low[1], b.high[1]);
        for (block, (low, high)) in self.low.iter().zip(&self.high).enumerate() {
            let mut near =
                s.le(s.splat(b.low[0]), s.load(high)) & s.le(s.load(low), s.splat(b.high[0]));
            while near != 0 {
                if bins & !self.bins[block * 8 + near.trailing_zeros() as usize] != 0 {
                    return true;
                }
                near &= near - 1;
            }
        }
        false
    }

    /// Records the lines' running intervals; true if all lines are hidden.
    #[inline(always)]
    fn record(&mut self, lines: &Lines) -> bool {
        let mut all = u64::MAX;
        for line in 0..lines.count.min(GROUP) {
            let (block, lane) = (line / 8, line % 8);
            self.bins[line] |= filled(
                lines.blocks[block].run_lo[lane],
                lines.blocks[block].run_hi[lane],
            );
            all &= self.bins[line];
        }
        all == u64::MAX
    }
}

/// The boxes of a node that the shaft may meet, with their images.
#[inline(always)]
fn images<S: Simd>(s: S, bounds: &ShaftBounds, node: &Node, found: u8, stack: &mut Vec<NearBox>) {
    let (mut low, mut high) = ([[0.0; 8]; 3], [[0.0; 8]; 3]);
    let mut least = [s.splat(0.0); 3];
    let mut most = [s.splat(0.0); 3];
    for k in 0..3 {
        let n = &bounds.rows[k];
        let mut near = s.splat(-bounds.offset[k] - bounds.room[k]);
        let mut far = s.splat(-bounds.offset[k] + bounds.room[k]);
        for (axis, &n) in n.iter().enumerate() {
            let up = axis + 3 * usize::from(n >= 0.0);
            let down = axis + 3 * usize::from(n < 0.0);
            near = s.fma(s.splat(n), s.load(&node.bounds[down]), near);
            far = s.fma(s.splat(n), s.load(&node.bounds[up]), far);
        }
        least[k] = near;
        most[k] = far;
    }
    s.store(least[2], &mut low[2]);
    s.store(most[2], &mut high[2]);
    for k in 0..2 {
        s.store(least[k], &mut low[k]);
        s.store(most[k], &mut high[k]);
    }
    let base = stack.len();
    let mut found = found;
    while found != 0 {
        let lane = found.trailing_zeros() as usize;
        found &= found - 1;
        let mut b = NearBox {
            child: node.child[lane],
            depth: low[2][lane],
            low: [f32::NEG_INFINITY; 2],
            high: [f32::INFINITY; 2],
        };
        if low[2][lane] > 1e-6 {
            // The room covers the two roundings of a quotient as well.
            let (near, far) = (1.0 / low[2][lane], 1.0 / high[2][lane]);
            for k in 0..2 {
                let (l, h) = (low[k][lane], high[k][lane]);
                let l = l * if l < 0.0 { near } else { far };
                let h = h * if h > 0.0 { near } else { far };
                b.low[k] = l - 1e-6 * l.abs();
                b.high[k] = h + 1e-6 * h.abs();
            }
        }
        // Insertion keeps the farthest lowest on the stack.
        stack.push(b);
        let mut k = stack.len() - 1;
        while k > base && stack[k - 1].depth < b.depth {
            stack[k] = stack[k - 1];
            k -= 1;
        }
        stack[k] = b;
    }
}

/// Keeps those triangles of a leaf whose image crosses a line where that is not hidden yet.
#[inline(always)]
fn push_needed<S: Simd>(
    s: S,
    bounds: &ShaftBounds,
    leaf: &Leaf,
    parent: &NearBox,
    maybe: u8,
    covered: &Covered,
    corners: &mut Corners,
) {
    let (mut low, mut high) = ([[0.0; 8]; 2], [[0.0; 8]; 2]);
    let near = bounds.triangle_images(s, &leaf.vertices, &mut low, &mut high);
    let (mut maybe, mut needed) = (maybe, 0);
    while maybe != 0 {
        let lane = maybe.trailing_zeros();
        maybe &= maybe - 1;
        let k = lane as usize;
        let image = NearBox {
            low: [low[0][k], low[1][k]],
            high: [high[0][k], high[1][k]],
            ..*parent
        };
        if near >> lane & 1 == 0 || covered.needs(s, &image) {
            needed |= 1 << lane;
        }
    }
    if needed != 0 {
        corners.add(s, leaf, parent.child.index(), needed);
    }
}

/// The visible pieces of up to eight lines in `scratch.lines`, in the coordinates of `frame`.
#[inline(always)]
fn dense_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    bounds: &ShaftBounds,
    (point, frame): (DVec3, &LightFrame),
    scratch: &mut Scratch,
    out: &mut VisibleLines,
) {
    let Scratch {
        counters,
        corners,
        flat,
        lines,
        slots_per_line,
        pieces,
        near_boxes: stack,
        covered,
        ..
    } = scratch;
    slots_per_line.reset(lines.count);
    *covered = Covered::start(lines);
    corners.clear();
    stack.clear();
    stack.push(NearBox {
        child: Child::node(0),
        depth: 0.0,
        low: [f32::NEG_INFINITY; 2],
        high: [f32::INFINITY; 2],
    });
    loop {
        let next = stack.pop();
        if let Some(b) = &next {
            if !covered.needs(s, b) {
                continue;
            }
            if b.child.is_leaf() {
                counters.triangle_tests += u64::from(b.child.count());
                let leaf = &occluders.hierarchy.leaves[b.child.index()];
                let maybe = bounds.triangles(s, leaf).0 & b.child.mask();
                if maybe != 0 {
                    push_needed(s, bounds, leaf, b, maybe, covered, corners);
                }
            } else {
                let node = &occluders.hierarchy.nodes[b.child.index()];
                counters.node_tests += u64::from(node.valid.count_ones());
                let found = bounds.boxes(s, node);
                occluders.hierarchy.prefetch(s, node, found);
                images(s, bounds, node, found, stack);
            }
        }
        // Eight triangles at a time, and what is left at the end.
        while corners.count >= 8 || (next.is_none() && corners.count > 0) {
            let first = corners.count.saturating_sub(8);
            flat.clear();
            let left = project::project_some::<S, false>(s, corners, first, point, frame, flat);
            corners.count = first;
            counters.candidates += flat.count as u64;
            if left.is_none() {
                // One triangle before all the lines: nothing is visible.
                return;
            }
            sweep::sweep_flat(s, flat, lines, slots_per_line);
            if flat.count > 0 && covered.record(lines) {
                return;
            }
        }
        if next.is_none() {
            break;
        }
    }
    merge::finish(s, lines, slots_per_line, pieces, out);
}

dispatch! {
    /// The visible pieces of up to eight lines of a dense shaft, on an instruction set.
    dense = dense_kernel(occluders: &Occluders, bounds: &ShaftBounds, at: (DVec3, &LightFrame), scratch: &mut Scratch, out: &mut VisibleLines)
}

//! Searching the hierarchy for a shaft: which triangles lie between a point and a light.
//!
//! This walk has a loop of its own. It visits all that it finds, unless a triangle hides the light
//! as a whole, so that it opens two nodes at a time and looks into leaves a dozen at a time:
//! nothing waits for what another node holds.

use crate::{
    bvh::Bvh,
    counters::Counters,
    node::{Child, DENSE, Leaf},
    shaft::{
        project,
        seen::{Look, Seen},
    },
};
use linelit_simd::{Simd, dispatch};

/// The result of a search for triangles in a shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// No triangle that hides anything.
    Nothing,
    /// Triangles that are few enough to be kept.
    Few,
    /// More than that.
    Many,
    /// A triangle that hides the light as a whole.
    All,
    /// No result: there is no frame to look for anything in
    /// ([`LightFrame::set`](crate::shaft::frame::LightFrame::set)).
    Unknown,
}

/// Leaves that are looked into in one go.
const BATCH: usize = 12;

/// Nodes that are opened in one go.
const ABREAST: usize = 2;

/// The number of triangles of a dense shaft that are looked at for one that hides the
/// light as a whole.
const FEW_IF_DENSE: usize = 48;

/// Sets the triangles of a leaf aside that may be in the shaft.
#[inline(always)]
fn look_into<S: Simd>(s: S, look: &mut Look<'_>, leaf: &Leaf, child: Child, limit: usize) -> Found {
    let (maybe, around) = look.bounds.triangles(s, leaf);
    let maybe = maybe & child.mask();
    let around = maybe & around;
    if around != 0 && around & project::hiding(s, leaf, look.point, look.frame) != 0 {
        return Found::All;
    }
    if maybe != 0 {
        look.keep(s, child, leaf, maybe);
        if look.corners.count > limit {
            return Found::Many;
        }
    }
    Found::Few
}

/// Finds what is between the shading point and `seen.light`: the images of up to [`DENSE`]
/// triangles are in `seen.flat` then.
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
fn find_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    exclude: (u32, u32),
    seen: &mut Seen,
    stack: &mut Vec<u32>,
    counters: &mut Counters,
) -> Found {
    seen.corners.clear();
    seen.flat.clear();
    let hierarchy = &*bvh.hierarchy;
    if hierarchy.nodes.is_empty() {
        return Found::Nothing;
    }
    if !seen.frame.set(&seen.light, seen.point, bvh.origin) {
        return Found::Unknown;
    }
    let Some(mut look) = seen.look(s, bvh, exclude, None) else {
        return Found::Unknown;
    };
    // Most triangles that are kept.
    let mut limit = DENSE;
    bvh.make_room(stack);
    let stack = &mut stack[..];
    stack[0] = 0;
    let mut top = 1;
    // Leaves to look into: many at a time, so that nothing hangs on what kind a child is.
    let mut leaves = [0_u32; BATCH + 8 * ABREAST + 8];
    let mut waiting = 0;
    while top > 0 {
        // Several nodes at a time, so that none waits for what another holds.
        let mut next = [0; ABREAST];
        let few = top.min(ABREAST);
        for (k, node) in next.iter_mut().enumerate().take(few) {
            *node = stack[top - 1 - k];
        }
        top -= few;
        for &node in next[..few].iter().rev() {
            let node = &hierarchy.nodes[node as usize];
            counters.node_tests += u64::from(node.valid.count_ones());
            let mut found = look.bounds.boxes(s, node);
            if found & node.dense != 0 {
                let within = found & node.dense & look.bounds.holds(s, node);
                if within != 0 {
                    // None of those hides the light as a whole, but others may.
                    limit = FEW_IF_DENSE;
                    found &= !within;
                }
            }
            hierarchy.prefetch(s, node, found);
            let inner = found & !node.leaf;
            s.pack(inner, &node.child, stack, top);
            top += inner.count_ones() as usize;
            let ready = found & node.leaf;
            s.pack(ready, &node.child, &mut leaves, waiting);
            waiting += ready.count_ones() as usize;
        }
        if waiting < BATCH && top > 0 {
            continue;
        }
        for &child in &leaves[..waiting] {
            let child = Child(child);
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.leaf_index()];
            let found = look_into(s, &mut look, leaf, child, limit);
            if found != Found::Few {
                return found;
            }
        }
        waiting = 0;
    }
    if limit < DENSE {
        return Found::Many;
    }
    match look.project_all(s) {
        false => Found::All,
        true if look.flat.count == 0 => Found::Nothing,
        true => Found::Few,
    }
}

dispatch! {
    /// Finds what is in a shaft on an instruction set.
    pub(crate) fn find = find_kernel(bvh: &Bvh, exclude: (u32, u32), seen: &mut Seen, stack: &mut Vec<u32>, counters: &mut Counters) -> Found
}

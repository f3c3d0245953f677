//! The search of the hierarchy for a shaft: which triangles lie between a point and a light.
//!
//! This walk has a loop of its own. Unless a triangle hides the whole light, it visits everything
//! that it finds, so it opens two nodes at a time and tests leaves a dozen at a time: no memory
//! access has to wait for the contents of another node.

use crate::{
    bvh::Bvh,
    counters::Counters,
    node::{Child, DENSE, Leaf},
    shaft::{
        project,
        seen::{ShaftSearch, ShaftState},
    },
};
use linelit_simd::{Simd, dispatch};

/// The result of a search for triangles in a shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// No triangle hides anything.
    Nothing,
    /// There are triangles, but few enough to be stored.
    Few,
    /// There are more triangles than are stored: the shaft is dense.
    Many,
    /// A triangle hides the whole light.
    All,
    /// There is no result: the light has no frame from this point
    /// ([`LightFrame::set`](crate::shaft::frame::LightFrame::set)), or the shaft has no bounds.
    Unknown,
}

/// The number of leaves that are collected before their triangles are tested.
const BATCH: usize = 12;

/// The number of nodes that are opened together.
const ABREAST: usize = 2;

/// The number of triangles of a dense shaft that are tested in search of one that hides the whole
/// light.
const FEW_IF_DENSE: usize = 48;

/// Collects the triangles of a leaf that may be in the shaft, for projection.
#[inline(always)]
fn look_into<S: Simd>(
    s: S,
    look: &mut ShaftSearch<'_>,
    leaf: &Leaf,
    child: Child,
    limit: usize,
) -> Found {
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

/// Finds the triangles between the shading point and `seen.light`. If the result is [`Found::Few`],
/// the projections of the triangles onto the light, at most [`DENSE`], are in `seen.flat`.
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
fn find_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    exclude: (u32, u32),
    seen: &mut ShaftState,
    stack: &mut Vec<u32>,
    counters: &mut Counters,
) -> Found {
    // Set up the frame of the light and the bounds of the shaft.
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
    // The largest number of triangles to store.
    let mut limit = DENSE;
    bvh.make_room(stack);
    let stack = &mut stack[..];
    stack[0] = 0;
    let mut top = 1;
    // Leaves to test. They are collected so that no branch depends on whether a child is a leaf.
    let mut leaves = [0_u32; BATCH + 8 * ABREAST + 8];
    let mut waiting = 0;
    while top > 0 {
        // Open several nodes at a time, so that none waits for the contents of another.
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
                    // A box with many triangles that is wholly in the shaft makes it dense. Its
                    // triangles are smaller than the light as the point sees it, but others may
                    // still hide the whole light.
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
        // Test the leaves once there are enough of them, or no nodes are left.
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
    // Project the triangles that were found.
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
    /// [`find_kernel`] on an instruction set.
    pub(crate) fn find = find_kernel(bvh: &Bvh, exclude: (u32, u32), seen: &mut ShaftState, stack: &mut Vec<u32>, counters: &mut Counters) -> Found
}

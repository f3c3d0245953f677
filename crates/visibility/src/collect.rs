//! Triangles between a point and a light, without a word on what they hide: those with holes.

use crate::{Occluders, Scratch, bounds::ShaftBounds, node::Child};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};

/// Puts the triangles that may be between a point and `scratch.light` in `scratch.found`, by leaf ×
/// 8 + lane: all that are, and few others. False if there is no frame to look for anything in: then
/// it is all triangles.
#[inline(always)]
fn between_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    &point: &DVec3,
    scratch: &mut Scratch,
) -> bool {
    let Scratch {
        light,
        frame,
        counters,
        stack,
        found,
        ..
    } = scratch;
    found.clear();
    let hierarchy = &*occluders.hierarchy;
    if hierarchy.nodes.is_empty() {
        return true;
    }
    let inside = match frame.set(light, point, occluders.origin) {
        false => None,
        true => {
            let around = [light.lo - occluders.origin, light.hi - occluders.origin];
            let point = point - occluders.origin;
            ShaftBounds::new(s, occluders, point, around, frame, (0, 0))
        }
    };
    if stack.len() < occluders.stack_size {
        stack.resize(occluders.stack_size, 0);
    }
    stack[0] = 0;
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let node = &hierarchy.nodes[stack[top] as usize];
        counters.node_tests += u64::from(node.valid.count_ones());
        let boxes = match &inside {
            Some(bounds) => bounds.boxes(s, node),
            None => node.valid,
        };
        let inner = boxes & !node.leaf;
        s.pack(inner, &node.child, stack, top);
        top += inner.count_ones() as usize;
        let mut leaves = boxes & node.leaf;
        while leaves != 0 {
            let child = Child(node.child[leaves.trailing_zeros() as usize]);
            leaves &= leaves - 1;
            let mut these = child.mask();
            counters.triangle_tests += u64::from(child.count());
            if let Some(bounds) = &inside {
                these &= bounds.triangles(s, &hierarchy.leaves[child.leaf_index()]).0;
            }
            for (lane, slot) in child.slots().into_iter().enumerate() {
                if these >> lane & 1 != 0 {
                    found.push(slot);
                }
            }
        }
    }
    inside.is_some()
}

dispatch! {
    /// Finds what is between, on an instruction set.
    pub(crate) fn between = between_kernel(occluders: &Occluders, point: &DVec3, scratch: &mut Scratch) -> bool
}

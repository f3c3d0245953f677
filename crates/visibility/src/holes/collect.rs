//! The search for triangles between a point and a light that does not determine what they hide. It
//! is used for triangles with holes, for which a filter is called later.

use crate::{
    bvh::Bvh,
    counters::Counters,
    node::Child,
    shaft::{
        bounds::ShaftBounds,
        frame::{Light, LightFrame},
    },
    walk::in_any_order,
};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};
use std::ops::ControlFlow;

/// The triangles between a point and a light, with the buffers of the search.
#[derive(Debug, Default)]
pub(crate) struct Collected {
    /// The latest light.
    pub(crate) light: Light,
    /// The projective frame of the light for the shading point.
    pub(crate) frame: LightFrame,
    /// The slots of the triangles that were found: leaf × 8 + lane.
    pub(crate) slots: Vec<u32>,
    stack: Vec<u32>,
}

/// Finds the triangles that may be between a point and `all.light`, and stores them in `all.slots`:
/// every triangle that is between the two, and few others. If the shaft has no frame or bounds, all
/// triangles are stored.
#[inline(always)]
fn between_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    &point: &DVec3,
    all: &mut Collected,
    counters: &mut Counters,
) {
    let Collected {
        light,
        frame,
        slots,
        stack,
    } = all;
    slots.clear();
    let hierarchy = &*bvh.hierarchy;
    // Set up the shaft.
    if hierarchy.nodes.is_empty() {
        return;
    }
    let inside = match frame.set(light, point, bvh.origin) {
        false => None,
        true => {
            let around = [light.lo, light.hi].map(|corner| corner - bvh.origin);
            ShaftBounds::new(s, bvh.extent, point - bvh.origin, around, frame, (0, 0))
        }
    };
    // Walk in any order, and store the triangles that may be in the shaft.
    bvh.make_room(stack);
    in_any_order(
        s,
        hierarchy,
        stack,
        #[inline(always)]
        |node| {
            counters.node_tests += u64::from(node.valid.count_ones());
            let found = match &inside {
                Some(bounds) => bounds.boxes(s, node),
                None => node.valid,
            };
            let mut leaves = found & node.leaf;
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
                        slots.push(slot);
                    }
                }
            }
            ControlFlow::Continue(found & !node.leaf)
        },
    );
}

dispatch! {
    /// [`between_kernel`] on an instruction set.
    pub(crate) fn between = between_kernel(bvh: &Bvh, point: &DVec3, all: &mut Collected, counters: &mut Counters) -> ()
}

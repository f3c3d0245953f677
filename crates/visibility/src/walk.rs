//! Walking the hierarchy with a shaft: which triangles lie between a point and a light.

use crate::{
    Occluders, Scratch,
    bounds::{self, ShaftBounds},
    closed_mesh::BackfaceFilter,
    frame::LightFrame,
    node::{Child, Leaf},
    project::{self, Corners},
    shaft::DENSE,
};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};

/// What is in a shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// As many triangles as are kept, or fewer, or none.
    Few,
    /// More than that.
    Many,
    /// A triangle that hides the light as a whole.
    All,
    /// There is no frame to look for anything in ([`LightFrame::set`]).
    Unknown,
}

/// Leaves that are looked into in one go.
const BATCH: usize = 12;

/// Nodes that are opened in one go.
const ABREAST: usize = 2;

/// Of a shaft that is known to be dense, so many triangles are looked at for one that hides the
/// light as a whole.
const FEW_IF_DENSE: usize = 48;

/// What a shaft is looked for with.
struct Query<'a> {
    bounds: ShaftBounds,
    backfaces: BackfaceFilter<'a>,
    /// In the hierarchy's coordinates.
    point: DVec3,
    frame: &'a LightFrame,
    /// Most triangles that are kept.
    limit: usize,
}

impl Query<'_> {
    /// Sets the triangles of a leaf aside that may be in the shaft.
    #[inline(always)]
    fn look<S: Simd>(&self, s: S, leaf: &Leaf, child: Child, corners: &mut Corners) -> Found {
        let (maybe, around) = self.bounds.triangles(s, leaf);
        let maybe = maybe & child.mask();
        let around = maybe & around;
        if around != 0 && around & project::hiding(s, leaf, self.point, self.frame) != 0 {
            return Found::All;
        }
        if maybe != 0 {
            let meshes = || self.backfaces.codes(child.leaf_index());
            let meshes = self.backfaces.any().then(meshes);
            corners.add(s, leaf, maybe, &child.slots(), meshes.as_ref());
            if corners.count > self.limit {
                return Found::Many;
            }
        }
        Found::Few
    }
}

/// Finds what is between a point of the world and `scratch.light`: the images of up to [`DENSE`]
/// triangles are in `scratch.flat` then.
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
fn find_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    &point: &DVec3,
    exclude: (u32, u32),
    scratch: &mut Scratch,
) -> Found {
    let Scratch {
        light,
        frame,
        counters,
        corners,
        stack,
        flat,
        clear_of,
        ..
    } = scratch;
    corners.clear();
    flat.clear();
    let hierarchy = &*occluders.hierarchy;
    if hierarchy.nodes.is_empty() {
        return Found::Few;
    }
    if !frame.set(light, point, occluders.origin) {
        return Found::Unknown;
    }
    let point = point - occluders.origin;
    let around = [light.lo - occluders.origin, light.hi - occluders.origin];
    let Some(bounds) = ShaftBounds::new(s, occluders, point, around, frame, exclude) else {
        return Found::Unknown;
    };
    frame.set_near(bounds::reach(occluders, point));
    let mut query = Query {
        bounds,
        backfaces: BackfaceFilter::new(
            hierarchy.meshes(),
            clear_of,
            point,
            around,
            frame.margins,
            exclude,
        ),
        point,
        frame,
        limit: DENSE,
    };
    if stack.len() < occluders.stack_size {
        stack.resize(occluders.stack_size, 0);
    }
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
            let mut found = query.bounds.boxes(s, node);
            if found & node.dense != 0 {
                let within = found & node.dense & query.bounds.holds(s, node);
                if within != 0 {
                    // None of those hides the light as a whole, but others may.
                    query.limit = FEW_IF_DENSE;
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
            let found = query.look(s, leaf, child, corners);
            if found != Found::Few {
                return found;
            }
        }
        waiting = 0;
    }
    if query.limit < DENSE {
        return Found::Many;
    }
    if corners.count == 0 {
        return Found::Few;
    }
    let backfaces = &mut query.backfaces;
    project::project(s, point, frame, corners, flat, backfaces)
}

dispatch! {
    /// Finds what is in a shaft on an instruction set.
    pub(crate) fn find = find_kernel(occluders: &Occluders, point: &DVec3, exclude: (u32, u32), scratch: &mut Scratch) -> Found
}

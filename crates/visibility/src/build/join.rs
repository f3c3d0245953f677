//! Joining few triangles into a subtree from its leaves: parallel locally-ordered clustering of
//! obvhs.
//!
//! Where each triangle is nearest to the one before it (rows, nests) a pass over all of them joins
//! one pair, so no more than [`FEW`] are joined at once: the whole stays at n log n.
//!
//! **Source**: Meister & Bittner 2018, "Parallel locally-ordered clustering for bounding volume
//! hierarchy construction".

use super::{
    binary::{Binary, Bounds},
    index,
    split::Reference,
};
use linelit_geometry::glam::Vec3A;
use obvhs::{
    aabb::Aabb,
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

/// Most triangles that are joined. The colonnade's expected work per ray is the same within 1 %
/// for 32, 64, 256 and for trying every split of 20 at a time (2 % more for 1,024); 32 fills leaves
/// best: 74, 77 and 91 bytes a triangle on colonnade, grid and soup (64: 71, 79 and 101).
/// `docs/decisions/003-growing-the-hierarchy.md`.
pub(super) const FEW: usize = 32;

/// Boxes that reach beyond this are scaled: half a surface, up to 12 times its square, has to fit
/// into `f32`.
const LARGE: f32 = 1e18;

/// Brings any `f32` below [`LARGE`]: 2⁻⁶⁹, so that only what vanishes beside it loses digits.
const SMALLER: f32 = 1.694_065_9e-21;

/// The tree over at least two and at most [`FEW`] triangles: `root`, and what is below it in
/// `nodes`, the first of which is node `at`. False if it has more than about twice the levels of a
/// full tree, as those of copies, rows and nests do: then the triangles are to be split.
pub(super) fn join(
    references: &[Reference],
    root: &mut Binary,
    nodes: &mut [Binary],
    at: usize,
) -> bool {
    let scale = scale(references);
    let boxes: Vec<Aabb> = references
        .iter()
        .map(|r| scaled(&r.bounds, scale))
        .collect();
    let ids = (0..index(references.len())).collect();
    let tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        &boxes,
        ids,
        SortPrecision::U64,
        0,
    );
    let mut levels = [0_u32; 2 * FEW];
    // Children stand behind their parents.
    for (k, node) in tree.nodes.iter().enumerate().rev() {
        let own = if node.is_leaf() {
            let place = tree.primitive_indices[node.first_index as usize];
            let Reference { bounds, id } = references[place as usize];
            Binary {
                bounds,
                first: id,
                tag: Binary::LEAF,
            }
        } else {
            let child = node.first_index as usize;
            levels[k] = 1 + levels[child].max(levels[child + 1]);
            Binary {
                bounds: nodes[child - 1].bounds.union(&nodes[child].bounds),
                first: index(at + child - 1),
                tag: 0,
            }
        };
        match k.checked_sub(1) {
            Some(k) => nodes[k] = own,
            None => *root = own,
        }
    }
    levels[0] <= 2 * references.len().ilog2() + 1
}

/// What brings all coordinates below [`LARGE`].
fn scale(references: &[Reference]) -> f32 {
    let corners = references
        .iter()
        .flat_map(|r| r.bounds.lo.into_iter().chain(r.bounds.hi));
    let largest = corners.fold(0.0_f32, |largest, x| largest.max(x.abs()));
    if largest < LARGE { 1.0 } else { SMALLER }
}

fn scaled(bounds: &Bounds, scale: f32) -> Aabb {
    let corner = |v: [f32; 3]| Vec3A::from_array(v) * scale;
    Aabb::new(corner(bounds.lo), corner(bounds.hi))
}

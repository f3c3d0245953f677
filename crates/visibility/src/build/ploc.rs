//! The binary tree as the crate obvhs clusters it, in place of the one that [`split`](super::split)
//! grows.
//!
//! Parallel locally ordered clustering joins pairs of boxes that are nearest to each other. Of many
//! pairs that are equally near (copies, rows) it joins a single one in each pass, so that it takes
//! quadratic time and the tree degenerates to a list; and areas that overflow or underflow are all
//! equal. So it receives boxes in units of the scene, each enlarged by a random amount of its own,
//! which breaks such ties. The nodes get boxes without that enlargement, and the tree is improved
//! as in the own builder.

use super::{
    binary::Binary,
    index, reinsert,
    split::{self, Reference},
};
use linelit_geometry::glam::Vec3A;
use obvhs::{BvhBuildParams, aabb::Aabb, ploc::PlocBuilder};

/// Grows the tree over some triangles; `None` if it becomes deeper than trees that can be improved
/// and collapsed. `extent` is the largest absolute coordinate. obvhs uses the caller's thread
/// alone.
pub(super) fn grow(references: &[Reference], extent: f32) -> Option<Vec<Binary>> {
    let unit = split::unit(extent);
    // Let obvhs cluster the enlarged boxes.
    let leaves: Vec<_> = references.iter().map(Reference::node).collect();
    let boxes: Vec<_> = leaves.iter().map(|leaf| shaken(leaf, unit)).collect();
    let settings = BvhBuildParams::medium_build();
    let tree = PlocBuilder::new().build(
        settings.ploc_search_distance,
        &boxes,
        (0..index(boxes.len())).collect(),
        settings.sort_precision,
        settings.search_depth_threshold,
    );
    let most_levels = reinsert::LEVELS * (usize::BITS - leaves.len().leading_zeros());
    let mut levels = vec![0; tree.nodes.len()];
    let mut nodes = vec![Binary::EMPTY; tree.nodes.len()];
    // Convert its nodes, and check the depth; children come after their parents.
    for (at, node) in tree.nodes.iter().enumerate() {
        let first = node.first_index as usize;
        if node.is_leaf() {
            nodes[at] = leaves[first];
            continue;
        }
        nodes[at].first = node.first_index;
        let below = levels[at] + 1;
        if below > most_levels {
            return None;
        }
        levels[first..first + 2].fill(below);
    }
    // Fit the boxes from the leaves up, and improve the tree.
    for at in (0..nodes.len()).rev() {
        let Binary { first, .. } = nodes[at];
        if !nodes[at].is_leaf() {
            let pair = &nodes[first as usize..first as usize + 2];
            nodes[at].bounds = pair[0].bounds.union(&pair[1].bounds);
        }
    }
    reinsert::improve(&mut nodes);
    Some(nodes)
}

/// Returns the bounding box of a triangle in units of the scene, with every side moved outwards by
/// a pseudo-random amount: up to 2⁻⁶ of the box's size, plus 2⁻²⁰ of its coordinates (16
/// roundings), plus 2⁻⁶⁰ units, whose square is not denormal.
fn shaken(leaf: &Binary, unit: f32) -> Aabb {
    let [lo, hi] = [leaf.bounds.lo, leaf.bounds.hi].map(|v| Vec3A::from(v) * unit);
    let magnitude = lo.abs().max_element().max(hi.abs().max_element());
    let room = (hi - lo).max_element() * 2.0_f32.powi(-6)
        + magnitude * 2.0_f32.powi(-20)
        + 2.0_f32.powi(-60);
    let mut bits = (u64::from(leaf.first) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    // Each side uses ten bits.
    let random = |side: u64| (bits >> (4 + 10 * side) & 0x3ff) as f32 * 2.0_f32.powi(-10);
    let by = |first| room * Vec3A::new(random(first), random(first + 1), random(first + 2));
    Aabb::new(lo - by(0), hi + by(3))
}

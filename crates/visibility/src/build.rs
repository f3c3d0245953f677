//! Building the hierarchy: a binary tree by obvhs, collapsed into nodes of eight.

use crate::{
    node::{Child, Leaf, Node},
    shells::{Shell, Shells},
    simd::Simd,
};
use linelit_geometry::glam::Vec3A;
use obvhs::{
    BvhBuildParams,
    bvh2::{Bvh2, builder::build_bvh2_from_tris},
    triangle::Triangle,
};
use std::time::Duration;

/// Cost of testing a leaf, in tests of a node: measured, see docs/performance.md.
const LEAF_COST: f32 = 1.2;

/// The same in scenes of fewer than [`SMALL`] triangles. There it makes no difference to speed;
/// fuller leaves keep such scenes below a hundred bytes a triangle.
const LEAF_COST_SMALL: f32 = 0.6;
const SMALL: usize = 10_000;

/// With fewer leaves (3 MB) the caches hold everything.
const WORTH_PREFETCHING: usize = 10_000;

/// Most triangles in a leaf.
const LEAF_SIZE: u32 = 8;

impl Hierarchy {
    /// Closed meshes and the leaves' triangles in them.
    pub(crate) fn shells(&self) -> (&[Shell], &[[u16; 8]]) {
        (&self.shells, &self.shell_of)
    }

    /// Asks for the memory of a node's children ahead of time.
    #[inline(always)]
    pub(crate) fn prefetch<S: Simd>(&self, s: S, node: &Node, found: u8) {
        if self.leaves.len() < WORTH_PREFETCHING {
            return;
        }
        let mut found = found;
        while found != 0 {
            let child = Child(node.child[found.trailing_zeros() as usize]);
            found &= found - 1;
            if child.is_leaf() {
                s.prefetch(&self.leaves[child.index()]);
            } else {
                s.prefetch(&self.nodes[child.index()]);
            }
        }
    }
}

/// The collapsed hierarchy.
#[derive(Debug, Default)]
pub(crate) struct Hierarchy {
    pub(crate) nodes: Vec<Node>,
    pub(crate) leaves: Vec<Leaf>,
    /// Closed meshes, and which of them the triangles of each leaf belong to (one more than the
    /// index, or zero); empty if there are none.
    pub(crate) shells: Vec<Shell>,
    pub(crate) shell_of: Vec<[u16; 8]>,
}

/// Builds the hierarchy over triangles given by their (shifted) vertices; `ids` are the numbers
/// they have with the caller.
pub(crate) fn build(triangles: &[[[f32; 3]; 3]], ids: &[u32], shells: Shells) -> Hierarchy {
    let mut out = Hierarchy::default();
    if triangles.is_empty() {
        return out;
    }
    let bvh2 = binary_tree(triangles);
    let plan = Plan::new(&bvh2);
    out.nodes.push(Node::EMPTY);
    let mut todo = vec![(0_usize, 0_usize)];
    let mut members = Vec::new();
    while let Some((node, root)) = todo.pop() {
        members.clear();
        plan.members(&bvh2, root, &mut members);
        let mut packed = Node::EMPTY;
        for (lane, &member) in members.iter().enumerate() {
            let aabb = bvh2.nodes[member].aabb();
            for axis in 0..3 {
                packed.bounds[axis][lane] = aabb.min[axis];
                packed.bounds[axis + 3][lane] = aabb.max[axis];
            }
            packed.valid |= 1 << lane;
            packed.leaf |= u8::from(plan.is_leaf[member]) << lane;
            let child = if plan.is_leaf[member] {
                pack_leaf(&bvh2, member, triangles, (ids, &shells.of), &mut out)
            } else {
                out.nodes.push(Node::EMPTY);
                todo.push((out.nodes.len() - 1, member));
                Child::node(out.nodes.len() - 1)
            };
            packed.child[lane] = child.0;
        }
        out.nodes[node] = packed;
    }
    out.shells = shells.shells;
    out
}

/// A good binary tree with one triangle a leaf.
fn binary_tree(triangles: &[[[f32; 3]; 3]]) -> Bvh2 {
    let input: Vec<Triangle> = triangles
        .iter()
        .map(|t| Triangle {
            v0: Vec3A::from_array(t[0]),
            v1: Vec3A::from_array(t[1]),
            v2: Vec3A::from_array(t[2]),
        })
        .collect();
    let params = BvhBuildParams {
        max_prims_per_leaf: 1,
        ..BvhBuildParams::medium_build()
    };
    build_bvh2_from_tris(&input, params, &mut Duration::default())
}

/// Puts the triangles below a binary node into one leaf.
fn pack_leaf(
    bvh2: &Bvh2,
    root: usize,
    triangles: &[[[f32; 3]; 3]],
    (ids, shell_of): (&[u32], &[u16]),
    out: &mut Hierarchy,
) -> Child {
    let mut found = [0_usize; LEAF_SIZE as usize];
    let mut count = 0;
    let mut todo = vec![root];
    while let Some(index) = todo.pop() {
        let node = &bvh2.nodes[index];
        if node.is_leaf() {
            let first = node.first_index as usize;
            for &p in &bvh2.primitive_indices[first..first + node.prim_count as usize] {
                found[count] = p as usize;
                count += 1;
            }
        } else {
            todo.push(node.first_index as usize + 1);
            todo.push(node.first_index as usize);
        }
    }
    let mut leaf = Leaf {
        vertices: [[0.0; 8]; 9],
        id: [u32::MAX; 8],
    };
    for lane in 0..8 {
        let t = found[if lane < count { lane } else { 0 }];
        for (k, slot) in leaf.vertices.iter_mut().enumerate() {
            slot[lane] = triangles[t][k / 3][k % 3];
        }
        leaf.id[lane] = ids[t];
    }
    out.leaves.push(leaf);
    if !shell_of.is_empty() {
        let lane = |k: usize| shell_of[found[if k < count { k } else { 0 }]];
        out.shell_of.push(std::array::from_fn(lane));
    }
    Child::leaf(out.leaves.len() - 1, count)
}

/// Which binary nodes become leaves and which are opened, by the least expected cost.
///
/// **Source**: the dynamic programme of Ylitie, Karras & Laine 2017, section 3.1, with leaves of
/// eight at a fixed cost.
struct Plan {
    /// Whether a subtree in one piece is best kept as a leaf.
    is_leaf: Vec<bool>,
    /// `split[n][j − 2]`: pieces for the left child when `n` is spread over up to `j` pieces; 0:
    /// `n` stays in one piece.
    split: Vec<[u8; 7]>,
}

impl Plan {
    fn new(bvh2: &Bvh2) -> Self {
        let n = bvh2.nodes.len();
        let small = bvh2.primitive_indices.len() < SMALL;
        let leaf_cost = if small { LEAF_COST_SMALL } else { LEAF_COST };
        let mut plan = Self {
            is_leaf: vec![false; n],
            split: vec![[0; 7]; n],
        };
        let mut cost = vec![[0.0_f32; 8]; n];
        let mut count = vec![0_u32; n];
        for index in post_order(bvh2) {
            let node = &bvh2.nodes[index];
            let area = node.aabb().half_area();
            if node.is_leaf() {
                count[index] = node.prim_count;
                plan.is_leaf[index] = true;
                cost[index] = [area * leaf_cost; 8];
                continue;
            }
            let (l, r) = (node.first_index as usize, node.first_index as usize + 1);
            count[index] = count[l].saturating_add(count[r]);
            for pieces in 2..=8_usize {
                let mut best = (f32::INFINITY, 0_u8);
                for left in 1..pieces {
                    let c = cost[l][left - 1] + cost[r][pieces - left - 1];
                    if c < best.0 {
                        #[allow(clippy::cast_possible_truncation, reason = "1 to 7")]
                        {
                            best = (c, left as u8);
                        }
                    }
                }
                cost[index][pieces - 1] = best.0;
                plan.split[index][pieces - 2] = best.1;
            }
            let opened = area + cost[index][7];
            let closed = if count[index] <= LEAF_SIZE {
                area * leaf_cost
            } else {
                f32::INFINITY
            };
            plan.is_leaf[index] = closed <= opened;
            cost[index][0] = closed.min(opened);
            for pieces in 2..=8_usize {
                if cost[index][pieces - 2] <= cost[index][pieces - 1] {
                    cost[index][pieces - 1] = cost[index][pieces - 2];
                    // As for one piece fewer.
                    plan.split[index][pieces - 2] = if pieces == 2 {
                        0
                    } else {
                        plan.split[index][pieces - 3]
                    };
                }
            }
        }
        plan
    }

    /// The up to eight members of the wide node that opens `root`.
    fn members(&self, bvh2: &Bvh2, root: usize, out: &mut Vec<usize>) {
        if bvh2.nodes[root].is_leaf() || self.is_leaf[root] {
            out.push(root);
            return;
        }
        let first = bvh2.nodes[root].first_index as usize;
        let left = usize::from(self.split[root][6]).clamp(1, 7);
        self.spread(bvh2, first, left, out);
        self.spread(bvh2, first + 1, 8 - left, out);
    }

    fn spread(&self, bvh2: &Bvh2, index: usize, pieces: usize, out: &mut Vec<usize>) {
        let node = &bvh2.nodes[index];
        let left = if pieces < 2 || node.is_leaf() {
            0
        } else {
            usize::from(self.split[index][pieces - 2])
        };
        if left == 0 {
            out.push(index);
        } else {
            let first = node.first_index as usize;
            self.spread(bvh2, first, left, out);
            self.spread(bvh2, first + 1, pieces - left, out);
        }
    }
}

/// Children before their parents.
fn post_order(bvh2: &Bvh2) -> Vec<usize> {
    let mut order = Vec::with_capacity(bvh2.nodes.len());
    let mut todo = vec![0_usize];
    while let Some(index) = todo.pop() {
        order.push(index);
        let node = &bvh2.nodes[index];
        if !node.is_leaf() {
            todo.push(node.first_index as usize);
            todo.push(node.first_index as usize + 1);
        }
    }
    order.reverse();
    order
}

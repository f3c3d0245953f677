//! Fine meshes as surfaces: which triangles are neighbours, and which way the triangles under each
//! node face. Shafts use this to find silhouettes without a visit to every triangle.
//!
//! The part of a line that a triangle hides begins at one of the triangle's sides and ends at
//! another. A *layer* over a point of a line is a triangle that hides the point. Nearly everywhere,
//! two neighbours lie on either side of the side that they share, so that the part hidden by one
//! ends where the part hidden by the other begins. The number of layers over a line changes only at
//! sides with both neighbours on one side of them, which are the surface's *silhouette* as seen
//! from the shading point, and at the surface's edges:
//!
//! ```text
//!       goes on: no event             silhouette: two layers begin
//!      ─────────┬─────────                   ┌─────────
//!        A      │     B                      │ A over B
//!      ─────────┴─────────                   └─────────
//! ```
//!
//! Each node stores bounds of the planes of all triangles in it and next to it: where they all face
//! the shading point, or all face away, and none has an edge, the number of layers changes nowhere.

use crate::{
    build::{Bounds, Geometry, index, least, most},
    closed_mesh::FineTriangles,
    node::{Child, Leaf, Node},
    pool,
};
use linelit_geometry::{DVec3, glam::Vec3};
use linelit_simd::Simd;
use std::sync::atomic::{AtomicU32, Ordering};

/// The least number of triangles in a fine surface. Triangles of smaller surfaces are tested one by
/// one. See `docs/decisions/015-silhouettes-of-fine-meshes.md`.
pub(crate) const FINE: u32 = 1024;

/// The silhouettes of fine surfaces are used only if at most one in this many triangles of the
/// scene belongs to no fine surface. With more such triangles, all triangles are tested one by one,
/// since the triangles outside of fine surfaces have to be tested in any case and hide most
/// silhouettes.
pub(crate) const LOOSE: u32 = 8;

/// The least number of triangles per edge (a side without exactly one neighbour) in a fine surface;
/// triangles of surfaces with more edges are tested one by one.
pub(crate) const MOSTLY: u32 = 4;

/// The code of a neighbour for the sides of a triangle that belongs to no fine surface.
pub(crate) const NONE: u32 = u32::MAX;

/// The code of a neighbour for a side beyond which there is no other triangle, or more than one.
pub(crate) const EDGE: u32 = u32::MAX - 2;

/// The least height of a triangle, as a fraction of its longest side and of a tenth of the scene's
/// size, at which the direction that it faces is used. For a higher triangle, the sign computed in
/// `f64` is right wherever the distance of the shading point from its plane exceeds
/// [`FACING_ROOM`].
const LEAST_HEIGHT: f64 = 1e-6;

/// A bound of the rounding error of the distance of a point from a triangle's plane, as a fraction
/// of the scene's size. In `f32`, six roundings (of normals, points and offsets, and of their
/// products), each at most 6e-8 of two scenes, on three axes each, are 4e-6; what `f64` may get
/// wrong of the sign is under 1e-6.
pub(crate) const FACING_ROOM: f64 = 1e-5;

/// The number of leaves that one parallel task handles.
const AT_ONCE: usize = 1 << 11;

/// The fine surfaces of a hierarchy, with the neighbours of triangles for each leaf, and bounds of
/// the planes of triangles for each node.
#[derive(Debug, Default)]
pub(crate) struct Surfaces {
    /// For each leaf, the neighbours of its triangles beyond the sides from corner 0 to 1, 1 to 2
    /// and 2 to 0: twice the neighbour's slot (leaf × 8 + lane), plus one if the neighbour runs
    /// along the side in the same direction. [`EDGE`] where there is no neighbour or several;
    /// [`NONE`] for a triangle of no fine surface.
    pub(crate) sides: Vec<[[u32; 8]; 3]>,
    /// For each leaf, how the neighbours of its triangles are bent away from the triangles: see
    /// [`bend`].
    pub(crate) bends: Vec<Bends>,
    /// For each node, bounds of the planes below each of its children.
    pub(crate) facing: Vec<Facing>,
    /// The ranges of the caller's triangle indices that belong to fine surfaces: the first index of
    /// each range, and the one after its last.
    ranges: Vec<[u32; 2]>,
}

/// Bounds of the planes of the triangles in each child of a node and of their neighbours.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Facing {
    /// Bounds of the unit normals, after all triangles of one mesh are oriented alike: the rows of
    /// the least x, y, z, then of the greatest.
    pub(crate) normal: [[f32; 8]; 6],
    /// The least and the greatest signed distance from the centre of the child's box to the planes,
    /// along their normals; infinite where the direction that a triangle faces is not known.
    pub(crate) offset: [[f32; 8]; 2],
}

impl Facing {
    /// The facing of a node without triangles of fine surfaces below its children.
    const NOTHING: Self = Self {
        normal: [
            [2.0; 8], [2.0; 8], [2.0; 8], [-2.0; 8], [-2.0; 8], [-2.0; 8],
        ],
        offset: [[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]],
    };

    /// Extends the facing of the child in `lane` by the planes of some of the leaves below it.
    fn add(&mut self, lane: usize, way: &Way) {
        for axis in 0..3 {
            let [x, y] = way.normals[axis];
            self.normal[axis][lane] = least(self.normal[axis][lane], x);
            self.normal[axis + 3][lane] = most(self.normal[axis + 3][lane], y);
        }
        self.offset[0][lane] = least(self.offset[0][lane], way.offset[0]);
        self.offset[1][lane] = most(self.offset[1][lane], way.offset[1]);
    }
}

/// The facing of one child of a node, accumulated over some of the leaves below that child.
struct Way {
    /// The child's slot: node × 8 + lane.
    slot: u32,
    /// The centre of the child's box.
    middle: DVec3,
    /// Whether the child is a leaf in which all triangles belong to fine surfaces.
    is_all_fine: bool,
    /// The bounds of the normals and offsets, as in [`Planes`] and [`Facing`].
    normals: [[f32; 2]; 3],
    offset: [f32; 2],
}

impl Way {
    /// Returns the facing of a child before any plane below it was added.
    fn new(slot: u32, nodes: &[Node]) -> Self {
        let Bounds { lo, hi } = nodes[slot as usize / 8].bounds_of(slot as usize % 8);
        // The centre is computed by the same operations as for eight boxes at a time, with
        // identical results.
        let middle = [0, 1, 2].map(|axis| f64::from((lo[axis] + hi[axis]) * 0.5));
        Self {
            slot,
            middle: middle.into(),
            is_all_fine: false,
            normals: Planes::NONE.normals,
            offset: [f32::INFINITY, f32::NEG_INFINITY],
        }
    }

    /// Extends the bounds by the planes of a leaf; `None` means that the facing of a triangle in
    /// the leaf or of a neighbour is not known, and so neither is that of the child.
    fn add(&mut self, planes: Option<&Planes>) {
        let Some(planes) = planes else {
            self.offset = [f32::NEG_INFINITY, f32::INFINITY];
            return;
        };
        let [low, high] = planes.offsets(self.middle);
        self.offset = [least(self.offset[0], low), most(self.offset[1], high)];
        for (own, [x, y]) in self.normals.iter_mut().zip(planes.normals) {
            *own = [least(own[0], x), most(own[1], y)];
        }
    }

    fn is_unknown(&self) -> bool {
        self.offset[0] == f32::NEG_INFINITY
    }
}

/// Returns the unit normal of a triangle in the orientation of its corners; not a number where the
/// triangle is so thin, for the scene's `size`, that rounding may decide which way it faces.
fn normal([a, b, c]: [DVec3; 3], size: f64) -> Vec3 {
    let normal = (b - a).cross(c - a);
    let squared = normal.length_squared();
    let sides = [b - a, c - a, c - b].map(DVec3::length_squared);
    let longest = sides.into_iter().fold(0.0, f64::max);
    let height = LEAST_HEIGHT * LEAST_HEIGHT * longest.max(0.01 * size * size);
    match squared >= height * longest && squared > 0.0 {
        true => (normal * (1.0 / squared.sqrt())).as_vec3(),
        false => Vec3::NAN,
    }
}

/// The planes of a leaf's triangles and of the neighbours of these.
#[derive(Debug)]
struct Planes {
    count: usize,
    /// The rows x, y and z of the normals, and the row of the offsets. The number of planes is
    /// rounded up to a multiple of four; the padding repeats the first plane.
    rows: [[f64; Self::MOST]; 4],
    /// The least and the greatest component of the normals on each axis.
    normals: [[f32; 2]; 3],
}

impl Planes {
    /// The capacity for planes: eight triangles, and one neighbour beyond each of their 24 sides.
    const MOST: usize = 32;

    const NONE: Self = Self {
        count: 0,
        rows: [[0.0; Self::MOST]; 4],
        normals: [[2.0, -2.0]; 3],
    };

    fn clear(&mut self) {
        (self.count, self.normals) = (0, Self::NONE.normals);
    }

    /// Adds the plane with `normal` through the point `place`, and returns whether the plane is
    /// known, that is, whether its normal is a number.
    fn add(&mut self, normal: Vec3, place: DVec3) -> bool {
        let own = normal.to_array();
        for ((bounds, row), x) in self.normals.iter_mut().zip(&mut self.rows).zip(own) {
            *bounds = [least(bounds[0], x), most(bounds[1], x)];
            row[self.count] = f64::from(x);
        }
        let offset = normal.as_dvec3().dot(place);
        self.rows[3][self.count] = offset;
        self.count += 1;
        !offset.is_nan()
    }

    /// Pads the rows to a multiple of four, with copies of the first plane.
    fn fill_up(&mut self) {
        let rest = self.count..self.count.next_multiple_of(4);
        for row in &mut self.rows {
            let first = row[0];
            row[rest.clone()].fill(first);
        }
    }

    /// Returns the least and the greatest signed distance from the point `place` to the planes,
    /// along their normals.
    #[allow(clippy::cast_possible_truncation, reason = "the room allows for it")]
    fn offsets(&self, place: DVec3) -> [f32; 2] {
        let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
        let [x, y, z, offset] = &self.rows;
        // Four independent minima and maxima, so that the compiler vectorizes the loop.
        for first in (0..self.count).step_by(4) {
            for lane in 0..4 {
                let k = first + lane;
                let far = offset[k] - (x[k] * place.x + y[k] * place.y + z[k] * place.z);
                low[lane] = if far < low[lane] { far } else { low[lane] };
                high[lane] = if far > high[lane] { far } else { high[lane] };
            }
        }
        let low = low.into_iter().fold(f64::INFINITY, f64::min);
        let high = high.into_iter().fold(f64::NEG_INFINITY, f64::max);
        [low as f32, high as f32]
    }
}

/// The [bends](bend) of the neighbours beyond the sides of a leaf's triangles: for each of the
/// three sides, the bends of the eight triangles.
pub(crate) type Bends = [[u16; 8]; 3];

/// The bend of a neighbour where the bend is not known: not a number.
const UNKNOWN: u16 = 0x7fc0;

/// The last bit of a bend, set if the neighbour lies within the box of the triangle's leaf enlarged
/// threefold.
pub(crate) const NEAR: u16 = 1;

/// The largest relative error of a bend: it has only the upper half of an `f32`, and the last bit
/// is not part of the value.
pub(crate) const BEND_ROOM: f32 = 1.0 / 64.0;

/// Returns how a neighbour is bent away from a triangle's plane beyond one of the triangle's sides:
/// the tangent of the angle between the planes over the side's length, as the upper half of an
/// `f32`. The result is not a number if the angle is over 45° or a unit normal is missing. The sign
/// follows the orientation of the corners.
///
/// With N the triangle's normal, e the side's vector, and A the vector from a shading point to the
/// side, N·A says how far the point is behind the triangle's plane, and N·A + bend N·(A × e) how
/// far it is behind the neighbour's, each up to a positive factor. Unit normals that are rounded to
/// `f32` turn by ε = 2⁻²⁴ each, so the tangent is off by 4 ε.
#[allow(clippy::cast_possible_truncation, reason = "the room allows for it")]
pub(crate) fn bend(side: DVec3, own: Vec3, other: Vec3) -> u16 {
    let (own, other) = (own.as_dvec3(), other.as_dvec3());
    let (sine, cosine) = (other.dot(side.cross(own)), other.dot(own));
    let squared = side.length_squared();
    match sine * sine <= cosine * cosine * squared && cosine > 0.0 {
        true => (((sine / (cosine * squared)) as f32).to_bits() >> 16) as u16 & !NEAR,
        false => UNKNOWN,
    }
}

impl Surfaces {
    /// Collects the data about fine meshes that queries on a finished hierarchy need, and marks the
    /// nodes that hold their triangles. The lists of the triangles are freed as soon as the leaves
    /// have their data, since memory is at its peak then.
    pub(crate) fn new(
        geometry: &Geometry<'_>,
        FineTriangles { sides, turned }: FineTriangles,
        nodes: &mut [Node],
        leaves: &[Leaf],
    ) -> Self {
        for node in &mut *nodes {
            (node.fine, node.all_fine) = (0, 0);
        }
        if sides.is_empty() {
            return Self::default();
        }
        // Collect the ranges of triangle numbers that belong to surfaces.
        let is_fine = (0_u32..).zip(sides.iter().map(|sides| sides[0] != NONE));
        let mut ranges: Vec<[u32; 2]> = Vec::new();
        for (id, _) in is_fine.filter(|(_, is_fine)| *is_fine) {
            match ranges.last_mut() {
                Some([_, end]) if *end == id => *end += 1,
                _ => ranges.push([id, id + 1]),
            }
        }
        // Bring neighbours and normals into the order of leaves, all normals of a surface oriented
        // alike.
        let sides = sides_by_leaves(leaves, sides);
        let size = f64::from(geometry.extent);
        let normals = pool::collect(leaves.len(), AT_ONCE, &|at| {
            let (leaf, known) = (&leaves[at], &sides[at][0]);
            std::array::from_fn(|lane| match known[lane] != NONE {
                false => Vec3::NAN,
                true if turned[leaf.id[lane] as usize] => -normal(corners(leaf, lane), size),
                true => normal(corners(leaf, lane), size),
            })
        });
        drop(turned);
        // Compute the bends in parallel, and for each range of leaves the facing of the nodes above
        // them.
        let mut bends = vec![[[UNKNOWN; 8]; 3]; leaves.len()];
        let around = Around {
            leaves,
            sides: &sides,
            normals,
        };
        let (above_nodes, above_leaves) = above(nodes, leaves.len());
        let ways = pool::stretches_of(&mut bends, AT_ONCE, &|first, bends| {
            around.ways(first, bends, nodes, [&above_nodes, &above_leaves])
        });
        // Combine the facings of all ranges, and mark the children that hold triangles of surfaces,
        // or only such triangles.
        let mut facing = vec![Facing::NOTHING; nodes.len()];
        for way in ways.iter().flatten() {
            let (at, lane) = (way.slot as usize / 8, way.slot as usize % 8);
            facing[at].add(lane, way);
            nodes[at].fine |= 1 << lane;
            nodes[at].all_fine |= u8::from(way.is_all_fine) << lane;
        }
        // A node is all fine if all its children are; go from the leaves up, as children follow
        // their parents.
        for at in (1..nodes.len()).rev() {
            let slot = above_nodes[at] as usize;
            let all = nodes[at].all_fine == nodes[at].valid;
            nodes[slot / 8].all_fine |= u8::from(all) << (slot % 8);
        }
        Self {
            sides,
            bends,
            facing,
            ranges,
        }
    }

    /// Whether the hidden parts of lines can be found by silhouettes of surfaces: there are
    /// surfaces, and none of their triangles is `excluded` (the index of the first excluded
    /// triangle, and how many).
    #[inline]
    pub(crate) fn serve(&self, excluded: (u32, u32)) -> bool {
        let (start, count) = excluded;
        if self.ranges.is_empty() || count == 0 {
            return !self.ranges.is_empty();
        }
        let next = self.ranges.partition_point(|range| range[1] <= start);
        let first = self.ranges.get(next).map(|range| range[0]);
        first.is_none_or(|first| start.saturating_add(count) <= first)
    }

    /// Prefetches the data of a leaf's triangles.
    #[inline(always)]
    pub(crate) fn prefetch_leaf<S: Simd>(&self, s: S, index: usize) {
        s.prefetch(&self.bends[index]);
        s.prefetch(&self.sides[index]);
    }

    /// The bytes of memory that the surfaces take.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.sides[..]) + size_of_val(&self.bends[..]) + size_of_val(&self.facing[..])
    }
}

/// The leaves of a hierarchy, with the neighbours and normals of their triangles.
struct Around<'a> {
    leaves: &'a [Leaf],
    sides: &'a [[[u32; 8]; 3]],
    /// The normals of surfaces' triangles, all of one surface oriented alike.
    normals: Vec<[Vec3; 8]>,
}

impl Around<'_> {
    /// Computes the bends of a range of leaves that begins at `first`, and returns the facing of
    /// all children of nodes that these leaves are in; a child that several ranges share is
    /// returned by each. `above_nodes` and `above_leaves` are the parent slots of nodes and leaves.
    fn ways(
        &self,
        first: usize,
        bends: &mut [Bends],
        nodes: &[Node],
        [above_nodes, above_leaves]: [&[u32]; 2],
    ) -> Vec<Way> {
        let mut done: Vec<Way> = Vec::new();
        // The children on the path from the root to the current leaf. Since leaves are in the
        // tree's order, only the end of the path changes from one to the next.
        let (mut open, mut path): (Vec<Way>, Vec<u32>) = Default::default();
        let mut planes = Planes::NONE;
        for (at, bends) in (first..).zip(bends) {
            let fine = (self.sides[at][0].iter().filter(|side| **side != NONE)).count();
            if fine == 0 {
                continue;
            }
            // Find the path to this leaf, and keep the part that it shares with the one before.
            path.clear();
            let mut slot = above_leaves[at];
            while slot != NONE {
                path.push(slot);
                slot = above_nodes[slot as usize / 8];
            }
            let same = open.iter().zip(path.iter().rev());
            let same = same.take_while(|(way, slot)| way.slot == **slot).count();
            done.extend(open.drain(same..));
            open.extend((path.iter().rev().skip(same)).map(|slot| Way::new(*slot, nodes)));
            // Add the leaf's planes to all children on the path.
            let slot = above_leaves[at] as usize;
            let is_known = self.look(at, &nodes[slot / 8], slot % 8, bends, &mut planes);
            planes.fill_up();
            let planes = is_known.then_some(&planes);
            if let Some(own) = open.last_mut() {
                own.is_all_fine = fine == lanes(&self.leaves[at]).count();
            }
            // Everything above a child whose facing is not known is not known either.
            for way in open.iter_mut().rev().take_while(|way| !way.is_unknown()) {
                way.add(planes);
            }
        }
        done.extend(open);
        done
    }

    /// Computes the bends of one leaf, collects in `around` the planes of its triangles and of
    /// their neighbours, and returns whether all of these planes are known. `node` and `lane` say
    /// where the leaf's box is stored.
    fn look(
        &self,
        at: usize,
        node: &Node,
        lane: usize,
        bends: &mut Bends,
        around: &mut Planes,
    ) -> bool {
        let (leaves, normals, sides) = (self.leaves, &self.normals, &self.sides[at]);
        let Bounds { lo, hi } = node.bounds_of(lane);
        // A neighbour is near if it lies within the leaf's box enlarged threefold.
        let room = [0, 1, 2].map(|axis| {
            let (low, high) = (f64::from(lo[axis]), f64::from(hi[axis]));
            [low - (high - low), high + (high - low)]
        });
        let is_near = |slot: usize| {
            let corners = leaves[slot / 8].vertices.chunks_exact(3);
            let mut all = corners.flat_map(|v| v.iter().zip(&room));
            all.all(|(row, [low, high])| (low..=high).contains(&&f64::from(row[slot % 8])))
        };
        around.clear();
        let mut is_known = true;
        for own in (0..8).filter(|own| sides[0][*own] != NONE) {
            let normal = normals[at][own];
            let corners = corners(&leaves[at], own);
            is_known &= around.add(normal, corners[0]);
            let [a, b, c] = corners;
            for (k, (from, e)) in [(a, b - a), (b, c - b), (c, a - c)].into_iter().enumerate() {
                let side = sides[k][own];
                if side == EDGE {
                    // The number of layers changes at an edge no matter which way the triangle
                    // faces.
                    is_known = false;
                    continue;
                }
                let slot = (side >> 1) as usize;
                let is_within = slot / 8 == at;
                let other = normals[slot / 8][slot % 8];
                let bend_away = &mut bends[k][own];
                if side & 1 == 0 {
                    *bend_away = bend(e, normal, other);
                }
                *bend_away |= NEAR * u16::from(is_within || is_near(slot));
                if !is_within {
                    // The plane goes through the corners that both triangles have.
                    is_known &= around.add(other, from);
                }
            }
        }
        is_known
    }
}

/// Returns, for each node and each leaf, the slot of its parent, which is the parent's index × 8 +
/// the lane in it; [`NONE`] for the root.
fn above(nodes: &[Node], leaves: usize) -> (Vec<u32>, Vec<u32>) {
    let mut above = (vec![NONE; nodes.len()], vec![NONE; leaves]);
    for (first, node) in (0_u32..).step_by(8).zip(nodes) {
        for lane in node.lanes() {
            let child = Child(node.child[lane]);
            let slots = match child.is_leaf() {
                true => &mut above.1,
                false => &mut above.0,
            };
            slots[child.index()] = first + index(lane);
        }
    }
    above
}

/// Returns the corners of the triangle in one lane of a leaf.
fn corners(leaf: &Leaf, lane: usize) -> [DVec3; 3] {
    leaf.triangle(lane).map(|v| DVec3::from(v.map(f64::from)))
}

/// The lanes of a leaf that are in use; the others repeat the first.
fn lanes(leaf: &Leaf) -> impl Iterator<Item = usize> {
    let id = leaf.id;
    (0..8).filter(move |lane| *lane == 0 || id[*lane] != id[0])
}

/// Converts neighbours from the caller's order, with triangle numbers, to the order of leaves, with
/// slots, as [`Surfaces::sides`] has them. The atomics only let threads fill the table together.
fn sides_by_leaves(leaves: &[Leaf], of: Vec<[u32; 3]>) -> Vec<[[u32; 8]; 3]> {
    let slot_of = pool::collect(of.len(), AT_ONCE, &|_| AtomicU32::new(NONE));
    pool::collect(leaves.len(), AT_ONCE, &|at| {
        for lane in lanes(&leaves[at]) {
            let slot = &slot_of[leaves[at].id[lane] as usize];
            slot.store(index(8 * at + lane), Ordering::Relaxed);
        }
    });
    pool::collect(leaves.len(), AT_ONCE, &|at| {
        let mut sides = [[NONE; 8]; 3];
        for lane in lanes(&leaves[at]) {
            for (own, side) in sides.iter_mut().zip(of[leaves[at].id[lane] as usize]) {
                own[lane] = match side {
                    NONE | EDGE => side,
                    _ => {
                        let slot = slot_of[(side >> 1) as usize].load(Ordering::Relaxed);
                        slot << 1 | side & 1
                    }
                };
            }
        }
        sides
    })
}

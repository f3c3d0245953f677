//! Fine meshes as surfaces: which triangles are neighbours, and which way they all face.
//!
//! What a triangle hides of a line begins at one of its sides and ends at another. Where two
//! neighbours lie on either side of the side they share, as nearly everywhere, one goes on where
//! the other ends; the number of layers over a line changes only at the sides of which both lie on
//! one side, the surface's *silhouette* as seen from the shading point, and at its edges. A node
//! keeps bounds of the planes of all triangles in it and next to it: where they all face the
//! shading point, or all face away, and none has an edge, nothing changes.

use crate::{
    build::{Bounds, Geometry, index, least, most},
    closed_mesh::FineTriangles,
    node::{Child, Leaf, Node},
    pool,
};
use linelit_geometry::{DVec3, glam::Vec3};
use linelit_simd::Simd;
use std::sync::atomic::{AtomicU32, Ordering};

/// The least number of triangles in a fine surface: smaller ones are tested one by one.
/// `docs/decisions/015-silhouettes-of-fine-meshes.md`.
pub(crate) const FINE: u32 = 1024;

/// The largest part, one in so many, of triangles that may belong to no fine surface: with more,
/// all are tested one by one, since these have to be in any case and hide most silhouettes.
pub(crate) const LOOSE: u32 = 8;

/// The least number of triangles per edge in a fine surface: others are tested one by one.
pub(crate) const MOSTLY: u32 = 4;

/// A side of a triangle that belongs to no surface.
pub(crate) const NONE: u32 = u32::MAX;

/// A side of a surface's triangle that has no other triangle beyond it, or several.
pub(crate) const EDGE: u32 = u32::MAX - 2;

/// Height of a triangle, as a fraction of its longest side and of the scene, from which the way it
/// faces is known in `f64` where [`FACING_ROOM`] says so.
const LEAST_HEIGHT: f64 = 1e-6;

/// Rounding of how far a place is before a triangle's plane, in units of the scene: in `f32`, six
/// roundings of normals, places and offsets and of products of them, each at most 6e-8 of two
/// scenes, three axes each, are 4e-6; what `f64` may get wrong of the sign is under 1e-6.
pub(crate) const FACING_ROOM: f64 = 1e-5;

/// Leaves that are looked at in one go.
const AT_ONCE: usize = 1 << 11;

/// The surfaces of a hierarchy.
#[derive(Debug, Default)]
pub(crate) struct Surfaces {
    /// The neighbours of each leaf's triangles beyond their sides from corner 0 to 1, 1 to 2 and 2
    /// to 0: the neighbour's leaf × 8 + lane, and in the last bit whether it runs along the side in
    /// the same direction; [`NONE`] for a triangle of no surface.
    pub(crate) sides: Vec<[[u32; 8]; 3]>,
    /// The angles, for each leaf, by which its triangles' neighbours are bent away: [`bend`].
    pub(crate) bends: Vec<Bends>,
    /// The facing of each node's children.
    pub(crate) facing: Vec<Facing>,
    /// The stretches of the caller's numbers that are triangles of surfaces: first, and beyond.
    ranges: Vec<[u32; 2]>,
}

/// Bounds of the planes of the triangles in each child of a node and next to them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Facing {
    /// Unit normals, all of a mesh turned alike: least x, y, z, then greatest.
    pub(crate) normal: [[f32; 8]; 6],
    /// The distances from the planes to the middle of the child's box, before it, at least and at
    /// most; infinite where nothing is known.
    pub(crate) offset: [[f32; 8]; 2],
}

impl Facing {
    const NOTHING: Self = Self {
        normal: [
            [2.0; 8], [2.0; 8], [2.0; 8], [-2.0; 8], [-2.0; 8], [-2.0; 8],
        ],
        offset: [[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]],
    };

    /// Extends the facing of a child by that of some leaves.
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

/// The facing of a child of a node, as some of the leaves in it determine it.
struct Way {
    /// The node × 8 + lane.
    slot: u32,
    /// The middle of its box.
    middle: DVec3,
    /// Whether it is a leaf of nothing but triangles of surfaces.
    is_all_fine: bool,
    /// The bounds of the normals and offsets, as in [`Planes`] and [`Facing`].
    normals: [[f32; 2]; 3],
    offset: [f32; 2],
}

impl Way {
    fn new(slot: u32, nodes: &[Node]) -> Self {
        let Bounds { lo, hi } = nodes[slot as usize / 8].bounds_of(slot as usize % 8);
        // The same bits as for eight at a time.
        let middle = [0, 1, 2].map(|axis| f64::from((lo[axis] + hi[axis]) * 0.5));
        Self {
            slot,
            middle: middle.into(),
            is_all_fine: false,
            normals: Planes::NONE.normals,
            offset: [f32::INFINITY, f32::NEG_INFINITY],
        }
    }

    /// Takes in planes; `None` faces any way.
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

/// A normal as a triangle's corners run, of unit length; not a number where rounding may decide
/// which way it faces.
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

/// The planes of a leaf's triangles and those next to them.
#[derive(Debug)]
struct Planes {
    count: usize,
    /// x, y and z of the normals, and the offsets; a whole number of fours, of which the last
    /// repeat the first.
    rows: [[f64; Self::MOST]; 4],
    /// The least and the greatest component of the normals on each axis.
    normals: [[f32; 2]; 3],
}

impl Planes {
    /// Eight triangles, and one beyond each of their sides.
    const MOST: usize = 32;

    const NONE: Self = Self {
        count: 0,
        rows: [[0.0; Self::MOST]; 4],
        normals: [[2.0, -2.0]; 3],
    };

    fn clear(&mut self) {
        (self.count, self.normals) = (0, Self::NONE.normals);
    }

    /// Adds that with a normal through a place, and tells whether it is known.
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

    /// Fills up to a whole number of fours.
    fn fill_up(&mut self) {
        let rest = self.count..self.count.next_multiple_of(4);
        for row in &mut self.rows {
            let first = row[0];
            row[rest.clone()].fill(first);
        }
    }

    /// Returns how far the planes are before a place, at least and at most.
    #[allow(clippy::cast_possible_truncation, reason = "the room allows for it")]
    fn offsets(&self, place: DVec3) -> [f32; 2] {
        let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
        let [x, y, z, offset] = &self.rows;
        // Four side by side, which one after the other would not be taken for.
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

/// The [bends](bend) of the neighbours beyond the sides of a leaf's triangles.
pub(crate) type Bends = [[u16; 8]; 3];

/// The bend of a neighbour for which it is not known: not a number.
const UNKNOWN: u16 = 0x7fc0;

/// The bit of a bend that tells whether the neighbour lies within the box of the leaf made three
/// times as large.
pub(crate) const NEAR: u16 = 1;

/// The relative error of a bend at most, from the lower half of the `f32` and the last bit.
pub(crate) const BEND_ROOM: f32 = 1.0 / 64.0;

/// Returns how a neighbour is bent away from a triangle's plane beyond one of its sides, as its
/// corners run: the tangent of the angle over the side's length, as the upper half of an `f32`; not
/// a number if that angle is over 45° or a unit normal is missing.
///
/// With N the normal of the triangle as its corners run, e the side, and A the way to it from a
/// place: N·A tells how far that place is behind the triangle's plane, and N·A + bend N·(A × e) how
/// far it is behind the neighbour's, each up to a factor. Unit normals that are rounded to `f32`
/// turn by ε = 2⁻²⁴ each: the tangent is off by 4 ε.
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
    /// Finds how the fine meshes lie in a hierarchy. The data of their triangles are freed as soon
    /// as leaves have them: the hierarchy is at its largest then.
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
        let is_fine = (0_u32..).zip(sides.iter().map(|sides| sides[0] != NONE));
        let mut ranges: Vec<[u32; 2]> = Vec::new();
        for (id, _) in is_fine.filter(|(_, is_fine)| *is_fine) {
            match ranges.last_mut() {
                Some([_, end]) if *end == id => *end += 1,
                _ => ranges.push([id, id + 1]),
            }
        }
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
        let mut facing = vec![Facing::NOTHING; nodes.len()];
        for way in ways.iter().flatten() {
            let (at, lane) = (way.slot as usize / 8, way.slot as usize % 8);
            facing[at].add(lane, way);
            nodes[at].fine |= 1 << lane;
            nodes[at].all_fine |= u8::from(way.is_all_fine) << lane;
        }
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

    /// Whether lines past them may be answered by their silhouettes: there are some, and none of
    /// their triangles may be excluded.
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

    /// Asks for what is known of a leaf's triangles ahead of time.
    #[inline(always)]
    pub(crate) fn prefetch_leaf<S: Simd>(&self, s: S, index: usize) {
        s.prefetch(&self.bends[index]);
        s.prefetch(&self.sides[index]);
    }

    /// Bytes that they take.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.sides[..]) + size_of_val(&self.bends[..]) + size_of_val(&self.facing[..])
    }
}

/// The hierarchy around the leaves.
struct Around<'a> {
    leaves: &'a [Leaf],
    sides: &'a [[[u32; 8]; 3]],
    /// The normals of surfaces' triangles, of a surface all turned alike.
    normals: Vec<[Vec3; 8]>,
}

impl Around<'_> {
    /// Fills in how the neighbours of some leaves' triangles are bent away, and tells how the
    /// children face that these leaves are in, given where nodes and leaves hang.
    fn ways(
        &self,
        first: usize,
        bends: &mut [Bends],
        nodes: &[Node],
        [above_nodes, above_leaves]: [&[u32]; 2],
    ) -> Vec<Way> {
        let mut done: Vec<Way> = Vec::new();
        // From the root down to the leaf; in the tree's order, few of them change.
        let (mut open, mut path): (Vec<Way>, Vec<u32>) = Default::default();
        let mut planes = Planes::NONE;
        for (at, bends) in (first..).zip(bends) {
            let fine = (self.sides[at][0].iter().filter(|side| **side != NONE)).count();
            if fine == 0 {
                continue;
            }
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
            let slot = above_leaves[at] as usize;
            let is_known = self.look(at, &nodes[slot / 8], slot % 8, bends, &mut planes);
            planes.fill_up();
            let planes = is_known.then_some(&planes);
            if let Some(own) = open.last_mut() {
                own.is_all_fine = fine == lanes(&self.leaves[at]).count();
            }
            // Above what is not known nothing is.
            for way in open.iter_mut().rev().take_while(|way| !way.is_unknown()) {
                way.add(planes);
            }
        }
        done.extend(open);
        done
    }

    /// Fills in how the neighbours of a leaf's triangles are bent away; collects their planes and
    /// those of the triangles, and tells whether all are known.
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
                    // It may be crossed however it faces.
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
                    // Both have the side's corners.
                    is_known &= around.add(other, from);
                }
            }
        }
        is_known
    }
}

/// Returns the parent slot of each node and each leaf: the node × 8 + lane; [`NONE`] for the root.
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

/// A triangle's corners.
fn corners(leaf: &Leaf, lane: usize) -> [DVec3; 3] {
    leaf.triangle(lane).map(|v| DVec3::from(v.map(f64::from)))
}

/// The lanes of a leaf that are in use; others repeat the first.
fn lanes(leaf: &Leaf) -> impl Iterator<Item = usize> {
    let id = leaf.id;
    (0..8).filter(move |lane| *lane == 0 || id[*lane] != id[0])
}

/// [`Surfaces::sides`], of those of triangles in the caller's order.
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

//! Fine meshes as surfaces: which triangles are neighbours, and which way they all face.
//!
//! What a triangle hides of a line begins at one of its sides and ends at another. Where two
//! neighbours lie on either side of the side they share, as nearly everywhere, one goes on where
//! the other ends; the number of layers over a line changes only at the sides of which both lie on
//! one side, the surface's *silhouette* as seen from the shading point, and at its edges. A node
//! keeps bounds of the planes of all triangles in it and next to it: where they all face the
//! shading point, or all face away, and none has an edge, nothing changes.

use crate::{
    build::Geometry,
    closed_mesh::ClosedMeshes,
    node::{Child, Leaf, Node},
};
use linelit_geometry::DVec3;
use linelit_simd::Simd;

/// Meshes of fewer triangles are looked at triangle by triangle.
/// `docs/decisions/015-silhouettes-of-fine-meshes.md`.
pub(crate) const FINE: u32 = 1024;

/// So are all where more than this part of the triangles belong to none that is fine: they have to
/// be walked past in any case, and hide most of what silhouettes would tell.
pub(crate) const LOOSE: u32 = 8;

/// And so are those of which more than one side in so many triangles is an edge.
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

/// The surfaces of a hierarchy.
#[derive(Debug, Default)]
pub(crate) struct Surfaces {
    /// For each leaf, what is beyond the sides from corner 0 to 1, 1 to 2 and 2 to 0 of its
    /// triangles: the neighbour's leaf × 8 + lane, and in the last bit whether it runs along the
    /// side in the same direction; [`NONE`] for a triangle of no surface.
    pub(crate) sides: Vec<[[u32; 8]; 3]>,
    /// For each leaf, how its triangles' neighbours are bent away: [`bend`].
    pub(crate) bends: Vec<Bends>,
    /// For each node, how its children face.
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
    /// How far the planes are before the middle of the child's box, at least and at most; infinite
    /// where nothing is known.
    pub(crate) offset: [[f32; 8]; 2],
}

impl Facing {
    const NOTHING: Self = Self {
        normal: [
            [2.0; 8], [2.0; 8], [2.0; 8], [-2.0; 8], [-2.0; 8], [-2.0; 8],
        ],
        offset: [[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]],
    };

    /// Takes in a plane before or behind the middle of a child's box; `None` faces any way.
    #[allow(clippy::cast_possible_truncation, reason = "the room allows for it")]
    fn add(&mut self, lane: usize, middle: DVec3, plane: Option<&Plane>) {
        if self.is_unknown(lane) {
            return;
        }
        let Some(Plane { normal, place }) = plane else {
            self.offset[0][lane] = f32::NEG_INFINITY;
            self.offset[1][lane] = f32::INFINITY;
            return;
        };
        for (axis, x) in normal.to_array().into_iter().enumerate() {
            let [least, most] = [axis, axis + 3];
            self.normal[least][lane] = self.normal[least][lane].min(x as f32);
            self.normal[most][lane] = self.normal[most][lane].max(x as f32);
        }
        let offset = normal.dot(*place - middle) as f32;
        self.offset[0][lane] = self.offset[0][lane].min(offset);
        self.offset[1][lane] = self.offset[1][lane].max(offset);
    }

    fn is_unknown(&self, lane: usize) -> bool {
        self.offset[0][lane] == f32::NEG_INFINITY
    }
}

/// The plane of a triangle.
#[derive(Clone, Copy, Debug)]
struct Plane {
    /// Unit length, rounded to `f32`.
    normal: DVec3,
    /// A place in it.
    place: DVec3,
}

impl Plane {
    /// Of a triangle, turned or not; `None` where rounding may decide which way it faces.
    fn new(leaf: &Leaf, lane: usize, turned: bool, size: f64) -> Option<Self> {
        let [a, b, c] = leaf.triangle(lane).map(|v| DVec3::from(v.map(f64::from)));
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        let sides = [b - a, c - a, c - b].map(DVec3::length);
        let longest = sides.into_iter().fold(0.0, f64::max);
        let known = length >= LEAST_HEIGHT * longest * longest
            && length >= 0.1 * LEAST_HEIGHT * longest * size;
        let normal = normal * (if turned { -1.0 } else { 1.0 } / length);
        known.then(|| Self {
            normal: normal.as_vec3().as_dvec3(),
            place: a,
        })
    }
}

/// How the neighbours beyond the sides of a leaf's triangles are [bent](bend) away.
pub(crate) type Bends = [[u16; 8]; 3];

/// That of a neighbour of which it is not known: not a number.
const UNKNOWN: u16 = 0x7fc0;

/// The bit of a bend that tells whether the neighbour lies within the box of the leaf made three
/// times as large.
pub(crate) const NEAR: u16 = 1;

/// What cutting off the lower half of an `f32` and that bit, or adding it, changes of it at most.
pub(crate) const BEND_ROOM: f32 = 0.015_625;

/// How a neighbour beyond side `k` is bent away from the plane of a triangle: the tangent of the
/// angle over the side's length; not a number if that angle is over 45° or hardly known. The upper
/// half of an `f32`.
///
/// With N the normal of the triangle as its corners run, e the side, and A the way to it from a
/// place: N·A tells how far that place is behind the triangle's plane, and N·A + bend N·(A × e) how
/// far it is behind the neighbour's, each up to a factor.
#[allow(clippy::cast_possible_truncation, reason = "the room allows for it")]
pub(crate) fn bend(triangle: [DVec3; 3], k: usize, neighbour: [DVec3; 3]) -> u16 {
    let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
    let mut beyond = neighbour.into_iter().filter(|v| *v != a && *v != b);
    let (Some(d), None) = (beyond.next(), beyond.next()) else {
        return UNKNOWN;
    };
    let (e, f, g) = (b - a, c - a, d - a);
    let (own, other) = (e.cross(f), g.cross(e));
    let least = |side: DVec3| LEAST_HEIGHT * e.length() * e.length().max(side.length());
    if !(own.length() > least(f) && other.length() > least(g)) {
        return UNKNOWN;
    }
    let outward = e.cross(own);
    let bend = other.dot(outward) / (other.dot(own) * e.length_squared());
    match other.dot(own) > 0.0 && bend.abs() * e.length() <= 1.0 {
        true => ((bend as f32).to_bits() >> 16) as u16 & !NEAR,
        false => UNKNOWN,
    }
}

/// The middle of a child's box: the same bits as for eight at a time.
#[inline]
fn middle(node: &Node, lane: usize) -> DVec3 {
    let b = &node.bounds;
    let x = [0, 1, 2].map(|axis| (b[axis][lane] + b[axis + 3][lane]) * 0.5);
    DVec3::from(x.map(f64::from))
}

impl Surfaces {
    /// Finds how the fine meshes lie in a hierarchy.
    pub(crate) fn new(
        geometry: &Geometry<'_>,
        closed: &ClosedMeshes,
        (nodes, leaves): (&mut [Node], &[Leaf]),
    ) -> Self {
        for node in &mut *nodes {
            (node.fine, node.all_fine) = (0, 0);
        }
        let fine = &closed.fine;
        if fine.sides.is_empty() {
            return Self::default();
        }
        let mut slot_of = vec![NONE; fine.sides.len()];
        for (slot, id) in slots(leaves) {
            slot_of[id as usize] = slot;
        }
        let mut sides = vec![[[NONE; 8]; 3]; leaves.len()];
        for (slot, id) in slots(leaves) {
            let (leaf, lane) = (slot as usize / 8, slot as usize % 8);
            for (k, side) in fine.sides[id as usize].into_iter().enumerate() {
                sides[leaf][k][lane] = match side {
                    NONE | EDGE => side,
                    _ => slot_of[(side >> 1) as usize] << 1 | side & 1,
                };
            }
        }
        let corners = |slot: u32| {
            leaves[slot as usize / 8]
                .triangle(slot as usize % 8)
                .map(|v| DVec3::from(v.map(f64::from)))
        };
        let mut bends = vec![[[UNKNOWN; 8]; 3]; leaves.len()];
        for (slot, _) in slots(leaves) {
            let (leaf, lane) = (slot as usize / 8, slot as usize % 8);
            for (k, sides) in sides[leaf].iter().enumerate() {
                let side = sides[lane];
                if side != NONE && side != EDGE && side & 1 == 0 {
                    bends[leaf][k][lane] = bend(corners(slot), k, corners(side >> 1));
                }
            }
        }
        let is_fine = (0_u32..).zip(fine.sides.iter().map(|sides| sides[0] != NONE));
        let mut ranges: Vec<[u32; 2]> = Vec::new();
        for (id, _) in is_fine.filter(|(_, is_fine)| *is_fine) {
            match ranges.last_mut() {
                Some([_, end]) if *end == id => *end += 1,
                _ => ranges.push([id, id + 1]),
            }
        }
        let mut surfaces = Self {
            sides,
            bends,
            facing: vec![Facing::NOTHING; nodes.len()],
            ranges,
        };
        surfaces.face(geometry, closed, (nodes, leaves));
        surfaces
    }

    /// Fills in how the nodes' children face, and which have triangles of surfaces.
    fn face(
        &mut self,
        geometry: &Geometry<'_>,
        closed: &ClosedMeshes,
        (nodes, leaves): (&mut [Node], &[Leaf]),
    ) {
        let size = f64::from(geometry.extent);
        let plane = |slot: u32| {
            let (leaf, lane) = (&leaves[slot as usize / 8], slot as usize % 8);
            Plane::new(leaf, lane, closed.fine.turned[leaf.id[lane] as usize], size)
        };
        // Where each node hangs: what is above a node stands before it.
        let mut above = vec![(NONE, 0_usize); nodes.len()];
        let mut planes = Vec::new();
        for at in 0..nodes.len() {
            let Node { child, valid, .. } = nodes[at];
            let number = u32::try_from(at).unwrap_or(NONE);
            for lane in (0..8).filter(|lane| valid >> lane & 1 != 0) {
                let child = Child(child[lane]);
                if !child.is_leaf() {
                    above[child.index()] = (number, lane);
                    continue;
                }
                planes.clear();
                self.mark_near(child, (&nodes[at], lane), leaves);
                let sides = &self.sides[child.index()];
                let (slots, mut count) = (child.slots(), 0);
                for own in (0..8).filter(|own| sides[0][*own] != NONE) {
                    count += 1;
                    planes.push(plane(slots[own]));
                    for side in sides.map(|side| side[own]) {
                        if side == EDGE {
                            // An edge may be crossed however it faces.
                            planes.push(None);
                        } else if side >> 4 != slots[0] >> 3 {
                            planes.push(plane(side >> 1));
                        }
                    }
                }
                nodes[at].all_fine |= u8::from(count == child.count()) << lane;
                let mut place = (number, lane);
                while place.0 != NONE && count > 0 {
                    let (at, lane) = (place.0 as usize, place.1);
                    let middle = middle(&nodes[at], lane);
                    nodes[at].fine |= 1 << lane;
                    for plane in &planes {
                        self.facing[at].add(lane, middle, plane.as_ref());
                    }
                    place = above[at];
                }
            }
        }
        for at in (1..nodes.len()).rev() {
            let (node, lane) = above[at];
            let all = nodes[at].all_fine == nodes[at].valid;
            nodes[node as usize].all_fine |= u8::from(all) << lane;
        }
    }

    /// Marks the sides of a leaf's triangles whose neighbours are [near](NEAR) its box.
    fn mark_near(&mut self, child: Child, (node, lane): (&Node, usize), leaves: &[Leaf]) {
        let sides = &self.sides[child.index()];
        let is_near = |side: u32| {
            let leaf = &leaves[side as usize >> 4];
            let within = |v: [f32; 3]| {
                (0..3).all(|axis| {
                    let [low, high] = [axis, axis + 3].map(|row| f64::from(node.bounds[row][lane]));
                    let size = high - low;
                    (low - size..=high + size).contains(&f64::from(v[axis]))
                })
            };
            leaf.triangle((side >> 1) as usize % 8)
                .into_iter()
                .all(within)
        };
        for (sides, bends) in sides.iter().zip(&mut self.bends[child.index()]) {
            for (&side, bend) in sides.iter().zip(bends) {
                if side != NONE && side != EDGE && is_near(side) {
                    *bend |= NEAR;
                }
            }
        }
    }

    /// Whether lines past them may be answered by their silhouettes: there are some, and none of
    /// their triangles may be excluded.
    #[inline]
    pub(crate) fn serve(&self, (start, count): (u32, u32)) -> bool {
        if self.ranges.is_empty() || count == 0 {
            return !self.ranges.is_empty();
        }
        let next = self.ranges.partition_point(|range| range[1] <= start);
        let first = self.ranges.get(next).map(|range| range[0]);
        first.is_none_or(|first| start.saturating_add(count) <= first)
    }

    /// Asks for what is known of a node's or leaf's triangles ahead of time.
    #[inline(always)]
    pub(crate) fn prefetch<S: Simd>(&self, s: S, child: Child) {
        if child.is_leaf() {
            s.prefetch(&self.bends[child.index()]);
            s.prefetch(&self.sides[child.index()]);
        } else {
            s.prefetch(&self.facing[child.index()]);
        }
    }

    /// Bytes that they take.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.sides[..]) + size_of_val(&self.bends[..]) + size_of_val(&self.facing[..])
    }
}

/// Each triangle's leaf × 8 + lane, and its number in the caller's list; lanes that are not in use
/// repeat the first.
fn slots(leaves: &[Leaf]) -> impl Iterator<Item = (u32, u32)> {
    let lanes = |(leaf, first): (&Leaf, u32)| {
        let id = leaf.id;
        let used = (0..8).filter(move |k| *k == 0 || id[*k as usize] != id[0]);
        used.map(move |k| (first + k, id[k as usize]))
    };
    leaves.iter().zip((0_u32..).step_by(8)).flat_map(lanes)
}

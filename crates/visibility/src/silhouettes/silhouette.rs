//! The silhouettes of fine meshes.
//!
//! Along a line on the light, the number of a surface's triangles that lie over it changes only
//! where it crosses a side of which both neighbours lie on one side, so that two come or two go, or
//! an edge, where one does. So what lies between such sides is hidden as a whole or not at all,
//! whatever shape the surface has, and whether or not it meets itself: what decides grows with the
//! length of silhouettes and not with the number of triangles.
//!
//! A triangle that is not wholly between the shading point and the light, or runs far aside, is cut
//! and hides what its pieces hide, as in any shaft; its neighbours begin and end at the sides they
//! share with it. Ends of sides are the same bits as those of the images of triangles, which way a
//! triangle faces is one decision for all three of its sides, and so what comes goes.

use crate::{
    build::Hierarchy,
    counters::Counters,
    node::{Child, Leaf, Node},
    shaft::{
        bounds::ShaftBounds,
        frame::LightFrame,
        project::{self, GUARD},
    },
    silhouettes::turning::{is_front, turning},
    surfaces::{EDGE, FACING_ROOM, Facing, NEAR, NONE},
};
use linelit_geometry::DVec3;
use linelit_simd::Simd;

/// A light or lines that silhouettes may hide.
pub(crate) trait Target {
    /// Tells which of eight images may matter, given bounds of p and of q; of others than those
    /// `among` which it is asked, anything.
    fn needs<S: Simd>(&self, s: S, among: u8, low: [S::F; 2], high: [S::F; 2]) -> u8;

    /// Tells which of the sides between eight places and eight others may matter.
    fn meets<S: Simd>(&self, s: S, from: [S::D; 2], to: [S::D; 2]) -> u8;

    /// Takes in a side between two places, and how many layers begin beyond it, where q is greater,
    /// if p ascends along it or does not.
    fn side<S: Simd>(&mut self, s: S, ends: [[f64; 2]; 2], change: impl FnOnce(bool) -> i32);
}

/// Buffers of a search for silhouettes.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    /// Leaves with triangles that have to be cut, and a bit for each of those.
    pub(crate) cut: Vec<(u32, u8)>,
    /// Nodes to open, in the order in which they were found.
    nodes: Vec<u32>,
    /// Leaves to look into: of any triangles; of some of which none has to be cut; and of some of
    /// which none has to be in a box three times as large, either.
    leaves: [Vec<u32>; 3],
}

/// A search for silhouettes between a shading point and a light or a few lines on it.
pub(crate) struct Search<'a> {
    hierarchy: &'a Hierarchy,
    bounds: &'a ShaftBounds,
    frame: &'a LightFrame,
    /// The shading point in the hierarchy's coordinates.
    point: DVec3,
    /// The shading point, rounded.
    near_point: [f32; 3],
    /// The rounding error of a distance from a plane, at most.
    room: f32,
    /// Whether [front](Outlines::front) triangles are counter-clockwise in (p, q).
    upright: bool,
}

/// The sides of eight triangles in (p, q).
struct Outlines {
    p: [[f64; 8]; 3],
    q: [[f64; 8]; 3],
    /// A bit for each triangle whose plane the shading point is behind, as its corners run.
    front: u8,
    /// A bit for each triangle whose corner is between the shading point and the light, and not far
    /// aside.
    good: [u8; 3],
}

/// The known facts about a triangle and its neighbour beyond a side; false where not known.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    /// Whether the shading point is behind its plane, as its corners run.
    front: bool,
    /// Whether the shading point is before its plane.
    back: bool,
    /// It is before that of the neighbour, which has its corners in the same order.
    back_beyond: bool,
    /// The neighbour does not have to be cut.
    whole_beyond: bool,
}

impl Outlines {
    fn whole(&self) -> u8 {
        self.good[0] & self.good[1] & self.good[2]
    }
}

/// Returns how many layers begin beyond a side that a line crosses, for a triangle that faces so
/// and runs along it with p ascending or not.
#[inline(always)]
fn layers(is_front: bool, upright: bool, ascending: bool) -> i32 {
    // Counter-clockwise, what is inside is left of the way.
    let counter_clockwise = is_front == upright;
    if counter_clockwise == ascending {
        1
    } else {
        -1
    }
}

impl<'a> Search<'a> {
    /// Creates the search from a point, given the hierarchy, its extent and bounds.
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward")]
    pub(crate) fn new(
        hierarchy: &'a Hierarchy,
        extent: f64,
        bounds: &'a ShaftBounds,
        frame: &'a LightFrame,
        point: DVec3,
    ) -> Self {
        let size = extent.max(point.abs().max_element());
        Self {
            hierarchy,
            bounds,
            frame,
            point,
            near_point: point.as_vec3().to_array(),
            room: (FACING_ROOM * size) as f32,
            upright: frame.p.dot(frame.q.cross(frame.w)) > 0.0,
        }
    }

    /// Finds the silhouettes that matter to a target.
    #[inline(always)]
    pub(crate) fn walk<S: Simd>(
        &self,
        s: S,
        target: &mut impl Target,
        lists: &mut Lists,
        counters: &mut Counters,
    ) {
        lists.cut.clear();
        // Breadth first, and all leaves at the end: nothing hangs on how many boxes are found, so
        // that one node need not wait for another, and all are known ahead.
        let mut nodes = std::mem::take(&mut lists.nodes);
        let mut leaves = std::mem::take(&mut lists.leaves);
        let (mut ends, mut end) = ([0; 3], 1);
        make_room(&mut nodes, 0);
        nodes[0] = 0;
        let mut at = 0;
        while at < end {
            let ahead = nodes[(at + AHEAD).min(end - 1)] as usize;
            s.prefetch(&self.hierarchy.nodes[ahead]);
            s.prefetch(&self.hierarchy.surfaces.facing[ahead]);
            let index = nodes[at] as usize;
            at += 1;
            let node = &self.hierarchy.nodes[index];
            counters.node_tests += u64::from(node.valid.count_ones());
            let facing = &self.hierarchy.surfaces.facing[index];
            let (found, whole, roomy) = self.boxes(s, node, facing, target);
            make_room(&mut nodes, end);
            let inner = found & !node.leaf;
            s.pack(inner, &node.child, &mut nodes, end);
            end += inner.count_ones() as usize;
            let found = found & node.leaf;
            let kinds = [
                found & !whole,
                found & whole & !roomy,
                found & whole & roomy,
            ];
            for ((leaves, end), kind) in leaves.iter_mut().zip(&mut ends).zip(kinds) {
                make_room(leaves, *end);
                s.pack(kind, &node.child, leaves, *end);
                *end += kind.count_ones() as usize;
            }
        }
        for (kind, (leaves, end)) in leaves.iter().zip(ends).enumerate() {
            let leaves = &leaves[..end];
            for (at, &leaf) in leaves.iter().enumerate() {
                let ahead = Child(leaves[(at + AHEAD).min(end - 1)]).leaf_index();
                s.prefetch(&self.hierarchy.leaves[ahead]);
                self.hierarchy.surfaces.prefetch_leaf(s, ahead);
                let child = Child(leaf);
                counters.triangle_tests += u64::from(child.count());
                match kind {
                    0 => self.look_into(s, child, target, &mut lists.cut),
                    _ => self.look_at_whole(s, child, kind == 2, target),
                }
            }
        }
        lists.nodes = nodes;
        lists.leaves = leaves;
    }

    /// The boxes of a node in which there may be a silhouette that matters, or a triangle that has
    /// to be cut; those in which there is none of the latter; and those with
    /// none in a box three times as large.
    #[allow(clippy::cast_possible_truncation, reason = "a small power of two")]
    #[inline(always)]
    fn boxes<S: Simd>(
        &self,
        s: S,
        node: &Node,
        facing: &Facing,
        target: &impl Target,
    ) -> (u8, u8, u8) {
        let inside = self.bounds.boxes(s, node) & node.fine;
        if inside == 0 {
            return (0, 0, 0);
        }
        let mut rows = [s.splat(0.0); 6];
        for (row, bounds) in rows.iter_mut().zip(&node.bounds) {
            *row = s.load(bounds);
        }
        let one_way = self.faces_one_way(s, &rows, facing);
        let (least, most) = self.bounds.extents(s, node);
        let before = s.lt(s.splat(1e-6), least[2]);
        // Where all triangles are whole and face one way, each goes on where another ends.
        let (mut aside, mut far_aside) = (s.splat(0.0), s.splat(0.0));
        for k in 0..2 {
            let most_aside = s.max(s.abs(least[k]), s.abs(most[k]));
            aside = s.max(aside, most_aside);
            far_aside = s.max(far_aside, most_aside + (most[k] - least[k]));
        }
        let end = s.splat(1.0 - 4e-6);
        let guard = s.splat(0.5 * GUARD as f32);
        let whole = before & s.le(aside, least[2] * guard) & s.le(most[2], end);
        let depth = most[2] - least[2];
        let (near, far) = (least[2] - depth, most[2] + depth);
        let roomy = s.lt(s.splat(1e-6), near) & s.le(far_aside, near * guard) & s.le(far, end);
        let wanted = inside & !(whole & one_way);
        if wanted & before == 0 {
            return (wanted, whole, roomy);
        }
        let [low, high] = ShaftBounds::images(s, &least, &most);
        let needed = target.needs(s, wanted & before, low, high);
        (wanted & (needed | !before), whole, roomy)
    }

    /// The boxes in which all triangles, and their neighbours, surely face one way.
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "the room allows for it")]
    fn faces_one_way<S: Simd>(&self, s: S, rows: &[S::F; 6], facing: &Facing) -> u8 {
        let mut least = s.load(&facing.offset[0]);
        let mut most = s.load(&facing.offset[1]);
        for axis in 0..3 {
            let middle = (rows[axis] + rows[axis + 3]) * 0.5;
            let from_point = middle - s.splat(self.point[axis] as f32);
            let low = s.load(&facing.normal[axis]) * from_point;
            let high = s.load(&facing.normal[axis + 3]) * from_point;
            least = least + s.min(low, high);
            most = most + s.max(low, high);
        }
        s.lt(s.splat(self.room), least) | s.lt(most, s.splat(-self.room))
    }

    /// Finds the silhouettes in a leaf of which no triangle has to be cut.
    #[inline(always)]
    fn look_at_whole<S: Simd>(&self, s: S, child: Child, is_roomy: bool, target: &mut impl Target) {
        let index = child.leaf_index();
        let sides = &self.hierarchy.surfaces.sides[index];
        let leaf = &self.hierarchy.leaves[index];
        let bends = &self.hierarchy.surfaces.bends[index];
        let found = turning(s, leaf, bends, self.near_point, self.room);
        let part = child.mask();
        let slots = child.slots();
        // All sides in one loop, which is short: where it ends is a guess each time.
        let turning = found.sides.map(|turning| turning & part);
        let mut left = u32::from_le_bytes([turning[0], turning[1], turning[2], 0]);
        while left != 0 {
            let number = left.trailing_zeros() as usize;
            left &= left - 1;
            let (k, lane) = (number / 8, number % 8);
            let side = sides[k][lane];
            let is_known = |bits: u8| bits >> lane & 1 != 0;
            // Of two neighbours, the front tells.
            if side == NONE || is_known(found.back) && side & 1 == 0 {
                continue;
            }
            let facing = Known {
                front: is_known(found.front),
                back: is_known(found.back),
                back_beyond: is_known(found.backs_beyond[k]),
                whole_beyond: is_roomy && bends[k][lane] & NEAR != 0,
            };
            self.look_at_side(s, slots[lane], k, side, facing, target);
        }
    }

    /// Hands out a side of a triangle that does not have to be cut.
    #[inline(always)]
    fn look_at_side<S: Simd>(
        &self,
        s: S,
        slot: u32,
        k: usize,
        side: u32,
        known: Known,
        target: &mut impl Target,
    ) {
        let leaf = &self.hierarchy.leaves[slot as usize / 8];
        let lane = slot as usize % 8;
        // Not by `map`, which would be called for each.
        let from = self.image(leaf, lane, k);
        let to = self.image(leaf, lane, (k + 1) % 3);
        target.side(s, [from, to], |ascending| {
            if known.front & known.back_beyond & known.whole_beyond {
                2 * layers(true, self.upright, ascending)
            } else {
                let is_front = known.front || !known.back && self.is_front(slot);
                self.change(true, is_front, slot, side, known, ascending)
            }
        });
    }

    /// Returns the place of a triangle's corner in (p, q), which [`Search::outlines`] describes.
    #[inline(always)]
    fn image(&self, leaf: &Leaf, lane: usize, corner: usize) -> [f64; 2] {
        let place = [0, 1, 2].map(|axis| f64::from(leaf.vertices[3 * corner + axis][lane]));
        let [p, q, w] = self.frame.vertex(place.into(), self.point);
        let inverse = 1.0 / w;
        [p * inverse, q * inverse]
    }

    /// Finds the silhouettes in a leaf, and which of its triangles have to be cut.
    #[inline(always)]
    fn look_into<S: Simd>(
        &self,
        s: S,
        child: Child,
        target: &mut impl Target,
        all_cut: &mut Vec<(u32, u8)>,
    ) {
        let index = child.leaf_index();
        let sides = &self.hierarchy.surfaces.sides[index];
        let part = !s.in_range(&sides[0], NONE, 1) & child.mask();
        if part == 0 {
            return;
        }
        let leaf = &self.hierarchy.leaves[index];
        let (outlines, between) = self.outlines(s, leaf);
        let cut = part & between & !outlines.whole();
        if cut != 0 {
            let within = cut & self.bounds.within(s, &self.bounds.vertices(s, leaf));
            if within != 0 {
                #[allow(clippy::cast_possible_truncation, reason = "below 2^28")]
                all_cut.push((index as u32, within));
            }
        }
        let slots = child.slots();
        for (k, sides) in sides.iter().enumerate() {
            let j = (k + 1) % 3;
            let place = |k: usize| [s.dload(&outlines.p[k]), s.dload(&outlines.q[k])];
            let good = part & outlines.good[k] & outlines.good[j];
            let mut met = good & target.meets(s, place(k), place(j));
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                let ends = [k, j].map(|k| [outlines.p[k][lane], outlines.q[k][lane]]);
                let is_whole = outlines.whole() >> lane & 1 != 0;
                let is_front = outlines.front >> lane & 1 != 0;
                let (slot, side) = (slots[lane], sides[lane]);
                target.side(s, ends, |ascending| {
                    self.change(is_whole, is_front, slot, side, Known::default(), ascending)
                });
            }
        }
    }

    /// Returns how many layers begin beyond a side of a triangle, here or as its neighbour has it,
    /// with p ascending along it or not; zero where the neighbour counts them.
    #[inline(always)]
    fn change(
        &self,
        is_whole: bool,
        is_front: bool,
        slot: u32,
        side: u32,
        known: Known,
        ascending: bool,
    ) -> i32 {
        // Of two whole neighbours one tells: where they run along their side in opposite
        // directions, the front, if the other is none; else the first.
        let opposite = side & 1 == 0;
        let other_tells = (opposite & !is_front) | (!opposite & (side >> 1 < slot));
        if is_whole & other_tells {
            return 0;
        }
        let own = match is_whole {
            true => layers(is_front, self.upright, ascending),
            false => 0,
        };
        if side == EDGE {
            return own;
        }
        let neighbour = side >> 1;
        let beyond = !known.back_beyond && self.is_front(neighbour);
        // One that is not whole tells of its neighbours.
        if is_whole & opposite & beyond || !(known.whole_beyond || self.is_whole(neighbour)) {
            return 0;
        }
        own + layers(beyond, self.upright, ascending != opposite)
    }

    /// The outlines of a leaf's triangles, and a bit for each that may hide something.
    #[inline(always)]
    fn outlines<S: Simd>(&self, s: S, leaf: &Leaf) -> (Outlines, u8) {
        let mut outlines = Outlines {
            p: [[0.0; 8]; 3],
            q: [[0.0; 8]; 3],
            front: 0,
            good: [0; 3],
        };
        let (near, end) = (
            s.dsplat(self.frame.near),
            s.dsplat(self.frame.margins.end()),
        );
        let mut places = [[s.dsplat(0.0); 3]; 3];
        let (mut some_before, mut some_between) = (0, 0);
        for (k, place) in places.iter_mut().enumerate() {
            let rows = [0, 1, 2].map(|axis| s.load(&leaf.vertices[3 * k + axis]));
            *place = rows.map(|row| s.widen(row));
            let v = project::to_frame(s, rows, self.point, self.frame);
            let between = s.dle(near, v[2]) & s.dle(v[2], end);
            outlines.good[k] = s.bits(between & project::within_guard(s, &v));
            some_before |= s.bits(s.dlt(near, v[2]));
            some_between |= s.bits(s.dlt(v[2], end));
            let [p, q] = project::to_plane(s, &v);
            s.dstore(p, &mut outlines.p[k]);
            s.dstore(q, &mut outlines.q[k]);
        }
        let [a, b, c] = places;
        let (ex, ey, ez) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
        let (fx, fy, fz) = (c[0] - a[0], c[1] - a[1], c[2] - a[2]);
        let n = [ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx];
        let (x, y, z) = (
            a[0] - self.point.x,
            a[1] - self.point.y,
            a[2] - self.point.z,
        );
        outlines.front = s.bits(s.dlt(s.dsplat(0.0), n[0] * x + n[1] * y + n[2] * z));
        (outlines, some_before & some_between)
    }

    /// Whether the shading point is behind a triangle's plane: as [`Outlines::front`].
    #[inline(always)]
    fn is_front(&self, slot: u32) -> bool {
        is_front(self.triangle(slot), self.point)
    }

    /// Whether a triangle does not have to be cut: as [`Outlines::whole`].
    #[inline(always)]
    fn is_whole(&self, slot: u32) -> bool {
        self.triangle(slot).into_iter().all(|place| {
            let [p, q, w] = self.frame.vertex(place.into(), self.point);
            let limit = w * GUARD;
            let between = self.frame.near <= w && w <= self.frame.margins.end();
            between && p.abs() <= limit && q.abs() <= limit
        })
    }

    #[inline(always)]
    fn triangle(&self, slot: u32) -> [[f64; 3]; 3] {
        let leaf = &self.hierarchy.leaves[slot as usize / 8];
        leaf.triangle(slot as usize % 8).map(|v| v.map(f64::from))
    }
}

/// Nodes and leaves are asked for so many ahead. Two: fine meshes of 10⁶ triangles take 6 to 8 %
/// longer; eight: the same time.
const AHEAD: usize = 4;

/// Makes room for eight more after `end`.
#[inline(always)]
fn make_room(list: &mut Vec<u32>, end: usize) {
    if list.len() < end + 8 {
        list.resize(2 * end + 64, 0);
    }
}

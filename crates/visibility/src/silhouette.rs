//! Lines past fine meshes: where they cross silhouettes.
//!
//! Along a line on the light, the number of a surface's triangles that lie over it changes only
//! where it crosses a side of which both neighbours lie on one side, so that two come or two go, or
//! an edge, where one does. So a stretch between two crossings is hidden as a whole or not at all,
//! whatever shape the surface has, and whether or not it meets itself: what decides grows with the
//! length of silhouettes and not with the number of triangles.
//!
//! Of a gap between what other triangles hide, the crossings tell how many layers more or fewer
//! lie over each stretch than over the first, and one ray the rest: if nothing is before the
//! stretch under the fewest layers, there are none over it; if something is, there are some over
//! all.
//!
//! A triangle that is not wholly between the shading point and the light, or runs far aside, is cut
//! and hides what its pieces hide, as in any shaft; its neighbours begin and end at the sides they
//! share with it. Crossings are the same bits as the ends of what a triangle hides, which way a
//! triangle faces is one decision for all three of its sides, and so what comes goes.

use crate::{
    Counters,
    block::{LineBlock, Lines, ddot},
    bounds::ShaftBounds,
    build::Hierarchy,
    dense_shaft::{Covered, GROUP, Images},
    frame::LightFrame,
    merge::Slots,
    node::{Child, Leaf, Node},
    project::{self, GUARD, Vertex},
    surfaces::{EDGE, FACING_ROOM, Facing, NEAR, NONE},
    turning::{is_front, turning},
};
use linelit_geometry::{DVec3, LIGHT_MARGIN};
use linelit_simd::Simd;
use std::ops::Range;

/// Where the lines of a dense shaft may begin or cease to be hidden by fine meshes.
#[derive(Debug, Default)]
pub(crate) struct Crossings {
    /// Where each line crosses silhouettes, and how many layers more there are beyond.
    of: [Vec<(f64, i32)>; GROUP],
    /// Leaves with triangles that have to be cut, and a bit for each of those.
    pub(crate) cut: Vec<(u32, u8)>,
    /// Gaps between what is known to be hidden.
    pub(crate) gaps: Vec<Gap>,
    /// The stretches of all gaps.
    stretches: Vec<Stretch>,
    /// Nodes to open, in the order in which they were found.
    nodes: Vec<u32>,
    /// Leaves to look into: of any triangles; of some of which none has to be cut; and of some of
    /// which none has to be in a box three times as large, either.
    leaves: [Vec<u32>; 3],
}

/// A part of a line between two neighbouring crossings.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    low: f64,
    high: f64,
    /// How many layers more lie over it than over the gap's first.
    layers: i32,
}

/// A part of a line that is not known to be hidden, cut where it crosses silhouettes.
#[derive(Clone, Debug)]
pub(crate) struct Gap {
    /// The line's number among the few.
    pub(crate) line: u32,
    /// The middle of the longest stretch under the fewest layers.
    pub(crate) middle: f64,
    layers: i32,
    stretches: Range<u32>,
}

/// What silhouettes are looked for with: a shading point, and a few lines on a light.
pub(crate) struct Search<'a> {
    hierarchy: &'a Hierarchy,
    bounds: &'a ShaftBounds,
    frame: &'a LightFrame,
    /// In the hierarchy's coordinates.
    point: DVec3,
    /// The same, rounded.
    near_point: [f32; 3],
    /// How far off a distance from a plane may be.
    room: f32,
    /// Whether [front](Outlines::front) triangles are counter-clockwise in (p, q).
    upright: bool,
    /// What is not hidden yet of the lines.
    covered: &'a Covered,
    /// The lines' ends, the least and the greatest.
    start: f64,
    end: f64,
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

/// What is known of a triangle, and of its neighbour beyond a side; nothing where false.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    /// The shading point is behind its plane, as its corners run.
    front: bool,
    /// It is before it.
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

/// How many layers begin beyond a side that a line crosses, for a triangle that faces so and runs
/// along it with p ascending or not.
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
    /// For a few lines, of which `covered` tells what is open.
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward")]
    pub(crate) fn new(
        (hierarchy, extent): (&'a Hierarchy, f64),
        (bounds, frame): (&'a ShaftBounds, &'a LightFrame),
        point: DVec3,
        covered: &'a Covered,
        lines: &Lines,
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
            covered,
            start: ends(lines, |block| &block.from).fold(1.0, f64::min),
            end: ends(lines, |block| &block.to).fold(0.0, f64::max),
        }
    }

    /// Finds where the lines cross silhouettes.
    #[inline(always)]
    pub(crate) fn walk<S: Simd>(
        &self,
        s: S,
        lines: &Lines,
        crossings: &mut Crossings,
        counters: &mut Counters,
    ) {
        for line in &mut crossings.of {
            line.clear();
        }
        crossings.cut.clear();
        // Breadth first, and all leaves at the end: nothing hangs on how many boxes are found, so
        // that one node need not wait for another, and all are known ahead.
        let mut nodes = std::mem::take(&mut crossings.nodes);
        let mut leaves = std::mem::take(&mut crossings.leaves);
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
            let (found, whole, roomy) = self.boxes(s, node, &self.hierarchy.surfaces.facing[index]);
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
                    0 => self.look_into(s, child, lines, crossings),
                    _ => self.look_at_whole(s, child, kind == 2, lines, crossings),
                }
            }
        }
        crossings.nodes = nodes;
        crossings.leaves = leaves;
        let found = crossings.of.iter().map(Vec::len).sum::<usize>();
        counters.candidates += found as u64;
    }

    /// The boxes of a node in which lines may cross a silhouette, where they are not hidden yet, or
    /// a triangle that has to be cut; those in which there is none of the latter; and those with
    /// none in a box three times as large.
    #[allow(clippy::cast_possible_truncation, reason = "a small power of two")]
    #[inline(always)]
    fn boxes<S: Simd>(&self, s: S, node: &Node, facing: &Facing) -> (u8, u8, u8) {
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
        let needed = self.covered.needs_any(s, &Images::new(s, low, high));
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

    /// Finds the crossings in a leaf of which no triangle has to be cut.
    #[inline(always)]
    fn look_at_whole<S: Simd>(
        &self,
        s: S,
        child: Child,
        is_roomy: bool,
        lines: &Lines,
        crossings: &mut Crossings,
    ) {
        let index = child.leaf_index();
        let sides = &self.hierarchy.surfaces.sides[index];
        let leaf = &self.hierarchy.leaves[index];
        let bends = &self.hierarchy.surfaces.bends[index];
        let found = turning(s, (leaf, bends), (self.near_point, self.room));
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
            let at = (slots[lane], k, side);
            let facing = Known {
                front: is_known(found.front),
                back: is_known(found.back),
                back_beyond: is_known(found.backs_beyond[k]),
                whole_beyond: is_roomy && bends[k][lane] & NEAR != 0,
            };
            self.cross_side(s, at, facing, lines, crossings);
        }
    }

    /// Notes where lines cross a side of a triangle that does not have to be cut.
    #[inline(always)]
    fn cross_side<S: Simd>(
        &self,
        s: S,
        (slot, k, side): (u32, usize, u32),
        known: Known,
        lines: &Lines,
        crossings: &mut Crossings,
    ) {
        debug_assert!(self.holds(slot, side, known), "{known:?}");
        let leaf = &self.hierarchy.leaves[slot as usize / 8];
        let lane = slot as usize % 8;
        let a = self.image(leaf, lane, k);
        let b = self.image(leaf, lane, (k + 1) % 3);
        let (low, high) = (-a[0].max(b[0]), -a[0].min(b[0]));
        let along = a[1].min(b[1]) <= self.end && self.start <= a[1].max(b[1]);
        let (low, high) = (s.dsplat(low), s.dsplat(high));
        // The few lines of a walk are one block.
        let Some(block) = lines.blocks.first() else {
            return;
        };
        let u = s.dload(&block.u);
        let met = s.bits(s.dle(low, u) & s.dlt(u, high));
        if along && met != 0 {
            let ascending = a[0] < b[0];
            let change = if known.front & known.back_beyond & known.whole_beyond {
                2 * layers(true, self.upright, ascending)
            } else {
                let is_front = known.front || !known.back && self.is_front(slot);
                self.change((true, is_front), (slot, side), known, ascending)
            };
            if change != 0 {
                cross(block, met, (a, b), change, &mut crossings.of);
            }
        }
    }

    /// Where a corner of a triangle is in (p, q): as [`Search::outlines`] has it.
    #[inline(always)]
    fn image(&self, leaf: &Leaf, lane: usize, corner: usize) -> [f64; 2] {
        let x = f64::from(leaf.vertices[3 * corner][lane]) - self.point.x;
        let y = f64::from(leaf.vertices[3 * corner + 1][lane]) - self.point.y;
        let z = f64::from(leaf.vertices[3 * corner + 2][lane]) - self.point.z;
        let (p, q, w) = (self.frame.p, self.frame.q, self.frame.w);
        let inverse = 1.0 / (x * w.x + y * w.y + z * w.z);
        [
            (x * p.x + y * p.y + z * p.z) * inverse,
            (x * q.x + y * q.y + z * q.z) * inverse,
        ]
    }

    /// Finds the crossings in a leaf.
    #[inline(always)]
    fn look_into<S: Simd>(&self, s: S, child: Child, lines: &Lines, crossings: &mut Crossings) {
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
                crossings.cut.push((index as u32, within));
            }
        }
        let (Some(first), Some(last)) = (lines.blocks.first(), lines.blocks.last()) else {
            return;
        };
        let (first, last) = (s.dsplat(first.u[0]), s.dsplat(last.u[7]));
        let slots = child.slots();
        for (k, sides) in sides.iter().enumerate() {
            let j = (k + 1) % 3;
            let (p, p1) = (s.dload(&outlines.p[k]), s.dload(&outlines.p[j]));
            let zero = s.dsplat(0.0);
            let (low, high) = (zero - s.dmax(p, p1), zero - s.dmin(p, p1));
            let (q, q1) = (s.dload(&outlines.q[k]), s.dload(&outlines.q[j]));
            let along = s.dle(s.dmin(q, q1), s.dsplat(self.end))
                & s.dle(s.dsplat(self.start), s.dmax(q, q1));
            let met = s.dle(low, last) & s.dlt(first, high) & along;
            let mut met = part & outlines.good[k] & outlines.good[j] & s.bits(met);
            if met == 0 {
                continue;
            }
            // Most sides of fine triangles are between the lines.
            let mut crossed = s.dlt(zero, zero);
            for u in lines.blocks.iter().flat_map(|block| &block.u) {
                let u = s.dsplat(*u);
                crossed = crossed | s.dle(low, u) & s.dlt(u, high);
            }
            met &= s.bits(crossed);
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                let [a, b] = [k, j].map(|k| [outlines.p[k][lane], outlines.q[k][lane]]);
                let own = (
                    outlines.whole() >> lane & 1 != 0,
                    outlines.front >> lane & 1 != 0,
                );
                let at = (slots[lane], sides[lane]);
                let change = self.change(own, at, Known::default(), a[0] < b[0]);
                if change != 0
                    && let Some(block) = lines.blocks.first()
                {
                    cross(block, u8::MAX, (a, b), change, &mut crossings.of);
                }
            }
        }
    }

    /// How many layers begin beyond a side of a triangle, here or as its neighbour has it, with p
    /// ascending along it or not; none where the neighbour tells.
    #[inline(always)]
    fn change(
        &self,
        (is_whole, is_front): (bool, bool),
        (slot, side): (u32, u32),
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
        let (near, end) = (s.dsplat(self.frame.near), s.dsplat(1.0 - LIGHT_MARGIN));
        let mut places = [[s.dsplat(0.0); 3]; 3];
        let (mut some_before, mut some_between) = (0, 0);
        for (k, place) in places.iter_mut().enumerate() {
            for (x, row) in place.iter_mut().zip(&leaf.vertices[3 * k..]) {
                *x = s.widen(s.load(row));
            }
            let [x, y, z] = *place;
            let (x, y, z) = (x - self.point.x, y - self.point.y, z - self.point.z);
            let v: Vertex<S> = [
                ddot::<S>(self.frame.p, x, y, z),
                ddot::<S>(self.frame.q, x, y, z),
                ddot::<S>(self.frame.w, x, y, z),
            ];
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
            let [x, y, z] = [0, 1, 2].map(|axis| place[axis] - self.point[axis]);
            let form = |n: DVec3| x * n.x + y * n.y + z * n.z;
            let (p, q, w) = (form(self.frame.p), form(self.frame.q), form(self.frame.w));
            let limit = w * GUARD;
            let between = self.frame.near <= w && w <= 1.0 - LIGHT_MARGIN;
            between && p.abs() <= limit && q.abs() <= limit
        })
    }

    /// Whether what is known of a triangle and of its neighbour beyond a side is so.
    fn holds(&self, slot: u32, side: u32, known: Known) -> bool {
        let front = self.is_front(slot);
        let own = (!known.front || front) & (!known.back || !front);
        let beyond = side == EDGE || {
            let neighbour = side >> 1;
            // As far as it has its corners in the same order.
            let back = !known.back_beyond || side & 1 == 0 && !self.is_front(neighbour);
            back && (!known.whole_beyond || self.is_whole(neighbour))
        };
        own & beyond & self.is_whole(slot)
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

/// Notes where lines `among` a block cross a side: the same expression as for a triangle's
/// interval.
#[inline(always)]
fn cross(
    block: &LineBlock,
    among: u8,
    ([p, q], [p1, q1]): ([f64; 2], [f64; 2]),
    change: i32,
    of: &mut [Vec<(f64, i32)>; GROUP],
) {
    // Across is −p.
    let ends = [(-p, q), (-p1, q1)];
    let [(u0, v0), (u1, v1)] = if ends[1].0 < ends[0].0 {
        [ends[1], ends[0]]
    } else {
        ends
    };
    let slope = (v1 - v0) / (u1 - u0).max(1e-280);
    let mut among = among;
    while among != 0 {
        let lane = among.trailing_zeros() as usize;
        among &= among - 1;
        let u = block.u[lane];
        let place = v0 + (u - u0) * slope;
        if u0 <= u && u < u1 && block.from[lane] < place && place < block.to[lane] {
            of[lane].push((place, change));
        }
    }
}

/// One of the two ends of each line.
fn ends(lines: &Lines, which: fn(&LineBlock) -> &[f64; 8]) -> impl Iterator<Item = f64> {
    lines.blocks.iter().flat_map(which).copied()
}

/// A ray is sent towards stretches that are narrower, as a fraction of the light, only if there are
/// no others: where crossings meet in one place, their order is a matter of rounding.
const NARROW: f64 = 1e-13;

impl Gap {
    /// Of the stretches from `first` on; nothing if there are none.
    #[allow(clippy::cast_possible_truncation, reason = "stretches are fewer")]
    fn new(line: u32, stretches: &[Stretch], first: usize) -> Option<Self> {
        let width = |stretch: &Stretch| stretch.high - stretch.low;
        let is_narrow = |stretch: &Stretch| width(stretch) <= NARROW;
        let order = |a: &&Stretch, b: &&Stretch| {
            let fewer = || a.layers.cmp(&b.layers);
            let wider = || width(b).total_cmp(&width(a));
            is_narrow(a)
                .cmp(&is_narrow(b))
                .then_with(fewer)
                .then_with(wider)
        };
        let fewest = stretches[first..].iter().min_by(order)?;
        Some(Self {
            line,
            middle: 0.5 * (fewest.low + fewest.high),
            layers: fewest.layers,
            stretches: first as u32..stretches.len() as u32,
        })
    }
}

impl Crossings {
    /// Cuts what is left of lines where they cross silhouettes.
    pub(crate) fn cut_lines(&mut self, lines: &Lines, slots: &mut Slots) {
        let Self {
            of,
            gaps,
            stretches,
            ..
        } = self;
        gaps.clear();
        stretches.clear();
        for (line, crossings) in (0_u32..).zip(of).take(lines.count) {
            let (index, k) = (line as usize / 8, line as usize % 8);
            let block = &lines.blocks[index];
            let (from, to) = (block.from[k], block.to[k]);
            if !(from < to) {
                continue;
            }
            // What begins before what ends in the same place.
            crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            let mut next = crossings.iter().copied().peekable();
            let mut start = from;
            let hidden = slots.sorted(index, k, (block.run_lo[k], block.run_hi[k]));
            let is_some = |(low, high): &&(f64, f64)| low <= high;
            for &(low, high) in hidden.iter().filter(is_some).chain([&(to, to)]) {
                let end = low.min(to);
                while next.next_if(|(place, _)| *place <= start).is_some() {}
                if start < end {
                    let first = stretches.len();
                    let mut layers = 0;
                    while let Some((place, change)) = next.next_if(|(place, _)| *place < end) {
                        stretches.push(Stretch {
                            low: start,
                            high: place,
                            layers,
                        });
                        start = place;
                        layers += change;
                    }
                    stretches.push(Stretch {
                        low: start,
                        high: end,
                        layers,
                    });
                    gaps.extend(Gap::new(line, stretches, first));
                }
                start = start.max(high);
            }
        }
    }

    /// What is hidden of a gap, once it is known whether its [middle](Gap::middle) is visible: if
    /// it is, no layer is over that, nor over what has as few; if not, some are over all of it.
    pub(crate) fn hidden(&self, gap: usize, is_visible: bool) -> impl Iterator<Item = (f64, f64)> {
        let Gap {
            layers, stretches, ..
        } = &self.gaps[gap];
        let stretches = &self.stretches[stretches.start as usize..stretches.end as usize];
        let hidden = move |s: &&Stretch| !is_visible || s.layers != *layers;
        stretches.iter().filter(hidden).map(|s| (s.low, s.high))
    }
}

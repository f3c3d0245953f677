//! Lines past fine closed meshes: where they cross silhouettes.
//!
//! Along a line on the light, the number of a mesh's triangles that lie over it changes only where
//! it crosses a side of which both neighbours lie on one side: two come, or two go. Beyond the
//! mesh's image it is zero. So the crossings of silhouettes, from far before the line's start to
//! its end, tell what the mesh hides of it, whatever shape it has, and whether or not it meets
//! itself: what decides grows with the length of silhouettes and not with their meshes' triangles.
//!
//! A triangle that is not wholly between the shading point and the light, or runs far aside, is cut
//! and hides what its pieces hide, as in any shaft; its neighbours begin and end at the sides they
//! share with it. Crossings are the same bits as the ends of what a triangle hides, which way a
//! triangle faces is one decision for all three of its sides, and so what comes goes.

use crate::{
    Counters,
    block::{LineBlock, ddot},
    bounds::ShaftBounds,
    build::Hierarchy,
    frame::LightFrame,
    merge::Slots,
    node::{Child, Leaf, Node},
    project::{self, GUARD, Vertex},
    surfaces::{FACING_ROOM, Facing, NONE},
};
use linelit_geometry::{DVec3, LIGHT_MARGIN};
use linelit_simd::Simd;

/// What decides where the lines of a dense shaft are hidden by fine meshes.
#[derive(Debug, Default)]
pub(crate) struct Crossings {
    /// Where each line crosses silhouettes, and how many layers more there are beyond.
    of: [Vec<(f64, i32)>; 8],
    /// Leaves with triangles that have to be cut, and a bit for each of those.
    pub(crate) cut: Vec<(u32, u8)>,
    /// Nodes and leaves still to visit.
    stack: Vec<u32>,
}

/// What silhouettes are looked for with: a shading point, and a few lines on a light.
pub(crate) struct Search<'a> {
    hierarchy: &'a Hierarchy,
    bounds: &'a ShaftBounds,
    frame: &'a LightFrame,
    /// In the hierarchy's coordinates.
    point: DVec3,
    /// How far off a distance from a plane may be.
    room: f32,
    /// Whether triangles with a positive [`Outlines::facing`] are counter-clockwise in (p, q).
    upright: bool,
    /// Bounds of p of each line; nothing for what is no line.
    low: &'a [f32; 8],
    high: &'a [f32; 8],
    /// The farthest of the lines' ends.
    end: f64,
}

/// The sides of eight triangles in (p, q).
struct Outlines {
    p: [[f64; 8]; 3],
    q: [[f64; 8]; 3],
    /// How far the shading point is behind each triangle's plane, times twice its area.
    facing: [f64; 8],
    /// A bit for each triangle whose corner is between the shading point and the light, and not far
    /// aside.
    good: [u8; 3],
}

impl Outlines {
    fn whole(&self) -> u8 {
        self.good[0] & self.good[1] & self.good[2]
    }
}

/// How many layers begin beyond a side that a line crosses, for a triangle that faces so and runs
/// along it with p ascending or not.
#[inline(always)]
fn layers(facing: f64, upright: bool, ascending: bool) -> i32 {
    if facing == 0.0 {
        return 0;
    }
    // Counter-clockwise, what is inside is left of the way.
    let counter_clockwise = (facing > 0.0) == upright;
    if counter_clockwise == ascending {
        1
    } else {
        -1
    }
}

impl<'a> Search<'a> {
    /// Nothing where the light's frame has no orientation.
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward")]
    pub(crate) fn new(
        (hierarchy, extent): (&'a Hierarchy, f64),
        (bounds, frame): (&'a ShaftBounds, &'a LightFrame),
        point: DVec3,
        (low, high): (&'a [f32; 8], &'a [f32; 8]),
        lines: &LineBlock,
    ) -> Option<Self> {
        let volume = frame.p.dot(frame.q.cross(frame.w));
        let size = extent.max(point.abs().max_element());
        (volume != 0.0 && volume.is_finite()).then(|| Self {
            hierarchy,
            bounds,
            frame,
            point,
            room: (FACING_ROOM * size) as f32,
            upright: volume > 0.0,
            low,
            high,
            end: lines.to.iter().fold(0.0, |end, to| f64::max(end, *to)),
        })
    }

    /// Finds where the lines cross silhouettes.
    #[inline(always)]
    pub(crate) fn walk<S: Simd>(
        &self,
        s: S,
        lines: &LineBlock,
        crossings: &mut Crossings,
        counters: &mut Counters,
    ) {
        for line in &mut crossings.of {
            line.clear();
        }
        crossings.cut.clear();
        let mut stack = std::mem::take(&mut crossings.stack);
        stack.clear();
        stack.push(0);
        while let Some(next) = stack.pop() {
            let child = Child(next);
            if child.is_leaf() {
                counters.triangle_tests += u64::from(child.count());
                self.look_into(s, child, lines, crossings);
                continue;
            }
            let node = &self.hierarchy.nodes[child.index()];
            counters.node_tests += u64::from(node.valid.count_ones());
            let mut found = self.boxes(s, node, &self.hierarchy.surfaces.facing[child.index()]);
            while found != 0 {
                let child = Child(node.child[found.trailing_zeros() as usize]);
                found &= found - 1;
                self.hierarchy.surfaces.prefetch(s, child);
                if child.is_leaf() {
                    s.prefetch(&self.hierarchy.leaves[child.index()]);
                } else {
                    s.prefetch(&self.hierarchy.nodes[child.index()]);
                }
                stack.push(child.0);
            }
        }
        crossings.stack = stack;
        let found = crossings.of.iter().map(Vec::len).sum::<usize>();
        counters.candidates += found as u64;
    }

    /// The boxes of a node in which lines, or what is before their start, may cross a silhouette or
    /// a triangle that has to be cut.
    #[inline(always)]
    fn boxes<S: Simd>(&self, s: S, node: &Node, facing: &Facing) -> u8 {
        let (zero, one) = (s.splat(0.0), s.splat(1.0));
        let (least, most) = self.bounds.extents(s, node);
        let mut rows = [zero; 6];
        for (row, bounds) in rows.iter_mut().zip(&node.bounds) {
            *row = s.load(bounds);
        }
        // All half-spaces but the one at the lines' start.
        let mut inside = s.min(most[2], one - least[2]);
        for plane in [0, 1, 3] {
            inside = s.min(inside, self.bounds.reach(s, plane, &rows));
        }
        let inside = s.le(zero, inside) & node.valid & facing.some;
        if inside == 0 {
            return 0;
        }
        let before = s.lt(s.splat(1e-6), least[2]);
        let (near, far) = (one / least[2], one / most[2]);
        let mut image = [[zero; 2]; 2];
        for k in 0..2 {
            let low = s.min(least[k] * near, least[k] * far);
            let high = s.max(most[k] * near, most[k] * far);
            image[k] = [
                s.fma(s.abs(low), s.splat(-1e-6), low),
                s.fma(s.abs(high), s.splat(1e-6), high),
            ];
        }
        let mut crossed = 0;
        for (low, high) in self.low.iter().zip(self.high) {
            crossed |= s.le(image[0][0], s.splat(*high)) & s.le(s.splat(*low), image[0][1]);
        }
        crossed &= s.le(image[1][0], s.splat(1.0 + 1e-5));
        let wanted = inside & (crossed | !before);
        // Where all triangles are whole and face one way, each goes on where another ends.
        let mut aside = zero;
        for bound in image.as_flattened() {
            aside = s.max(aside, s.abs(*bound));
        }
        #[allow(clippy::cast_possible_truncation, reason = "a small power of two")]
        let guard = s.splat(0.5 * GUARD as f32);
        let margin = s.splat(1.0 - 4e-6);
        let whole = before & s.le(aside, guard) & s.le(most[2], margin);
        wanted & !(whole & self.faces_one_way(s, &rows, facing))
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

    /// Finds the crossings in a leaf.
    #[inline(always)]
    fn look_into<S: Simd>(&self, s: S, child: Child, lines: &LineBlock, crossings: &mut Crossings) {
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
        let (first, last) = (s.dsplat(lines.u[0]), s.dsplat(lines.u[7]));
        let slots = child.slots();
        for (k, sides) in sides.iter().enumerate() {
            let j = (k + 1) % 3;
            let (p, p1) = (s.dload(&outlines.p[k]), s.dload(&outlines.p[j]));
            let zero = s.dsplat(0.0);
            let (low, high) = (zero - s.dmax(p, p1), zero - s.dmin(p, p1));
            let start = s.dmin(s.dload(&outlines.q[k]), s.dload(&outlines.q[j]));
            let met = s.dle(low, last) & s.dlt(first, high) & s.dle(start, s.dsplat(self.end));
            let mut met = part & outlines.good[k] & outlines.good[j] & s.bits(met);
            let (mut lows, mut highs) = ([0.0; 8], [0.0; 8]);
            s.dstore(low, &mut lows);
            s.dstore(high, &mut highs);
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                // Most sides of fine triangles are between the lines.
                let u = s.dload(&lines.u);
                let on_line = s.dle(s.dsplat(lows[lane]), u) & s.dlt(u, s.dsplat(highs[lane]));
                if s.bits(on_line) == 0 {
                    continue;
                }
                let side = sides[lane];
                let is_whole = outlines.whole() >> lane & 1 != 0;
                // Of two whole neighbours, the first tells of both; one that is not tells of one
                // that is.
                if is_whole && side >> 1 < slots[lane] {
                    continue;
                }
                let Some(beyond) = self.facing_of(side >> 1) else {
                    continue;
                };
                let [a, b] = [k, j].map(|k| [outlines.p[k][lane], outlines.q[k][lane]]);
                let ascending = a[0] < b[0];
                let mut change = layers(beyond, self.upright, ascending == (side & 1 != 0));
                if is_whole {
                    change += layers(outlines.facing[lane], self.upright, ascending);
                }
                if change != 0 {
                    cross(lines, (a, b), change, &mut crossings.of);
                }
            }
        }
    }

    /// The outlines of a leaf's triangles, and a bit for each that may hide something.
    #[inline(always)]
    fn outlines<S: Simd>(&self, s: S, leaf: &Leaf) -> (Outlines, u8) {
        let mut outlines = Outlines {
            p: [[0.0; 8]; 3],
            q: [[0.0; 8]; 3],
            facing: [0.0; 8],
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
        s.dstore(n[0] * x + n[1] * y + n[2] * z, &mut outlines.facing);
        (outlines, some_before & some_between)
    }

    /// The same of one triangle: how it faces, unless it has to be cut.
    #[inline(always)]
    fn facing_of(&self, slot: u32) -> Option<f64> {
        let leaf = &self.hierarchy.leaves[slot as usize / 8];
        let places = leaf.triangle(slot as usize % 8).map(|v| v.map(f64::from));
        let mut good = true;
        for place in places {
            let [x, y, z] = [0, 1, 2].map(|axis| place[axis] - self.point[axis]);
            let form = |n: DVec3| x * n.x + y * n.y + z * n.z;
            let (p, q, w) = (form(self.frame.p), form(self.frame.q), form(self.frame.w));
            let limit = w * GUARD;
            good &= self.frame.near <= w && w <= 1.0 - LIGHT_MARGIN;
            good &= p.abs() <= limit && q.abs() <= limit;
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
        good.then(|| n[0] * x + n[1] * y + n[2] * z)
    }
}

/// Notes where lines cross a side: the same expression as for a triangle's interval.
#[inline(always)]
fn cross(
    lines: &LineBlock,
    ([p, q], [p1, q1]): ([f64; 2], [f64; 2]),
    change: i32,
    crossings: &mut [Vec<(f64, i32)>; 8],
) {
    // Across is −p.
    let ends = [(-p, q), (-p1, q1)];
    let [(u0, v0), (u1, v1)] = if ends[1].0 < ends[0].0 {
        [ends[1], ends[0]]
    } else {
        ends
    };
    let slope = (v1 - v0) / (u1 - u0).max(1e-280);
    for (u, crossings) in lines.u.iter().zip(crossings) {
        if u0 <= *u && *u < u1 {
            crossings.push((v0 + (u - u0) * slope, change));
        }
    }
}

impl Crossings {
    /// Hides from each line what has layers over it.
    pub(crate) fn hide(&mut self, lines: &mut LineBlock, slots: &mut Slots) {
        for (lane, crossings) in self.of.iter_mut().enumerate() {
            // What begins before what ends in the same place.
            crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            let (from, to) = (lines.from[lane], lines.to[lane]);
            let (mut count, mut start) = (0, f64::NEG_INFINITY);
            let mut keep = |low: f64, high: f64| {
                if low < to && from < high {
                    slots.push(0, lane, low, high);
                }
            };
            for &(place, change) in &*crossings {
                let before = count;
                count += change;
                if before <= 0 && count > 0 {
                    start = place;
                } else if before > 0 && count <= 0 {
                    keep(start, place);
                }
            }
            if count > 0 {
                keep(start, to.max(start) + 1.0);
            }
        }
    }
}

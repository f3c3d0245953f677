//! Back-face culling for shadows: the triangles of one orientation of a closed mesh hide as much as
//! all of them.
//!
//! Where a segment runs from outside a closed surface to outside of it, it goes in as often as it
//! comes out, so whatever a triangle facing one way hides, one facing the other way hides too. A
//! *closed mesh* is a set of triangles, connected by their edges, in which every edge belongs to
//! two and which can be turned so that the two run along it in opposite directions: the signs of
//! its triangles' images then add up to zero over every place of the light's plane, whatever the
//! mesh's shape, whether it intersects itself or is inside out. So the images of one sign may be
//! left out, once neither the shading point nor the light is in the mesh's box.

use crate::{
    build::{Geometry, least, most},
    surfaces::{EDGE, FINE, LOOSE, MOSTLY, NONE},
};
use linelit_geometry::{DVec3, Margins};
use linelit_simd::Simd;

/// A connected closed mesh: its box, and which triangles are its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClosedMesh {
    /// Its box, in the hierarchy's coordinates.
    lo: [f32; 3],
    hi: [f32; 3],
    /// The least and the largest number of its triangles, as the caller counts.
    first: u32,
    last: u32,
}

/// The closed meshes of a scene, and which of them each triangle belongs to.
#[derive(Debug, Default)]
pub(crate) struct ClosedMeshes {
    pub(crate) meshes: Vec<ClosedMesh>,
    /// For each triangle of the caller's, zero or its mesh's index plus one, with [`TURNED`] if it
    /// is turned; empty without meshes.
    pub(crate) of: Vec<u16>,
    /// What of the triangles belongs to [fine surfaces](crate::surfaces).
    pub(crate) fine: FineTriangles,
}

/// The triangles of surfaces that are fine.
#[derive(Debug, Default)]
pub(crate) struct FineTriangles {
    /// For each triangle of the caller's, who is beyond its sides from corner 0 to 1, 1 to 2 and 2
    /// to 0, with a last bit that says whether both run along it in the same direction; [`EDGE`]
    /// where there is nobody or several; [`NONE`] for triangles of no such surface. Empty without
    /// any.
    pub(crate) sides: Vec<[u32; 3]>,
    /// Which of them are turned against the first of their surface.
    pub(crate) turned: Vec<bool>,
}

/// What is known of triangles that are connected, by the number of the first.
#[derive(Clone, Copy, Debug, Default)]
struct Set {
    /// How many they are, and how many sides of theirs are no other triangle's, or several ones'.
    count: u32,
    edges: u32,
    /// Whether they cannot be turned so that neighbours run along their sides in opposite
    /// directions.
    one_sided: bool,
}

impl Set {
    /// Takes in a triangle.
    fn add(&mut self, flags: u8) {
        self.count += 1;
        self.edges += u32::from(flags & !ONE_SIDED);
        self.one_sided |= flags & ONE_SIDED != 0;
    }

    fn is_closed(self) -> bool {
        self.edges == 0 && !self.one_sided
    }

    /// Whether it is a fine surface.
    fn is_fine(self) -> bool {
        self.count >= FINE && !self.one_sided && self.edges <= self.count / MOSTLY
    }
}

/// The bit of a triangle that is turned against the first of its mesh.
const TURNED: u16 = 1 << 15;

/// The bit of a triangle that two ways of turning it meet at.
const ONE_SIDED: u8 = 1 << 7;

/// Triangles that are connected, each with an earlier one, and in the last bit whether it is turned
/// against that.
struct Connected(Vec<u32>);

impl Connected {
    /// The first triangle connected to `i`, and whether `i` is turned against it.
    fn root(&mut self, i: u32) -> (u32, bool) {
        let (mut at, mut turned) = (i, 0);
        loop {
            let step = self.0[at as usize];
            let next = step >> 1;
            if next == at {
                return (at, turned != 0);
            }
            // Halves the way for those who come later.
            let after = self.0[next as usize] ^ step & 1;
            self.0[at as usize] = after;
            turned ^= after & 1;
            at = after >> 1;
        }
    }

    /// Connects two triangles; false if they were, but turned otherwise.
    fn join(&mut self, i: u32, j: u32, turned: bool) -> bool {
        let ((i, ti), (j, tj)) = (self.root(i), self.root(j));
        if i == j {
            return ti ^ tj == turned;
        }
        self.0[i.max(j) as usize] = i.min(j) << 1 | u32::from(ti ^ tj ^ turned);
        true
    }
}

/// The bits of a position; zero has two signs.
fn bits(position: [f32; 3]) -> [u32; 3] {
    position.map(|x| (x + 0.0).to_bits())
}

/// One number for each place: the least index of a position there.
fn weld(positions: &[[f32; 3]]) -> Vec<u32> {
    // A table takes two looks or so for each position, unless somebody has aimed at it.
    weld_in_table(positions, 16 * positions.len()).unwrap_or_else(|| weld_sorted(positions))
}

/// By a table of places, in as many looks at it as are allowed.
fn weld_in_table(positions: &[[f32; 3]], mut looks: usize) -> Option<Vec<u32>> {
    const FREE: u32 = u32::MAX;
    let slots = (positions.len() + positions.len() / 2 + 1).next_power_of_two();
    let mut table = vec![FREE; slots];
    let mix = |h: u64, x: u32| (h ^ u64::from(x)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mut weld = Vec::with_capacity(positions.len());
    for (i, position) in (0_u32..).zip(positions) {
        let here = bits(*position);
        let [x, y, z] = here;
        let hash = mix(mix(mix(0, x).rotate_left(29), y).rotate_left(29), z);
        let mut slot = (hash >> 32) as usize % slots;
        loop {
            looks = looks.checked_sub(1)?;
            let first = table[slot];
            if first == FREE {
                table[slot] = i;
                weld.push(i);
                break;
            }
            if bits(positions[first as usize]) == here {
                weld.push(first);
                break;
            }
            slot = (slot + 1) % slots;
        }
    }
    Some(weld)
}

/// By sorting them.
fn weld_sorted(positions: &[[f32; 3]]) -> Vec<u32> {
    let key = |i: u32| bits(positions[i as usize]);
    let mut order: Vec<u32> = (0..).take(positions.len()).collect();
    order.sort_unstable_by_key(|&i| (key(i), i));
    let mut weld = vec![0; positions.len()];
    for here in order.chunk_by(|&i, &j| key(i) == key(j)) {
        for &i in here {
            weld[i as usize] = here[0];
        }
    }
    weld
}

/// The lower half.
#[allow(clippy::cast_possible_truncation, reason = "the lower half")]
fn low(entry: u64) -> u32 {
    entry as u32
}

/// Entries, some at a time, by their group's number, and where each group ends in the list.
fn grouped<const N: usize>(
    groups: usize,
    entries: impl Iterator<Item = [(usize, u64); N]> + Clone,
) -> (Vec<u32>, Vec<u64>) {
    let mut ends = vec![0_u32; groups + 1];
    for few in entries.clone() {
        for (group, _) in few {
            ends[group + 1] += 1;
        }
    }
    let mut sum = 0;
    for count in &mut ends {
        sum += *count;
        *count = sum;
    }
    let mut list = vec![0; sum as usize];
    for few in entries {
        for (group, entry) in few {
            let next = &mut ends[group];
            list[*next as usize] = entry;
            *next += 1;
        }
    }
    // Each entry of `ends` has moved to where the next group begins.
    (ends, list)
}

/// Calls `f` with each group that is not empty, sorted.
fn for_groups(ends: &[u32], list: &mut [u64], mut f: impl FnMut(&mut [u64])) {
    let mut begin = 0;
    for &end in ends {
        let here = &mut list[begin..end as usize];
        if here.len() > 1 {
            here.sort_unstable();
        }
        if !here.is_empty() {
            f(here);
        }
        begin = end as usize;
    }
}

/// Edges by their lesser corner: the other corner, with the edge's direction in the last bit, and
/// the triangle.
fn edges(
    corners: impl Iterator<Item = (u32, [u32; 3])> + Clone,
    places: usize,
) -> (Vec<u32>, Vec<u64>) {
    let sides = |(id, [a, b, c]): (u32, [u32; 3])| {
        [(a, b), (b, c), (c, a)].map(|(v, w)| {
            let other = v.max(w) << 1 | u32::from(v > w);
            (v.min(w) as usize, u64::from(other) << 32 | u64::from(id))
        })
    };
    grouped(places, corners.map(sides))
}

/// Connects triangles by the sides that belong to two, and tells of each how many of its sides are
/// edges, with [`ONE_SIDED`] if it meets itself turned.
fn connect(ends: &[u32], edges: &mut [u64], triangles: usize) -> (Connected, Vec<u8>) {
    let mut connected = Connected((0..).map(|i| i << 1).take(triangles).collect());
    let mut flags = vec![0_u8; triangles];
    for_groups(ends, edges, |here| {
        for same in here.chunk_by(|a, b| a >> 33 == b >> 33) {
            if let &[a, b] = same {
                let turned = (a ^ b) >> 32 & 1 == 0;
                if !connected.join(low(a), low(b), turned) {
                    flags[low(a) as usize] |= ONE_SIDED;
                }
            } else {
                for edge in same {
                    flags[low(*edge) as usize] += 1;
                }
            }
        }
    });
    (connected, flags)
}

impl ClosedMeshes {
    /// Finds the closed meshes among the triangles that `kept` has.
    pub(crate) fn find(geometry: &Geometry<'_>, kept: &[bool]) -> Self {
        let places = geometry.positions.len();
        // Numbers take a bit with them, and edges are counted in 32 bits.
        if places >= 1 << 31 || kept.len() >= 1 << 30 {
            return Self::default();
        }
        let place = weld(geometry.positions);
        let ids = || {
            (0_u32..)
                .zip(kept)
                .filter(|(_, kept)| **kept)
                .map(|(id, _)| id)
        };
        let corners = |id: u32| geometry.triangles[id as usize].map(|c| place[c as usize]);
        let (ends, mut edges) = edges(ids().map(|id| (id, corners(id))), places);
        let (mut connected, flags) = connect(&ends, &mut edges, kept.len());
        let mut sets = vec![Set::default(); kept.len()];
        for id in ids() {
            sets[connected.root(id).0 as usize].add(flags[id as usize]);
        }
        let mut found = Self::default();
        let mut number = vec![Number::NONE; kept.len()];
        let mut of = vec![0; kept.len()];
        for id in ids() {
            let (root, turned) = connected.root(id);
            let set = sets[root as usize];
            let number = &mut number[root as usize];
            if *number == Number::NONE {
                *number = if set.is_closed() {
                    found.begin(id)
                } else {
                    Number::OPEN
                };
            }
            if *number != Number::OPEN {
                of[id as usize] = number.0 | if turned { TURNED } else { 0 };
                found.meshes[usize::from(number.0) - 1].add(id, geometry.vertices(id));
            }
        }
        if !found.meshes.is_empty() {
            found.of = of;
        }
        let fine_and_turned = |id| {
            let (root, turned) = connected.root(id);
            let fine = kept[id as usize] && sets[root as usize].is_fine();
            (fine, turned)
        };
        let (fine, turned): (Vec<_>, _) = (0..).take(kept.len()).map(fine_and_turned).unzip();
        let count = |which: &[bool]| which.iter().filter(|is| **is).count();
        let all = count(kept);
        let loose = all - count(&fine);
        if loose < all && loose <= all / LOOSE as usize {
            found.fine = FineTriangles::new(&ends, &edges, corners, &fine, turned);
        }
        found
    }

    /// A mesh that begins with a triangle, empty as yet; beyond the numbers' end it counts as open.
    fn begin(&mut self, id: u32) -> Number {
        let number = u16::try_from(self.meshes.len() + 1).unwrap_or(u16::MAX);
        if number >= TURNED {
            return Number::OPEN;
        }
        self.meshes.push(ClosedMesh {
            lo: [f32::INFINITY; 3],
            hi: [f32::NEG_INFINITY; 3],
            first: id,
            last: id,
        });
        Number(number)
    }
}

impl ClosedMesh {
    /// Takes in a triangle.
    fn add(&mut self, id: u32, vertices: [[f32; 3]; 3]) {
        self.last = self.last.max(id);
        self.first = self.first.min(id);
        for (axis, x) in vertices.into_iter().flat_map(|v| (0..3).zip(v)) {
            self.lo[axis] = least(self.lo[axis], x);
            self.hi[axis] = most(self.hi[axis], x);
        }
    }
}

impl FineTriangles {
    /// Finds the neighbours of those triangles that are `fine`.
    fn new(
        ends: &[u32],
        edges: &[u64],
        corners: impl Fn(u32) -> [u32; 3],
        fine: &[bool],
        turned: Vec<bool>,
    ) -> Self {
        let of = |fine: &bool| if *fine { [EDGE; 3] } else { [NONE; 3] };
        let mut sides: Vec<[u32; 3]> = fine.iter().map(of).collect();
        let mut begin = 0;
        for (place, &end) in (0_u32..).zip(ends) {
            let here = &edges[begin..end as usize];
            begin = end as usize;
            for same in here.chunk_by(|a, b| a >> 33 == b >> 33) {
                let &[a, b] = same else { continue };
                let (i, j) = (low(a), low(b));
                if !fine[i as usize] {
                    continue;
                }
                let ends = [place, low(a >> 33)];
                let alike = u32::from((a ^ b) >> 32 & 1 == 0);
                for (here, beyond) in [(i, j), (j, i)] {
                    let c = corners(here);
                    let is_here = |k: &usize| {
                        let side = [c[*k], c[(k + 1) % 3]];
                        side == ends || side == [ends[1], ends[0]]
                    };
                    if let Some(k) = (0..3).find(is_here) {
                        sides[here as usize][k] = beyond << 1 | alike;
                    }
                }
            }
        }
        Self { sides, turned }
    }
}

/// The index of a connected set's mesh plus one.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Number(u16);

impl Number {
    /// It has none yet.
    const NONE: Self = Self(0);
    /// It is not closed.
    const OPEN: Self = Self(u16::MAX);
}

/// Which closed meshes stand clear of both ends of a shaft, as far as that has been asked.
#[derive(Debug, Default)]
pub(crate) struct ClearOfMesh {
    /// Twice the number of the shaft they were asked for, and whether they do.
    known: Vec<u32>,
    shaft: u32,
}

/// Which triangles of closed meshes a shaft can do without, since others hide as much.
#[derive(Debug)]
pub(crate) struct BackfaceFilter<'a> {
    meshes: &'a [ClosedMesh],
    /// The meshes of the triangles in each leaf.
    of: &'a [[u16; 8]],
    clear_of: &'a mut ClearOfMesh,
    point: DVec3,
    /// The light's box, and how far from both a mesh has to be.
    lo: DVec3,
    hi: DVec3,
    margin: f64,
    /// Excluded triangles: first and number.
    exclude: (u32, u32),
}

impl<'a> BackfaceFilter<'a> {
    /// For a shaft from `point` to a light between `lo` and `hi`.
    #[inline(always)]
    pub(crate) fn new(
        (meshes, of): (&'a [ClosedMesh], &'a [[u16; 8]]),
        clear_of: &'a mut ClearOfMesh,
        point: DVec3,
        [lo, hi]: [DVec3; 2],
        margins: Margins,
        exclude: (u32, u32),
    ) -> Self {
        let mut margin = 0.0;
        if !meshes.is_empty() {
            if clear_of.known.len() < meshes.len() || clear_of.shaft == u32::MAX / 2 {
                clear_of.known.clear();
                clear_of.known.resize(meshes.len(), 0);
                clear_of.shaft = 0;
            }
            clear_of.shaft += 1;
            // What is this near to an end of a segment may be beyond its margins.
            let reach = (hi.max(point) - lo.min(point)).element_sum();
            margin = 2.0 * margins.point.max(margins.light) * reach;
        }
        Self {
            meshes,
            of,
            clear_of,
            point,
            lo,
            hi,
            margin,
            exclude,
        }
    }

    /// Whether there are any meshes.
    #[inline(always)]
    pub(crate) fn any(&self) -> bool {
        !self.meshes.is_empty()
    }

    /// The meshes of a leaf's triangles, as [`Self::left_out`] takes them; zero for none.
    #[inline(always)]
    pub(crate) fn codes(&self, leaf: usize) -> [u32; 8] {
        let mut codes = [0; 8];
        if !self.any() {
            return codes;
        }
        for (code, mesh) in codes.iter_mut().zip(&self.of[leaf]) {
            *code = u32::from(mesh & !TURNED) | u32::from(mesh & TURNED) << 16;
        }
        codes
    }

    /// Which triangles to leave out, a bit each: those that belong to a mesh clear of the shaft's
    /// ends and face the one way, given which of them face either way for sure.
    #[inline(always)]
    pub(crate) fn left_out<S: Simd>(
        &mut self,
        s: S,
        codes: &[u32; 8],
        negative: u8,
        positive: u8,
    ) -> u8 {
        let turned = s.in_range(codes, 1 << 31, 1 << 31);
        let closed = s.in_range(codes, 1, u32::MAX);
        let mut back = closed & (turned & positive | !turned & negative);
        let mut out = 0;
        while back != 0 {
            let lane = back.trailing_zeros() as usize;
            back &= back - 1;
            let index = (codes[lane] & 0x7fff_ffff) as usize - 1;
            let known = self.clear_of.known[index];
            let clear = if known >> 1 == self.clear_of.shaft {
                known & 1 != 0
            } else {
                self.stands_clear(index)
            };
            out |= u8::from(clear) << lane;
        }
        out
    }

    /// Whether neither end of the shaft is in the mesh's box, and no triangle of it is excluded;
    /// remembered for this shaft.
    #[inline(never)]
    fn stands_clear(&mut self, index: usize) -> bool {
        let mesh = &self.meshes[index];
        let lo = DVec3::from(mesh.lo.map(f64::from)) - self.margin;
        let hi = DVec3::from(mesh.hi.map(f64::from)) + self.margin;
        let is_clear = |from: DVec3, to: DVec3| !(from.cmple(hi).all() && lo.cmple(to).all());
        // A mesh of which triangles are excluded is not closed.
        let (start, count) = self.exclude;
        let whole = count == 0 || mesh.last < start || mesh.first >= start.saturating_add(count);
        let clear = whole && is_clear(self.point, self.point) && is_clear(self.lo, self.hi);
        self.clear_of.known[index] = self.clear_of.shaft << 1 | u32::from(clear);
        clear
    }
}

#[cfg(test)]
mod tests {
    use super::{ClosedMeshes, EDGE, Geometry, NONE, TURNED, weld_in_table, weld_sorted};

    #[allow(clippy::float_cmp, reason = "the very same place")]
    #[test]
    fn places_in_a_table_are_those_sorted() {
        for count in [0, 1, 2, 100, 5000_u32] {
            // Three numbers of few, zero with either sign.
            let random = |k: u32| k.wrapping_mul(2_654_435_769) >> 20;
            let positions: Vec<[f32; 3]> = (0..count)
                .map(|k| [k, k + 1, 7 * k].map(|k| [0.0, -0.0, 1.0, 1e30][random(k) as usize % 4]))
                .collect();
            let sorted = weld_sorted(&positions);
            assert_eq!(weld_in_table(&positions, 100_000).as_ref(), Some(&sorted));
            for (&first, i) in sorted.iter().zip(0..) {
                let same = |k: &u32| positions[*k as usize] == positions[i as usize];
                assert_eq!((0..count).find(same), Some(first));
            }
            // Fewer looks than positions do not do.
            let looks = positions.len().saturating_sub(1);
            assert_eq!(weld_in_table(&positions, looks).is_some(), count == 0);
        }
    }

    /// The triangles of a cube, or all but the last of them, some turned; every triangle with
    /// corners of its own.
    fn cube(count: usize, turned: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let mut positions = Vec::new();
        for axis in 0..3 {
            for side in [0.0_f32, 1.0] {
                let corner = |a: f32, b: f32| {
                    let mut v = [side; 3];
                    v[(axis + 1) % 3] = a;
                    v[(axis + 2) % 3] = b;
                    // Zero with either sign.
                    if side > 0.0 {
                        v
                    } else {
                        v.map(|x| if x == 0.0 { -0.0 } else { x })
                    }
                };
                let mut quad = [
                    corner(0., 0.),
                    corner(1., 0.),
                    corner(1., 1.),
                    corner(0., 1.),
                ];
                if side == 0.0 {
                    quad.reverse();
                }
                for k in [[0, 1, 2], [0, 2, 3]] {
                    let mut t = k.map(|i| quad[i]);
                    if turned >> (positions.len() / 3) & 1 != 0 {
                        t.reverse();
                    }
                    positions.extend(t);
                }
            }
        }
        positions.truncate(3 * count);
        let triangles = (0..)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .take(count)
            .collect();
        (positions, triangles)
    }

    fn find(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> ClosedMeshes {
        let geometry = Geometry {
            positions,
            triangles,
            origin: [0.0; 3],
            extent: 1.0,
        };
        ClosedMeshes::find(&geometry, &vec![true; triangles.len()])
    }

    #[test]
    fn cubes_are_closed_however_their_triangles_are_turned() {
        for turned in [0, 0xfff, 0b1010_0110_0101] {
            let (positions, triangles) = cube(12, turned);
            let found = find(&positions, &triangles);
            assert_eq!(found.meshes.len(), 1);
            let mesh = &found.meshes[0];
            assert_eq!((mesh.lo, mesh.hi), ([0.0; 3], [1.0; 3]));
            assert_eq!((mesh.first, mesh.last), (0, 11));
            for (i, code) in found.of.iter().enumerate() {
                let against_first = (turned >> i ^ turned) & 1 != 0;
                assert_eq!(*code, 1 | if against_first { TURNED } else { 0 });
            }
        }
    }

    #[test]
    fn open_and_branching_surfaces_are_none() {
        let (positions, triangles) = cube(11, 0);
        assert!(find(&positions, &triangles).meshes.is_empty());
        // A fin on an edge of the cube.
        let (mut positions, mut triangles) = cube(12, 0);
        positions.extend([[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, -1.0]]);
        triangles.push([36, 37, 38]);
        assert!(find(&positions, &triangles).meshes.is_empty());
    }

    /// A strip of `columns` × 8 quads, open or closed to a ring, which may be twisted, and loose
    /// triangles.
    fn strip(columns: u32, ring: bool, twisted: bool, loose: u32) -> ClosedMeshes {
        let row = columns + 1;
        let mut positions: Vec<[f32; 3]> = (0..9 * row)
            .map(|i| [(i % row) as f32, (i / row) as f32, 0.0])
            .collect();
        let aside = (0..3 * loose).map(|i| [i as f32, (i * i) as f32, 10.0]);
        positions.extend(aside);
        let corner = |x: u32, y: u32| match (ring && x == columns, twisted) {
            (false, _) => y * row + x,
            (true, false) => y * row,
            (true, true) => (8 - y) * row,
        };
        let quad = |k: u32| {
            let (x, y) = (k % columns, k / columns);
            let [a, b, c, d] =
                [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| corner(x, y));
            [[a, b, c], [a, c, d]]
        };
        let apart = (0..loose).map(|k| [0, 1, 2].map(|j| 9 * row + 3 * k + j));
        let triangles: Vec<[u32; 3]> = (0..8 * columns).flat_map(quad).chain(apart).collect();
        find(&positions, &triangles)
    }

    #[test]
    fn fine_surfaces_may_have_edges_but_two_sides() {
        // 1,120 triangles, with 156 or 140 sides that are edges.
        for (ring, edges) in [(false, 156), (true, 140)] {
            let found = strip(70, ring, false, 0);
            assert!(found.meshes.is_empty());
            let sides: Vec<u32> = found.fine.sides.into_iter().flatten().collect();
            assert_eq!(sides.len(), 3360);
            assert!(sides.iter().all(|side| *side != NONE));
            assert_eq!(sides.iter().filter(|side| **side == EDGE).count(), edges);
            // Neighbours run along their sides in opposite directions.
            assert!(sides.iter().all(|side| *side == EDGE || side & 1 == 0));
        }
        assert!(strip(70, true, true, 0).fine.sides.is_empty());
        assert!(strip(63, false, false, 0).fine.sides.is_empty());
        // An eighth of 1,280 triangles is 160.
        assert!(!strip(70, false, false, 160).fine.sides.is_empty());
        assert!(strip(70, false, false, 161).fine.sides.is_empty());
    }

    /// The projective plane of six corners: every edge belongs to two, but they cannot all
    /// be turned alike.
    #[test]
    fn one_sided_surfaces_are_none() {
        let positions: Vec<[f32; 3]> = (0..6_u8).map(|i| [f32::from(i), 1.0, 0.0]).collect();
        let triangles = [
            [0, 1, 2],
            [0, 2, 3],
            [0, 3, 4],
            [0, 4, 5],
            [0, 5, 1],
            [1, 2, 4],
            [2, 3, 5],
            [3, 4, 1],
            [4, 5, 2],
            [5, 1, 3],
        ];
        assert!(find(&positions, &triangles).meshes.is_empty());
    }
}

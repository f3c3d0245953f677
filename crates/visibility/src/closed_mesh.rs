//! Closed meshes, and back-face culling for shadows: the triangles of one orientation of a closed
//! mesh hide as much as all of them.
//!
//! Where a segment runs from outside a closed surface to outside of it, it enters as often as it
//! leaves, so whatever a triangle facing one way hides, one facing the other way hides too. A
//! *closed mesh* is a set of triangles, connected by their edges, in which every edge belongs to
//! exactly two triangles, and whose triangles can be oriented so that the two run along each edge
//! in opposite directions. Project the triangles from the shading point onto the light's plane,
//! each with a sign for its orientation there. Then the signs of the projections over any point of
//! the plane add up to zero, whatever the mesh's shape, even if it intersects itself or is inside
//! out. So the projections of one sign may be left out, provided that neither the shading point nor
//! the light is in the mesh's bounding box.
//!
//! Meshes are found in four parallel steps: [`weld`] gives corners at the same position the same
//! index; [`by_corners`] sorts the sides of triangles by their lesser corner; [`connect`] joins the
//! two triangles of each side in a union–find structure that also stores relative orientations; and
//! [`sets`] counts triangles and edges of each connected set.

use crate::{
    build::{Bounds, Geometry, index},
    pool,
    surfaces::{EDGE, FINE, LOOSE, MOSTLY, NONE},
};
use linelit_geometry::{DVec3, Margins};
use linelit_simd::Simd;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// The bounding box of a connected closed mesh, and the range of its triangles' indices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClosedMesh {
    bounds: Bounds,
    /// The least index of a triangle of the mesh in the caller's list; `last` is the largest.
    first: u32,
    last: u32,
}

/// The closed meshes of a scene, and which of them each triangle belongs to.
#[derive(Debug, Default)]
pub(crate) struct ClosedMeshes {
    pub(crate) meshes: Vec<ClosedMesh>,
    /// For each triangle in the caller's list, zero if it belongs to no closed mesh, or the index
    /// of its mesh in `meshes` plus one, with the bit [`TURNED`] if its orientation is opposite to
    /// that of the mesh's first triangle. Empty if there are no meshes.
    pub(crate) of: Vec<u16>,
    /// The triangles that belong to fine surfaces (`surfaces`).
    pub(crate) fine: FineTriangles,
}

/// The triangles that belong to fine surfaces.
#[derive(Debug, Default)]
pub(crate) struct FineTriangles {
    /// For each triangle in the caller's list, its neighbours beyond the sides from corner 0 to 1,
    /// 1 to 2 and 2 to 0: twice the neighbour's index, plus one if both triangles run along the
    /// side in the same direction. [`EDGE`] if there is no neighbour or more than one; [`NONE`] if
    /// the triangle belongs to no fine surface. Empty if there are no fine surfaces.
    pub(crate) sides: Vec<[u32; 3]>,
    /// For each triangle in the caller's list, whether its orientation is opposite to that of its
    /// surface's first triangle.
    pub(crate) turned: Vec<bool>,
}

/// The totals of a set of connected triangles, stored at the index of the set's first triangle.
#[derive(Debug, Default)]
struct Set {
    /// The number of triangles.
    count: AtomicU32,
    /// The number of sides of the set's triangles that no other triangle shares, or that more than
    /// one other triangle shares; with the bit [`ONE_SIDED`] if the triangles cannot be oriented so
    /// that neighbours run along their common sides in opposite directions.
    edges: AtomicU32,
}

impl Set {
    /// Adds the numbers of triangles and of edges of a part of the set.
    fn add(&self, count: u32, edges: u32) {
        self.count.fetch_add(count, Ordering::Relaxed);
        self.edges.fetch_add(edges & !ONE_SIDED, Ordering::Relaxed);
        self.edges.fetch_or(edges & ONE_SIDED, Ordering::Relaxed);
    }

    fn count(&self) -> u32 {
        self.count.load(Ordering::Relaxed)
    }

    /// Returns the number of sides without exactly one neighbour. For a set that cannot be oriented
    /// the number includes [`ONE_SIDED`], and so exceeds every limit.
    fn edges(&self) -> u32 {
        self.edges.load(Ordering::Relaxed)
    }

    fn is_closed(&self) -> bool {
        self.count() > 0 && self.edges() == 0
    }

    /// Whether the set is a fine surface.
    fn is_fine(&self) -> bool {
        self.count() >= FINE && self.edges() <= self.count() / MOSTLY
    }
}

/// The bit of a triangle's mesh code that says that its orientation is opposite to that of its
/// mesh's first triangle.
const TURNED: u16 = 1 << 15;

/// The bit of a set's number of edges, or of a neighbour, that says that two opposite orientations
/// of the set meet there, as on a Möbius strip.
const ONE_SIDED: u32 = 1 << 31;

/// The number of positions or triangles that one parallel task handles.
const AT_ONCE: usize = 1 << 14;

/// A union–find forest over triangles that several threads may extend at once. Each triangle refers
/// to an earlier triangle of its set, or to itself if it is the root; the last bit of a reference
/// says whether the two triangles have opposite orientations.
///
/// Since references only lead to earlier triangles, the root of a set is always its first triangle.
/// So the result does not depend on the order in which threads join triangles.
struct Connected(Vec<AtomicU32>);

impl Connected {
    /// Returns the root of the set of triangle `i`, and whether `i` is oriented opposite to it.
    fn root(&self, i: u32) -> (u32, bool) {
        let (mut at, mut turned) = (i, 0);
        loop {
            let step = self.0[at as usize].load(Ordering::Relaxed);
            let next = step >> 1;
            if next == at {
                return (at, turned != 0);
            }
            // Path halving: refer to the triangle after the next, to shorten the path for later
            // searches.
            let after = self.0[next as usize].load(Ordering::Relaxed) ^ step & 1;
            if after != step {
                self.0[at as usize].store(after, Ordering::Relaxed);
            }
            turned ^= after & 1;
            at = after >> 1;
        }
    }

    /// Joins the sets of two triangles; `turned` says whether their orientations are opposite.
    /// Returns false if the triangles were in one set already, but with the other relative
    /// orientation.
    fn join(&self, i: u32, j: u32, turned: bool) -> bool {
        loop {
            let ((i, ti), (j, tj)) = (self.root(i), self.root(j));
            if i == j {
                return ti ^ tj == turned;
            }
            let (first, last) = (i.min(j), i.max(j));
            let step = first << 1 | u32::from(ti ^ tj ^ turned);
            let last_step = &self.0[last as usize];
            let (now, then) = (Ordering::Relaxed, Ordering::Relaxed);
            // The later root refers to the earlier, unless another thread has changed it meanwhile.
            if (last_step.compare_exchange(last << 1, step, now, then)).is_ok() {
                return true;
            }
        }
    }
}

/// Returns the bits of a position's coordinates, by which equal positions are recognized; minus
/// zero counts as zero.
fn bits(position: [f32; 3]) -> [u32; 3] {
    position.map(|x| (x + 0.0).to_bits())
}

/// Maps each position to the least index of an equal position.
///
/// The hash table takes about two probes for each position. Its key is random, so that no input can
/// be constructed to be slow; the result does not depend on the key.
fn weld(positions: &[[f32; 3]]) -> Vec<u32> {
    const FREE: u32 = u32::MAX;
    let slots = (positions.len() + positions.len() / 2 + 1).next_power_of_two();
    let table = pool::collect(slots, AT_ONCE, &|_| AtomicU32::new(FREE));
    let key = RandomState::new().build_hasher().finish() | 1;
    let mix = |h: u64, x: u32| (h ^ u64::from(x)).wrapping_mul(key);
    // Find the slot of a position's entry, and make the entry its least index seen so far.
    let slot_of = |i: u32| {
        let here = bits(positions[i as usize]);
        let [x, y, z] = here;
        let hash = mix(mix(mix(0, x).rotate_left(29), y).rotate_left(29), z);
        let mut slot = (hash >> 32) as usize % slots;
        loop {
            let entry = &table[slot];
            let mut first = entry.load(Ordering::Relaxed);
            if first == FREE {
                // Claim a free slot, or go on with the entry of the thread that was faster.
                let put = entry.compare_exchange(FREE, i, Ordering::Relaxed, Ordering::Relaxed);
                first = put.err().unwrap_or(i);
            }
            if first == i || bits(positions[first as usize]) == here {
                if i < first {
                    entry.fetch_min(i, Ordering::Relaxed);
                }
                return index(slot);
            }
            slot = (slot + 1) % slots;
        }
    };
    // Read the entries only when all positions are in the table.
    let slots = pool::collect(positions.len(), AT_ONCE, &|i| slot_of(index(i)));
    pool::collect(slots.len(), AT_ONCE, &|i| {
        table[slots[i] as usize].load(Ordering::Relaxed)
    })
}

/// A side of a triangle, packed into 64 bits for sorting: the greater corner in the upper half,
/// followed by a bit for the direction; in the lower half the triangle's index, and in the last two
/// bits which of its sides it is. The lesser corner is not included; it is the key under which
/// sides are stored.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side(u64);

impl Side {
    /// Returns the three sides of a triangle, each as a pair of its lesser corner and the packed
    /// side.
    fn all(id: u32, [a, b, c]: [u32; 3]) -> [(u32, Self); 3] {
        let side = |k: u32, v: u32, w: u32| {
            let other = v.max(w) << 1 | u32::from(v > w);
            (
                v.min(w),
                Self(u64::from(other) << 32 | u64::from(id << 2 | k)),
            )
        };
        [side(0, a, b), side(1, b, c), side(2, c, a)]
    }

    // The index of the triangle.
    #[allow(clippy::cast_possible_truncation, reason = "the lower half")]
    fn id(self) -> u32 {
        self.0 as u32 >> 2
    }

    // Which of the triangle's three sides it is: 0, 1 or 2.
    fn number(self) -> usize {
        (self.0 & 3) as usize
    }
}

/// Sorts the sides of triangles by their lesser corners, by a counting sort in parallel. Returns a
/// list that says for each corner where its sides end in the sorted list, and the sorted list; the
/// order of the sides of one corner is arbitrary.
fn by_corners(
    sides: &(impl Fn(usize) -> Option<[(u32, Side); 3]> + Sync),
    triangles: usize,
    places: usize,
) -> (Vec<AtomicU32>, Vec<AtomicU64>) {
    let alone = pool::is_alone();
    let next = |count: &AtomicU32| match alone {
        // Avoid an atomic read-modify-write where there is no other thread.
        true => {
            let next = count.load(Ordering::Relaxed);
            count.store(next + 1, Ordering::Relaxed);
            next
        }
        false => count.fetch_add(1, Ordering::Relaxed),
    };
    // Count the sides of each corner.
    let mut ends = pool::collect(places, AT_ONCE, &|_| AtomicU32::new(0));
    pool::collect(triangles, AT_ONCE, &|id| {
        for (corner, _) in sides(id).into_iter().flatten() {
            next(&ends[corner as usize]);
        }
    });
    // Turn counts into where each corner's sides begin.
    let mut sum = 0;
    for end in &mut ends {
        let count = std::mem::replace(end.get_mut(), sum);
        sum += count;
    }
    // Place the sides; each entry of `ends` advances from the beginning of a corner's sides to
    // their end.
    let list = pool::collect(sum as usize, AT_ONCE, &|_| AtomicU64::new(0));
    pool::collect(triangles, AT_ONCE, &|id| {
        for (corner, side) in sides(id).into_iter().flatten() {
            list[next(&ends[corner as usize]) as usize].store(side.0, Ordering::Relaxed);
        }
    });
    // By now each entry is where the corner's sides end.
    (ends, list)
}

/// Joins triangles along the sides that belong to exactly two triangles. Returns each triangle's
/// neighbours as in [`FineTriangles::sides`], with the bit [`ONE_SIDED`] where a set meets itself
/// in the opposite orientation.
fn connect(
    ends: &[AtomicU32],
    list: &[AtomicU64],
    triangles: usize,
) -> (Connected, Vec<[AtomicU32; 3]>) {
    // At first, each triangle is a set of its own, and all of its sides are edges.
    let alone = |id| AtomicU32::new(index(id) << 1);
    let connected = Connected(pool::collect(triangles, AT_ONCE, &alone));
    let edges = |_| [EDGE; 3].map(AtomicU32::new);
    let beyond = pool::collect(triangles, AT_ONCE, &edges);
    let end = |corner: usize| ends[corner].load(Ordering::Relaxed) as usize;
    pool::stretches(ends.len(), AT_ONCE, &|corners| {
        let mut here = Vec::new();
        for corner in corners {
            let begin = corner.checked_sub(1).map_or(0, end);
            here.clear();
            let all = list[begin..end(corner)].iter();
            here.extend(all.map(|side| Side(side.load(Ordering::Relaxed))));
            here.sort_unstable();
            // Sides with the same two corners; only pairs of them connect.
            for same in here.chunk_by(|a, b| a.0 >> 33 == b.0 >> 33) {
                let &[a, b] = same else { continue };
                let alike = (a.0 ^ b.0) >> 32 & 1 == 0;
                let fits = connected.join(a.id(), b.id(), alike);
                let bits = u32::from(alike) | if fits { 0 } else { ONE_SIDED };
                for (here, there) in [(a, b), (b, a)] {
                    let side = &beyond[here.id() as usize][here.number()];
                    side.store(there.id() << 1 | bits, Ordering::Relaxed);
                }
            }
        }
    });
    (connected, beyond)
}

/// Computes the totals of each set of connected triangles, and stores them at the index of the
/// set's first triangle.
fn sets(connected: &Connected, beyond: &[[AtomicU32; 3]], kept: &[bool]) -> Vec<Set> {
    let sets = pool::collect(kept.len(), AT_ONCE, &|_| Set::default());
    pool::stretches(kept.len(), AT_ONCE, &|ids| {
        // Add up consecutive triangles of one set before the atomic additions.
        let (mut of, mut count, mut edges) = (0, 0, 0);
        for id in ids.filter(|id| kept[*id]) {
            let (root, _) = connected.root(index(id));
            if root != of {
                sets[of as usize].add(count, edges);
                (of, count, edges) = (root, 0, 0);
            }
            count += 1;
            for side in beyond[id].each_ref() {
                match side.load(Ordering::Relaxed) {
                    EDGE => edges += 1,
                    side => edges |= side & ONE_SIDED,
                }
            }
        }
        sets[of as usize].add(count, edges);
    });
    sets
}

impl ClosedMeshes {
    /// Finds the closed meshes and the fine surfaces among the triangles for which `kept` is true.
    pub(crate) fn find(geometry: &Geometry<'_>, kept: &[bool]) -> Self {
        let (places, triangles) = (geometry.positions.len(), kept.len());
        // Triangle indices share 32 bits with flags, and sides are counted in 32 bits.
        if places >= 1 << 31 || triangles >= 1 << 29 || triangles == 0 {
            return Self::default();
        }
        // Connect triangles along their sides, and total the sets.
        let place = weld(geometry.positions);
        let sides = |id: usize| {
            let corners = || geometry.triangles[id].map(|c| place[c as usize]);
            kept[id].then(|| Side::all(index(id), corners()))
        };
        let (ends, list) = by_corners(&sides, triangles, places);
        drop(place);
        let (connected, beyond) = connect(&ends, &list, triangles);
        drop((ends, list));
        let sets = sets(&connected, &beyond, kept);
        let mut found = Self::default();
        // For the first triangle of each closed mesh, the mesh's index plus one.
        let mut numbers = vec![0_u16; triangles];
        let (mut all, mut fine) = (0, 0);
        for (set, number) in sets.iter().zip(&mut numbers) {
            all += set.count();
            fine += if set.is_fine() { set.count() } else { 0 };
            // Meshes beyond the largest index of 15 bits count as open.
            let next = u16::try_from(found.meshes.len() + 1).unwrap_or(u16::MAX);
            if next < TURNED && set.is_closed() {
                found.meshes.push(ClosedMesh::NONE);
                *number = next;
            }
        }
        if !found.meshes.is_empty() {
            let of = |id| match connected.root(index(id)) {
                (root, turned) if numbers[root as usize] != 0 => {
                    numbers[root as usize] | if turned { TURNED } else { 0 }
                }
                _ => 0,
            };
            found.of = pool::collect(triangles, AT_ONCE, &of);
            found.measure(geometry);
        }
        // Store the neighbours of fine surfaces, if few triangles are outside of them.
        let loose = all - fine;
        if fine > 0 && loose <= all / LOOSE {
            let is_fine = |id| sets[connected.root(index(id)).0 as usize].is_fine();
            let sides = |id: usize| match is_fine(id) {
                true => beyond[id].each_ref().map(|s| s.load(Ordering::Relaxed)),
                false => [NONE; 3],
            };
            found.fine = FineTriangles {
                sides: pool::collect(triangles, AT_ONCE, &sides),
                turned: pool::collect(triangles, AT_ONCE, &|id| connected.root(index(id)).1),
            };
        }
        found
    }

    /// Finds the bounding box and the range of triangle indices of each mesh.
    fn measure(&mut self, geometry: &Geometry<'_>) {
        let of = &self.of;
        let runs = pool::stretches(of.len(), AT_ONCE, &|ids| {
            let mut runs: Vec<(u16, ClosedMesh)> = Vec::new();
            for id in ids.filter(|id| of[*id] != 0) {
                let number = of[id] & !TURNED;
                let one = ClosedMesh {
                    bounds: geometry.bounds(index(id)),
                    first: index(id),
                    last: index(id),
                };
                match runs.last_mut() {
                    Some((last, mesh)) if *last == number => mesh.take(&one),
                    _ => runs.push((number, one)),
                }
            }
            runs
        });
        for (number, run) in runs.iter().flatten() {
            self.meshes[usize::from(*number) - 1].take(run);
        }
    }
}

impl ClosedMesh {
    const NONE: Self = Self {
        bounds: Bounds::EMPTY,
        first: u32::MAX,
        last: 0,
    };

    /// Extends the box and the range of indices by another part of the same mesh.
    fn take(&mut self, other: &Self) {
        self.bounds.extend(&other.bounds);
        self.first = self.first.min(other.first);
        self.last = self.last.max(other.last);
    }
}

/// Cached answers, for the current shaft, to whether a closed mesh has neither the shading point
/// nor the light in its bounding box, so that its back faces can be left out.
#[derive(Debug, Default)]
pub(crate) struct ClearOfMesh {
    /// For each mesh, twice the number of the shaft for which the answer was computed, plus one if
    /// the mesh is clear of both ends of that shaft.
    known: Vec<u32>,
    shaft: u32,
}

/// The filter that finds the triangles of closed meshes that a shaft can leave out, since triangles
/// that face the other way hide as much.
#[derive(Debug)]
pub(crate) struct BackfaceFilter<'a> {
    meshes: &'a [ClosedMesh],
    /// For each leaf, the mesh codes of its triangles, as in [`ClosedMeshes::of`].
    of: &'a [[u16; 8]],
    clear_of: &'a mut ClearOfMesh,
    point: DVec3,
    /// The lowest and the highest corner of the light's bounding box, and the distance that a mesh
    /// has to have from that box and from the shading point.
    lo: DVec3,
    hi: DVec3,
    margin: f64,
    /// The excluded triangles: the index of the first, and how many.
    exclude: (u32, u32),
}

impl<'a> BackfaceFilter<'a> {
    /// Creates the filter for a shaft from `point` to a light between `lo` and `hi`.
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
            // Whatever is this close to an end of a segment may be beyond its margins.
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

    /// Returns the mesh codes of a leaf's triangles in the form that [`Self::left_out`] expects:
    /// the mesh's index plus one, with the highest bit set for turned triangles; zero for triangles
    /// of no mesh.
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

    /// Returns a bit for each triangle of a leaf to leave out: the triangles whose mesh contains
    /// neither end of the shaft, and whose projection onto the light is clockwise in the mesh's
    /// orientation. `codes` are the mesh codes of the triangles; `negative` and `positive` are the
    /// masks of the triangles whose projections, in their own orientation, are surely clockwise or
    /// counter-clockwise.
    #[inline(always)]
    pub(crate) fn left_out<S: Simd>(
        &mut self,
        s: S,
        codes: &[u32; 8],
        negative: u8,
        positive: u8,
    ) -> u8 {
        // Back faces have clockwise projections, or counter-clockwise ones if the triangle is
        // turned.
        let turned = s.in_range(codes, 1 << 31, 1 << 31);
        let closed = s.in_range(codes, 1, u32::MAX);
        // Leave out the back faces whose mesh is clear of both ends of the shaft.
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

    /// Computes and caches whether neither end of the shaft is in the mesh's bounding box, and no
    /// triangle of the mesh is excluded.
    #[inline(never)]
    fn stands_clear(&mut self, index: usize) -> bool {
        let mesh = &self.meshes[index];
        let lo = DVec3::from(mesh.bounds.lo.map(f64::from)) - self.margin;
        let hi = DVec3::from(mesh.bounds.hi.map(f64::from)) + self.margin;
        let is_clear = |from: DVec3, to: DVec3| !(from.cmple(hi).all() && lo.cmple(to).all());
        // A mesh of which some triangles are excluded is not closed any more.
        let (start, count) = self.exclude;
        let whole = count == 0 || mesh.last < start || mesh.first >= start.saturating_add(count);
        let clear = whole && is_clear(self.point, self.point) && is_clear(self.lo, self.hi);
        self.clear_of.known[index] = self.clear_of.shaft << 1 | u32::from(clear);
        clear
    }
}

#[cfg(test)]
mod tests {
    use super::{ClosedMeshes, EDGE, Geometry, NONE, TURNED, weld};

    #[allow(clippy::float_cmp, reason = "the very same place")]
    #[test]
    fn places_are_told_apart() {
        for count in [0, 1, 2, 100, 5000_u32] {
            // Coordinates are one of three numbers, with zeros of either sign.
            let random = |k: u32| k.wrapping_mul(2_654_435_769) >> 20;
            let positions: Vec<[f32; 3]> = (0..count)
                .map(|k| [k, k + 1, 7 * k].map(|k| [0.0, -0.0, 1.0, 1e30][random(k) as usize % 4]))
                .collect();
            for (first, i) in weld(&positions).into_iter().zip(0..) {
                let same = |k: &u32| positions[*k as usize] == positions[i as usize];
                assert_eq!((0..count).find(same), Some(first));
            }
        }
    }

    /// The triangles of a cube, or all except the last, some of them reversed; no two triangles
    /// share corner indices.
    fn cube(count: usize, turned: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let mut positions = Vec::new();
        for axis in 0..3 {
            for side in [0.0_f32, 1.0] {
                let corner = |a: f32, b: f32| {
                    let mut v = [side; 3];
                    v[(axis + 1) % 3] = a;
                    v[(axis + 2) % 3] = b;
                    // Zeros of either sign.
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
            assert_eq!((mesh.bounds.lo, mesh.bounds.hi), ([0.0; 3], [1.0; 3]));
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

    /// A strip of `columns` × 8 quads, open or closed to a ring, which may be twisted, and
    /// triangles that belong to no mesh.
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

    /// The projective plane with six corners: every edge belongs to two triangles, but they cannot
    /// all be oriented alike.
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

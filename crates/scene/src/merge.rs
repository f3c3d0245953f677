//! The merging of coplanar emissive triangles into convex polygons, which are better lights.
//!
//! A quad light comes from its file as two triangles. Sampled as one polygon it needs one
//! technique instead of two, and its lines do not end at the diagonal:
//!
//! ```text
//!   d────c        d────c
//!   │  ╱ │        │    │
//!   │ ╱  │   ─►   │    │
//!   a────b        a────b
//! ```
//!
//! Triangles are merged when they share edges, lie in one plane to the rounding of their `f32`
//! vertices (which [`ConvexPolygon::new`] judges), face the same way, emit the same, and their
//! union is convex. The steps are these. Corners at the same position are identified, which gives
//! the neighbours of each triangle over its edges ([`Topology`]). Connected patches in one plane
//! are collected by a flood fill. If the union of a whole patch is convex, it becomes one polygon;
//! otherwise neighbours are merged greedily as long as the result stays convex (after Hertel and
//! Mehlhorn).

use linelit_geometry::{ConvexPolygon, DVec3, MAX_VERTICES, PolygonError};
use std::collections::HashMap;

/// An emissive triangle, wound so that its normal is the emitting side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    corners: [DVec3; 3],
    /// The normal, whose length is twice the area.
    cross: DVec3,
}

/// Facets that form one light, by their indices.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    /// The union of the facets; an error if a single facet is not a valid polygon.
    pub(crate) polygon: Result<ConvexPolygon, PolygonError>,
    pub(crate) facets: Vec<usize>,
}

/// The number of facets that greedy merging may visit for each facet of a patch, which keeps the
/// time in proportion to the number of facets. Trying to merge two single facets visits two facets,
/// so that ordinary patches stay far below the limit.
const GREEDY_BUDGET: usize = 128;

impl Facet {
    /// Creates a facet. `keep` is called with the right-hand unit normal of the corners, and
    /// returns whether this normal is on the emitting side; if not, the vertex order is reversed.
    pub(crate) fn new([a, b, c]: [DVec3; 3], keep: impl FnOnce(DVec3) -> bool) -> Self {
        let cross = (b - a).cross(c - a);
        if keep(cross.normalize_or(DVec3::Z)) {
            Self {
                corners: [a, b, c],
                cross,
            }
        } else {
            Self {
                corners: [a, c, b],
                cross: -cross,
            }
        }
    }

    /// Returns the area of the facet.
    pub(crate) fn area(&self) -> f64 {
        0.5 * self.cross.length()
    }
}

/// Groups facets into lights and calls `add` with one after the other. `same` says whether two
/// facets, given by their indices, emit the same. Every facet is in exactly one group.
pub(crate) fn merge<E>(
    facets: &[Facet],
    same: impl Fn(usize, usize) -> bool,
    mut add: impl FnMut(Group) -> Result<(), E>,
) -> Result<(), E> {
    let mesh = Topology::new(facets);
    for patch in mesh.patches(facets, &same) {
        if let [alone] = patch[..] {
            add(single(facets, alone))?;
        } else if let Some(polygon) = mesh.union(facets, &patch) {
            add(Group {
                polygon: Ok(polygon),
                facets: patch,
            })?;
        } else {
            mesh.greedy(facets, patch)
                .into_iter()
                .try_for_each(&mut add)?;
        }
    }
    Ok(())
}

/// Returns a facet as a group of its own.
fn single(facets: &[Facet], k: usize) -> Group {
    Group {
        polygon: ConvexPolygon::new(&facets[k].corners),
        facets: vec![k],
    }
}

/// The adjacency of facets by shared edges.
struct Topology {
    /// The corners of each facet, as indices into `points`.
    corners: Vec<[u32; 3]>,
    /// The different positions of corners.
    points: Vec<DVec3>,
    /// The facet on the left of each directed edge; `None` if several facets have that edge.
    edges: HashMap<(u32, u32), Option<usize>>,
}

impl Topology {
    /// Finds the common corners and the edges of facets.
    fn new(facets: &[Facet]) -> Self {
        let mut ids: HashMap<[u64; 3], u32> = HashMap::new();
        let mut points = Vec::new();
        let mut edges = HashMap::new();
        let mut corners = Vec::with_capacity(facets.len());
        for (k, facet) in facets.iter().enumerate() {
            // Identify corners that have the same position.
            let triple = facet.corners.map(|p| {
                // Adding zero turns -0 into 0.
                let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
                *ids.entry(key).or_insert_with(|| {
                    points.push(p);
                    u32::try_from(points.len() - 1).unwrap_or(u32::MAX)
                })
            });
            // Note the facet on the left of each edge.
            for i in 0..3 {
                edges
                    .entry((triple[i], triple[(i + 1) % 3]))
                    .and_modify(|e| *e = None)
                    .or_insert(Some(k));
            }
            corners.push(triple);
        }
        Self {
            corners,
            points,
            edges,
        }
    }

    /// Returns the facets on the other side of the three edges of facet `k`.
    fn neighbours(&self, k: usize) -> [Option<usize>; 3] {
        let c = self.corners[k];
        std::array::from_fn(|i| {
            let (a, b) = (c[i], c[(i + 1) % 3]);
            // An edge that several facets have in the same direction joins no facets.
            let mine = self.edges.get(&(a, b)).copied().flatten();
            mine.and(self.edges.get(&(b, a)).copied().flatten())
        })
    }

    /// Returns the connected sets of facets in one plane that emit the same, each in the order of
    /// the file.
    fn patches(&self, facets: &[Facet], same: &impl Fn(usize, usize) -> bool) -> Vec<Vec<usize>> {
        // Grow each patch from its first facet over edges; `patch[next..]` are the facets whose
        // neighbours have not been visited.
        let mut taken = vec![false; facets.len()];
        let mut patches = Vec::new();
        for seed in 0..facets.len() {
            if taken[seed] {
                continue;
            }
            taken[seed] = true;
            let mut patch = vec![seed];
            let mut next = 0;
            while next < patch.len() {
                for n in self.neighbours(patch[next]).into_iter().flatten() {
                    if !taken[n] && coplanar(&facets[seed], &facets[n]) && same(seed, n) {
                        taken[n] = true;
                        patch.push(n);
                    }
                }
                next += 1;
            }
            patch.sort_unstable();
            patches.push(patch);
        }
        patches
    }

    /// Returns the union of the facets of a patch, if the union is one convex polygon; otherwise
    /// `None`.
    fn union(&self, facets: &[Facet], patch: &[usize]) -> Option<ConvexPolygon> {
        // Make a polygon of the outline.
        let outline = self.outline(patch)?;
        let points: Vec<DVec3> = outline.iter().map(|i| self.points[*i as usize]).collect();
        let points = without_straight_corners(&points);
        if points.len() > MAX_VERTICES {
            return None;
        }
        let polygon = ConvexPolygon::new(&snapped(&points)).ok()?;
        // Check that the facets fill it once: with overlaps and folds, the sum of their areas would
        // be larger than the area of the outline.
        let area: f64 = patch.iter().map(|k| facets[*k].area()).sum();
        let cross: DVec3 = patch.iter().map(|k| facets[*k].cross).sum();
        let close = (polygon.area() - area).abs() <= 1e-5 * area;
        (close && polygon.normal().dot(cross) > 0.0).then_some(polygon)
    }

    /// Returns the boundary of a patch as one loop of corners; `None` if it is several loops, or
    /// touches itself in a corner.
    fn outline(&self, patch: &[usize]) -> Option<Vec<u32>> {
        // Collect the outer edges by their first corners, of which each may have only one.
        let mut next: HashMap<u32, u32> = HashMap::new();
        let inside: std::collections::HashSet<usize> = patch.iter().copied().collect();
        for &k in patch {
            let (c, others) = (self.corners[k], self.neighbours(k));
            for i in 0..3 {
                let is_inner = others[i].is_some_and(|n| inside.contains(&n));
                if !is_inner && next.insert(c[i], c[(i + 1) % 3]).is_some() {
                    return None;
                }
            }
        }
        // Follow the edges around, from a corner of the first facet if that is on the boundary, so
        // that the loop does not depend on the order of the hash map.
        let start = *self.corners[patch[0]]
            .iter()
            .find(|c| next.contains_key(c))
            .or_else(|| next.keys().min())?;
        let mut outline = vec![start];
        let mut at = *next.get(&start)?;
        while at != start {
            outline.push(at);
            if outline.len() > next.len() {
                return None;
            }
            at = *next.get(&at)?;
        }
        // If edges are left over, there are several loops.
        (outline.len() == next.len()).then_some(outline)
    }

    /// Merges neighbours while the union stays convex: each facet begins as a group of its own, and
    /// over each edge the two groups become one if their union is convex.
    fn greedy(&self, facets: &[Facet], patch: Vec<usize>) -> Vec<Group> {
        // `owner` has the group of each facet; a group is named by the index of the facet that it
        // began with.
        let mut owner: HashMap<usize, usize> = patch.iter().map(|k| (*k, *k)).collect();
        let mut groups: HashMap<usize, Group> =
            patch.iter().map(|k| (*k, single(facets, *k))).collect();
        let mut budget = GREEDY_BUDGET * patch.len();
        for &k in &patch {
            for n in self.neighbours(k).into_iter().flatten() {
                let (Some(&a), Some(&b)) = (owner.get(&k), owner.get(&n)) else {
                    continue;
                };
                // Skip edges within a group, and groups that are too large for the budget.
                let size = groups[&a].facets.len() + groups[&b].facets.len();
                if a == b || size > budget {
                    continue;
                }
                budget -= size;
                // Merge the two groups if their union is convex.
                let mut both: Vec<usize> = [a, b]
                    .iter()
                    .flat_map(|g| groups[g].facets.iter().copied())
                    .collect();
                // Sort the facets in the order of the file, so that the polygon starts at the same
                // corner as if these facets were a patch of their own.
                both.sort_unstable();
                if let Some(polygon) = self.union(facets, &both) {
                    for f in &both {
                        owner.insert(*f, a);
                    }
                    groups.remove(&b);
                    groups.insert(
                        a,
                        Group {
                            polygon: Ok(polygon),
                            facets: both,
                        },
                    );
                }
            }
        }
        // Put the groups in the order of the file.
        let mut groups: Vec<Group> = groups.into_values().collect();
        groups.sort_by_key(|g| g.facets.iter().copied().min());
        groups
    }
}

/// Returns whether the corners of `b` are in the plane of `a` and both face the same way, to the
/// rounding of `f32` coordinates: each coordinate may be off by 2⁻²⁴ of the largest one, and the
/// plane through three such corners is tilted by that over the height of the triangle.
fn coplanar(a: &Facet, b: &Facet) -> bool {
    let size = |f: &Facet| {
        let largest = f.corners.iter().map(|p| p.abs().max_element());
        largest.fold(0.0, f64::max)
    };
    let longest = (0..3)
        .map(|i| (a.corners[i] - a.corners[(i + 1) % 3]).length())
        .fold(0.0, f64::max);
    let height = a.cross.length() / longest;
    let normal = a.cross.normalize_or_zero();
    let rounding = 3.0_f64.sqrt() * size(a).max(size(b)) / f64::from(1u32 << 24);
    normal.dot(b.cross) > 0.0
        && b.corners.iter().all(|p| {
            let v = *p - a.corners[0];
            normal.dot(v).abs() <= rounding * (2.0 + 2.0 * v.length() / height)
        })
}

/// Makes a quad that is a parallelogram to `f32` rounding one to `f64` rounding, by moving each
/// corner by a quarter of its defect a − b + c − d. Other outlines are returned unchanged.
fn snapped(points: &[DVec3]) -> Vec<DVec3> {
    let mut points = points.to_vec();
    if let [a, b, c, d] = points.as_mut_slice() {
        let defect = *a - *b + *c - *d;
        let size = a.abs().max(b.abs()).max(c.abs()).max(d.abs());
        // Each of the four coordinates is off by half a unit in its last place.
        let rounding = 4.0 * size / f64::from(1u32 << 24);
        if defect.abs().cmple(rounding).all() {
            let quarter = 0.25 * defect;
            *a -= quarter;
            *b += quarter;
            *c -= quarter;
            *d += quarter;
        }
    }
    points
}

/// Removes the corners that lie on the line between their neighbours to `f32` rounding.
fn without_straight_corners(points: &[DVec3]) -> Vec<DVec3> {
    let n = points.len();
    (0..n)
        .filter(|&i| {
            let (a, p, b) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
            let base = (b - a).length();
            let off = (p - a).cross(b - a).length();
            let rounding =
                4.0 * p.abs().max(a.abs()).max(b.abs()).max_element() / f64::from(1u32 << 24);
            off > rounding * base
        })
        .map(|i| points[i])
        .collect()
}

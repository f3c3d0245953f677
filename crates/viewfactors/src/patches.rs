//! Patches: neighbouring parts in one plane that form a convex polygon, and so hide others as one
//! polygon. Fewer and larger blockers make view factors cheaper to compute.

use crate::facets::Part;
use crate::tree::Tree;
use linelit_geometry::{ConvexPolygon, DVec3, stop};
use std::collections::HashMap;
use std::ops::RangeInclusive;

/// A convex polygon made of parts in one plane, with a tree of the parts.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    pub polygon: ConvexPolygon,
    /// The first and the last of the facets to which its parts belong.
    pub facets: RangeInclusive<usize>,
    /// A tree of the parts.
    pub tree: Tree,
    /// For each node of the tree, a rectangle around its parts; for a leaf, the part itself.
    pub around: Vec<ConvexPolygon>,
    /// The tolerance for flatness: corners that the patch shares with other patches are within this
    /// height of its plane.
    pub flatness: f64,
}

/// The tolerance for the distance of a corner from a plane or a line, as a fraction of the largest
/// coordinate as given; corners are differences and sums of coordinates. A corner within it counts
/// as in the plane or on the line.
pub(crate) const FLAT: f64 = 16.0 * f64::EPSILON;

/// Joins polygons in one plane that share edges, wherever the result is convex, and returns the
/// patches. `outlines` are the corners of the parts as given, so that neighbours have exactly equal
/// corners.
pub(crate) fn patches(parts: &[Part], outlines: &[Vec<DVec3>]) -> Vec<Patch> {
    // Join neighbours in pairs until there is nothing to join.
    let polygons: Vec<ConvexPolygon> = parts.iter().map(|part| part.polygon).collect();
    let flatness = parts.iter().map(|part| part.flatness).collect();
    let mut joiner = Joiner::new(&polygons, outlines, flatness);
    while joiner.pass() {}
    let Joiner {
        loops,
        members,
        points,
        flatness,
        ..
    } = joiner;
    let mut patches = Vec::new();
    for ((outline, members), flatness) in loops
        .iter()
        .zip(members)
        .zip(flatness)
        .filter(|((outline, _), _)| !outline.is_empty())
    {
        // Make a patch of the parts of each outline: its polygon, its facets, and a tree of its
        // parts with a rectangle around each node.
        let bounds = |k: usize| bounds(polygons[k].vertices());
        let (first, count) = (members[0], members.len());
        let facets = || members.iter().map(|&k| parts[k].facet);
        let facets = facets().min().unwrap_or(0)..=facets().max().unwrap_or(0);
        let tree = Tree::build(members, bounds);
        let corners: Vec<DVec3> = outline.iter().map(|&v| points[v as usize]).collect();
        let corners = without_flat(&corners, polygons[first].normal(), flatness);
        let whole = ConvexPolygon::new(&corners).ok().filter(|_| count > 1);
        let around = tree.nodes.iter().map(|node| {
            let parts = tree.order[node.items.clone()].iter().map(|&k| &polygons[k]);
            rectangle(parts).unwrap_or(polygons[tree.order[node.items.start]])
        });
        patches.push(Patch {
            polygon: whole.unwrap_or(polygons[first]),
            facets,
            around: around.collect(),
            tree,
            flatness,
        });
    }
    patches
}

/// Returns the bounding box of some points, as its lowest and its highest corner.
pub(crate) fn bounds(points: &[DVec3]) -> [DVec3; 2] {
    let start = points.first().copied().unwrap_or_default();
    points
        .iter()
        .fold([start; 2], |[low, high], p| [low.min(*p), high.max(*p)])
}

/// Returns a rectangle around two or more polygons in one plane, along an edge of the first; `None`
/// for a single polygon.
fn rectangle<'a>(
    polygons: impl Iterator<Item = &'a ConvexPolygon> + Clone,
) -> Option<ConvexPolygon> {
    let first = polygons
        .clone()
        .next()
        .filter(|_| polygons.clone().nth(1).is_some())?;
    let n = first.normal();
    let [a, b] = [first.vertices()[0], first.vertices()[1]];
    let u = (b - a).normalize_or_zero();
    let v = n.cross(u);
    let corners = polygons.flat_map(|p| p.vertices());
    let places = corners.map(|p| DVec3::new(u.dot(*p - a), v.dot(*p - a), 0.0));
    let [low, high] = bounds(&places.collect::<Vec<_>>());
    let at = |s: f64, t: f64| a + u * s + v * t;
    let corners = [
        at(low.x, low.y),
        at(high.x, low.y),
        at(high.x, high.y),
        at(low.x, high.y),
    ];
    ConvexPolygon::new(&corners).ok()
}

/// Outlines of polygons, which are joined in pairs.
struct Joiner {
    points: Vec<DVec3>,
    /// For each outline, the indices of its corners, including corners in the middle of a side;
    /// empty where an outline was joined to another.
    loops: Vec<Vec<u32>>,
    normals: Vec<DVec3>,
    members: Vec<Vec<usize>>,
    /// For each directed edge, given by the indices of its ends, the index of the outline on its
    /// left.
    left: HashMap<[u32; 2], usize>,
    flatness: Vec<f64>,
}

impl Joiner {
    /// Assigns an index to each corner, the same one to equal corners, and enters all edges in the
    /// table.
    fn new(polygons: &[ConvexPolygon], outlines: &[Vec<DVec3>], flatness: Vec<f64>) -> Self {
        let (mut points, mut numbers) = (Vec::new(), HashMap::new());
        let mut number = |p: &DVec3| {
            // Zeros of both signs are the same.
            let key = (*p + DVec3::ZERO).to_array().map(f64::to_bits);
            *numbers.entry(key).or_insert_with(|| {
                points.push(*p);
                u32::try_from(points.len() - 1).unwrap_or(u32::MAX)
            })
        };
        let numbers = |outline: &Vec<DVec3>| outline.iter().map(&mut number).collect();
        let loops: Vec<Vec<u32>> = outlines.iter().map(numbers).collect();
        let mut left = HashMap::new();
        for (k, outline) in loops.iter().enumerate() {
            left.extend(edges(outline).map(|edge| (edge, k)));
        }
        Self {
            points,
            loops,
            normals: polygons.iter().map(ConvexPolygon::normal).collect(),
            members: (0..polygons.len()).map(|k| vec![k]).collect(),
            left,
            flatness,
        }
    }

    /// Joins each outline with at most one neighbour, so that all outlines grow at the same rate;
    /// returns whether any was joined.
    fn pass(&mut self) -> bool {
        let mut is_joined = vec![false; self.loops.len()];
        for k in 0..self.loops.len() {
            stop::check();
            let neighbour = match is_joined[k] {
                true => None,
                false => self.neighbour(k, &is_joined),
            };
            if let Some((other, joined)) = neighbour {
                self.left.extend(edges(&joined).map(|edge| (edge, k)));
                self.loops[k] = joined;
                self.loops[other] = Vec::new();
                self.flatness[k] = self.flatness[k].max(self.flatness[other]);
                let members = std::mem::take(&mut self.members[other]);
                self.members[k].extend(members);
                is_joined[k] = true;
                is_joined[other] = true;
            }
        }
        is_joined.contains(&true)
    }

    /// Finds a neighbour that outline `k` may be joined with, and the outline of both together;
    /// `None` if there is no such neighbour.
    fn neighbour(&self, k: usize, is_joined: &[bool]) -> Option<(usize, Vec<u32>)> {
        let own = &self.loops[k];
        let mut tried = None;
        for (place, [a, b]) in edges(own).enumerate() {
            let other = self.left.get(&[b, a]).copied();
            let Some(other) = other.filter(|o| *o != k && !is_joined[*o] && tried != Some(*o))
            else {
                continue;
            };
            tried = Some(other);
            let joined = self.joined(own, place, k, other);
            if joined.is_some() {
                return joined.map(|outline| (other, outline));
            }
        }
        None
    }

    /// Returns the outline of two polygons that share an edge; `None` unless both are in one plane
    /// and the outline is convex. `place` is the index of the shared edge in the first.
    fn joined(&self, own: &[u32], place: usize, k: usize, other: usize) -> Option<Vec<u32>> {
        let theirs = &self.loops[other];
        let (n, m) = (own.len(), theirs.len());
        let normal = self.normals[k];
        let flatness = self.flatness[k].max(self.flatness[other]);
        if normal.dot(self.normals[other]) <= 0.0 {
            return None;
        }
        // Find the chain of edges that both share, backwards and forwards from the shared edge.
        let there = theirs.iter().position(|v| *v == own[(place + 1) % n])?;
        let (mut before, mut after) = (0, 1);
        while before < n && own[(place + n - before) % n] == theirs[(there + 1 + before) % m] {
            before += 1;
        }
        while after < n && own[(place + after) % n] == theirs[(there + m + 1 - after) % m] {
            after += 1;
        }
        // Count the shared edges; `after` counts the first one twice.
        let shared = before + after - 2;
        if before == 0 || shared >= n.min(m) {
            return None;
        }
        let rest = |j: usize| own[(place + after - 1 + j) % n];
        let add = |j: usize| theirs[(there + before + j) % m];
        let point = |v: u32| self.points[v as usize];
        // Make the common outline. Only where the two meet may a corner turn the wrong way.
        let (last, end) = (n - shared, m - shared - 1);
        let outline: Vec<u32> = (0..=last).map(rest).chain((1..=end).map(add)).collect();
        let ends = [
            [outline.len() - 1, 0, 1],
            [last - 1, last, (last + 1) % outline.len()],
        ];
        let turns_right = |[a, b, c]: &[usize; 3]| {
            turn([a, b, c].map(|k| point(outline[*k])), normal, flatness) < 0.0
        };
        // The other polygon has to be in the plane of the first.
        let origin = point(own[0]);
        let is_off = |v: &u32| normal.dot(point(*v) - origin).abs() > flatness;
        if ends.iter().any(turns_right) || theirs.iter().any(is_off) {
            return None;
        }
        let corners: Vec<DVec3> = outline.iter().map(|&v| point(v)).collect();
        let corners = without_flat(&corners, normal, flatness);
        ConvexPolygon::new(&corners).is_ok().then_some(outline)
    }
}

/// Returns the directed edges of an outline, as pairs of corner indices.
fn edges(outline: &[u32]) -> impl Iterator<Item = [u32; 2]> {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(&a, &b)| [a, b])
}

/// Returns twice the signed area of the triangle at a corner, positive where the outline turns
/// left; zero where it is at most the rounding `room`.
fn turn([a, b, c]: [DVec3; 3], normal: DVec3, room: f64) -> f64 {
    let turn = normal.dot((b - a).cross(c - b));
    let length = (b - a).length() + (c - b).length();
    if turn.abs() <= room * length {
        0.0
    } else {
        turn
    }
}

/// Returns the corners without those in the middle of a side.
fn without_flat(corners: &[DVec3], normal: DVec3, room: f64) -> Vec<DVec3> {
    let n = corners.len();
    let turns = |k: &usize| {
        let beside = [k + n - 1, *k, k + 1].map(|j| corners[j % n]);
        turn(beside, normal, room) > 0.0
    };
    (0..n).filter(turns).map(|k| corners[k]).collect()
}

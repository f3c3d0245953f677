//! The space between a point and a light, for callers that search it themselves: renderers with a
//! hierarchy of their own, and everybody who wants the triangles there and not their shadows.

use crate::node::Child;
use crate::occluders::Occluders;
use crate::shaft::frame::LightCorners;
use linelit_geometry::{ConvexPolygon, DVec3, Triangle, Vector3, stop};

/// The space between a shading point and a light, which is the convex hull of both. A renderer with
/// a hierarchy of its own asks [`SpaceBetween::may_meet`] which of its boxes to open, and builds
/// [`Occluders`](crate::Occluders) of the triangles that it finds there.
///
/// ```
/// use linelit_visibility::geometry::Segment;
/// use linelit_visibility::{SpaceBetween, Occluders, Scratch, ShaftQuery, VisibleLines};
///
/// // A triangle halfway up hides the part of the light with x > 0; another is beyond the light.
/// let mine = [
///     [[0.0, -1.0, 1.0], [3.0, 0.0, 1.0], [0.0, 1.0, 1.0]],
///     [[0.0, -1.0, 3.0], [3.0, 0.0, 3.0], [0.0, 1.0, 3.0_f32]],
/// ];
/// let light = [[-0.5, -0.5, 2.0], [0.5, -0.5, 2.0], [0.5, 0.5, 2.0], [-0.5, 0.5, 2.0]];
/// let (point, light) = ([0.0; 3], light.map(Into::into));
///
/// let between = SpaceBetween::new(point, &light);
/// let found = mine.into_iter().filter(|[a, b, c]| {
///     let most = |pick: fn(f32, f32) -> f32| [0, 1, 2].map(|k| pick(a[k], pick(b[k], c[k])));
///     between.may_meet(most(f32::min), most(f32::max))
/// });
/// let occluders = Occluders::from_triangles(found);
/// assert_eq!(occluders.triangle_count(), 1);
///
/// let (mut scratch, mut visible) = (Scratch::new(), VisibleLines::new());
/// let mut shaft = occluders.shaft(ShaftQuery::new(point, &light), &mut scratch);
/// shaft.visible(&[Segment::from([[-0.5, 0.0, 2.0], [0.5, 0.0, 2.0]])], &mut visible);
/// assert!((visible.fraction(0) - 0.5).abs() < 1e-12);
/// ```
#[derive(Clone, Debug)]
pub struct SpaceBetween {
    /// The lowest corner of the bounding box of the space; `hi` is the highest.
    lo: DVec3,
    hi: DVec3,
    /// The planes that bound the space, each given by a normal n and a point o of the plane such
    /// that n·(p − o) ≥ 0 for points p of the space: the planes through the shading point and each
    /// edge of the light, and the light's own plane. The first `count` entries are in use.
    planes: [(DVec3, DVec3); PLANES],
    count: usize,
    /// The largest absolute coordinate of the bounding box.
    largest: f64,
}

/// The largest number of planes that bound a [`SpaceBetween`]: one for each edge of the light, and
/// the light's own. A linear light needs five: two that face each other, and one for each side of
/// the triangle that the light spans with the shading point.
const PLANES: usize = ConvexPolygon::CAPACITY + 1;

/// The relative rounding error of the height of a point over one of the planes of a
/// [`SpaceBetween`]. The height is computed with fewer than 64 products and sums of coordinate
/// differences, each rounded to ε/2. A triangle farther outside of a plane than this fraction of
/// the coordinates does not meet the space.
const ROOM: f64 = 32.0 * f64::EPSILON;

impl SpaceBetween {
    /// Creates the space between a point and the corners of a light.
    #[must_use]
    pub fn new<'a>(point: impl Vector3, light: impl Into<LightCorners<'a>>) -> Self {
        let (x, light) = (point.dvec3(), light.into().corners());
        let around = |pick: fn(DVec3, DVec3) -> DVec3| light.iter().fold(x, |a, b| pick(a, *b));
        let (lo, hi) = (around(DVec3::min), around(DVec3::max));
        let mut all = Self {
            lo,
            hi,
            planes: [(DVec3::ZERO, DVec3::ZERO); PLANES],
            count: 0,
            largest: lo.abs().max(hi.abs()).max_element(),
        };
        // A linear light: the triangle with the point, as a prism without thickness.
        if let [a, b] = *light {
            let normal = (a - x).cross(b - x);
            all.add(normal, x);
            all.add(-normal, x);
            for (from, to) in [(x, a), (a, b), (b, x)] {
                all.add(normal.cross(to - from), from);
            }
            return all;
        }
        let last = light[light.len() - 1];
        // For each edge, the plane through it and the point. Its inner side is where the corner of
        // the light farthest from it is, so that rounding cannot decide it.
        for (a, b) in std::iter::once(&last).chain(light).zip(light) {
            let normal = (*a - x).cross(*b - x);
            let side = |v: &DVec3| normal.dot(*v - x);
            let far = light
                .iter()
                .map(side)
                .fold(0.0_f64, |far, s| if s.abs() > far.abs() { s } else { far });
            all.add(normal * far.signum(), x);
        }
        // The light's own plane, with the point on its inner side.
        let first = light[0];
        let pairs = light[1..].windows(2);
        let normal: DVec3 = pairs
            .map(|p| (p[0] - first).cross(p[1] - first))
            .fold(DVec3::ZERO, |sum, part| sum + part);
        all.add(normal * normal.dot(x - first).signum(), first);
        all
    }

    fn add(&mut self, normal: DVec3, origin: DVec3) {
        self.planes[self.count] = (normal, origin);
        self.count += 1;
    }

    /// Whether a box, given by its lowest and highest corner, may hold something that hides a part
    /// of the light. There are no false negatives. There are a few false positives: boxes close to
    /// an edge of the space that none of the space's planes separates from it.
    ///
    /// Returns true if a coordinate is not a number.
    #[must_use]
    pub fn may_meet(&self, low: [f32; 3], high: [f32; 3]) -> bool {
        self.may_hold(low.dvec3(), high.dvec3())
    }

    /// Computes [`Self::may_meet`] for corners in `f64`.
    fn may_hold(&self, low: DVec3, high: DVec3) -> bool {
        let apart = high.cmplt(self.lo) | low.cmpgt(self.hi);
        if apart.any() {
            return false;
        }
        let largest = low.abs().max(high.abs()).max_element().max(self.largest);
        !self.planes[..self.count].iter().any(|(normal, origin)| {
            // Compare the corner farthest along the normal, which is inside if any point of the box
            // is.
            let corner = DVec3::select(normal.cmpge(DVec3::ZERO), high, low);
            let room = ROOM * largest * normal.abs().element_sum();
            normal.dot(corner - *origin) < -room
        })
    }

    /// Whether a triangle, given by its corners, meets the space. A triangle that only touches the
    /// space counts, up to rounding.
    #[must_use]
    pub fn meets(&self, triangle: [DVec3; 3]) -> bool {
        let mut part = triangle.to_vec();
        let largest = triangle.iter().fold(self.largest, |largest, corner| {
            largest.max(corner.abs().max_element())
        });
        for (normal, origin) in &self.planes[..self.count] {
            // Clip the triangle to the inner side of the plane.
            let room = ROOM * largest * normal.abs().element_sum();
            let height = |p: DVec3| normal.dot(p - *origin) + room;
            let next = part.iter().cycle().skip(1);
            let edges = part.iter().zip(next).flat_map(|(&p, &q)| {
                let (from, to) = (height(p), height(q));
                let crosses = (from < 0.0) != (to < 0.0);
                let crossing = crosses.then(|| p + (q - p) * (from / (from - to)));
                [(from >= 0.0).then_some(p), crossing]
            });
            part = edges.flatten().collect();
        }
        !part.is_empty()
    }
}

impl Occluders {
    /// Returns the triangles that meet the space between a point and a light, as ascending indices
    /// into the list that the occluders were built from. Triangles with holes are among them.
    ///
    /// All triangles there are returned, whether other triangles hide them or not;
    /// [`Shaft::candidate_triangles`](crate::Shaft::candidate_triangles) returns only the triangles
    /// that determine shadows. Triangles that were left out when the hierarchy was built are not
    /// returned.
    ///
    /// ```
    /// use linelit_visibility::Occluders;
    /// let low = [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [0.0, 1.0, 1.0]];
    /// let beside = low.map(|[x, y, z]| [x + 5.0, y, z]);
    /// let occluders = Occluders::from_triangles([beside, low]);
    /// let light = [[-1.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]].map(Into::into);
    /// assert_eq!(occluders.between([0.0; 3], &light), [1]);
    /// ```
    #[must_use]
    pub fn between<'a>(&self, point: impl Vector3, light: impl Into<LightCorners<'a>>) -> Vec<u32> {
        let space = SpaceBetween::new(point, light);
        let mut found = Vec::new();
        let may_hold = |low, high| space.may_hold(low, high);
        self.any_triangle(may_hold, |number, triangle| {
            if space.meets(triangle.vertices) {
                found.push(number);
            }
            false
        });
        // A triangle is in several leaves if it was split.
        found.sort_unstable();
        found.dedup();
        found
    }
}

impl Occluders {
    /// Calls `is_wanted` for the triangles in one part of space until it returns true for one of
    /// them, and returns whether it did.
    ///
    /// `may_hold` receives the lowest and the highest corner of a box, and says whether triangles
    /// in that box are wanted. `is_wanted` receives the index and the corners of each triangle in
    /// such a box; some triangles are passed more than once.
    pub fn any_triangle(
        &self,
        may_hold: impl Fn(DVec3, DVec3) -> bool,
        mut is_wanted: impl FnMut(u32, Triangle) -> bool,
    ) -> bool {
        let holes = self.holes.as_ref().map(|holes| &holes.bvh);
        std::iter::once(&self.bvh).chain(holes).any(|bvh| {
            let hierarchy = &*bvh.hierarchy;
            let world = |v: [f32; 3]| v.dvec3() + bvh.origin;
            let mut waiting = vec![Child::node(0)];
            while let Some(child) = waiting.pop() {
                stop::check();
                // Ask for the triangles of a leaf, or visit the boxes of a node that may hold some.
                if child.is_leaf() {
                    let leaf = &hierarchy.leaves[child.leaf_index()];
                    let mut lanes = (0..8).filter(|lane| child.mask() >> lane & 1 != 0);
                    let wanted = |lane: usize| {
                        let [a, b, c] = leaf.triangle(lane).map(world);
                        is_wanted(leaf.id[lane], Triangle::new(a, b, c))
                    };
                    if lanes.any(wanted) {
                        return true;
                    }
                } else if let Some(node) = hierarchy.nodes.get(child.index()) {
                    let lanes = node.lanes().filter(|&lane| {
                        let bounds = node.bounds_of(lane);
                        may_hold(world(bounds.lo), world(bounds.hi))
                    });
                    waiting.extend(lanes.map(|lane| Child(node.child[lane])));
                }
            }
            false
        })
    }
}

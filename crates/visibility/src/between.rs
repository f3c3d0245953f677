//! The space between a point and a light, for hierarchies of others.

use crate::shaft::frame::LightCorners;
use linelit_geometry::{ConvexPolygon, DVec3, Vector3};

/// The space between a shading point and a light, their convex hull: what a
/// renderer asks its own hierarchy for, to build [`Occluders`](crate::Occluders) of the triangles
/// that it finds there.
///
/// ```
/// use linelit_visibility::geometry::Segment;
/// use linelit_visibility::{Between, Occluders, Scratch, ShaftQuery, VisibleLines};
///
/// // A triangle halfway up hides the part of the light with x > 0; another is beyond the light.
/// let mine = [
///     [[0.0, -1.0, 1.0], [3.0, 0.0, 1.0], [0.0, 1.0, 1.0]],
///     [[0.0, -1.0, 3.0], [3.0, 0.0, 3.0], [0.0, 1.0, 3.0_f32]],
/// ];
/// let light = [[-0.5, -0.5, 2.0], [0.5, -0.5, 2.0], [0.5, 0.5, 2.0], [-0.5, 0.5, 2.0]];
/// let (point, light) = ([0.0; 3], light.map(Into::into));
///
/// let between = Between::new(point, &light);
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
pub struct Between {
    /// The box around it.
    lo: DVec3,
    hi: DVec3,
    /// Planes that it lies on one side of, n·(p − o) ≥ 0: through the shading point and an edge of
    /// the light, and the light's own.
    planes: [(DVec3, DVec3); PLANES],
    count: usize,
    /// The largest coordinate.
    largest: f64,
}

/// One for each edge, and the light's; of a line two, which face each other.
const PLANES: usize = ConvexPolygon::CAPACITY + 1;

/// The relative rounding error of a side: the coordinates that it is found from are products and
/// sums of differences, each rounded to ε/2, of which there are fewer than 64.
const ROOM: f64 = 32.0 * f64::EPSILON;

impl Between {
    /// Creates the region between a point and the corners of a light.
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
        if let [a, b] = *light {
            let normal = (a - x).cross(b - x);
            all.add(normal, x);
            all.add(-normal, x);
            return all;
        }
        let last = light[light.len() - 1];
        // A corner in whose direction the light lies, from the edge: the farthest, so that its side
        // is not rounding.
        for (a, b) in std::iter::once(&last).chain(light).zip(light) {
            let normal = (*a - x).cross(*b - x);
            let side = |v: &DVec3| normal.dot(*v - x);
            let far = light
                .iter()
                .map(side)
                .fold(0.0_f64, |far, s| if s.abs() > far.abs() { s } else { far });
            all.add(normal * far.signum(), x);
        }
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

    /// Whether a box may hold something that hides a part of the light: no false negatives, few
    /// false positives (boxes beside an edge of the space that none of its faces separates).
    ///
    /// True of what is no number.
    #[must_use]
    pub fn may_meet(&self, low: [f32; 3], high: [f32; 3]) -> bool {
        let (low, high) = (low.dvec3(), high.dvec3());
        let apart = high.cmplt(self.lo) | low.cmpgt(self.hi);
        if apart.any() {
            return false;
        }
        let largest = low.abs().max(high.abs()).max_element().max(self.largest);
        !self.planes[..self.count].iter().any(|(normal, origin)| {
            // The corner farthest along the normal.
            let corner = DVec3::select(normal.cmpge(DVec3::ZERO), high, low);
            let room = ROOM * largest * normal.abs().element_sum();
            normal.dot(corner - *origin) < -room
        })
    }
}

//! The projective frame of a light as seen from a shading point: how it is set up for lines,
//! triangles, parallelograms and other polygons, and how points are projected by it.

use crate::shaft::sides::Sides;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Margins, double};

/// The most corners of a light.
const CORNERS: usize = ConvexPolygon::CAPACITY;

/// The frame of a light for a shading point: the homogeneous coordinates (P, Q, W) of points
/// relative to the shading point, as three linear functions of the point.
///
/// W is zero in the plane through the shading point parallel to the light, and one in the light's
/// plane. (P/W, Q/W) is where the ray from the shading point through a point meets the light's
/// plane, in affine coordinates of the light:
/// - a parallelogram is the unit square, a triangle the unit triangle;
/// - another polygon has the unit square as its bounding rectangle;
/// - a linear light runs from (0, 0) to (0, 1), and P is the side of the shadow triangle's plane.
///
/// ```text
///            light   q
///       W = 1  ┌─────┐
///               ╲   ╱
///       W = ½    ╲ ╱    a point halfway up has P/W, Q/W where its ray meets the light
///       W = 0     ●
/// ```
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightFrame {
    pub(crate) p: DVec3,
    pub(crate) q: DVec3,
    pub(crate) w: DVec3,
    pub(crate) shape: Shape,
    /// The light's corners in (p, q), two for a linear light; the last corner fills the entries
    /// that are not in use.
    pub(crate) corners: [[f64; 2]; CORNERS],
    pub(crate) corner_count: usize,
    /// How close to the shading point and to the light a triangle hides nothing, as fractions of
    /// the way between the two.
    pub(crate) margins: Margins,
    /// The least W at which triangles hide the light ([`Margins::near`]), and its reciprocal.
    pub(crate) near: f64,
    pub(crate) inverse_near: f64,
    /// The light's plane in higher precision, if the light is seen edge on, or if its margin is
    /// zero; `None` for other lights.
    pub(crate) sides: Option<Sides>,
}

/// The least height of the shading point above a light's plane, in units of its distance and the
/// light's size, at which sums of three products are precise enough for (P, Q, W). Projected points
/// have the rounding errors of the corners divided by this height: 3e-15 of the light at most in
/// 1e5 random views, which is 3e-10 here, below the 1e-9 that interval ends are held to. Closer to
/// the plane, [`Sides`] is used.
const EDGE_ON: f64 = 1e-5;

/// Twice the rounding error of W for points in a light's plane, times the height in the units of
/// [`EDGE_ON`]: the margin before the light has to exceed it.
const ROUNDING: f64 = 1e-14;

/// The least W of points before the shading point if there is no margin there; its reciprocal is
/// finite.
const LEAST: f64 = 1e-300;

/// The least distance from the light's plane, relative to all sizes, at which [`Sides`] is usable.
const TOO_EDGE_ON: f64 = 1e-12;

/// The shape of the light in the (p, q) plane; polygons other than triangles are bounded by the
/// square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// 0 ≤ p ≤ 1, 0 ≤ q ≤ 1.
    Square,
    /// p ≥ 0, q ≥ 0, p + q ≤ 1.
    Triangle,
    /// p = 0, 0 ≤ q ≤ 1.
    Line,
}

impl Shape {
    /// Returns the coefficients (k, j) of the upper bound on p, which is `k W − P − j Q ≥ 0`.
    pub(crate) fn upper(self) -> (f64, f64) {
        match self {
            Self::Square => (1.0, 0.0),
            Self::Triangle => (1.0, 1.0),
            Self::Line => (0.0, 0.0),
        }
    }
}

impl LightFrame {
    /// Sets the frame of a light seen from a point, except for [`LightFrame::near`]. Returns false
    /// if there is no usable frame: the light is seen edge on, or has no area or length. `origin`
    /// is the origin of the hierarchy.
    #[inline(always)]
    pub(crate) fn set(&mut self, light: &Light, point: DVec3, origin: DVec3) -> bool {
        self.sides = None;
        match &light.kind {
            Kind::None => false,
            Kind::Line => self.set_line(light.corners[0] - point, light.corners[1] - point),
            Kind::Polygon(plane) => {
                self.margins.light > 0.0 && self.set_polygon(plane, point)
                    || self.set_exactly(light, plane, point, origin)
            }
        }
    }

    /// Sets [`LightFrame::near`], given that no occluder is farther than `reach` from the shading
    /// point.
    #[inline(always)]
    pub(crate) fn set_near(&mut self, reach: f64) {
        // For lights well within reach, as most are, the margin is this, without a square root.
        (self.near, self.inverse_near) = if reach * reach * self.w.length_squared() > 2.0 {
            (self.margins.point, 1.0 / self.margins.point)
        } else {
            let near = self.margins.near(reach, 1.0 / self.w.length());
            (near, 1.0 / near)
        };
        if self.margins.point == 0.0 {
            // Without a margin, points before the shading point have a positive W.
            (self.near, self.inverse_near) = (LEAST, 1.0 / LEAST);
        }
    }

    /// Returns the light's corners in groups of four; the last corner fills the last group.
    #[inline(always)]
    pub(crate) fn corners_by_four(&self) -> &[[[f64; 2]; 4]] {
        let fours = self.corners.as_chunks().0;
        &fours[..self.corner_count.div_ceil(4)]
    }

    /// Sets the frame of a linear light between two points relative to the shading point; false if
    /// the shading point is on its line.
    fn set_line(&mut self, p0: DVec3, p1: DVec3) -> bool {
        let e = p1 - p0;
        let square = e.length_squared();
        // Compute the normal of the plane through both ends and the shading point, then the point
        // of the line that is closest to the shading point.
        let m = linelit_geometry::predicates::cross(p0, p1);
        let n = e.cross(m) / square;
        let n = n * n.dot(p0).signum();
        self.w = n / n.dot(p0);
        self.q = e / square - self.w * (e.dot(p0) / square);
        self.p = m / (m.length() * square.sqrt());
        m != DVec3::ZERO
    }

    /// Sets the frame of a polygonal light; false if the light is seen so nearly edge on, or its
    /// margin is so small, that sums of products are not precise enough.
    #[inline(always)]
    fn set_polygon(&mut self, plane: &LightPlane, point: DVec3) -> bool {
        let v0 = plane.origin - point;
        let height = plane.normal.dot(v0);
        let reach = v0.abs().max_element().max(plane.size);
        self.w = plane.normal * (1.0 / height);
        self.p = plane.d1 - self.w * plane.d1.dot(v0);
        self.q = plane.d2 - self.w * plane.d2.dot(v0);
        let (height, size) = (height.abs(), plane.length * reach);
        height > EDGE_ON * size && height * self.margins.light > ROUNDING * size
    }

    /// Does the same as [`LightFrame::set_polygon`], with the light's plane in twice the precision.
    #[cold]
    fn set_exactly(
        &mut self,
        light: &Light,
        plane: &LightPlane,
        point: DVec3,
        origin: DVec3,
    ) -> bool {
        // Choose a third corner that spans the largest triangle with the first two, so that the
        // three are not on one line.
        let corner = light.corners[0];
        let edge = light.corners[1] - corner;
        let area = |c: &DVec3| edge.cross(*c).length_squared();
        let others = light.corners[2..light.count].iter().map(|c| *c - corner);
        let other = others.max_by(|a, b| area(a).total_cmp(&area(b)));
        // Compute the shading point's height over that plane, in twice the precision.
        let mut normal = double::cross_of(edge, other.unwrap_or_default());
        if double::rounded(normal).dot(plane.normal) < 0.0 {
            normal = normal.map(|x| -x);
        }
        let v0 = plane.origin - point;
        let volume = double::dot(normal, double::difference(point, corner)).hi();
        let height = -volume * (plane.length / double::rounded(normal).length());
        let reach = v0.abs().max_element().max(plane.size);
        // Set up the frame with this height.
        let (d, c) = ([plane.d1, plane.d2], [plane.d1.dot(v0), plane.d2.dot(v0)]);
        self.w = plane.normal * (1.0 / height);
        [self.p, self.q] = [0, 1].map(|k| d[k] - self.w * c[k]);
        let [e1, e2] = plane.edges;
        self.sides = Some(Sides {
            corner: corner - origin,
            normal,
            volume,
            d,
            c,
            w: self.w,
            axes: [v0, e1, e2],
        });
        height.abs() > TOO_EDGE_ON * plane.length * reach
    }

    /// Projects a point, given relative to the shading point, along the ray from the shading point
    /// to the light's plane, and returns its (p, q). For a point in that plane W is one up to
    /// rounding, and there is no division.
    #[inline]
    pub(crate) fn project(&self, a: DVec3) -> [f64; 2] {
        if let Some(sides) = &self.sides {
            return sides.project(a);
        }
        let (p, q, w) = (self.p.dot(a), self.q.dot(a), self.w.dot(a));
        if (w - 1.0).abs() <= 1e-12 {
            [p, q]
        } else {
            [p / w, q / w]
        }
    }

    /// Returns the coordinates (P, Q, W) of a vertex at `place` as seen from `point`, both in the
    /// hierarchy's coordinates.
    pub(crate) fn vertex(&self, place: DVec3, point: DVec3) -> [f64; 3] {
        let from = place - point;
        if let Some(sides) = &self.sides {
            return sides.vertex_of(place, from);
        }
        [self.p, self.q, self.w].map(|n| from.x * n.x + from.y * n.y + from.z * n.z)
    }

    /// Returns the corners, relative to the shading point, of a rectangle on the light. `low` and
    /// `high` are the rectangle's least and greatest coordinates across and along the unit
    /// direction `along`.
    pub(crate) fn corners_in_space(
        &self,
        along: [f64; 2],
        low: [f64; 2],
        high: [f64; 2],
    ) -> [DVec3; 4] {
        // The matrix that maps (P, Q, W) = (p, q, 1) to the point.
        let inverse = DMat3::from_cols(self.p, self.q, self.w)
            .transpose()
            .inverse();
        [
            (low[0], low[1]),
            (high[0], low[1]),
            (low[0], high[1]),
            (high[0], high[1]),
        ]
        .map(|(u, v)| {
            let p = along[0] * v - along[1] * u;
            let q = along[1] * v + along[0] * u;
            inverse * DVec3::new(p, q, 1.0)
        })
    }

    /// Returns the frame of a few parallel lines on the light. In that frame q runs along the
    /// lines, and the lines lie within the unit square with a small margin; a single line has p =
    /// 0.
    ///
    /// `low` and `high` bound the lines' coordinates across and along the unit direction `along`.
    pub(crate) fn around_lines(&self, along: [f64; 2], low: [f64; 2], high: [f64; 2]) -> Self {
        let length = high[1] - low[1];
        let width = high[0] - low[0];
        let single = width <= 1e-12;
        // Compute the origin and the size of the lines' rectangle, enlarged by the margin.
        let (from, size) = if single {
            (0.5 * (low[0] + high[0]), 1.0)
        } else {
            let room = 1e-6 * width;
            (low[0] - room, width + 2.0 * room)
        };
        let start = [from, low[1] - 1e-6 * length];
        let size = [size, length * (1.0 + 2e-6)];
        // Transform P and Q, which are linear in the old ones and W, and likewise the forms of
        // `sides`.
        let across = |p: DVec3, q: DVec3| q * along[0] - p * along[1];
        let forward = |p: DVec3, q: DVec3| p * along[0] + q * along[1];
        let p = (across(self.p, self.q) - self.w * start[0]) / size[0];
        let q = (forward(self.p, self.q) - self.w * start[1]) / size[1];
        let sides = self.sides.map(|sides| {
            let ([d1, d2], [c1, c2]) = (sides.d, sides.c);
            let c = [c2 * along[0] - c1 * along[1], c1 * along[0] + c2 * along[1]];
            Sides {
                d: [across(d1, d2) / size[0], forward(d1, d2) / size[1]],
                c: [0, 1].map(|k| (c[k] + start[k]) / size[k]),
                ..sides
            }
        });
        // Set the corners of the new square, or of the line.
        let mut corners = [[0.0, 1.0]; CORNERS];
        corners[0] = [0.0, 0.0];
        if !single {
            corners[2] = [1.0, 1.0];
            corners[3] = [1.0, 0.0];
        }
        Self {
            p,
            q,
            w: self.w,
            shape: if single { Shape::Line } else { Shape::Square },
            corners,
            corner_count: if single { 2 } else { 4 },
            margins: self.margins,
            near: self.near,
            inverse_near: self.inverse_near,
            sides,
        }
    }
}

/// The corners of a light in a `ShaftQuery`: the two ends of a line, or 3 to
/// [`ConvexPolygon::CAPACITY`] corners of a polygon. The type ensures that no light has too many
/// corners for a query.
///
/// ```
/// use linelit_visibility::geometry::{ConvexPolygon, DVec3};
/// use linelit_visibility::LightCorners;
/// let square = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y).unwrap();
/// assert_eq!(LightCorners::from(&square).corners().len(), 4);
/// assert_eq!(LightCorners::from(&[DVec3::X, DVec3::Y]).corners().len(), 2);
/// assert!(LightCorners::new(&[DVec3::X; ConvexPolygon::CAPACITY]).is_some());
/// assert!(LightCorners::new(&[DVec3::X; ConvexPolygon::CAPACITY + 1]).is_none());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightCorners<'a>(&'a [DVec3]);

impl<'a> LightCorners<'a> {
    /// Takes the corners of a convex polygon, in either orientation, or the two ends of a linear
    /// light; `None` for fewer than two or more than [`ConvexPolygon::CAPACITY`] corners.
    #[must_use]
    pub fn new(corners: &'a [DVec3]) -> Option<Self> {
        (2..=CORNERS)
            .contains(&corners.len())
            .then_some(Self(corners))
    }

    /// The corners.
    #[must_use]
    pub const fn corners(self) -> &'a [DVec3] {
        self.0
    }
}

impl<'a> From<&'a ConvexPolygon> for LightCorners<'a> {
    fn from(polygon: &'a ConvexPolygon) -> Self {
        Self(polygon.vertices())
    }
}

impl<'a, const N: usize> From<&'a [DVec3; N]> for LightCorners<'a> {
    /// Takes an array of corners. It does not compile for lengths that [`LightCorners::new`]
    /// refuses.
    fn from(corners: &'a [DVec3; N]) -> Self {
        const {
            assert!(
                2 <= N && N <= CORNERS,
                "2 to ConvexPolygon::CAPACITY corners"
            )
        };
        Self(corners)
    }
}

/// The properties of a light that do not depend on the shading point; they are cached from one
/// query to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light {
    /// The corners in world space.
    corners: [DVec3; CORNERS],
    count: usize,
    kind: Kind,
    /// The lowest corner of the light's bounding box; `hi` is the highest.
    pub(crate) lo: DVec3,
    pub(crate) hi: DVec3,
}

/// The kind of a light, with its affine coordinates if it is a polygon.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// No light has been set.
    None,
    Line,
    Polygon(LightPlane),
}

/// The affine coordinates (p, q) of a polygon: `p = d1·(y − origin)`, `q = d2·(y − origin)` for a
/// point y.
#[derive(Clone, Copy, Debug)]
struct LightPlane {
    origin: DVec3,
    normal: DVec3,
    d1: DVec3,
    d2: DVec3,
    /// The vectors of one unit of p and of q.
    edges: [DVec3; 2],
    /// The length of the normal, and the size of the light.
    length: f64,
    size: f64,
}

impl Light {
    /// Whether the light has exactly these corners.
    #[inline(always)]
    pub(crate) fn is(&self, light: LightCorners<'_>) -> bool {
        self.corners[..self.count] == *light.0
    }

    /// Sets the light's corners, and in the frame everything that does not depend on the shading
    /// point.
    pub(crate) fn set(&mut self, LightCorners(light): LightCorners<'_>, frame: &mut LightFrame) {
        *self = Self::default();
        self.count = light.len();
        self.corners[..light.len()].copy_from_slice(light);
        self.lo = light[0];
        self.hi = light[0];
        for v in light {
            self.lo = self.lo.min(*v);
            self.hi = self.hi.max(*v);
        }
        frame.corner_count = light.len();
        if light.len() == 2 {
            frame.shape = Shape::Line;
            frame.corners = [[0.0, 1.0]; CORNERS];
            frame.corners[0] = [0.0, 0.0];
            self.kind = Kind::Line;
        } else {
            self.kind = polygon(light, frame);
        }
    }
}

/// Chooses affine coordinates for a polygon, and sets its corners in the frame.
fn polygon(light: &[DVec3], frame: &mut LightFrame) -> Kind {
    let count = light.len();
    let v0 = light[0];
    // Newell's method: the normal as a sum of cross products, here relative to a corner.
    let mut normal = DVec3::ZERO;
    for i in 1..count - 1 {
        normal += (light[i] - v0).cross(light[i + 1] - v0);
    }
    // Choose the origin and the two sides of the coordinates: of the triangle, of the
    // parallelogram, or of a bounding rectangle.
    let (mut size, mut reach) = (0.0_f64, 0.0_f64);
    for v in light {
        size = size.max((*v - v0).abs().max_element());
        reach = reach.max(v.abs().max_element());
    }
    let is_parallelogram = count == 4 && {
        let gap = (light[0] + light[2]) - (light[1] + light[3]);
        gap.abs().max_element() <= 1e-12 * (reach + size)
    };
    let (origin, e1, e2, shape) = match count {
        3 => (v0, light[1] - v0, light[2] - v0, Shape::Triangle),
        4 if is_parallelogram => (v0, light[1] - v0, light[3] - v0, Shape::Square),
        _ => {
            let (o, e1, e2) = bounding_rectangle(light, normal);
            (o, e1, e2, Shape::Square)
        }
    };
    // Compute the dual vectors in the plane: d1·e1 = 1, d1·e2 = 0, and the other way round.
    let n2 = normal / normal.length_squared();
    let ratio = normal.length_squared() / e1.cross(e2).dot(normal);
    let d1 = e2.cross(n2) * ratio;
    let d2 = n2.cross(e1) * ratio;
    for (i, c) in frame.corners.iter_mut().enumerate() {
        let from = light[i.min(count - 1)] - origin;
        *c = [d1.dot(from), d2.dot(from)];
    }
    frame.shape = shape;
    Kind::Polygon(LightPlane {
        origin,
        normal,
        d1,
        d2,
        edges: [e1, e2],
        length: normal.length(),
        size,
    })
}

/// The origin and the two sides of the polygon's bounding rectangle along its longest edge.
fn bounding_rectangle(light: &[DVec3], normal: DVec3) -> (DVec3, DVec3, DVec3) {
    // Find the longest edge.
    let mut x = DVec3::ZERO;
    for i in 0..light.len() {
        let e = light[(i + 1) % light.len()] - light[i];
        if e.length_squared() > x.length_squared() {
            x = e;
        }
    }
    // Bound the corners along the edge and across.
    let x = x.normalize_or_zero();
    let y = normal.cross(x).normalize_or_zero();
    let mut lo = [f64::INFINITY; 2];
    let mut hi = [f64::NEG_INFINITY; 2];
    for v in light {
        let a = *v - light[0];
        for (k, c) in [a.dot(x), a.dot(y)].into_iter().enumerate() {
            lo[k] = lo[k].min(c);
            hi[k] = hi[k].max(c);
        }
    }
    let origin = light[0] + x * lo[0] + y * lo[1];
    (origin, x * (hi[0] - lo[0]), y * (hi[1] - lo[1]))
}

impl Default for LightFrame {
    /// Returns the frame of no light.
    fn default() -> Self {
        Self {
            p: DVec3::ZERO,
            q: DVec3::ZERO,
            w: DVec3::ZERO,
            shape: Shape::Square,
            corners: [[0.0; 2]; CORNERS],
            corner_count: 0,
            margins: Margins::NONE,
            near: 0.0,
            inverse_near: f64::INFINITY,
            sides: None,
        }
    }
}

impl Default for Light {
    /// Returns no light.
    fn default() -> Self {
        Self {
            corners: [DVec3::ZERO; CORNERS],
            count: 0,
            kind: Kind::None,
            lo: DVec3::ZERO,
            hi: DVec3::ZERO,
        }
    }
}

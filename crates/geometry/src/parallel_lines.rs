//! [`ParallelLines`]: the line samples of a polygon in one direction, by Billen & Dutré's
//! parametrisation (section 4, Fig. 1).

use crate::{ConvexPolygon, DVec2, DVec3, PlaneFrame, Segment};

/// The largest number of knots, which are the offsets of the vertices: at most one for each vertex.
const CAPACITY: usize = ConvexPolygon::CAPACITY;

/// All segments in which lines of one direction cut a convex polygon, parametrised by their offset.
///
/// ```text
///     u ▲
///       │ ·····┌────┐········  knots: the offsets of the vertices
///       │     ╱──────╲         a line: the segment between its lower and its upper end
///       │ ···<········>·······
///       │     ╲      ╱
///       │ ·····└────┘········
///       └────────────────────► v
/// ```
///
/// Lines run along [`ParallelLines::direction`]. The offset u is measured along
/// [`ParallelLines::across`], in scene units, and covers [`ParallelLines::range`]. Between two
/// neighbouring knots (the offsets of the vertices) the polygon is a trapezoid: both ends of the
/// segment are linear in u, and so is its length l(u). ∫ l(u) du over the range is the polygon's
/// area.
///
/// **Source**: Billen & Dutré 2016, section 4, eqs. 3–5, here for any convex planar light.
#[derive(Clone, Copy, Debug)]
pub struct ParallelLines {
    frame: PlaneFrame,
    knots: [f64; CAPACITY],
    lower: [f64; CAPACITY],
    upper: [f64; CAPACITY],
    count: usize,
}

impl ParallelLines {
    /// Creates the lines at `angle_rad` radians from the polygon's first edge, counter-clockwise
    /// about the normal. If the angle is not finite there are no lines: one knot, and a range of
    /// width zero.
    #[must_use]
    pub fn new(polygon: &ConvexPolygon, angle_rad: f64) -> Self {
        Self::in_frame(polygon, &polygon.plane_frame(), angle_rad)
    }

    /// Creates the lines at `angle_rad` radians from the x axis of a frame of the polygon's plane,
    /// counter-clockwise about the normal; see [`ParallelLines::new`].
    #[must_use]
    pub fn in_frame(polygon: &ConvexPolygon, frame: &PlaneFrame, angle_rad: f64) -> Self {
        // Turn the frame such that its x axis runs along the lines: v = x and u = y.
        let frame = frame.turned(angle_rad);
        if !angle_rad.is_finite() {
            return Self {
                count: 1,
                ..Self::none(&frame)
            };
        }
        let vertices = polygon.vertices();
        let n = vertices.len();
        let mut plane = [DVec2::ZERO; CAPACITY];
        for (q, &p) in plane.iter_mut().zip(vertices) {
            *q = frame.to_plane(p);
        }
        let plane = &plane[..n];
        let mut offsets = [0.0; CAPACITY];
        for (o, q) in offsets.iter_mut().zip(plane) {
            *o = q.y;
        }
        Self::through_corners(&frame, plane, &mut offsets[..n], false)
    }

    const fn none(frame: &PlaneFrame) -> Self {
        Self {
            frame: *frame,
            knots: [0.0; CAPACITY],
            lower: [0.0; CAPACITY],
            upper: [0.0; CAPACITY],
            count: 0,
        }
    }

    /// Creates the lines of a polygon with corners (v, u), counter-clockwise, with knots at the
    /// given offsets, which are sorted in place. If `close` is true, the ends of a line are
    /// computed from the nearer corner of an edge, so that ends near the origin keep a small
    /// relative error.
    #[inline(always)]
    pub(crate) fn through_corners(
        frame: &PlaneFrame,
        plane: &[DVec2],
        offsets: &mut [f64],
        close: bool,
    ) -> Self {
        let mut out = Self::none(frame);
        offsets.sort_unstable_by(f64::total_cmp);
        for &u in offsets.iter() {
            out.push_knot(plane, u, close);
        }
        out
    }

    /// Adds a knot at the offset `u`, and computes both ends of the line at that offset.
    #[allow(
        clippy::float_cmp,
        reason = "equal offsets of a sorted list are the same knot"
    )]
    #[inline(always)]
    fn push_knot(&mut self, plane: &[DVec2], u: f64, close: bool) {
        if self.count > 0 && self.knots[self.count - 1] == u {
            return;
        }
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for (i, a) in plane.iter().enumerate() {
            let b = plane[(i + 1) % plane.len()];
            let mut reach = |v: f64| {
                lo = if v < lo { v } else { lo };
                hi = if v > hi { v } else { hi };
            };
            if a.y == u {
                reach(a.x);
            } else if (a.y < u && b.y > u) || (a.y > u && b.y < u) {
                let swap = close && (b.y - u).abs() < (a.y - u).abs();
                let (a, b) = if swap { (&b, a) } else { (a, &b) };
                reach(a.x + (b.x - a.x) * ((u - a.y) / (b.y - a.y)));
            }
        }
        let k = self.count;
        (self.knots[k], self.lower[k], self.upper[k]) = (u, lo, hi);
        self.count += 1;
    }

    /// The unit direction of the lines (the paper's L_d).
    #[inline]
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        self.frame.axes.x
    }

    /// The unit direction in which offsets are measured (the paper's L_⊥).
    #[inline]
    #[must_use]
    pub fn across(&self) -> DVec3 {
        self.frame.axes.y
    }

    /// The frame in which a point of the light has the coordinates (v, u): the position v along the
    /// line, and the offset u.
    #[inline]
    #[must_use]
    pub const fn frame(&self) -> &PlaneFrame {
        &self.frame
    }

    /// The range [a, b] of offsets.
    #[inline]
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        (self.knots[0], self.knots[self.count - 1])
    }

    /// The offsets of the vertices in ascending order, each of them once.
    #[inline]
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots[..self.count]
    }

    /// The coordinate v at which the line at each knot begins, in the order of
    /// [`ParallelLines::knots`].
    #[inline]
    #[must_use]
    pub fn lower(&self) -> &[f64] {
        &self.lower[..self.count]
    }

    /// The coordinate v at which the line at each knot ends, in the order of
    /// [`ParallelLines::knots`].
    #[inline]
    #[must_use]
    pub fn upper(&self) -> &[f64] {
        &self.upper[..self.count]
    }

    /// Returns the coordinates v of the beginning and the end of the line at offset `u`; `None` if
    /// `u` is outside of the range.
    #[must_use]
    pub fn extent(&self, u: f64) -> Option<(f64, f64)> {
        let (a, b) = self.range();
        if !(a..=b).contains(&u) {
            return None;
        }
        if self.count == 1 {
            return Some((self.lower[0], self.upper[0]));
        }
        let k = (1..self.count - 1)
            .find(|&k| u < self.knots[k])
            .unwrap_or(self.count - 1);
        let w = (u - self.knots[k - 1]) / (self.knots[k] - self.knots[k - 1]);
        let lerp = |c: &[f64; CAPACITY]| c[k - 1] * (1.0 - w) + c[k] * w;
        let (lo, hi) = (lerp(&self.lower), lerp(&self.upper));
        Some((lo, if hi > lo { hi } else { lo }))
    }

    /// Returns the segment at offset `u`, along [`ParallelLines::direction`]; `None` if `u` is
    /// outside of the range.
    #[must_use]
    pub fn segment(&self, u: f64) -> Option<Segment> {
        Some(self.segment_between(u, self.extent(u)?))
    }

    /// The segment at offset `u` between two ends, which are coordinates v as
    /// [`ParallelLines::extent`] returns them.
    #[inline]
    #[must_use]
    pub fn segment_between(&self, u: f64, ends: (f64, f64)) -> Segment {
        let at = |v: f64| self.frame.from_plane(DVec2::new(v, u));
        Segment::new(at(ends.0), at(ends.1))
    }

    /// The length l(u) of the segment at offset `u`; zero outside of the range.
    #[must_use]
    pub fn length(&self, u: f64) -> f64 {
        self.extent(u).map_or(0.0, |(lo, hi)| hi - lo)
    }

    /// Returns the coordinates (offset u, position v along the line) of a point of the light's
    /// plane.
    #[must_use]
    pub fn coordinates(&self, p: DVec3) -> (f64, f64) {
        let q = self.frame.to_plane(p);
        (q.y, q.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A convex polygon from sorted angles on an ellipse in a random plane.
    fn polygons() -> impl Strategy<Value = ConvexPolygon> {
        (
            prop::collection::vec(0.0..std::f64::consts::TAU, 3..12),
            0.05..3.0f64,
            prop::array::uniform3(-1.0..1.0f64),
        )
            .prop_filter_map("degenerate", |(mut angles, squash, n)| {
                angles.sort_by(f64::total_cmp);
                let n = DVec3::from_array(n).try_normalize()?;
                let f = crate::Frame::from_normal(n);
                let points: Vec<_> = angles
                    .iter()
                    .map(|a| f.to_world(DVec3::new(a.cos(), squash * a.sin(), 0.7)))
                    .collect();
                ConvexPolygon::new(&points).ok().filter(|p| p.area() > 1e-3)
            })
    }

    proptest! {
        #[test]
        fn lengths_integrate_to_the_area(p in polygons(), angle in -7.0..7.0f64) {
            let lines = ParallelLines::new(&p, angle);
            // Trapezoids are integrated exactly by their ends.
            let k = lines.knots();
            let area: f64 = (1..k.len())
                .map(|i| {
                    let mean = 0.5 * (lines.length(k[i - 1]) + lines.length(k[i]));
                    (k[i] - k[i - 1]) * mean
                })
                .sum();
            // Coordinates are accurate to a few eps of the size (diameter <= 12 here); each of the
            // at most 11 trapezoids inherits that times its width.
            let tol = 16.0 * f64::EPSILON * p.diameter() * p.diameter() * 11.0;
            prop_assert!((area - p.area()).abs() < tol, "{area} {}", p.area());
        }

        #[test]
        fn segments_end_on_the_boundary(p in polygons(), angle in -7.0..7.0f64, w in 0.0..1.0f64) {
            let lines = ParallelLines::new(&p, angle);
            let (a, b) = lines.range();
            let s = lines.segment(a + w * (b - a)).unwrap();
            for end in [s.p0, s.p1] {
                let n = p.vertices().len();
                let inside = (0..n)
                    .map(|i| {
                        let (q, r) = (p.vertices()[i], p.vertices()[(i + 1) % n]);
                        let edge = (r - q).normalize_or_zero();
                        p.normal().cross(edge).dot(end - q)
                    })
                    .fold(f64::INFINITY, f64::min);
                // Slope amplifies: an edge nearly parallel to the lines moves its end by
                // eps / sin(angle), but the distance from the edge stays a few eps of the size.
                prop_assert!(inside.abs() < 64.0 * f64::EPSILON * p.diameter(), "{inside}");
            }
            prop_assert!(s.vector().dot(lines.direction()) >= 0.0);
        }
    }

    #[test]
    fn aligned_square_has_constant_length() {
        let p = ConvexPolygon::parallelogram(DVec3::ZERO, 2.0 * DVec3::X, 3.0 * DVec3::Y).unwrap();
        let lines = ParallelLines::new(&p, 0.0);
        assert_eq!(lines.knots().len(), 2);
        for u in [0.0, 1.0, 3.0] {
            assert!((lines.length(u) - 2.0).abs() < 4.0 * f64::EPSILON);
        }
        assert!(lines.segment(3.5).is_none());
        assert!(lines.length(-0.1).abs() < f64::MIN_POSITIVE);
    }
}

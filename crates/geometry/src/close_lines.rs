//! Line samples of a polygon for a shading point that is close to the polygon's plane, where the
//! ordinary [`ParallelLines`] lose their digits.

use crate::double::{self, Double, Doubles};
use crate::parallel_lines::ParallelLines;
use crate::{ConvexPolygon, DVec2, DVec3, PlaneFrame, predicates};

/// The largest number of corners: the capacity of [`ParallelLines`].
const CAPACITY: usize = ConvexPolygon::CAPACITY;

/// The ratio of the distance of an edge's ends to the distance of the edge, both from the foot (of
/// the perpendicular from the shading point to the polygon's plane), above which the point of the
/// edge nearest to the foot becomes an additional corner: from two ends this far, the distance of
/// the edge loses at most four bits.
const NEAR_EDGE: f64 = 16.0;

/// The lines of the part of a polygon above a horizon, for a shading point so close to the
/// polygon's plane that the distance of an edge from the *foot* (of the perpendicular from the
/// shading point to that plane) would be lost in the rounding of the edge's ends.
///
/// The origin of coordinates is the point of that part which is nearest to the foot, or the foot
/// itself if it is inside the part. There are additional knots at the foot's offset and where an
/// edge or the horizon runs closely by the foot. So each line, and each step from one line to the
/// next, is known to a few ε of its distance from the origin, instead of ε of the light's size.
/// Everything is computed in twice the working precision from the vertices as they are given.
#[derive(Clone, Copy, Debug)]
pub struct CloseLines {
    /// The lines; their knots are the offsets of the vertices, of the foot and of the nearest
    /// points of edges.
    pub lines: ParallelLines,
    /// The foot of the perpendicular from the shading point, in line coordinates (offset u,
    /// position v along the line).
    pub foot: (f64, f64),
    /// The height of the polygon's plane over the shading point, along the polygon's normal.
    pub height: f64,
}

impl CloseLines {
    /// Creates the lines at `angle_rad` radians from the polygon's first edge, counter-clockwise
    /// about the normal, of the part with `(p − x)·normal ≥ 0`; `None` if that part is empty, or if
    /// the angle or a distance is not finite.
    #[must_use]
    pub fn new(polygon: &ConvexPolygon, angle_rad: f64, x: DVec3, normal: DVec3) -> Option<Self> {
        if !angle_rad.is_finite() {
            return None;
        }
        // Compute the normal again in twice the precision, since the polygon's own is only as
        // precise as its construction.
        let frame = polygon.plane_frame();
        let area = area_vector(polygon);
        let along_normal = double::rounded(area);
        let axis = predicates::normalize(along_normal)?;
        let frame = PlaneFrame::new(frame.origin, axis, frame.axes.x).turned(angle_rad);
        // Find the corners of the part above the horizon, and add the nearest points of edges that
        // pass the foot.
        let mut corners = Corners::above(polygon, &frame, x, normal);
        let nearest = corners.nearest_point()?;
        corners.push_nearest_points();
        // Move the origin to the point nearest to the foot, and round.
        let (mut plane, mut offsets) = ([DVec2::ZERO; CAPACITY], [0.0; CAPACITY]);
        for ((q, o), p) in plane.iter_mut().zip(&mut offsets).zip(corners.all()) {
            let [v, u] = double::minus(*p, nearest).map(Double::hi);
            (*q, *o) = (DVec2::new(v, u), u);
        }
        // Add a knot at the foot's offset, if it is inside the range.
        let [v, u] = nearest.map(Double::hi);
        let mut knots = corners.count;
        let used = &plane[..corners.count];
        let is_within = |o: f64| used.iter().any(|q| q.y < o) && used.iter().any(|q| q.y > o);
        if knots < CAPACITY && is_within(-u) {
            offsets[knots] = -u;
            knots += 1;
        }
        let to_plane = double::dot(area, double::difference(frame.origin, x)).hi();
        let height = to_plane / predicates::length(along_normal);
        // Place the frame from the foot or from the light's first vertex, whichever is nearer,
        // since each step is rounded.
        let first = double::minus(nearest, Corners::coordinates(&frame, frame.origin, x));
        let first = DVec2::new(first[0].hi(), first[1].hi());
        let (base, step) = if v * v + u * u < first.length_squared() {
            (x + frame.axes.z * height, DVec2::new(v, u))
        } else {
            (frame.origin, first)
        };
        let frame = PlaneFrame {
            origin: base + frame.axes.x * step.x + frame.axes.y * step.y,
            axes: frame.axes,
        };
        let lines = ParallelLines::through_corners(&frame, used, &mut offsets[..knots], true);
        let ((first, last), foot) = (lines.range(), (-u, -v));
        let numbers = [first, last, foot.0, foot.1, height];
        numbers.iter().all(|x| x.is_finite()).then_some(Self {
            lines,
            foot,
            height,
        })
    }
}

/// Twice the polygon's area as a vector along the normal.
fn area_vector(polygon: &ConvexPolygon) -> Doubles<3> {
    let vertices = polygon.vertices();
    let edge = |p: DVec3| double::difference(p, vertices[0]);
    vertices[1..].windows(2).fold([Double::ZERO; 3], |sum, w| {
        double::along(sum, double::cross(edge(w[0]), edge(w[1])), 1.0.into())
    })
}

/// The corners of a convex polygon, counter-clockwise, as coordinates (along, across) relative to
/// the foot of the perpendicular from the shading point.
struct Corners {
    points: [Doubles<2>; CAPACITY],
    count: usize,
}

impl Corners {
    const NONE: Self = Self {
        points: [[Double::ZERO; 2]; CAPACITY],
        count: 0,
    };

    fn all(&self) -> &[Doubles<2>] {
        &self.points[..self.count]
    }

    /// Adds a corner. Corners beyond [`CAPACITY`] are dropped, as in [`ConvexPolygon::clip`].
    fn push(&mut self, p: Doubles<2>) {
        if self.count < CAPACITY {
            self.points[self.count] = p;
            self.count += 1;
        }
    }

    /// Returns the coordinates of a point of the plane relative to the foot of the perpendicular
    /// from the shading point `x`.
    fn coordinates(frame: &PlaneFrame, p: DVec3, x: DVec3) -> Doubles<2> {
        let p = double::difference(p, x);
        [frame.axes.x, frame.axes.y].map(|a| double::dot(double::vector(a), p))
    }

    /// Returns the corners of the part of a polygon with `(p − x)·normal ≥ 0`.
    fn above(polygon: &ConvexPolygon, frame: &PlaneFrame, x: DVec3, normal: DVec3) -> Self {
        let normal = double::vector(normal);
        let place = |p: DVec3| {
            let side = double::dot(normal, double::difference(p, x));
            (Self::coordinates(frame, p, x), side)
        };
        let mut out = Self::NONE;
        let vertices = polygon.vertices();
        for (i, &p) in vertices.iter().enumerate() {
            let (a, sa) = place(p);
            let (b, sb) = place(vertices[(i + 1) % vertices.len()]);
            if sa.hi() >= 0.0 {
                out.push(a);
            }
            if (sa.hi() > 0.0 && sb.hi() < 0.0) || (sa.hi() < 0.0 && sb.hi() > 0.0) {
                out.push(double::along(a, double::minus(b, a), sa / (sa - sb)));
            }
        }
        out
    }

    /// Returns the two ends of each edge.
    fn edges(&self) -> impl Iterator<Item = (Doubles<2>, Doubles<2>)> + '_ {
        let next = self.all().iter().cycle().skip(1);
        self.all().iter().copied().zip(next.copied())
    }

    /// Returns the point of the polygon nearest to the foot, or the foot if it is inside; `None` if
    /// there are fewer than three corners.
    fn nearest_point(&self) -> Option<Doubles<2>> {
        if self.count < 3 {
            return None;
        }
        if self.edges().all(|(a, b)| double::turn(a, b).hi() >= 0.0) {
            return Some([Double::ZERO; 2]);
        }
        let distance = |p: &Doubles<2>| double::dot(*p, *p).hi();
        self.edges()
            .map(|(a, b)| nearest_of_edge(a, b).unwrap_or(a))
            .min_by(|p, q| distance(p).total_cmp(&distance(q)))
    }

    /// Inserts the nearest points of edges that pass the foot closely as corners.
    fn push_nearest_points(&mut self) {
        let square = |p: Doubles<2>| double::dot(p, p).hi();
        let mut out = Self::NONE;
        // One more knot is reserved for the foot.
        let mut room = (CAPACITY - 1).saturating_sub(self.count);
        for (a, b) in self.edges() {
            out.push(a);
            let close = nearest_of_edge(a, b).filter(|&q| {
                room > 0 && NEAR_EDGE * NEAR_EDGE * square(q) < square(a).min(square(b))
            });
            if let Some(q) = close {
                out.push(q);
                room -= 1;
            }
        }
        *self = out;
    }
}

/// Returns the point of the edge from a to b that is nearest to the foot; `None` if that point is
/// one of the ends.
fn nearest_of_edge(a: Doubles<2>, b: Doubles<2>) -> Option<Doubles<2>> {
    let edge = double::minus(b, a);
    let t = -(double::dot(a, edge) / double::dot(edge, edge));
    (t.hi() > 0.0 && t.hi() < 1.0).then(|| double::along(a, edge, t))
}

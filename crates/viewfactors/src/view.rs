//! What a point sees of a polygon past a few convex blockers: the shadow of one blocker after the
//! other is subtracted, and the view factor of the remaining convex pieces is summed.

use linelit_geometry::{ConvexPolygon, DVec3, stop};
use linelit_shading::polygon;
use std::f64::consts::FRAC_1_PI;

/// A list of convex polygons, stored corner after corner.
#[derive(Debug, Default)]
struct Pieces {
    corners: Vec<DVec3>,
    /// The end of each polygon in `corners`.
    ends: Vec<usize>,
}

impl Pieces {
    fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    fn push(&mut self, corners: &[DVec3]) {
        self.corners.extend_from_slice(corners);
        self.ends.push(self.corners.len());
    }

    fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts
            .zip(&self.ends)
            .map(|(&from, &to)| &self.corners[from..to])
    }
}

/// A plane that bounds a shadow or a part of a polygon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    /// The normal, which points inwards.
    pub normal: DVec3,
    /// The height of the plane along its normal.
    pub at: f64,
    /// The height above the plane below which a point counts as on it.
    pub room: f64,
}

/// The planes through the edges of a convex polygon, perpendicular to its plane, which has the
/// normal `n`.
pub(crate) fn edge_planes(n: DVec3, corners: &[DVec3], room: f64) -> Vec<Plane> {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let plane = |(a, b): (&DVec3, &DVec3)| {
        let normal = n.cross(*b - *a).try_normalize()?;
        let at = normal.dot(*a);
        Some(Plane { normal, at, room })
    };
    edges.filter_map(plane).collect()
}

/// Divides a convex polygon into the part above all of some planes, and the rest in convex pieces;
/// `None` if no part of it is above all planes.
pub(crate) fn divided(
    polygon: &[DVec3],
    planes: &[Plane],
) -> Option<(Vec<DVec3>, Vec<Vec<DVec3>>)> {
    let (mut inside, mut cut, mut rest) = (polygon.to_vec(), Vec::new(), Pieces::default());
    for plane in planes {
        split(&mut inside, &mut cut, &mut rest, *plane);
        if inside.is_empty() {
            return None;
        }
    }
    Some((inside, rest.iter().map(<[DVec3]>::to_vec).collect()))
}

/// Buffers for views, to be reused from one point to the next.
#[derive(Debug, Default)]
pub(crate) struct View {
    pieces: Pieces,
    next: Pieces,
    planes: Vec<Plane>,
    inside: Vec<DVec3>,
    cut: Vec<DVec3>,
}

/// Heights below this fraction of the distance count as on the plane: products and sums of
/// coordinate differences have smaller rounding errors. A larger margin would close slits.
const ON_PLANE: f64 = 64.0 * f64::EPSILON;

/// The view factor below which what is seen of a polygon counts as rounding, given its unobstructed
/// view factor; a few ε are rounding errors of Lambert's sum.
pub(crate) fn unseen_below(open: f64) -> f64 {
    1e-12 * open + 8.0 * f64::EPSILON
}

impl View {
    /// The view factors from a point with a normal to a polygon: without blockers, and past them.
    /// The polygon and the blockers are before the point's plane, and the blockers are before the
    /// polygon's.
    pub(crate) fn factors<'a>(
        &mut self,
        x: DVec3,
        n: DVec3,
        polygon: &ConvexPolygon,
        blockers: impl Iterator<Item = &'a ConvexPolygon>,
    ) -> [f64; 2] {
        let mut room = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        let whole = polygon.relative_to(x, &mut room);
        let open = FRAC_1_PI * polygon::irradiance_by_edges(whole, n);
        self.pieces.clear();
        self.pieces.push(whole);
        let mut is_cut = false;
        // Subtract the shadow of each blocker: the cone from the point through its edges.
        for blocker in blockers {
            let height = blocker.normal().dot(blocker.vertices()[0] - x);
            // If the point is on an edge's line, the edge's plane bounds nothing.
            let plane = |a: DVec3, b: DVec3| ((a - x).cross(b - x) * height.signum(), 0.0);
            is_cut |= self.subtract(blocker, height.abs(), plane);
            if self.pieces.ends.is_empty() {
                return [open, 0.0];
            }
        }
        if !is_cut {
            return [open, open];
        }
        // Sum the view factors of what is left.
        let each = self
            .pieces
            .iter()
            .map(|piece| polygon::irradiance_by_edges(piece, n));
        [open, FRAC_1_PI * each.sum::<f64>()]
    }

    /// The area of the part of a polygon that light from one direction reaches past blockers. The
    /// polygon faces the direction, and the blockers are before its plane.
    pub(crate) fn lit(
        &mut self,
        direction: DVec3,
        polygon: &ConvexPolygon,
        blockers: &[ConvexPolygon],
    ) -> f64 {
        let origin = polygon.vertices()[0];
        let mut room = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        self.pieces.clear();
        self.pieces.push(polygon.relative_to(origin, &mut room));
        // Subtract the shadow of each blocker: the prism along the direction through its edges.
        for blocker in blockers {
            let height = blocker.normal().dot(direction);
            let plane = |a: DVec3, b: DVec3| {
                let normal = (b - a).cross(-direction) * height.signum();
                (normal, normal.dot(a - origin))
            };
            let corners = blocker.vertices().iter();
            let size = corners.map(|v| v.distance(origin)).fold(0.0, f64::max);
            self.subtract(blocker, height.abs() * size, plane);
        }
        // Sum the areas of what is left.
        let n = polygon.normal();
        let area = |piece: &[DVec3]| {
            let fan = piece
                .windows(2)
                .skip(1)
                .map(|w| (w[0] - piece[0]).cross(w[1] - piece[0]));
            0.5 * n.dot(fan.sum::<DVec3>())
        };
        self.pieces.iter().map(area).sum()
    }

    /// Subtracts from all pieces the shadow of a blocker. `plane` returns the plane through one of
    /// the blocker's edges that bounds the shadow, with its normal inwards. `height` is the height
    /// of the eye above the blocker's plane. Returns whether anything was subtracted.
    fn subtract(
        &mut self,
        blocker: &ConvexPolygon,
        height: f64,
        plane: impl Fn(DVec3, DVec3) -> (DVec3, f64),
    ) -> bool {
        stop::check();
        let all = &self.pieces.corners;
        let room = ON_PLANE
            * all
                .iter()
                .fold(0.0_f64, |most, v| most.max(v.abs().max_element()));
        // A blocker seen edge on hides nothing.
        if height <= room {
            return false;
        }
        // Compute the planes around the shadow; if all pieces are outside of one, the blocker hides
        // nothing.
        self.planes.clear();
        let corners = blocker.vertices();
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (normal, at) = plane(*a, *b);
            let room = room * normal.abs().element_sum();
            if all.iter().all(|v| normal.dot(*v) - at <= room) {
                return false;
            }
            self.planes.push(Plane { normal, at, room });
        }
        // Divide each piece by the planes: what is inside of all is hidden, and the rest stays. A
        // piece of which nothing is hidden stays in one piece.
        self.next.clear();
        let mut is_cut = false;
        let Self {
            pieces,
            next,
            planes,
            inside,
            cut,
        } = self;
        for piece in pieces.iter() {
            let mark = (next.corners.len(), next.ends.len());
            inside.clear();
            inside.extend_from_slice(piece);
            for plane in planes.iter() {
                split(inside, cut, next, *plane);
                if inside.is_empty() {
                    break;
                }
            }
            if inside.is_empty() {
                next.corners.truncate(mark.0);
                next.ends.truncate(mark.1);
                next.push(piece);
            } else {
                is_cut = true;
            }
        }
        if is_cut {
            std::mem::swap(&mut self.pieces, &mut self.next);
        }
        is_cut
    }
}

/// Reduces the polygon `inside` to the part above a plane, and adds the part below to `others`.
fn split(
    inside: &mut Vec<DVec3>,
    cut: &mut Vec<DVec3>,
    others: &mut Pieces,
    Plane { normal, at, room }: Plane,
) {
    let height = |v: &DVec3| normal.dot(*v) - at;
    // If the polygon is on one side, up to rounding, it is not cut.
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    for h in inside.iter().map(height) {
        (low, high) = (low.min(h), high.max(h));
    }
    if low >= -room {
        if high <= room {
            inside.clear();
        }
        return;
    }
    if high <= room {
        others.push(inside);
        inside.clear();
        return;
    }
    // Distribute corners and crossings to both sides.
    cut.clear();
    for (p, q) in inside.iter().zip(inside.iter().cycle().skip(1)) {
        let (from, to) = (height(p), height(q));
        if from <= 0.0 {
            others.corners.push(*p);
        }
        if from >= 0.0 {
            cut.push(*p);
        }
        if (from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0) {
            let crossing = *p + (*q - *p) * (from / (from - to));
            others.corners.push(crossing);
            cut.push(crossing);
        }
    }
    others.ends.push(others.corners.len());
    std::mem::swap(inside, cut);
}

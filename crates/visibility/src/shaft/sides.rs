//! A light's frame for cases in which the side of the light's plane on which vertices lie must be
//! exact: for a light that is seen edge on, and for one whose margin is zero.

use crate::lanes::Lanes;
use linelit_geometry::{DVec3, double};
use linelit_simd::Simd;

/// Homogeneous coordinates of one vertex in eight lanes.
pub(crate) type Vertex<S> = [<S as linelit_simd::Lanes>::D; 3];

/// The plane of a polygonal light and coordinates on it, from which (P, Q, W) of vertices near the
/// plane are computed.
///
/// As a sum of three products, W suffers from cancellation for a vertex that is much closer to the
/// light's plane than to the foot of the perpendicular from the shading point on that plane. There,
/// W = 1 − V(v)/V(x) is used instead, for the vertex v and the shading point x. V is the signed
/// volume over three corners of the light, by determinants in twice the precision, which are exact
/// where corners and vertices are `f32` numbers of similar size. A vertex in the plane then has
/// W = 1 exactly. P = d₁·(v − x) − W c₁, and Q likewise, with the same W.
///
/// Everything depends on the vertex alone, so that triangles that share it agree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sides {
    /// A corner of the light, in the hierarchy's coordinates, and the normal of its plane.
    pub(crate) corner: DVec3,
    pub(crate) normal: double::Doubles<3>,
    /// The volume V(x) of the shading point.
    pub(crate) volume: f64,
    /// The coefficients of the linear functions P + c₁ W, Q + c₂ W and W.
    pub(crate) d: [DVec3; 2],
    pub(crate) c: [f64; 2],
    pub(crate) w: DVec3,
    /// The point (0, 0) relative to the shading point, and the vectors of one unit of p and of q.
    pub(crate) axes: [DVec3; 3],
}

/// W is computed from volumes where the terms of its sum of products are larger than W by the
/// factor `CANCELS`, or where W differs from one by less than `NEAR_ONE`, in units of the terms.
/// Elsewhere the sum loses at most eight bits, and the side of the plane on which the vertex lies
/// is certain.
const CANCELS: f64 = 256.0;
const NEAR_ONE: f64 = 1e-14;

impl Sides {
    /// Returns the volume V of a vertex.
    fn volume(&self, vertex: DVec3) -> f64 {
        let from = double::difference(vertex, self.corner);
        double::dot(self.normal, from).hi()
    }

    /// Returns the coordinates (P, Q, W) of eight vertices, given their positions in the
    /// hierarchy's coordinates and relative to the shading point.
    #[inline(always)]
    pub(crate) fn vertex<S: Simd>(&self, s: S, places: [S::D; 3], from: [S::D; 3]) -> Vertex<S> {
        let mut rows = Lanes([[0.0; 8]; 6]);
        for (row, column) in rows.iter_mut().zip(places.into_iter().chain(from)) {
            s.dstore(column, row);
        }
        self.vertices(&mut rows);
        [s.dload(&rows[0]), s.dload(&rows[1]), s.dload(&rows[2])]
    }

    /// Replaces the first three of the six rows, which hold the positions in both coordinates, by
    /// (P, Q, W).
    #[inline(never)]
    fn vertices(&self, rows: &mut [[f64; 8]; 6]) {
        for lane in 0..8 {
            let [x, y, z, dx, dy, dz] = rows.each_ref().map(|row| row[lane]);
            let vertex = self.vertex_of(DVec3::new(x, y, z), DVec3::new(dx, dy, dz));
            for (row, coordinate) in rows.iter_mut().zip(vertex) {
                row[lane] = coordinate;
            }
        }
    }

    /// Returns the coordinates (P, Q, W) of one vertex.
    pub(crate) fn vertex_of(&self, place: DVec3, from: DVec3) -> [f64; 3] {
        let [p, q, w] = self.about_foot(place, from);
        [p - w * self.c[0], q - w * self.c[1], w]
    }

    /// Returns the coordinates (P + c₁ W, Q + c₂ W, W) of a vertex, whose origin is the foot of the
    /// perpendicular from the shading point on the light's plane. For a light seen edge on, the
    /// first two are small where P, Q and W are not, so that interpolation between two vertices
    /// loses no digits.
    pub(crate) fn about_foot(&self, place: DVec3, from: DVec3) -> [f64; 3] {
        let form = |n: DVec3| from.x * n.x + from.y * n.y + from.z * n.z;
        let w = self.w(place, from, form(self.w));
        [form(self.d[0]), form(self.d[1]), w]
    }

    /// Projects a point of the light's plane, or one close to it, along the ray through it to that
    /// plane. The point is relative to the shading point.
    #[cold]
    pub(crate) fn project(&self, from: DVec3) -> [f64; 2] {
        let terms = (self.w * from).abs().element_sum();
        let w = self.w.dot(from);
        // A point in the plane, up to rounding, has W = 1.
        let w = if (w - 1.0).abs() <= NEAR_ONE * (1.0 + terms) {
            1.0
        } else {
            w
        };
        [0, 1].map(|k| self.d[k].dot(from) / w - self.c[k])
    }

    /// Returns W of a vertex, given its position in the hierarchy's coordinates and relative to the
    /// shading point, and W as the sum of products.
    fn w(&self, place: DVec3, from: DVec3, w: f64) -> f64 {
        let terms = (self.w * from).abs().element_sum();
        if terms > CANCELS * w.abs() || (w - 1.0).abs() <= NEAR_ONE * (1.0 + terms) {
            1.0 - self.volume(place) / self.volume
        } else {
            w
        }
    }
}

//! The watertight ray–triangle test. All other tests of rays give bit-identical results.

use linelit_geometry::DVec3;

/// A ray prepared for watertight tests: the axes are permuted so that the ray's longest component
/// comes last, and sheared so that the ray points along that axis.
///
/// A triangle's vertices are sheared by operations that depend on the vertex and the ray alone;
/// then the question is whether the origin of the plane lies in the triangle's projection. The edge
/// functions are differences of two products, whose sign rounding can turn into zero but never
/// reverse, and the same edge in the opposite direction gives exactly the negative. With zero
/// counted as inside, a ray never slips between triangles that share an edge or a vertex.
///
/// **Source**: Woop, Benthin & Wald 2013, here entirely in `f64`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WatertightRay {
    pub(crate) origin: [f64; 3],
    pub(crate) axes: [usize; 3],
    pub(crate) shear: [f64; 3],
}

impl WatertightRay {
    /// Prepares a ray from `origin` along a `direction` that is not zero.
    #[inline(always)]
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        let d = direction.to_array();
        let longest = direction.abs().max_position();
        let (mut kx, mut ky) = ((longest + 1) % 3, (longest + 2) % 3);
        if d[longest] < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        Self {
            origin: origin.to_array(),
            axes: [kx, ky, longest],
            shear: [d[kx] / d[longest], d[ky] / d[longest], 1.0 / d[longest]],
        }
    }

    /// Intersects the ray's line, which extends in both directions, with a triangle. Returns the
    /// distance in units of the direction's length, and the barycentric coordinates of vertices 1
    /// and 2; `None` if the line misses the triangle or lies in its plane.
    #[inline(always)]
    pub(crate) fn intersect(&self, triangle: &[[f32; 3]; 3]) -> Option<(f64, [f64; 2])> {
        let sz = self.shear[2];
        let (ax, ay, az) = self.sheared(&triangle[0]);
        let (bx, by, bz) = self.sheared(&triangle[1]);
        let (cx, cy, cz) = self.sheared(&triangle[2]);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        // The triangle is seen edge on, or a coordinate is not a number.
        if !(det.abs() > 0.0) {
            return None;
        }
        let t = (u * az + v * bz + w * cz) * sz / det;
        Some((t, [v / det, w / det]))
    }

    /// A vertex in the ray's coordinates.
    #[inline(always)]
    fn sheared(&self, v: &[f32; 3]) -> (f64, f64, f64) {
        let [kx, ky, kz] = self.axes;
        let z = f64::from(v[kz]) - self.origin[kz];
        (
            f64::from(v[kx]) - self.origin[kx] - self.shear[0] * z,
            f64::from(v[ky]) - self.origin[ky] - self.shear[1] * z,
            z,
        )
    }
}

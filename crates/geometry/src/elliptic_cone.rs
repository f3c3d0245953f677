//! Elliptic cones: the directions in which a point sees a disk, directly or under a linear map.

use crate::{DVec3, Frame, predicates};
use linelit_elementary::hypot;

/// The largest number of Newton steps towards the negative eigenvalue that belongs to the cone's
/// axis. The iteration approaches it from below, and each step covers at least a third of the
/// remaining distance.
const STEPS: usize = 100;

/// A cone of directions from the origin over an ellipse, given by its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipticCone {
    /// Unit vectors along the wider half angle, along the narrower one, and along the cone's axis;
    /// orthogonal and right-handed.
    pub axes: [DVec3; 3],
    /// The tangents of the half angles; the wider comes first.
    pub tan: [f64; 2],
}

impl EllipticCone {
    /// Creates the cone from the origin over the ellipse c + u cos t + v sin t; `None` if the
    /// origin is in the ellipse's plane, u and v are parallel, or products of six lengths overflow.
    ///
    /// **Formula**: the matrix P = uuᵀ + vvᵀ − ccᵀ has one negative eigenvalue −μ, which belongs to
    /// the axis; the squares of the tangents are the other two eigenvalues over μ. The smaller
    /// tangent follows from det P = −det(u, v, c)². **Error**: in the axes, a few ε times the
    /// squares of the ratios of the lengths of c, u and v; the tangents of small ellipses far away
    /// lose no digits.
    ///
    /// ```
    /// use linelit_geometry::{DVec3, EllipticCone};
    /// // A circle overhead.
    /// let cone = EllipticCone::over(DVec3::Z * 2.0, DVec3::X, DVec3::Y).unwrap();
    /// assert!((cone.axes[2] - DVec3::Z).length() < 1e-15);
    /// assert!((cone.tan[0] - 0.5).abs() < 1e-15 && (cone.tan[1] - 0.5).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn over(c: DVec3, u: DVec3, v: DVec3) -> Option<Self> {
        let (across, [cc, uu, vv]) = (u.cross(v), [c, u, v].map(DVec3::length_squared));
        let determinant = c.dot(across);
        // Compute the characteristic polynomial ((x − trace) x + minors) x + det².
        let (trace, square) = (uu + vv - cc, determinant * determinant);
        let minors = [u.cross(c), v.cross(c)].map(DVec3::length_squared);
        let minors = across.length_squared() - minors[0] - minors[1];
        if !(square > 0.0 && square.is_finite()) {
            return None;
        }
        // Find the negative eigenvalue by Newton's iteration from below.
        let mut low = -cc;
        for _ in 0..STEPS {
            let value = ((low - trace) * low + minors) * low + square;
            let slope = (3.0 * low - 2.0 * trace) * low + minors;
            let next = low - value / slope;
            if !(next > low) {
                break;
            }
            low = next;
        }
        let mu = -low;
        // Find the axis: P + μ has rank two, and maps the axis to zero.
        let row = |k: usize| u * u[k] + v * v[k] - c * c[k] + DVec3::AXES[k] * mu;
        let [x, y, z] = [0, 1, 2].map(row);
        let normals = [x.cross(y), y.cross(z), z.cross(x)];
        let longer = |a: DVec3, b: DVec3| {
            if b.length_squared() > a.length_squared() {
                b
            } else {
                a
            }
        };
        let axis = predicates::normalize(normals.into_iter().fold(DVec3::ZERO, longer))?;
        let axis = if axis.dot(c) < 0.0 { -axis } else { axis };
        // Diagonalize P in the plane across the axis.
        let frame = Frame::from_normal(axis);
        let [e, f] = [frame.x, frame.y];
        let part =
            |a: DVec3, b: DVec3| u.dot(a) * u.dot(b) + v.dot(a) * v.dot(b) - c.dot(a) * c.dot(b);
        let (ee, ef, ff) = (part(e, e), part(e, f), part(f, f));
        let (mean, half) = (0.5 * (ee + ff), 0.5 * (ee - ff));
        let root = hypot(half, ef);
        let widest = mean + root;
        let along = if half >= 0.0 {
            e * (half + root) + f * ef
        } else {
            e * ef + f * (root - half)
        };
        let first = predicates::normalize(along).unwrap_or(e);
        let tan = [
            (widest / mu).sqrt(),
            determinant.abs() / (mu * widest.sqrt()),
        ];
        let usable = mu > 0.0 && tan.iter().all(|t| *t > 0.0 && t.is_finite());
        usable.then(|| Self {
            axes: [first, axis.cross(first), axis],
            // Rounding may have exchanged the order of the two tangents.
            tan: [tan[0], tan[1].min(tan[0])],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::EllipticCone;
    use crate::DVec3;

    /// The whole ellipse is on the cone, for any size and position of it.
    #[test]
    fn the_ellipse_is_on_its_cone() {
        let c = DVec3::new(0.3, -0.4, 1.2);
        let (u, v) = (DVec3::new(0.9, 0.1, -0.3), DVec3::new(0.2, 0.7, 0.5));
        let cases = [
            (c, u, v),
            (c, u * 1e-3, v * 1e-3),
            (c, u * 1e-5, v * 1e-5),
            (c, u * 30.0, v * 30.0),
            (c * 1e-3, u, v * 1e-2),
            (c * 1e20, u * 1e19, v * 1e20),
        ];
        for (c, u, v) in cases {
            let cone = EllipticCone::over(c, u, v).expect("a cone");
            let [a, b] = cone.tan;
            assert!(a >= b, "{cone:?}");
            let [x, y, z] = cone.axes;
            assert!((x.cross(y) - z).length() < 1e-14);
            let ratio = (c.length() / v.length()).max(u.length() / c.length());
            for k in 0..32 {
                let (s, t) = (f64::from(k) * 0.2).sin_cos();
                let p = c + u * t + v * s;
                let (p, q, r) = (p.dot(x) / a, p.dot(y) / b, p.dot(z));
                assert!(r > 0.0);
                let off = (p.hypot(q) / r - 1.0).abs();
                assert!(
                    off < 64.0 * f64::EPSILON * ratio * ratio * (a / b),
                    "{off} of {cone:?}"
                );
            }
        }
    }

    /// Ellipses that have no cone are refused.
    #[test]
    fn flat_cones_are_none() {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let nan = DVec3::splat(f64::NAN);
        let cases = [
            (x, x, y),
            (z, x, x),
            (DVec3::ZERO, x, y),
            (z, DVec3::ZERO, y),
            (z * 1e200, x, y),
            (z * 1e-200, x, y * 1e-200),
            (z, x * f64::INFINITY, y),
            (nan, x, y),
            (z, nan, y),
        ];
        for (c, u, v) in cases {
            assert_eq!(EllipticCone::over(c, u, v), None, "{c} {u} {v}");
        }
    }
}

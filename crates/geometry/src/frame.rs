//! Orthonormal frames around a direction, and transformation to and from their coordinates.

use crate::{DVec3, predicates};

/// A right-handed orthonormal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The first tangent.
    pub x: DVec3,
    /// The second tangent, `z × x`.
    pub y: DVec3,
    /// The axis around which the frame was built.
    pub z: DVec3,
}

impl Frame {
    /// Creates a frame around the unit vector `z`. The tangents are continuous functions of `z`
    /// except at z.z = 0.
    ///
    /// **Error**: orthonormal to 4 ε. **Source**: Duff et al. 2017, "Building an Orthonormal Basis,
    /// Revisited".
    #[must_use]
    pub fn from_normal(z: DVec3) -> Self {
        let sign = 1.0f64.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: DVec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: DVec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// Creates a frame around `z` whose x axis is as close to `x` as possible; neither has to be a
    /// unit vector. If `x` is parallel to `z`, zero or not finite, the frame is that of
    /// [`Frame::from_normal`]; if `z` is zero or not finite, `z` is replaced by the world's z axis.
    ///
    /// **Error**: orthonormal to 1e-12, and to 16 ε unless the angle between `z` and `x` is between
    /// 1e-3 and 1e-1.
    #[must_use]
    pub fn from_normal_and_tangent(z: DVec3, x: DVec3) -> Self {
        let z = predicates::normalize(z).unwrap_or(DVec3::Z);
        let plain = z.cross(x);
        // At an angle of 2⁻¹⁰, the plain product has 43 correct bits. For smaller angles, and for
        // vectors so short or long that it loses its digits, it is computed from exact products of
        // unit vectors.
        let y = if plain.length_squared() > 1e-6 * x.length_squared() && x.length_squared() > 1e-270
        {
            plain
        } else {
            // Products shorter than 1e-130 have lost digits to underflow, so the vectors count as
            // parallel.
            predicates::normalize(x)
                .map(|x| predicates::cross(z, x))
                .filter(|y| y.length_squared() > 1e-260)
                .unwrap_or(DVec3::ZERO)
        };
        match predicates::normalize(y) {
            Some(y) => Self {
                x: y.cross(z),
                y,
                z,
            },
            None => Self::from_normal(z),
        }
    }

    /// Transforms a direction from world to local coordinates.
    #[inline]
    #[must_use]
    pub fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Transforms a direction from local to world coordinates.
    #[inline]
    #[must_use]
    pub fn to_world(&self, v: DVec3) -> DVec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn orthonormal_and_right_handed(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64,
            tx in -1.0..1.0f64, ty in -1.0..1.0f64,
        ) {
            let n = DVec3::new(x, y, z);
            prop_assume!(n.length() > 1e-3);
            let n = n.normalize();
            let tangent = DVec3::new(tx, ty, 0.3);
            prop_assume!(n.cross(tangent).length() > 1e-3);
            for f in [Frame::from_normal(n), Frame::from_normal_and_tangent(n, tangent)] {
                // The bound 16 eps covers the few roundings of each entry; the tangent form
                // divides by |n x t| >= 1e-3 only inside a normalisation, which cancels.
                let tol = 16.0 * f64::EPSILON * 1e3;
                prop_assert!((f.x.cross(f.y) - f.z).length() < tol);
                prop_assert!((f.x.length() - 1.0).abs() < tol);
                prop_assert!((f.to_world(f.to_local(tangent)) - tangent).length() < tol);
            }
        }
    }
}

//! Orthonormal frames.

use crate::{DVec3, predicates};

/// A right-handed orthonormal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: DVec3,
    /// Second tangent, `z × x`.
    pub y: DVec3,
    /// The axis the frame was built around.
    pub z: DVec3,
}

impl Frame {
    /// A frame around the unit vector `z`; continuous but for the plane z = 0.
    ///
    /// **Error**: orthonormal to 4 ε. **Source**: Duff et al. 2017, "Building an Orthonormal
    /// Basis, Revisited".
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

    /// A frame around `z` whose x axis lies as near to `x` as it can: both need not be unit. Where
    /// `x` is parallel to `z`, zero or not finite, [`Frame::from_normal`] serves; the frame is the
    /// world's where `z` is zero or not finite.
    ///
    /// **Error**: orthonormal to 1e-12, and to 16 ε but for 1e-3 < angle < 1e-1 between `z` and
    /// `x`.
    #[must_use]
    pub fn from_normal_and_tangent(z: DVec3, x: DVec3) -> Self {
        let z = predicates::normalize(z).unwrap_or(DVec3::Z);
        let plain = z.cross(x);
        // An angle of 2⁻¹⁰ leaves the plain product 43 good bits; below, and for what is so small
        // or large that its own bits are gone, it is formed from exact products of unit vectors.
        let y = if plain.length_squared() > 1e-6 * x.length_squared() && x.length_squared() > 1e-270
        {
            plain
        } else {
            // Vectors shorter than 1e-130 have lost digits to underflow: as good as parallel.
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

    /// World to local coordinates of a direction.
    #[inline]
    #[must_use]
    pub fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Local to world coordinates of a direction.
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

//! The sphere of directions on a square: the equal-area octahedral map of pbrt-v4.
//!
//! The octants about +z fill the diamond in the middle of the square, each in the quadrant of the
//! signs of its x and y; those about −z fill the corners, so that −z is all four of them. Equal
//! areas of the square are equal solid angles: the square stands for 4π.
//!
//! **Source**: Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD";
//! `EqualAreaSquareToSphere` and `EqualAreaSphereToSquare` of pbrt-v4, whose polynomials stand for
//! the functions that are called here.

use linelit_elementary::{atan2, hypot, sin_cos};
use linelit_geometry::DVec3;
use linelit_geometry::finite::fraction;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_4};

/// The unit vector at a place in [0, 1]². Coordinates beyond it are moved to its border, and those
/// that are not numbers to 0.
///
/// **Error**: of each coordinate, 16 ε.
///
/// ```
/// use linelit_lights::geometry::DVec3;
/// use linelit_lights::octahedral::square_to_sphere;
/// assert_eq!(square_to_sphere([0.5, 0.5]), DVec3::Z);
/// assert!(square_to_sphere([1.0, 0.5]).distance(DVec3::X) < 1e-15);
/// ```
#[must_use]
pub fn square_to_sphere(place: [f64; 2]) -> DVec3 {
    let [u, v] = place.map(|p| 2.0 * fraction(p) - 1.0);
    let distance = 1.0 - (u.abs() + v.abs());
    // One minus the distance from the diamond, formed without loss next to the middle.
    let r = if distance >= 0.0 {
        u.abs() + v.abs()
    } else {
        1.0 + distance
    };
    let turn = if r > 0.0 {
        (v.abs() - u.abs()) / r + 1.0
    } else {
        1.0
    };
    let (sin, cos) = sin_cos(turn * FRAC_PI_4);
    let sin_theta = r * (2.0 - r * r).sqrt();
    DVec3::new(
        sin_theta * cos.copysign(u),
        sin_theta * sin.copysign(v),
        (1.0 - r * r).copysign(distance),
    )
}

/// The place in [0, 1]² of a unit vector, which [`square_to_sphere`] takes back to it; some place
/// of the square for what is no unit vector.
///
/// **Error**: of each coordinate, 8 ε.
#[must_use]
pub fn sphere_to_square(w: DVec3) -> [f64; 2] {
    // 1 − |z| of a unit vector, without cancellation next to the poles.
    let r = hypot(w.x, w.y) / (1.0 + w.z.abs()).sqrt();
    let v = r * atan2(w.y.abs(), w.x.abs()) * FRAC_2_PI;
    let u = r - v;
    let [u, v] = if w.z < 0.0 {
        [1.0 - v, 1.0 - u]
    } else {
        [u, v]
    };
    [u.copysign(w.x), v.copysign(w.y)].map(|p| fraction(0.5 * p + 0.5))
}

/// Column and row of the texel of an image of size² texels that stands at a column and a row up to
/// one beyond its border: a side of the square meets itself, turned about its middle, and all
/// corners are one direction.
///
/// What crosses a side is mirrored at the side itself, so that bilinear interpolation is continuous
/// and keeps the mean of the image. (`RemapPixelCoords` of pbrt-v4 mirrors column −1 to 1 in place
/// of 0; its lights look up the nearest texel, which never crosses.)
#[must_use]
pub fn wrap_texel(texel: [isize; 2], size: usize) -> [usize; 2] {
    let last = size.max(1).cast_signed() - 1;
    let [mut x, mut y] = texel;
    if x < 0 || x > last {
        (x, y) = (x.clamp(0, last), last.saturating_sub(y));
    }
    if y < 0 || y > last {
        (x, y) = (last.saturating_sub(x), y.clamp(0, last));
    }
    [x, y].map(|i| i.clamp(0, last).cast_unsigned())
}

//! This module holds the equal-area octahedral map of pbrt-v4, between the sphere of directions and
//! the unit square.
//!
//! The four octants about +z fill the diamond in the middle of the square, each in the quadrant
//! with the signs of its x and y. The octants about −z fill the corners, so that −z is at all four
//! of them. Equal areas of the square are equal solid angles, and the whole square is 4π.
//!
//! ```text
//!   −z───────+y───────−z
//!    │     ╱    ╲     │
//!    │   ╱        ╲   │
//!   −x        +z       +x
//!    │   ╲        ╱   │
//!    │     ╲    ╱     │
//!   −z───────−y───────−z
//! ```
//!
//! **Source**: Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD";
//! `EqualAreaSquareToSphere` and `EqualAreaSphereToSquare` of pbrt-v4. These approximate the
//! trigonometric functions by polynomials; here the functions are called.

use linelit_elementary::{atan2, hypot, sin_cos};
use linelit_geometry::DVec3;
use linelit_geometry::finite::fraction;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_4};

/// Returns the unit vector at a point of the unit square. Coordinates outside [0, 1] are clamped,
/// and coordinates that are not numbers become 0.
///
/// **Error**: 16 ε in each coordinate.
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
    // r is one minus the signed distance from the diamond, computed without loss next to the
    // middle.
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

/// Returns the point of the unit square that belongs to a unit vector: the inverse of
/// [`square_to_sphere`]. A vector that is not a unit vector gives some point of the square.
///
/// **Error**: 8 ε in each coordinate.
#[must_use]
pub fn sphere_to_square(w: DVec3) -> [f64; 2] {
    // r² is 1 − |z| of a unit vector, computed without cancellation next to the poles.
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

/// Returns the column and the row of the texel that continues an octahedral image of size² texels
/// beyond its border, for a column and a row up to one outside. Each side of the square is glued to
/// itself, reversed about its midpoint, and all corners are the same direction.
///
/// Texels beyond a side are mirrored at the side itself, so that bilinear interpolation is
/// continuous and keeps the mean of the image. (`RemapPixelCoords` of pbrt-v4 mirrors column −1 to
/// 1, not to 0; its lights look up the nearest texel, which never crosses the border.)
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

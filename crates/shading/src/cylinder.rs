//! A thin cylinder: a linear light, seen by a diffuse surface.

use crate::ribbon;
use linelit_geometry::{DVec3, predicates::cross};

/// The irradiance of a linear light for each unit of radiance × radius, 1/length: its projected
/// solid angle for each unit of radius.
///
/// **Formula**: 2 h ∫ max(0, n·p)/|p|⁴ dt: a ribbon of width 2R that always faces the shading
/// point, with h the distance of the line.
///
/// **Error**: as [`ribbon::irradiance`].
///
/// **Source**: Nishita et al. 1985; Peters 2021, eqs. 1–3.
#[must_use]
pub fn irradiance(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let length = (p1 - p0).length();
    if length <= 0.0 {
        return 0.0;
    }
    2.0 * (cross(p0, p1).length() / length) * ribbon::irradiance(p0, p1, n)
}

//! The emission of surfaces, and linear lights.

use linelit_geometry::{DVec3, Segment};

/// Emission of a surface light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Emitted radiance in W/(m² sr), linear RGB, the same in all directions of the emitting
    /// side(s).
    pub radiance: DVec3,
    /// Whether both sides emit; otherwise only the side that the normal points to.
    pub two_sided: bool,
}

impl Emission {
    /// One-sided emission of constant radiance in W/(m² sr).
    #[must_use]
    pub const fn one_sided(radiance: DVec3) -> Self {
        Self {
            radiance,
            two_sided: false,
        }
    }

    /// Whether anything is sent to a receiver, where `side` is positive on the side that the normal
    /// points to: not behind a one-sided light, nor in its plane.
    #[inline]
    pub(crate) fn reaches(&self, side: f64) -> bool {
        side > 0.0 || (self.two_sided && side < 0.0)
    }

    /// Radiance towards a receiver, where `side` is positive on the side that the normal points to:
    /// zero behind a one-sided light and in its plane.
    #[must_use]
    #[inline]
    pub fn towards(&self, side: f64) -> DVec3 {
        if self.reaches(side) {
            self.radiance
        } else {
            DVec3::ZERO
        }
    }
}

/// The signed height of `x` over the plane of a light that is about `size` large and has the unit
/// normal `normal` at `at`: zero within `margin` of the distance or the size, and within rounding.
#[inline]
pub(crate) fn height(normal: DVec3, at: DVec3, size: f64, x: DVec3, margin: f64) -> f64 {
    let from = x - at;
    let height = normal.dot(from);
    let reach = from.abs().max_element().max(size);
    // Far above the plane, as most points are, nothing else is looked at.
    if height.abs() > 1e-5 * reach && margin <= 1e-5 {
        return height;
    }
    // Eight roundings of the coordinates, and some of the distance.
    let coordinates = x.abs().max(at.abs()).max_element();
    let rounding = 4.0 * f64::EPSILON * coordinates;
    if height.abs() > margin.max(1e-12) * reach + rounding {
        height
    } else {
        0.0
    }
}

/// A linear light: a Lambertian cylinder whose radius goes to zero while radiance × radius stays
/// finite (Nishita et al. 1985; Peters 2021, §3.1). No surface sample and no ray can ever hit it,
/// so BSDF sampling contributes nothing and its own techniques have the MIS weight 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearLight {
    /// The axis.
    pub segment: Segment,
    /// Radiance times radius in W/(m sr), linear RGB.
    pub radiance_radius: DVec3,
}

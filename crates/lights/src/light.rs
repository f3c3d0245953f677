//! This module holds the emission that all surface lights share, and the linear light.

use linelit_geometry::{DVec3, Segment};

/// The radiance that a surface light emits, and from which of its sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// The emitted radiance in W/(m² sr), linear RGB. It is the same in all directions from a side
    /// that emits.
    pub radiance: DVec3,
    /// Whether both sides emit; otherwise only the side that the normal points to.
    pub two_sided: bool,
}

impl Emission {
    /// Returns one-sided emission of a constant radiance in W/(m² sr).
    #[must_use]
    pub const fn one_sided(radiance: DVec3) -> Self {
        Self {
            radiance,
            two_sided: false,
        }
    }

    /// Whether the light emits towards a receiver, where `side` is positive on the side that the
    /// normal points to. False behind a one-sided light, and in the plane of any light (`side` =
    /// 0).
    #[inline]
    pub(crate) fn reaches(&self, side: f64) -> bool {
        side > 0.0 || (self.two_sided && side < 0.0)
    }

    /// Returns the radiance towards a receiver, where `side` is positive on the side that the
    /// normal points to. The radiance is zero behind a one-sided light, and in the plane of the
    /// light (`side` = 0).
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

/// Returns the signed height of `x` above the plane of a light: the plane passes through `at`,
/// `normal` is its unit normal, and `size` is about the light's size in scene units. Heights within
/// the rounding of the coordinates count as zero, and so do heights up to `margin` times the larger
/// of the distance and the size.
#[inline]
pub(crate) fn height(normal: DVec3, at: DVec3, size: f64, x: DVec3, margin: f64) -> f64 {
    let from = x - at;
    let height = normal.dot(from);
    let reach = from.abs().max_element().max(size);
    // Most points are high above the plane, where no tolerance has to be computed.
    if height.abs() > 1e-5 * reach && margin <= 1e-5 {
        return height;
    }
    // Allow for eight roundings of the coordinates, and for some roundings of the distance.
    let coordinates = x.abs().max(at.abs()).max_element();
    let rounding = 4.0 * f64::EPSILON * coordinates;
    if height.abs() > margin.max(1e-12) * reach + rounding {
        height
    } else {
        0.0
    }
}

/// A linear light: a Lambertian cylinder whose radius goes to zero while radiance × radius stays
/// finite (Nishita et al. 1985; Peters 2021, §3.1). No surface sample and no ray can ever hit a
/// linear light, so BSDF sampling contributes zero, and the techniques of the light have the MIS
/// weight 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearLight {
    /// The axis of the cylinder.
    pub segment: Segment,
    /// The radiance times the radius in W/(m sr), linear RGB.
    pub radiance_radius: DVec3,
}

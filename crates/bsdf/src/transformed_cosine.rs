//! Reflections as sums of linearly transformed cosines.

use crate::{ClosedForm, ClosedLobe, Layers};
use linelit_elementary::exp_m1;
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{DMat3, DVec3, Frame};
use std::f64::consts::{PI, TAU};

/// A lobe of a reflection times the receiver's cosine, as a cosine under a linear map M: about
/// albedo · p(ω) with p(ω) = max(0, c.z)/π |det M⁻¹|/|c|⁴ and c = M⁻¹ω.
///
/// **Source**: Heitz, Dupuy, Hill & Neubelt 2016.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformedCosine {
    /// M, from the cosine's space (its axis is z) to the local frame of the surface (its normal is
    /// z); invertible.
    pub map: DMat3,
    /// About ∫ f cos dω of the lobe over the hemisphere, by channel.
    pub albedo: DVec3,
}

impl TransformedCosine {
    /// p(ω), the density of the lobe in a unit direction of the local frame, per solid angle; it
    /// integrates to one over the sphere. Zero for a map without an inverse.
    #[must_use]
    pub fn density(&self, w: DVec3) -> f64 {
        let inverse = self.map.inverse();
        let c = inverse * w;
        let r2 = c.length_squared();
        nonnegative((c.z.max(0.0) / (r2 * r2)) * inverse.determinant().abs() / PI)
    }

    /// The lobe of a reflection scaled by a colour.
    pub(crate) fn scaled(self, scale: DVec3) -> Self {
        Self {
            albedo: self.albedo * scale,
            ..self
        }
    }
}

/// What a reflection times the receiver's cosine looks like from one direction, as a sum of
/// linearly transformed cosines: the cosine itself, and lobes.
///
/// It is what samples of lights are drawn by and weighed with, so only noise depends on how near it
/// is. It may be zero where the reflection is not: combine it with a technique that is not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformedCosines {
    /// The local frame of the maps: z is the normal.
    pub frame: Frame,
    /// The albedo of what the cosine itself stands for, by channel.
    pub diffuse: DVec3,
    lobes: [TransformedCosine; Self::MAX],
    count: usize,
}

impl TransformedCosines {
    /// The most lobes beside the cosine itself.
    pub const MAX: usize = Layers::MAX;

    /// The cosine itself, in a local frame with the normal as z, and no lobe.
    #[must_use]
    pub const fn new(frame: Frame, diffuse: DVec3) -> Self {
        Self {
            frame,
            diffuse,
            lobes: [TransformedCosine {
                map: DMat3::IDENTITY,
                albedo: DVec3::ZERO,
            }; Self::MAX],
            count: 0,
        }
    }

    /// Adds a lobe, unless it is black; one too many, or one whose map is of no numbers or flat,
    /// counts as the cosine itself.
    pub fn add(&mut self, lobe: TransformedCosine) {
        if lobe.albedo == DVec3::ZERO {
            return;
        }
        let determinant = lobe.map.determinant();
        let usable = determinant.is_finite() && determinant.abs() > 0.0;
        match self.lobes.get_mut(self.count) {
            Some(slot) if usable => {
                *slot = lobe;
                self.count += 1;
            }
            _ => self.diffuse += lobe.albedo,
        }
    }

    /// The lobes beside the cosine itself.
    #[must_use]
    pub fn lobes(&self) -> &[TransformedCosine] {
        &self.lobes[..self.count]
    }
}

impl ClosedForm<'_> {
    /// The diffuse part as the cosine itself, and each lobe.
    #[must_use]
    pub fn transformed_cosines(self, wo: DVec3, n: DVec3) -> TransformedCosines {
        let frame = Frame::from_normal(n);
        let mut sum = TransformedCosines::new(frame, self.diffuse.albedo);
        for lobe in self.lobes(wo, n) {
            sum.add(lobe.transformed_cosine(&frame));
        }
        sum
    }
}

impl ClosedLobe {
    /// The lobe in a local frame: the cosine about its axis, shrunk across it to be as high as the
    /// lobe of the same integral (wider ones stay the cosine), with the albedo that it has but for
    /// what is below the horizon.
    pub(crate) fn transformed_cosine(&self, frame: &Frame) -> TransformedCosine {
        // Its integrals over the sphere, without and (of powers) with the cosine about its axis.
        let (axis, whole, with_cosine) = match self {
            Self::Power { axis, exponent, .. } => {
                (axis, TAU / (exponent + 1.0), TAU / (exponent + 2.0))
            }
            Self::Gaussian {
                axis, sharpness, ..
            } => {
                // Flat ones like the flattest that is told from them.
                let sharpness = sharpness.max(f64::EPSILON);
                let whole = -TAU / sharpness * exp_m1(-2.0 * sharpness);
                (axis, whole, whole.min(PI))
            }
        };
        let axis = frame.to_local(*axis);
        let about = Frame::from_normal(axis);
        let across = (whole / PI).sqrt().min(1.0);
        TransformedCosine {
            map: DMat3::from_cols(about.x * across, about.y * across, about.z),
            albedo: self.scale() * (with_cosine * axis.z.max(0.0)),
        }
    }
}

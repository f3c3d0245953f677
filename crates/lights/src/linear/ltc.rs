//! This module samples a linear light proportionally to a linearly transformed cosine, LTC (Peters
//! 2021, §4.1).

use super::projected::ProjectedLine;
use super::view::LineView;
use super::{LinearSample, view_from};
use crate::LinearPointTechnique;
use crate::density::{Pdf, ThinSolidAngle};
use crate::linear::numbers::Bounds;
use core::f64::consts::PI;
use linelit_geometry::finite::below_one;
use linelit_geometry::{DMat3, DVec3, Segment};

/// Samples a linear light by an LTC, `p_M(ω) = (1/π) max(0, ω_c·z) |M⁻¹|/|M⁻¹ω|³` with `ω_c =
/// M⁻¹ω/|M⁻¹ω|`.
///
/// The ends are clipped at the surface's horizon, transformed by M⁻¹, and clipped again at the
/// horizon of the cosine; there the line is sampled by projected solid angle. M maps straight lines
/// to straight lines and preserves fractions along them, so that the position on the light is the
/// position in cosine space. The radius of the thin cylinder is not preserved: the factor `dR/dR_c
/// = |Mᵀ(s × l₀)|/|s × l₀|` (eq. 5) multiplies the density.
///
/// **Domain**: `m` maps cosine space, in which z is the axis of the cosine, to world space, and
/// must be invertible. The matrices that fit BRDFs are not part of this crate. **Units**: densities
/// in m/sr.
#[derive(Clone, Copy, Debug)]
pub struct LtcSampler {
    line: ProjectedLine,
    /// The line in world space, relative to x.
    start: DVec3,
    edge: DVec3,
    /// The range of the whole light that is above the horizon of the surface.
    above: [f64; 2],
    inverse: DMat3,
    factor: f64,
    /// The factor of the density: |det M⁻¹| over π and the integral. The density is this times the
    /// cosine, over the cubed stretch.
    density: f64,
}

impl LtcSampler {
    /// Sets the technique up for one light and the shading point `x` with the unit normal `normal`.
    /// `None` if no part of the line is above both horizons, if `m` is singular, or if the integral
    /// or its reciprocal is not a number.
    #[must_use]
    pub fn new(light: &Segment, x: DVec3, normal: DVec3, m: DMat3) -> Option<Self> {
        let determinant = m.determinant();
        if !(determinant.abs() > 0.0 && determinant.is_finite()) {
            return None;
        }
        // If an entry is not finite, so is a coordinate of both ends, and there will be no line.
        let inverse = m.inverse();
        let world = view_from(light, x, Some(normal))?;
        let (p0, p1) = world.ends();
        let edge = p1 - p0;
        let across = linelit_geometry::predicates::cross(p0, edge);
        // This is |Mᵀ (s × l₀)|/|s × l₀|; any multiple of s × l₀ will do.
        let factor = (m.transpose() * across).length() / across.length();
        // This is `ProjectedLine::new` in place, so that its arguments need not go through memory.
        let view = LineView::clipped(inverse * p0, inverse * p1, DVec3::Z)?;
        let line = ProjectedLine::of(view)?;
        let mut out = Self {
            line,
            start: p0,
            edge,
            above: world.range(),
            inverse,
            factor,
            density: 0.0,
        };
        let integral = out.integral();
        out.density = 1.0 / (PI * determinant.abs() * integral);
        (out.density.is_usable() && integral.is_usable()).then_some(out)
    }

    /// Returns `∫ p_M dω` over the light, per radius, in 1/m: the estimate of specular shading for
    /// unit radiance × radius, without the magnitude of the LTC.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.line.projected_solid_angle() / (PI * self.factor)
    }

    /// Returns the sample at a position in cosine space, given the cosine there.
    fn at(&self, lambda: f64, cosine: f64) -> LinearSample {
        // Convert from the part above the cosine's horizon to the part above the surface's horizon,
        // and from there to the whole light.
        let place = self.line.view().whole_fraction(lambda);
        let offset = self.start + self.edge * place;
        let direction = offset.normalize_or_zero();
        LinearSample {
            t: self.above[0] * (1.0 - place) + self.above[1] * place,
            offset,
            direction,
            pdf: self.pdf_in(direction, cosine),
        }
    }

    /// Returns the position in the part above the surface's horizon, and the position in cosine
    /// space.
    fn locate(&self, t: f64) -> Option<(f64, f64)> {
        let [a, b] = self.above;
        let place = (t - a) / (b - a);
        let inside = (0.0..=1.0).contains(&place);
        let lambda = self.line.view().clipped_fraction(place)?;
        inside.then_some((place, lambda))
    }

    /// Returns `p_M(ω) / ∫ p_M`, given the cosine in cosine space.
    fn pdf_in(&self, direction: DVec3, cosine: f64) -> Pdf<ThinSolidAngle> {
        let stretch = (self.inverse * direction).length();
        Pdf::new(cosine * self.density / (stretch * stretch * stretch))
    }
}

impl LinearPointTechnique for LtcSampler {
    fn sample(&self, xi: f64) -> LinearSample {
        let (arc, cosine) = self.line.sample_with_cosine(xi);
        self.at(arc.lambda, cosine)
    }

    fn pdf(&self, t: f64) -> Pdf<ThinSolidAngle> {
        self.locate(t).map_or(Pdf::ZERO, |(place, lambda)| {
            let direction = (self.start + self.edge * place).normalize_or_zero();
            self.pdf_in(direction, self.line.view().cosine(lambda))
        })
    }

    fn invert(&self, t: f64) -> Option<f64> {
        let (_, lambda) = self.locate(t)?;
        Some(below_one(self.line.invert(lambda)))
    }
}

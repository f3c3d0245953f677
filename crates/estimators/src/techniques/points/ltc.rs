//! `point-ltc`: points by linearly transformed cosines that look like the reflection.

use super::{DrawPoints, Drawn, LightPoint, PointDensity, Polygon};
use crate::techniques::points::linear::{LinearHeuristic, LinearOptions};
use crate::{EmissionTexture, ShadingPoint};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::finite::below_one;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use linelit_lights::{PointTechnique, SolidAngleSampler, TransformedSampler};
use std::f64::consts::FRAC_1_PI;

/// Lobes that are drawn by: those that reflect the most of the light, others as the cosine.
const KEPT: usize = 2;

/// The least share of samples uniform in the solid angle: bounds weights where the reflection has
/// more than its transformed cosines, which may be zero.
const LEAST_UNIFORM: f64 = 0.1;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ltc;

impl PointDensity for Ltc {
    const NAME: &'static str = "point-ltc";
    const HAS_VISIBILITY: bool = true;
    const ASKS_FOR_COSINES: bool = true;

    type OnPolygon<'t> = Lobes;

    fn on_polygon<T: EmissionTexture>(self, light: &Polygon<'_, T>) -> Option<Lobes> {
        // Nothing is known: the solid angle.
        let uniform = || TransformedCosines::new(Frame::from_normal(light.normal), DVec3::ZERO);
        let cosines = light.cosines.unwrap_or_else(uniform);
        Some(Lobes::new(light.polygon, light.position, &cosines))
    }

    fn on_linear(self) -> LinearOptions {
        LinearOptions::Ltc(LinearHeuristic::default())
    }
}

/// The lobes of a reflection over a polygon, drawn from as one technique.
#[derive(Clone, Debug)]
pub(crate) struct Lobes {
    /// With its share of the samples.
    uniform: (SolidAngleSampler, f64),
    lobes: [Option<(TransformedSampler, f64)>; KEPT],
}

impl Lobes {
    /// Shares in proportion to about what each lobe reflects of the unshadowed light.
    pub(crate) fn new(light: &ConvexPolygon, x: DVec3, cosines: &TransformedCosines) -> Self {
        let frame = &cosines.frame;
        let to_world = DMat3::from_cols(frame.x, frame.y, frame.z);
        let uniform = SolidAngleSampler::new(light, x);
        let cosine = frame.z.dot((light.centroid() - x).normalize_or_zero());
        let mut rest = cosines.diffuse.element_sum() * uniform.solid_angle() * cosine.max(0.0);
        rest *= FRAC_1_PI;
        let mut lobes: [Option<(TransformedSampler, f64)>; KEPT] = [None; KEPT];
        for lobe in cosines.lobes() {
            let Some(sampler) = TransformedSampler::new(light, x, to_world * lobe.map) else {
                continue;
            };
            let part = lobe.albedo.element_sum() * sampler.about_integral();
            let mut next = Some((sampler, part)).filter(|(_, part)| *part > 0.0);
            let size = |slot: &Option<(TransformedSampler, f64)>| slot.map_or(0.0, |(_, p)| p);
            for slot in &mut lobes {
                if size(&next) > size(slot) {
                    std::mem::swap(slot, &mut next);
                }
            }
            rest += size(&next);
        }
        let sum: f64 = lobes.iter().flatten().map(|(_, part)| part).sum();
        let share = (rest / (rest + sum)).max(LEAST_UNIFORM);
        let share = if sum > 0.0 && share <= 1.0 {
            share
        } else {
            1.0
        };
        for (_, part) in lobes.iter_mut().flatten() {
            *part *= (1.0 - share) / sum;
        }
        Self {
            uniform: (uniform, share),
            lobes,
        }
    }

    /// Draws from one of the lobes, for the choice of which `u[0]` is split and rescaled.
    fn point(&self, [mut a, b]: [f64; 2]) -> DVec3 {
        for (lobe, share) in self.lobes.iter().flatten() {
            if a < *share {
                return lobe.sample([below_one(a / share), b]).point;
            }
            a -= share;
        }
        let (uniform, share) = &self.uniform;
        uniform.sample([below_one(a / share), b]).point
    }
}

impl DrawPoints<ConvexPolygon> for Lobes {
    fn draw<R: Reflection>(
        &self,
        u: [f64; 2],
        surface: &ConvexPolygon,
        point: &ShadingPoint<R>,
    ) -> Drawn {
        let at = LightPoint::new(self.point(u), point.position, surface);
        let density = DrawPoints::<ConvexPolygon>::density(self, &at, point);
        Some((at, density))
    }

    /// Of all lobes together.
    fn density<R: Reflection>(&self, at: &LightPoint, _: &ShadingPoint<R>) -> f64 {
        let lobes = self.lobes.iter().flatten();
        let by_lobes: f64 = lobes
            .map(|(lobe, share)| share * lobe.pdf(at.point).value())
            .sum();
        by_lobes + self.uniform.1 * self.uniform.0.pdf(at.point).value()
    }
}

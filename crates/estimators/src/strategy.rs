//! Looking into the shaft towards a light before it is chosen what to do.

use crate::closed_form::without_samples;
use crate::line_sum::{self, Along};
use crate::techniques::integrals::exact::visible_light;
use crate::{
    Buffers, EmissionTexture, Lines, PointBy, Query, SampleBuffers, point_sum, transformed,
};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;
use linelit_visibility::{Shaft, ShaftClass};

/// What is done about a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Strategy {
    /// The closed form over the visible part.
    Exact,
    /// Line samples.
    Lines,
    /// Points that share the shaft.
    Points(PointBy),
    /// Points with a shadow ray each.
    Rays(PointBy),
}

/// Asks for the shaft and follows the strategy that `choose` picks by it, with so many samples in
/// place of one, where the answer needs any.
///
/// What `choose` is told (the candidates, or that there are too many to keep) depends on geometry
/// alone, never on random numbers: whatever it picks, the estimate stays unbiased.
pub(crate) fn through_shaft<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    lines: &Lines,
    buffers: &mut Buffers,
    choose: impl FnOnce(&Shaft<'_>) -> (Strategy, u32),
) -> DVec3 {
    let Buffers { scratch, samples } = &mut *buffers;
    let mut shaft = query.occluders.shaft(query.shaft(&area.polygon), scratch);
    let along = Along::best(query);
    if let Some(value) = without_samples(query, area, shaft.class(), along, &mut samples.plan) {
        return value;
    }
    let (strategy, times) = choose(&shaft);
    let query = &query.times(times);
    if strategy == Strategy::Exact
        && let Some(value) = exact(query, area, along, &mut shaft, samples)
    {
        samples.plan.exact_penumbrae += u64::from(shaft.class() == ShaftClass::Partial);
        return value;
    }
    match strategy {
        Strategy::Points(by) => {
            point_sum::in_shaft(query, area, by, &mut shaft, &mut samples.points)
        }
        Strategy::Rays(by) => point_sum::by_rays(query, area, by, buffers),
        Strategy::Exact | Strategy::Lines => {
            samples.plan.exact_fallbacks += u64::from(strategy == Strategy::Exact);
            line_sum::in_shaft(query, area, lines, along, &mut shaft, samples)
        }
    }
}

/// What is visible in closed form, if it is known and the light has no texture: of the reflection,
/// or of the transformed cosines that it looks like, with points for the difference.
fn exact<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    along: Along<'_>,
    shaft: &mut Shaft<'_>,
    samples: &mut SampleBuffers,
) -> Option<DVec3> {
    match along {
        Along::Analytic(reflection) if reflection.is_diffuse() => {
            let (point, penumbra) = (query.point, &mut samples.penumbra);
            visible_light(area, point, &reflection, shaft, penumbra)
        }
        Along::Point if query.light.texture.is_some() => None,
        Along::Analytic(_) | Along::Point => {
            transformed::visible_light(query, area, shaft, samples)
        }
    }
}

//! Points of a light that is densely occluded, by transformed cosines: by lobes as far as they see
//! the light.

use crate::point_block::BLOCK;
use crate::point_sum::{self, cheapest};
use crate::techniques::points::DrawPoints;
use crate::techniques::points::ltc::Mixture;
use crate::{Buffers, EmissionTexture, PointBy, Query, Stream};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::DVec3;
use linelit_lights::{AreaLight, AreaSampler, PointTechnique, SolidAngleSampler};

/// Of so many samples, one ray along lobes and one elsewhere go ahead: with a half or a fourth as
/// many, small lobes are missed more often, and rays take as long.
const SAMPLES_FOR_RAYS_AHEAD: u32 = 16;

/// The least share of samples that are drawn by lobes, and of others: rays ahead may be wrong.
const LEAST_SHARE: f64 = 0.1;

/// Points of an area light with a shadow ray each, by the transformed cosines that a reflection
/// looks like; uniform where nothing is known of it.
///
/// A lobe may reflect most of the light unshadowed, and yet see nothing of it. So a few rays go
/// ahead, along the lobes and elsewhere; how many of them arrive tells which share of the samples
/// is drawn by lobes. They tell nothing else, and so the estimate stays unbiased.
pub(crate) fn by_rays<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    buffers: &mut Buffers,
) -> DVec3 {
    let (point, light) = (query.point, &area.polygon);
    let by = cheapest(query, area);
    let cosines = point.bsdf.transformed_cosines(point.outgoing, point.normal);
    match (cosines, by) {
        (None, _) => point_sum::by_rays(query, area, by, buffers),
        (Some(cosines), PointBy::Area) => {
            by_lobes_and(AreaSampler::new(light), &cosines, query, area, buffers)
        }
        (Some(cosines), _) => {
            let uniform = SolidAngleSampler::new(light, point.position);
            by_lobes_and(uniform, &cosines, query, area, buffers)
        }
    }
}

/// By lobes, and by what draws uniformly.
fn by_lobes_and<R: Reflection, T: EmissionTexture>(
    uniform: impl PointTechnique + Copy,
    cosines: &TransformedCosines,
    query: &Query<'_, R, T>,
    area: &AreaLight,
    buffers: &mut Buffers,
) -> DVec3 {
    let light = &area.polygon;
    let mixture = Mixture::beside(uniform, light, query.point.position, cosines);
    let unshadowed = mixture.uniform_share();
    if unshadowed >= 1.0 {
        return point_sum::on_surface_by_rays(query, light, &Some(mixture), buffers);
    }
    let count = (query.samples / SAMPLES_FOR_RAYS_AHEAD).min(BLOCK);
    let set = query.numbers.points(Stream::Ahead, count);
    let arrive = [0.0, 1.0].map(|uniformly| {
        let part = mixture.with_uniform_share(uniformly);
        let block = &mut buffers.samples.points;
        block.clear();
        for i in 0..count {
            if let Some((at, density)) = part.draw(set.get_2d(i), light, query.point) {
                block.push(query.unshadowed(&at), density, at.to_light);
            }
        }
        query
            .free(block.targets(), &mut buffers.scratch)
            .count_ones()
    });
    let mixture = mixture.with_uniform_share(uniform_share(unshadowed, arrive, count));
    point_sum::on_surface_by_rays(query, light, &Some(mixture), buffers)
}

/// The share of what draws uniformly, from that of the unshadowed light, and of how many rays along
/// lobes and elsewhere how many arrive.
///
/// Of what is elsewhere, a half at least counts as seen: where hardly any ray arrives, a lobe is
/// as likely as not to see nothing, and the rest of the light is all there is.
fn uniform_share(unshadowed: f64, arrive: [u32; 2], count: u32) -> f64 {
    let seen = |rays: u32| (f64::from(rays) + 0.5) / (f64::from(count) + 1.0);
    let [lobes, elsewhere] = arrive.map(seen);
    let lobes = (1.0 - unshadowed) * lobes;
    let elsewhere = unshadowed * (0.5 + 0.5 * elsewhere);
    (elsewhere / (lobes + elsewhere)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples are drawn by lobes as far as these see the light, and some by either.
    #[test]
    fn lobes_that_see_nothing_get_the_least() {
        // Half a ray of 10,000 is 5e-5 of either part.
        let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-4, "{got} for {want}");
        let many = 10_000;
        // All is seen: as unshadowed.
        for unshadowed in [0.1, 0.25, 0.5, 0.8] {
            close(uniform_share(unshadowed, [many, many], many), unshadowed);
        }
        // A half of each; a lobe alone; all but that; nothing.
        close(uniform_share(0.5, [many / 2, many / 2], many), 0.6);
        close(uniform_share(0.5, [many, 0], many), 1.0 / 3.0);
        close(uniform_share(0.5, [0, many], many), 1.0 - LEAST_SHARE);
        close(uniform_share(0.5, [0, 0], many), 1.0 - LEAST_SHARE);
        // Nothing is known.
        close(uniform_share(0.5, [0, 0], 0), 0.6);
        for unshadowed in [0.0, 1e-300, 1.0 - 1e-16] {
            for arrive in [[0, 0], [0, 64], [64, 0], [64, 64]] {
                let share = uniform_share(unshadowed, arrive, 64);
                assert!((LEAST_SHARE..=1.0 - LEAST_SHARE).contains(&share));
            }
        }
    }
}

//! This module computes the direct light at one shading point.

use crate::choice;
use crate::{Luminaire, Luminaires, SampleNames, Settings, Workspace};
use linelit_bsdf::Reflection;
use linelit_estimators::{Query, RandomNumbers, ShadingPoint, VisibilityBy, estimate};
use linelit_geometry::DVec3;
use linelit_visibility::Occluders;

/// The occluders and the lights of a scene, and how its direct light is estimated.
///
/// Calls for single points and pictures both use this type.
#[derive(Clone, Copy, Debug)]
pub struct Illumination<'a> {
    /// The triangles that may hide lights.
    pub occluders: &'a Occluders,
    /// The lights.
    pub lights: &'a Luminaires,
    /// The estimator and its settings.
    pub settings: Settings<'a>,
}

impl Illumination<'_> {
    /// Estimates the radiance that a surface point reflects to its viewer because of the direct
    /// light of all lights, W/(m² sr) by channel. The estimate is unbiased, and a pure function of
    /// all arguments but the workspace, which only has memory and counters.
    pub fn radiance(
        &self,
        point: &ShadingPoint,
        names: SampleNames,
        workspace: &mut Workspace,
    ) -> DVec3 {
        // Forget cached occluders, so that the counts, too, depend on the arguments alone.
        workspace.buffers.scratch.forget_latest();
        workspace.buffers.counts.plan.points += 1;
        // Skip points on black materials.
        let Settings { skip, samples, .. } = self.settings;
        if skip && point.bsdf.is_black() {
            workspace.buffers.counts.plan.black_materials += 1;
            return DVec3::ZERO;
        }
        // Add the lights that are always sampled; leave out whole groups of them that face away or
        // are below a horizon.
        let (apart, union) = self.lights.split(self.settings.lights);
        let mut sum = DVec3::ZERO;
        let mut add = |lights: &[Luminaire], workspace: &mut Workspace| {
            for light in lights {
                sum += self.one_light(light, samples, point, names, workspace);
            }
        };
        match self.lights.groups(apart.len()).filter(|_| skip) {
            None => add(apart, workspace),
            Some(groups) => {
                let normals = [point.geometric_normal, point.normal];
                let mut left_out = apart.len();
                for range in groups.lighting(point.position, normals) {
                    // Groups are ranges of all lights, and the lights that are always sampled come
                    // first.
                    let lights = &apart[range.start.min(apart.len())..range.end.min(apart.len())];
                    left_out -= lights.len();
                    add(lights, workspace);
                }
                let plan = &mut workspace.buffers.counts.plan;
                plan.point_lights += left_out as u64;
                plan.groups_left_out += left_out as u64;
            }
        }
        if union.is_empty() {
            return sum;
        }
        // Choose one of the other lights for each sample, and divide by the probability of the
        // choice.
        choice::draw(union, self, point, names, workspace);
        let all = f64::from(samples.max(1));
        for k in 0..workspace.drawn.len() {
            let drawn = workspace.drawn[k];
            let names = SampleNames {
                block: drawn.block,
                ..names
            };
            let light = &union[drawn.light];
            let value = self.one_light(light, drawn.count, point, names, workspace);
            sum += value * (f64::from(drawn.count) / (all * drawn.probability));
        }
        sum
    }

    /// The radiance that one light causes to be reflected at the point to the viewer.
    #[inline]
    fn one_light(
        &self,
        light: &Luminaire,
        samples: u32,
        point: &ShadingPoint,
        names: SampleNames,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let settings = &self.settings;
        let (source, buffers) = (light.source(), &mut workspace.buffers);
        // Skip lights that face away or are below the horizon.
        if settings.skip && !source.reaches(point, &mut buffers.counts.plan) {
            return DVec3::ZERO;
        }
        // Estimate the light with random numbers that no other light has.
        let numbers = RandomNumbers {
            sampler: settings.sampler,
            seed: settings.seed,
            pixel: names.pixel,
            pair: (names.path.wrapping_mul(self.lights.indices)).wrapping_add(light.index),
            block: names.block,
        };
        let estimator = light.estimator.as_ref().unwrap_or(settings.estimator);
        let mut query = Query::new(self.occluders, &source, point, estimator, numbers, samples);
        query.margins = light.margins;
        query.skip = settings.skip;
        if !settings.share {
            query.ask = VisibilityBy::Rays;
        }
        estimate(&query, buffers)
    }
}

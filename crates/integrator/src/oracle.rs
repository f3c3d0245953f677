//! The slow way, to judge the fast one by.

use crate::lines::{self, Along, Draws, Streams};
use crate::renderer::first_dimension;
use crate::{LineOptions, Renderer, ShadingPoint};
use linelit_geometry::{DVec3, intervals::Interval};
use linelit_lights::Light;
use linelit_samplers::{Sampler, SamplerKind};
use linelit_visibility::brute;

impl Renderer<'_> {
    /// The direct light of all area lights by `count` stratified lines each, whose visible parts
    /// are found in `f64` by asking every triangle of the scene: no hierarchy, no kernels, no
    /// skips; where the material has a closed form along a line by that, else by a point of each.
    /// For tests and for judging other renderers' images.
    ///
    /// The lines are those that [`Renderer::direct`] draws for the estimator `line-analytic` and the
    /// first camera sample with the sampler `stratified` and the same seed and count, so that
    /// without skips both give the same light up to the rounding of the intervals' ends.
    #[must_use]
    pub fn brute_force(
        &self,
        point: &ShadingPoint,
        pixel: [u32; 2],
        count: u32,
        seed: u64,
    ) -> DVec3 {
        let scene = self.scene();
        let mut sum = DVec3::ZERO;
        let mut draws = Draws::default();
        for light in self.plan().lights() {
            let Light::Area(area) = &*light.light else {
                continue;
            };
            let along = light
                .closed_form(point)
                .map_or(Along::Point, Along::Analytic);
            let dimension = first_dimension(light.index);
            let streams = Streams {
                samples: &Sampler::new(SamplerKind::Stratified, seed)
                    .points(pixel, dimension, count),
                two_dimensional: along == Along::Point,
                orientations: &Sampler::new(SamplerKind::Independent, seed),
                key: (pixel, dimension),
                count,
            };
            draws.draw(area, LineOptions::default(), &streams);
            let parts: Vec<Vec<Interval>> = draws
                .lines
                .iter()
                .map(|line| {
                    let (positions, triangles) = (&scene.positions, &scene.triangles);
                    brute::visible(positions, triangles, point.position, line, &light.triangles)
                })
                .collect();
            let gathered = lines::gather((light, area), point, along, &mut draws, |i| &parts[i]);
            sum += gathered.sum / f64::from(count);
        }
        sum
    }
}

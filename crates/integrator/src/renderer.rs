//! From a pixel to its direct light.

use crate::probe;
use crate::world::World;
use crate::{LightChoice, Plan, PlannedLight, Settings, ShadingPoint, Workspace, selection};
use linelit_bsdf::Reflection;
use linelit_estimators::{Estimator, Queries, Query, RandomNumbers, estimate, streams};
use linelit_geometry::DVec3;
use linelit_samplers::{Block, Sampler};
use linelit_scene::{Projection, Scene};
use linelit_visibility::{Fan, Occluders};
use std::ops::Range;

/// A scene ready to be estimated: occluders built, plan made.
#[derive(Debug)]
pub struct Renderer<'s> {
    world: World<'s>,
    plan: Plan,
}

impl<'s> Renderer<'s> {
    /// Builds the occluders and the plan of a scene, and the smaller copies of its images.
    #[must_use]
    pub fn new(scene: &'s Scene) -> Self {
        let (world, mut plan) = (World::new(scene), Plan::new(scene));
        scene.prepare_textures();
        let occlusion = probe::occlusion(&world, plan.lights());
        plan.set_occlusion(&occlusion);
        Self { world, plan }
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &'s Scene {
        self.world.scene
    }

    /// The plan.
    #[must_use]
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Gives a light, by its number in the scene, an estimator of its own in place of the
    /// settings'; `None` takes it back. A light that the scene does not have is ignored.
    pub fn set_light_estimator(&mut self, light: u32, estimator: Option<Estimator>) {
        self.plan.set_estimator(light, estimator);
    }

    /// Samples a light, by its number in the scene, for itself with all samples, where one of the
    /// others is picked for each ([`LightChoice`]); or puts it back among them.
    ///
    /// For lights that are bright and mostly hidden, which no choice knows: a sun behind shutters
    /// would take nearly all samples from the lamps of a room (Shirley & Wang 1991, section 5). A
    /// light that the scene does not have is ignored.
    pub fn set_light_apart(&mut self, light: u32, is_apart: bool) {
        self.plan.set_apart(light, is_apart);
    }

    /// What camera rays meet: the triangles of the scene by their numbers.
    #[must_use]
    pub const fn occluders(&self) -> &Occluders {
        self.world.views()
    }

    /// What hides lights: the same, but for holes to lights alone and what casts no shadow.
    #[must_use]
    pub const fn light_occluders(&self) -> &Occluders {
        self.world.hiding()
    }

    /// The radiance of a pixel, W/(m²·sr), linear RGB, times the scale of the scene's film. A pure
    /// function of the settings and the pixel.
    ///
    /// Of n samples in a pixel each sees textures over 1/√n of its width and height, as in pbrt-v3:
    /// together they cover it once, and what many samples converge to has no blur but the film's.
    /// (pbrt-v4 keeps an eighth of the pixel from 64 samples on.)
    #[must_use]
    pub fn pixel(&self, settings: &Settings, pixel: [u32; 2], workspace: &mut Workspace) -> DVec3 {
        self.pixel_samples(settings, pixel, workspace, |_| {})
    }

    /// [`Renderer::pixel`], which tells `each` the radiance of every camera sample: of a film's
    /// moments, for one. Samples are spread evenly over the pixel, so that the variance of their
    /// mean is less than what they, as if independent, say.
    pub fn pixel_samples(
        &self,
        settings: &Settings,
        pixel: [u32; 2],
        workspace: &mut Workspace,
        mut each: impl FnMut(DVec3),
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for block in settings.sample_blocks() {
            sum += self.pixel_block(settings, pixel, block, workspace, &mut each);
        }
        sum / f64::from(settings.pixel_samples.max(1))
    }

    /// The sum of the radiance of some camera samples of a pixel, one of
    /// [`Settings::sample_blocks`]. Who adds the blocks of a pixel in their order, and divides by
    /// the number of samples, has [`Renderer::pixel`] to the bit, whoever computed them.
    pub fn pixel_block(
        &self,
        settings: &Settings,
        pixel: [u32; 2],
        block: Range<u32>,
        workspace: &mut Workspace,
        mut each: impl FnMut(DVec3),
    ) -> DVec3 {
        let count = settings.pixel_samples.max(1);
        let camera = (count > 1).then(|| {
            let sampler = Sampler::new(settings.sampler, settings.seed);
            sampler.points(pixel, streams::CAMERA, count)
        });
        let spacing = f64::from(count).sqrt().recip();
        let mut sum = DVec3::ZERO;
        for i in block {
            let jitter = camera
                .as_ref()
                .map_or([0.5, 0.5], |camera| camera.get_2d(i));
            let offset = self.film_offset(jitter);
            // By reference: points are large, and a move is a copy.
            let mut sample = DVec3::ZERO;
            if let Some(point) = &self
                .world
                .shading_point_at(pixel, offset, spacing, workspace)
            {
                let streams = Streams {
                    pixel,
                    path: 0,
                    block: Block::new(i, count),
                };
                sample = self.shown(settings, streams, point, workspace);
                sum += sample;
            }
            each(sample);
        }
        sum
    }

    /// The radiance of neighbouring pixels of a row, from `first` on to the right, in place of what
    /// `out` holds: as [`Renderer::pixel`] for one after the other, but that their camera rays are
    /// traced together ([`Occluders::closest_hits`]) where each has one, and one place is where all
    /// begin.
    pub fn row(
        &self,
        settings: &Settings,
        first: [u32; 2],
        out: &mut [DVec3],
        workspace: &mut Workspace,
    ) {
        let [mut x, y] = first;
        let camera = &self.scene().camera;
        let one_place = matches!(camera.projection(), Projection::Perspective { .. });
        if settings.pixel_samples > 1 || !one_place {
            for value in out {
                *value = self.pixel(settings, [x, y], workspace);
                x = x.wrapping_add(1);
            }
            return;
        }
        let [dx, dy] = self.film_offset([0.5, 0.5]);
        let at = |x: u32| [f64::from(x) + dx, f64::from(y) + dy];
        let mut directions = [DVec3::ZERO; 8];
        for out in out.chunks_mut(8) {
            let mut origin = DVec3::ZERO;
            let mut next = x;
            for direction in &mut directions[..out.len()] {
                let [x, y] = at(next);
                let ray = camera.ray(x, y);
                (origin, *direction) = (ray.origin, ray.direction);
                next = next.wrapping_add(1);
            }
            let fan = Fan {
                origin,
                directions: &directions[..out.len()],
                t_min: 0.0,
                t_max: f64::INFINITY,
            };
            let Workspace { buffers, hits, .. } = &mut *workspace;
            self.occluders()
                .closest_hits(&fan, hits, &mut buffers.scratch);
            for (i, value) in out.iter_mut().enumerate() {
                *value = match workspace.hits[i] {
                    None => DVec3::ZERO,
                    Some(hit) => {
                        let point = &self.world.seen_at(at(x), &hit, directions[i], 1.0);
                        let streams = Streams {
                            pixel: [x, y],
                            path: 0,
                            block: Block::WHOLE,
                        };
                        self.shown(settings, streams, point, workspace)
                    }
                };
                x = x.wrapping_add(1);
            }
        }
    }

    /// What a camera ray brings from a point.
    fn shown(
        &self,
        settings: &Settings,
        mut streams: Streams,
        point: &ShadingPoint,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let emitted = if settings.show_lights {
            point.emitted
        } else {
            DVec3::ZERO
        };
        let reflected = self.reflected(settings, &mut streams, point, settings.bounces, workspace);
        (emitted + reflected) * self.scene().film.scale
    }

    /// Direct light, and what perfect mirrors and glass show.
    fn reflected(
        &self,
        settings: &Settings,
        streams: &mut Streams,
        point: &ShadingPoint,
        bounces: u32,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let mut sum = self.direct_by(settings, point, *streams, workspace);
        if bounces == 0 {
            return sum;
        }
        for bounce in &point.bounces {
            streams.path = streams.path.wrapping_add(1);
            if let Some(next) = &self.world.follow(point, bounce, workspace) {
                let reflected = self.reflected(settings, streams, next, bounces - 1, workspace);
                sum += bounce.weight * (next.emitted + reflected);
            }
        }
        sum
    }

    /// The point at which the camera ray through the centre of a pixel meets the scene.
    #[must_use]
    pub fn shading_point(
        &self,
        pixel: [u32; 2],
        workspace: &mut Workspace,
    ) -> Option<ShadingPoint> {
        self.world.shading_point(pixel, workspace)
    }

    /// Offset of a camera sample in the pixel's filter, uniform over the filter's support.
    fn film_offset(&self, jitter: [f64; 2]) -> [f64; 2] {
        let radius = self.scene().film.filter_radius;
        [0, 1].map(|i| 0.5 + (2.0 * jitter[i] - 1.0) * radius[i])
    }

    /// The light that all lights of the scene send directly from `point` to its viewer,
    /// W/(m²·sr).
    ///
    /// `pixel` and `repetition` name the random numbers: the index of the camera sample, each of
    /// which takes its part of the patterns of the pixel's [`Settings::pixel_samples`]; past that
    /// number, the same of the next shading point of a path.
    #[must_use]
    pub fn direct(
        &self,
        settings: &Settings,
        point: &ShadingPoint,
        pixel: [u32; 2],
        repetition: u32,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let count = settings.pixel_samples.max(1);
        let streams = Streams {
            pixel,
            path: repetition / count,
            block: Block::new(repetition, count),
        };
        self.direct_by(settings, point, streams, workspace)
    }

    fn direct_by(
        &self,
        settings: &Settings,
        point: &ShadingPoint,
        streams: Streams,
        workspace: &mut Workspace,
    ) -> DVec3 {
        // What is counted is then a function of the arguments, as the radiance is.
        workspace.buffers.scratch.forget_latest();
        workspace.buffers.samples.plan.points += 1;
        if settings.skip && point.bsdf.is_black() {
            workspace.buffers.samples.plan.black_materials += 1;
            return DVec3::ZERO;
        }
        let set = self.plan.set_of(settings.spheres);
        let (mut apart, mut union) = set.split();
        if settings.lights == LightChoice::All {
            (apart, union) = (self.plan.lights_of(settings.spheres), &[]);
        }
        let mut sum = DVec3::ZERO;
        for light in apart {
            sum += self.one_light(settings, light, point, streams, workspace);
        }
        if union.is_empty() {
            return sum;
        }
        selection::draw(union, &set.tables, settings, point, streams, workspace);
        let all = f64::from(settings.samples.max(1));
        for k in 0..workspace.drawn.len() {
            let drawn = workspace.drawn[k];
            let settings = Settings {
                samples: drawn.count,
                ..*settings
            };
            let streams = Streams {
                block: drawn.block,
                ..streams
            };
            let light = &union[drawn.light];
            let value = self.one_light(&settings, light, point, streams, workspace);
            sum += value * (f64::from(drawn.count) / (all * drawn.probability));
        }
        sum
    }

    /// Radiance that one light sends from `point` to the viewer.
    fn one_light(
        &self,
        settings: &Settings,
        light: &PlannedLight,
        point: &ShadingPoint,
        streams: Streams,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let source = light.source();
        let buffers = &mut workspace.buffers;
        if settings.skip && !source.reaches(point, &mut buffers.samples.plan) {
            return DVec3::ZERO;
        }
        let total = u32::try_from(self.scene().lights.len()).unwrap_or(u32::MAX);
        let numbers = RandomNumbers {
            sampler: settings.sampler,
            seed: settings.seed,
            pixel: streams.pixel,
            pair: (streams.path.wrapping_mul(total)).wrapping_add(light.index),
            block: streams.block,
        };
        let estimator = light.estimator.as_ref().unwrap_or(&settings.estimator);
        let (occluders, samples) = (self.light_occluders(), settings.samples);
        let mut query = Query::new(occluders, &source, point, estimator, numbers, samples);
        query.skip = settings.skip;
        if !settings.share {
            query.queries = Queries::SeparateRays;
        }
        estimate(&query, buffers)
    }
}

/// The names of the random numbers of a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Streams {
    pub pixel: [u32; 2],
    /// The number of the shading point on the path of perfect reflections of a camera sample.
    pub path: u32,
    /// The part of the pixel's patterns that the camera sample takes.
    pub block: Block,
}

//! The renderer computes the radiance of pixels, from camera rays to the direct light of the
//! surfaces that they meet.

use crate::probe::{RAYS, grid};
use crate::world::World;
use crate::{Plan, Settings, ShadingPoint, Workspace};
use linelit_direct::{Illumination, SampleNames, needs_occlusion, needs_shafts, probe};
use linelit_estimators::{Estimator, streams};
use linelit_geometry::{DVec3, stop};
use linelit_samplers::{Block, Sampler};
use linelit_scene::{Projection, SceneDescription};
use linelit_visibility::{Fan, Occluders};
use std::ops::Range;

/// A scene that is ready to be rendered: its occluders are built and its lights are planned.
#[derive(Debug)]
pub struct Renderer<'s> {
    pub(crate) world: World<'s>,
    plan: Plan,
}

impl<'s> Renderer<'s> {
    /// Prepares a scene for any estimator: builds its occluders and the mipmaps of its images, and
    /// plans its lights.
    #[must_use]
    pub fn new(scene: &'s SceneDescription) -> Self {
        Self::for_estimators(scene, [&Estimator::hybrid()])
    }

    /// Prepares a scene for some estimators, which should include the estimators of single lights.
    /// If all of them query visibility by shadow rays alone (`point-area`), the parts of the
    /// hierarchy that only shafts need are left out. If none of them has lines, lights are not
    /// probed. The estimates are those of [`Renderer::new`], to the bit. Other estimators may take
    /// longer and choose other methods.
    #[must_use]
    pub fn for_estimators<'e>(
        scene: &'s SceneDescription,
        estimators: impl IntoIterator<Item = &'e Estimator>,
    ) -> Self {
        // Build the occluders.
        let (mut shafts, mut occlusion) = (false, false);
        for estimator in estimators {
            shafts |= needs_shafts(estimator);
            occlusion |= needs_occlusion(estimator);
        }
        let world = World::new(scene, !shafts);
        scene.prepare_textures();
        // Probe the lights from the points that a grid of camera rays meets, and plan them.
        let mut workspace = Workspace::new();
        let points = match occlusion {
            true => [RAYS, 2 * RAYS].map(|rays| grid(&world, rays, &mut workspace)),
            false => Default::default(),
        };
        let points = points.map(|points| points.into_iter().map(|p| p.shading).collect::<Vec<_>>());
        let plan = Plan::new(scene, |lights| {
            probe(
                &world.shadows,
                lights,
                points.each_ref().map(Vec::as_slice),
                &mut workspace.direct,
            );
        });
        Self { world, plan }
    }

    /// The scene that is rendered.
    #[must_use]
    pub const fn scene(&self) -> &'s SceneDescription {
        self.world.scene
    }

    /// The plan of the scene's lights.
    #[must_use]
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Gives a light, by its number in the scene, an estimator of its own, which replaces the
    /// estimator of the settings; `None` removes it. A round shape has the number of its first
    /// facet. Returns whether a light that emits has this number; if not, nothing changes.
    pub fn set_light_estimator(&mut self, light: u32, estimator: Option<Estimator>) -> bool {
        self.plan
            .change(light, |planned| planned.estimator = estimator)
    }

    /// Chooses whether a light, by its number in the scene, always gets all samples, even if one of
    /// the other lights is chosen at random for each sample ([`LightChoice`](crate::LightChoice)).
    ///
    /// This is for lights that are bright and mostly hidden, since no choice of lights knows the
    /// occluders: a sun behind shutters would take nearly all samples from the lamps of a room
    /// (Shirley & Wang 1991, section 5). Returns whether a light that emits has this number; if
    /// not, nothing changes.
    pub fn set_light_apart(&mut self, light: u32, is_apart: bool) -> bool {
        self.plan
            .change(light, |planned| planned.is_apart = is_apart)
    }

    /// The triangles of the scene, by their numbers, as camera rays meet them. Shadow rays may meet
    /// fewer of them.
    #[must_use]
    pub const fn occluders(&self) -> &Occluders {
        &self.world.views
    }

    /// Computes the radiance of a pixel, W/(m²·sr), in linear RGB, times the scale of the scene's
    /// film. It is a pure function of the settings and the pixel.
    ///
    /// If a pixel has n samples, each of them filters textures over 1/√n of the pixel's width and
    /// height, as in pbrt-v3. Together the samples cover the pixel once, so that the limit of many
    /// samples has no blur but the film's. (pbrt-v4 keeps an eighth of the pixel from 64 samples
    /// on.)
    #[must_use]
    pub fn pixel(&self, settings: &Settings, pixel: [u32; 2], workspace: &mut Workspace) -> DVec3 {
        let block = |block| self.pixel_block(settings, pixel, block, workspace, |_| {});
        let sum: DVec3 = settings.sample_blocks().map(block).sum();
        sum / f64::from(settings.pixel_samples.max(1))
    }

    /// Computes the sum of the radiance of some camera samples of a pixel, which are one of
    /// [`Settings::sample_blocks`]; `each` gets the radiance of every sample. The sum over the
    /// blocks of a pixel in their order, divided by the number of samples, is [`Renderer::pixel`]
    /// to the bit, no matter where the blocks were computed.
    ///
    /// The samples are spread evenly over the pixel. Hence the variance of their mean is less than
    /// one would estimate from them if they were independent.
    pub fn pixel_block(
        &self,
        settings: &Settings,
        pixel: [u32; 2],
        block: Range<u32>,
        workspace: &mut Workspace,
        mut each: impl FnMut(DVec3),
    ) -> DVec3 {
        // Choose the positions of the camera samples in the filter.
        let count = settings.pixel_samples.max(1);
        let sampler = Sampler::new(settings.sampler, settings.seed);
        let jitter = (count > 1).then(|| sampler.points(pixel, streams::CAMERA, count));
        let samples = block.map(|i| {
            let jitter = jitter.as_ref().map_or([0.5, 0.5], |set| set.get_2d(i));
            self.camera_sample(pixel, i, jitter)
        });
        // Add up their radiance.
        let mut sum = DVec3::ZERO;
        self.see(settings, samples, workspace, |radiance| {
            sum += radiance;
            each(radiance);
        });
        sum
    }

    /// Computes the radiance of neighbouring pixels of a row, from `first` to the right, and writes
    /// it to `out`. The values are those of [`Renderer::pixel`]; if pixels have one camera sample
    /// each, their camera rays are traced together.
    pub fn row(
        &self,
        settings: &Settings,
        first: [u32; 2],
        out: &mut [DVec3],
        workspace: &mut Workspace,
    ) {
        let pixels = (0..).map(|k| [first[0].wrapping_add(k), first[1]]);
        if settings.pixel_samples > 1 {
            for (value, pixel) in out.iter_mut().zip(pixels) {
                *value = self.pixel(settings, pixel, workspace);
            }
            return;
        }
        let pixels = pixels.take(out.len());
        let samples = pixels.map(|pixel| self.camera_sample(pixel, 0, [0.5, 0.5]));
        let mut values = out.iter_mut();
        self.see(settings, samples, workspace, |radiance| {
            if let Some(value) = values.next() {
                *value = radiance;
            }
        });
    }

    /// The camera sample at a position in the pixel's filter. For uniform `jitter` in [0, 1]² the
    /// position is uniform over the filter's support.
    fn camera_sample(&self, pixel: [u32; 2], index: u32, jitter: [f64; 2]) -> CameraSample {
        let radius = self.scene().film.filter_radius;
        let at = [0, 1].map(|i| {
            let offset = 0.5 + (2.0 * jitter[i] - 1.0) * radius[i];
            f64::from(pixel[i]) + offset
        });
        CameraSample { pixel, index, at }
    }

    /// Calls `each` with the radiance of each camera sample, in order. Up to eight camera rays with
    /// the same origin are traced together ([`Occluders::closest_hits`]).
    fn see(
        &self,
        settings: &Settings,
        mut samples: impl Iterator<Item = CameraSample>,
        workspace: &mut Workspace,
        mut each: impl FnMut(DVec3),
    ) {
        let camera = &self.scene().camera;
        let one_place = matches!(camera.projection(), Projection::Perspective { .. });
        let count = settings.pixel_samples.max(1);
        let spacing = f64::from(count).sqrt().recip();
        let mut together = [CameraSample::default(); 8];
        let mut directions = [DVec3::ZERO; 8];
        loop {
            stop::check();
            // Collect camera rays with the same origin.
            let (mut found, mut origin) = (0, DVec3::ZERO);
            for sample in samples.by_ref().take(if one_place { 8 } else { 1 }) {
                let ray = camera.ray(sample.at[0], sample.at[1]);
                (origin, directions[found], together[found]) = (ray.origin, ray.direction, sample);
                found += 1;
            }
            if found == 0 {
                return;
            }
            // Trace them together.
            let fan = Fan {
                origin,
                directions: &directions[..found],
                t_min: 0.0,
                t_max: f64::INFINITY,
            };
            let Workspace { direct, hits } = &mut *workspace;
            (self.world.views).closest_hits(&fan, hits, &mut direct.buffers.scratch);
            // Find the radiance of each: of the sky, or of the surface that the ray meets.
            for (k, CameraSample { pixel, index, at }) in together[..found].iter().enumerate() {
                let Some(hit) = workspace.hits[k] else {
                    let sky = match settings.show_lights {
                        true => self.world.sky(origin, directions[k].normalize_or_zero()),
                        false => DVec3::ZERO,
                    };
                    each(sky * self.scene().film.scale);
                    continue;
                };
                let point = &self.world.seen_at(*at, &hit, directions[k], spacing);
                let names = SampleNames {
                    pixel: *pixel,
                    path: 0,
                    block: Block::new(*index, count),
                };
                each(self.shown(settings, names, point, workspace));
            }
        }
    }

    /// The radiance that a camera ray sees at a point of a surface, times the scale of the film.
    fn shown(
        &self,
        settings: &Settings,
        mut names: SampleNames,
        point: &ShadingPoint,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let emitted = if settings.show_lights {
            point.emitted
        } else {
            DVec3::ZERO
        };
        let bounces = settings.bounces.min(Settings::MOST_BOUNCES);
        let reflected = self.reflected(settings, &mut names, point, bounces, workspace);
        (emitted + reflected) * self.scene().film.scale
    }

    /// The direct light of a point, plus the light that perfect mirrors and glass show there. Each
    /// bounce has random numbers of its own.
    fn reflected(
        &self,
        settings: &Settings,
        names: &mut SampleNames,
        point: &ShadingPoint,
        bounces: u32,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let mut sum = self.direct_by(settings, point, *names, workspace);
        if bounces == 0 {
            return sum;
        }
        // Follow the reflected and the refracted view.
        for bounce in &point.bounces {
            names.path = names.path.wrapping_add(1);
            if let Some(next) = &self.world.follow(point, bounce, workspace) {
                let reflected = self.reflected(settings, names, next, bounces - 1, workspace);
                sum += bounce.weight * (next.emitted + reflected);
            } else {
                sum += bounce.weight * self.world.sky(point.position, bounce.direction);
            }
        }
        sum
    }

    /// The point at which the camera ray through the centre of a pixel meets the scene; `None` if
    /// it meets nothing.
    #[must_use]
    pub fn shading_point(
        &self,
        pixel: [u32; 2],
        workspace: &mut Workspace,
    ) -> Option<ShadingPoint> {
        self.world.shading_point(pixel, workspace)
    }

    /// Estimates the direct light that `point` reflects to its viewer from all lights of the scene,
    /// W/(m²·sr). `pixel` selects the random numbers, which are those of its first camera sample.
    #[must_use]
    pub fn direct(
        &self,
        settings: &Settings,
        point: &ShadingPoint,
        pixel: [u32; 2],
        workspace: &mut Workspace,
    ) -> DVec3 {
        let names = SampleNames {
            pixel,
            path: 0,
            block: Block::new(0, settings.pixel_samples),
        };
        self.direct_by(settings, point, names, workspace)
    }

    /// The direct light of a point, with the random numbers of these names.
    fn direct_by(
        &self,
        settings: &Settings,
        point: &ShadingPoint,
        names: SampleNames,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let illumination = Illumination {
            occluders: &self.world.shadows,
            lights: self.plan.set_of(settings.spheres),
            settings: settings.direct(),
        };
        illumination.radiance(point, names, &mut workspace.direct)
    }
}

/// A camera sample: its pixel, its index in the pixel, and its position on the film.
#[derive(Clone, Copy, Debug, Default)]
struct CameraSample {
    pixel: [u32; 2],
    index: u32,
    at: [f64; 2],
}

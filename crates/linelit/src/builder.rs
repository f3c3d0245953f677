//! Scenes from slices.

use crate::{Error, Scene};
use linelit_direct::Luminaire;
use linelit_estimators::{Estimator, MOST_SAMPLES};
use linelit_geometry::{DVec3, Margins, Vector3};
use linelit_lights::{Light, Profile, Sphere};
use linelit_samplers::SamplerKind;
use linelit_visibility::{BuildOptions, Occluders};
use std::ops::Range;
use std::sync::Arc;

/// The largest coordinate of vertices, lights and points.
pub(crate) const LARGEST: f64 = (1_u64 << 60) as f64;

/// The settings of a scene's queries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    pub estimator: Estimator,
    pub sampler: SamplerKind,
    pub samples: u32,
    pub seed: u64,
    pub offset: Option<f64>,
    /// If none are set, each light has those that its own triangles need.
    pub margins: Option<Margins>,
}

/// Builds a [`Scene`] from slices of vertices and triangles, lights and settings.
#[derive(Clone, Debug)]
#[must_use]
pub struct SceneBuilder<'a, V = [f32; 3]> {
    positions: &'a [V],
    triangles: &'a [[u32; 3]],
    lights: Vec<Luminaire>,
    settings: Settings,
    /// Whether a profile came before all lights.
    has_stray_profile: bool,
}

impl<'a, V: Vector3 + Copy + Sync> SceneBuilder<'a, V> {
    pub(crate) fn new(positions: &'a [V], triangles: &'a [[u32; 3]]) -> Self {
        let settings = Settings {
            estimator: Estimator::hybrid(),
            sampler: SamplerKind::Auto,
            samples: 16,
            seed: 0,
            offset: None,
            margins: None,
        };
        Self {
            positions,
            triangles,
            lights: Vec::new(),
            settings,
            has_stray_profile: false,
        }
    }

    /// Adds a light; the first has number 0. Lights hide nothing by themselves.
    ///
    /// A light may be a part of the mesh, or lie in a triangle of it, as a lamp in a ceiling does.
    /// Rounded to `f32`, such triangles may be in front of the light. Those that lie in a polygon
    /// or a disk are taken for its own, which do not hide it, if their numbers follow each other;
    /// for others that are as close to its plane, nothing hides it in the last millionth of the way
    /// ([`Margins::DEFAULT`]). Elsewhere occluders hide it up to where they touch it
    /// ([`Margins::ROUNDING`]).
    pub fn light(self, light: impl Into<Light>) -> Self {
        self.light_of(light, 0..0)
    }

    /// Adds a light whose own triangles, by their numbers, do not hide it: of any shape, and also
    /// where its triangles are not in its plane, as those of a sphere.
    pub fn light_of(mut self, light: impl Into<Light>, triangles: Range<u32>) -> Self {
        let index = u32::try_from(self.lights.len()).unwrap_or(u32::MAX);
        self.lights.push(Luminaire {
            triangles,
            ..Luminaire::new(index, Arc::new(light.into()))
        });
        self
    }

    /// Has the light that was added last emit by a profile, about the normal of the side that
    /// emits. It is for polygons, disks, spheres and cylinders; others are refused by
    /// [`SceneBuilder::build`], for points hold their own.
    pub fn profile(mut self, profile: Arc<Profile>) -> Self {
        match self.lights.last_mut() {
            Some(last) => last.profile = Some(profile),
            None => self.has_stray_profile = true,
        }
        self
    }

    /// The estimator; [`Estimator::hybrid`] if none is set. [`Estimator::exact`] gives irradiance
    /// without noise, and is refused for lights where it would have some ([`Error::NotExact`]).
    pub const fn method(mut self, estimator: Estimator) -> Self {
        self.settings.estimator = estimator;
        self
    }

    /// The number of samples for each point and light: 16 if none is set. 0 counts as 1, and more
    /// than [`MOST_SAMPLES`](crate::estimators::MOST_SAMPLES) are refused by
    /// [`SceneBuilder::build`]. What has a closed form takes none.
    pub const fn samples(mut self, samples: u32) -> Self {
        self.settings.samples = if samples == 0 { 1 } else { samples };
        self
    }

    /// The sampling pattern.
    pub const fn sampler(mut self, sampler: SamplerKind) -> Self {
        self.settings.sampler = sampler;
        self
    }

    /// The seed, any number; two seeds give independent estimates.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// The distance by which `irradiance` and `radiance` lift points off their surface, along the
    /// normal. If none is set it is 2⁻⁴⁶ of the point's largest coordinate, which is for points
    /// computed in `f64`: points computed in `f32` on slanted triangles need some 10⁻⁶ of the
    /// coordinates, or the triangle may hide the light from its own points. From 0 on and below
    /// 2⁶⁰. Where vertices in `f64` were rounded, and a triangle is above the point by no more than
    /// twice what that moved one, it is as much more.
    pub const fn surface_offset(mut self, offset: f64) -> Self {
        self.settings.offset = Some(offset);
        self
    }

    /// The distances from a point and from a light within which triangles hide nothing, as
    /// fractions of the way, from 0 on and below 1, for all lights; if none are set, each light has
    /// those that [`SceneBuilder::light`] says.
    pub const fn margins(mut self, margins: Margins) -> Self {
        self.settings.margins = Some(margins);
        self
    }

    /// Checks everything and builds the hierarchy on all threads of the rayon pool. For `hybrid`
    /// and lines it sends queries from points on the triangles to the polygons among the first 16
    /// lights, which decide on methods and directions. ([`Scene::prepare`] takes other points.)
    ///
    /// # Errors
    /// The first setting, vertex, triangle or light that is not valid. Triangles without area are
    /// valid, and hide nothing. No triangles at all hide nothing, and no lights give no light.
    pub fn build(self) -> Result<Scene, Error> {
        let Self {
            positions,
            triangles,
            lights,
            settings,
            has_stray_profile,
        } = self;
        if has_stray_profile {
            return Err(Error::Profile(0));
        }
        let Margins { point, light } = settings.margins.unwrap_or_default();
        let offset = settings.offset.unwrap_or(0.0);
        let are_shares = [point, light].iter().all(|m| (0.0..1.0).contains(m));
        if !are_shares || !(0.0..LARGEST).contains(&offset) {
            return Err(Error::Setting);
        }
        check_samples(settings.samples)?;
        let is_valid = |p: &V| p.dvec3().abs().cmple(DVec3::splat(LARGEST)).all();
        if let Some(i) = positions.iter().position(|p| !is_valid(p)) {
            return Err(Error::Vertex(i));
        }
        let exists = |&vertex: &u32| (vertex as usize) < positions.len();
        for (i, triangle) in triangles.iter().enumerate() {
            if let Some(&vertex) = triangle.iter().find(|v| !exists(v)) {
                return Err(Error::Triangle {
                    triangle: i,
                    vertex,
                    vertices: positions.len(),
                });
            }
        }
        let mut scene = Scene {
            occluders: Occluders::build_with(positions, triangles, BuildOptions::default()),
            triangles: triangles.len(),
            ball: ball_around(positions, triangles),
            places: Arc::default(),
            lights: Arc::default(),
            settings,
        };
        scene.places = Arc::new(scene.places_on(positions, triangles));
        scene.set_lights(lights)?;
        Ok(scene)
    }
}

/// Refuses more samples than memory is for.
pub(crate) const fn check_samples(samples: u32) -> Result<(), Error> {
    match samples <= MOST_SAMPLES {
        true => Ok(()),
        false => Err(Error::Samples(samples)),
    }
}

/// The smallest ball around the box around all triangles.
fn ball_around<V: Vector3 + Copy>(positions: &[V], triangles: &[[u32; 3]]) -> Sphere {
    let used = triangles.iter().flatten();
    let mut all = used.map(|k| positions[*k as usize].dvec3());
    let first = all.next().unwrap_or(DVec3::ZERO);
    let (low, high) = all.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
    let center = 0.5 * (low + high);
    Sphere {
        center,
        radius: center.distance(high),
    }
}

//! The builder of a scene: it takes slices of vertices and triangles, lights and settings, checks
//! all of them, and builds the hierarchy. One comes here through [`Scene::builder`].

use crate::{Error, Scene};
use linelit_direct::Luminaire;
use linelit_estimators::{Estimator, MOST_SAMPLES};
use linelit_geometry::{DVec3, Margins, Vector3};
use linelit_lights::{Light, Profile, Sphere};
use linelit_samplers::SamplerKind;
use linelit_visibility::{BuildOptions, Occluders};
use std::ops::Range;
use std::sync::Arc;

/// The largest absolute coordinate that vertices, lights and points may have: 2⁶⁰. Larger
/// coordinates are refused.
pub(crate) const LARGEST: f64 = (1_u64 << 60) as f64;

/// The settings that all queries of a scene share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    pub estimator: Estimator,
    pub sampler: SamplerKind,
    pub samples: u32,
    pub seed: u64,
    pub offset: Option<f64>,
    /// The margins of all lights; if none are set, each light has the margins that the triangles
    /// in its plane need.
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
    /// Whether a profile was given before any light.
    has_stray_profile: bool,
}

impl<'a, V: Vector3 + Copy + Sync> SceneBuilder<'a, V> {
    /// Creates a builder of a scene with these triangles and the default settings.
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

    /// Adds a light. The index of a light is its position in the order in which lights are added,
    /// from 0. A light is no occluder: only triangles cast shadows.
    ///
    /// A light may be a part of the mesh, or lie in one of its triangles, as a lamp in a ceiling
    /// does. Rounding to `f32` may move such triangles in front of the light, where they would hide
    /// it. Triangles that lie in a polygon or a disk therefore count as its own and do not hide it,
    /// if their indices are consecutive. If other triangles are as close to its plane, occluders
    /// within the last millionth of the way to the light are left out ([`Margins::DEFAULT`]).
    /// Otherwise occluders hide the light up to where they touch it ([`Margins::ROUNDING`]).
    pub fn light(self, light: impl Into<Light>) -> Self {
        self.light_of(light, 0..0)
    }

    /// Adds a light together with the range of the triangles that are its own and do not hide it.
    /// It is for meshes of lights that are not flat, such as the triangles around a sphere, and for
    /// flat lights whose triangles [`SceneBuilder::light`] would not find.
    pub fn light_of(mut self, light: impl Into<Light>, triangles: Range<u32>) -> Self {
        let index = u32::try_from(self.lights.len()).unwrap_or(u32::MAX);
        self.lights.push(Luminaire {
            triangles,
            ..Luminaire::new(index, Arc::new(light.into()))
        });
        self
    }

    /// Gives the light that was added last a profile, by which its emission depends on the angle to
    /// the normal of the side that emits. Profiles are for polygons, disks, spheres and cylinders;
    /// [`SceneBuilder::build`] refuses them for other lights. (A point light has its profile in a
    /// field of its own.)
    pub fn profile(mut self, profile: Arc<Profile>) -> Self {
        match self.lights.last_mut() {
            Some(last) => last.profile = Some(profile),
            None => self.has_stray_profile = true,
        }
        self
    }

    /// Sets the estimator; the default is [`Estimator::hybrid`]. [`Estimator::exact`] computes the
    /// irradiance without noise, and [`SceneBuilder::build`] refuses it with [`Error::NotExact`]
    /// for lights whose irradiance has no such formula.
    pub const fn method(mut self, estimator: Estimator) -> Self {
        self.settings.estimator = estimator;
        self
    }

    /// Sets the number of samples for each point and light; the default is 16. 0 counts as 1, and
    /// [`SceneBuilder::build`] refuses more than
    /// [`MOST_SAMPLES`](crate::estimators::MOST_SAMPLES). Light that has a closed form takes no
    /// samples.
    pub const fn samples(mut self, samples: u32) -> Self {
        self.settings.samples = if samples == 0 { 1 } else { samples };
        self
    }

    /// Sets the sampling pattern; the default is [`SamplerKind::Auto`].
    pub const fn sampler(mut self, sampler: SamplerKind) -> Self {
        self.settings.sampler = sampler;
        self
    }

    /// Sets the seed of the random numbers, which may be any number and is 0 by default. Two seeds
    /// give independent estimates.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// Sets the distance by which `irradiance` and `radiance` lift points off their surface along
    /// the normal, so that a triangle does not hide the light from its own points. It is at least 0
    /// and below 2⁶⁰.
    ///
    /// The default is 2⁻⁴⁶ of the point's largest coordinate, which suits points computed in `f64`;
    /// points computed in `f32` on slanted triangles need some 10⁻⁶ of the coordinates. The default
    /// grows where vertices in `f64` were rounded to `f32`: if a triangle is above the point by at
    /// most twice the largest distance by which rounding moved a vertex, the default grows by this
    /// much.
    pub const fn surface_offset(mut self, offset: f64) -> Self {
        self.settings.offset = Some(offset);
        self
    }

    /// Sets how close to a point and to a light triangles are left out as occluders, as fractions
    /// of the way between the two, at least 0 and below 1. The margins hold for all lights; by
    /// default each light has the margins that [`SceneBuilder::light`] describes.
    pub const fn margins(mut self, margins: Margins) -> Self {
        self.settings.margins = Some(margins);
        self
    }

    /// Checks all input and builds the hierarchy on all threads of the rayon pool.
    ///
    /// For `hybrid` and for line samples it also measures how much of each polygon among the first
    /// 16 lights is hidden from points on the triangles; methods and the directions of lines are
    /// chosen by that. ([`Scene::prepare`] measures from other points.)
    ///
    /// # Errors
    /// The first setting, vertex, triangle or light that is not valid. Triangles without area are
    /// valid and hide nothing, and so are scenes without triangles and scenes without lights.
    pub fn build(self) -> Result<Scene, Error> {
        let Self {
            positions,
            triangles,
            lights,
            settings,
            has_stray_profile,
        } = self;
        // Check the settings.
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
        // Check the vertices (a comparison with NaN is false), and that the triangles' indices of
        // vertices exist.
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
        // Build the hierarchy.
        let mut scene = Scene {
            occluders: Occluders::build_with(positions, triangles, BuildOptions::default()),
            triangles: triangles.len(),
            ball: ball_around(positions, triangles),
            places: Arc::default(),
            lights: Arc::default(),
            settings,
        };
        // Take the lights, and measure from points on the triangles how much hides each.
        scene.places = Arc::new(scene.places_on(positions, triangles));
        scene.set_lights(lights)?;
        Ok(scene)
    }
}

/// Refuses more samples than estimators have memory for.
pub(crate) const fn check_samples(samples: u32) -> Result<(), Error> {
    match samples <= MOST_SAMPLES {
        true => Ok(()),
        false => Err(Error::Samples(samples)),
    }
}

/// Returns the ball around the bounding box of all triangles.
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

//! The lights of a [`Scene`]: how they are checked and measured, and scenes with other lights,
//! methods or samplers over the same triangles.

use crate::builder::{LARGEST, check_samples};
use crate::one_call::{WHITE, same_length};
use crate::{Error, Scene};
use linelit_direct::{Luminaire, Luminaires, PROBES, Workspace, needs_occlusion, points_on, probe};
use linelit_estimators::{Estimator, Integration, ShadingPoint, Technique};
use linelit_geometry::{DVec3, Vector3};
use linelit_lights::Light;
use linelit_samplers::SamplerKind;
use std::ops::Range;
use std::sync::Arc;

impl Scene {
    /// Returns a scene of the same triangles with other lights, whose indices are from 0. Both
    /// scenes share the hierarchy.
    ///
    /// # Errors
    /// The first light that is not valid.
    pub fn with_lights<L: Into<Light>>(
        &self,
        lights: impl IntoIterator<Item = L>,
    ) -> Result<Self, Error> {
        let mut scene = self.clone();
        let lights = lights.into_iter().zip(0..);
        let lights = lights.map(|(light, index)| Luminaire::new(index, Arc::new(light.into())));
        scene.set_lights(lights.collect())?;
        Ok(scene)
    }

    /// Returns this scene with another estimator and another number of samples for each point and
    /// light; 0 samples count as 1. Both scenes share the hierarchy.
    ///
    /// # Errors
    /// [`Error::Samples`] for more samples than [`MOST_SAMPLES`](crate::estimators::MOST_SAMPLES);
    /// [`Error::NotExact`] if the estimator is `exact` and a light has no exact irradiance.
    pub fn with_method(&self, estimator: Estimator, samples: u32) -> Result<Self, Error> {
        check_samples(samples)?;
        let mut scene = self.clone();
        scene.settings.estimator = estimator;
        scene.settings.samples = samples.max(1);
        scene.look_at(self.lights.as_slice().to_vec())?;
        Ok(scene)
    }

    /// Returns this scene with another sampling pattern.
    #[must_use]
    pub fn with_sampler(&self, sampler: SamplerKind) -> Self {
        let mut scene = self.clone();
        scene.settings.sampler = sampler;
        scene
    }

    /// Measures how much hides each light from these points, by which `hybrid` chooses its method
    /// and the directions of lines. These points replace the points on the triangles that the scene
    /// chose when it was built. Some hundred points in the parts of the scene that matter are
    /// enough. The points affect the noise of later estimates, but not their mean.
    ///
    /// # Errors
    /// Slices of different lengths; the first point or normal that is not valid.
    pub fn prepare<V: Vector3 + Copy>(&mut self, points: &[V], normals: &[V]) -> Result<(), Error> {
        same_length("normals", points, normals)?;
        let mut places = Vec::with_capacity(points.len());
        for (i, (point, normal)) in points.iter().zip(normals).enumerate() {
            places.push(self.point(i, point.dvec3(), normal.dvec3(), None, WHITE)?);
        }
        self.places = Arc::new([places.clone(), places]);
        self.look_at(self.lights.as_slice().to_vec())
    }

    /// Returns two lists of points on the triangles: the points from which it is measured how much
    /// hides each light, unless [`Scene::prepare`] gives others, and the points from which the
    /// directions of lines are chosen.
    pub(crate) fn places_on<V: Vector3 + Copy>(
        &self,
        positions: &[V],
        triangles: &[[u32; 3]],
    ) -> [Vec<ShadingPoint>; 2] {
        // Take corners as they are stored in `f32`, or points would be below their own triangles.
        let origin = self.occluders.origin();
        let stored = |p: DVec3| (p - origin).as_vec3().as_dvec3() + origin;
        let corners = |t: &[u32; 3]| t.map(|i| stored(positions[i as usize].dvec3()));
        PROBES.map(|count| {
            let points = points_on(corners, triangles, count).into_iter();
            let lifted = points.filter_map(|[p, n]| self.point(0, p, n, None, WHITE).ok());
            lifted.collect()
        })
    }

    /// Checks the lights, finds the triangles that belong to each of them, and sets them as the
    /// scene's lights.
    pub(crate) fn set_lights(&mut self, mut lights: Vec<Luminaire>) -> Result<(), Error> {
        for (i, light) in lights.iter_mut().enumerate() {
            Arc::make_mut(&mut light.light).set_scene(self.ball);
            let Range { start, end } = light.triangles;
            if start > end || end as usize > self.triangles {
                return Err(Error::LightTriangles(i));
            }
            // Check the shape, the emission and the profile.
            if !light.light.is_valid(LARGEST) {
                return Err(Error::Light(i));
            }
            if light.profile.is_some() && !light.takes_profile() {
                return Err(Error::Profile(i));
            }
            // Find the triangles in the light's plane, and the margins that they need.
            light.find_own_triangles(&self.occluders);
            light.margins = self.settings.margins.unwrap_or(light.margins);
        }
        self.look_at(lights)
    }

    /// Sets the lights, which must have been checked. If the estimator chooses its method by how
    /// much hides a light, that is measured first, from the scene's points. `exact` does not
    /// choose; for it, a light whose irradiance has no exact form is an error.
    fn look_at(&mut self, mut lights: Vec<Luminaire>) -> Result<(), Error> {
        // Refuse lights without an exact form where the estimator promises one.
        let is_exact = is_exact(&self.settings.estimator);
        if is_exact && let Some(i) = lights.iter().position(|light| !light.is_exact()) {
            return Err(Error::NotExact(i));
        }
        // Measure how much hides each light; from no points, none counts as hidden.
        let points = match needs_occlusion(&self.settings.estimator) && !is_exact {
            true => self.places.each_ref().map(Vec::as_slice),
            false => [&[][..]; 2],
        };
        probe(&self.occluders, &mut lights, points, &mut Workspace::new());
        let indices = u32::try_from(lights.len()).unwrap_or(u32::MAX);
        self.lights = Arc::new(Luminaires::new(lights, indices));
        Ok(())
    }
}

/// Returns whether an estimator promises irradiance without noise, as `exact` does.
fn is_exact(estimator: &Estimator) -> bool {
    let by = match estimator.alone() {
        Some(Technique::Lines(lines)) => lines.integration,
        Some(Technique::Points(_)) | None => None,
    };
    matches!(by, Some(Integration::Exact(_)))
}

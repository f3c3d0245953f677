//! The lights of a scene: what is refused, and lights and methods in place of others.

use crate::builder::{LARGEST, check_samples};
use crate::resting::resting;
use crate::{Error, Scene};
use linelit_estimators::{
    Estimator, ExactOptions, Integration, LightSource, OcclusionStats, Technique,
};
use linelit_geometry::{ConvexPolygon, DVec3, Margins};
use linelit_lights::{Light, Profile, SkyEmission};
use linelit_samplers::SamplerKind;
use linelit_visibility::Occluders;
use std::ops::Range;
use std::sync::Arc;

/// A light of a scene.
#[derive(Clone, Debug)]
pub(crate) struct SceneLight {
    pub light: Light,
    pub triangles: Range<u32>,
    pub profile: Option<Arc<Profile>>,
    /// The margins of its shadows, unless the settings have others.
    pub margins: Margins,
    pub occlusion: OcclusionStats,
}

impl From<Light> for SceneLight {
    fn from(light: Light) -> Self {
        Self {
            light,
            triangles: 0..0,
            profile: None,
            margins: Margins::DEFAULT,
            occlusion: OcclusionStats::FEW,
        }
    }
}

impl Scene {
    /// These triangles under other lights, which are numbered from 0. The hierarchy is shared.
    ///
    /// # Errors
    /// The first light that is not valid.
    pub fn with_lights<L: Into<Light>>(
        &self,
        lights: impl IntoIterator<Item = L>,
    ) -> Result<Self, Error> {
        let mut scene = self.clone();
        let lights = lights
            .into_iter()
            .map(|light| SceneLight::from(light.into()));
        scene.set_lights(lights.collect())?;
        Ok(scene)
    }

    /// This scene with another estimator and another number of samples for each point and
    /// light, of which 0 counts as 1. The hierarchy is shared.
    ///
    /// # Errors
    /// [`Error::Samples`] for more samples than [`MOST_SAMPLES`](crate::estimators::MOST_SAMPLES);
    /// [`Error::NotExact`] for a light that the estimator promises without noise and gives with it.
    pub fn with_method(&self, estimator: Estimator, samples: u32) -> Result<Self, Error> {
        check_samples(samples)?;
        let mut scene = self.clone();
        scene.settings.estimator = estimator;
        scene.settings.samples = samples.max(1);
        scene.set_lights(self.lights.to_vec())?;
        Ok(scene)
    }

    /// This scene with another sampling pattern.
    #[must_use]
    pub fn with_sampler(&self, sampler: SamplerKind) -> Self {
        let mut scene = self.clone();
        scene.settings.sampler = sampler;
        scene
    }

    /// Takes lights after checking them, and looks at them.
    pub(crate) fn set_lights(&mut self, mut lights: Vec<SceneLight>) -> Result<(), Error> {
        let is_exact = is_exact(&self.settings.estimator);
        for (i, light) in lights.iter_mut().enumerate() {
            light.light.set_scene(self.ball);
            let Range { start, end } = light.triangles;
            if start > end || end as usize > self.triangles {
                return Err(Error::LightTriangles(i));
            }
            if !is_light(&light.light) {
                return Err(Error::Light(i));
            }
            if light.profile.is_some() && !light.has_sides() {
                return Err(Error::Profile(i));
            }
            if is_exact && !light.is_exact() {
                return Err(Error::NotExact(i));
            }
            light.find_own(&self.occluders);
            light.margins = self.settings.margins.unwrap_or(light.margins);
        }
        self.look_at(&mut lights);
        self.lights = lights.into();
        Ok(())
    }
}

impl SceneLight {
    pub(crate) fn source(&self) -> LightSource<'_> {
        LightSource {
            triangles: self.triangles.clone(),
            profile: self.profile.as_deref(),
            occlusion: self.occlusion,
            ..LightSource::new(&self.light)
        }
    }

    /// Finds the light's own triangles if none are named, and the margins that it needs.
    fn find_own(&mut self, occluders: &Occluders) {
        let flat = match &self.light {
            Light::Area(area) => Some(area.polygon),
            Light::Disk(disk) => ConvexPolygon::new(&disk.disk.around()).ok(),
            _ => None,
        };
        self.margins = Margins::excluding(&self.triangles);
        if let Some(flat) = flat {
            (self.triangles, self.margins) = resting(occluders, &flat, self.triangles.clone());
        }
    }

    /// Whether a profile can be about its normal.
    const fn has_sides(&self) -> bool {
        match &self.light {
            Light::Area(_) | Light::Disk(_) | Light::Sphere(_) | Light::Cylinder(_) => true,
            Light::Linear(_) | Light::Point(_) | Light::Distant(_) | Light::Sky(_) => false,
        }
    }

    /// Whether `exact` gives its light without noise, on a diffuse surface.
    const fn is_exact(&self) -> bool {
        match &self.light {
            Light::Area(_) => self.profile.is_none(),
            Light::Linear(_) | Light::Point(_) | Light::Distant(_) => true,
            Light::Sphere(_) | Light::Disk(_) | Light::Cylinder(_) | Light::Sky(_) => false,
        }
    }
}

/// Whether an estimator promises light without noise.
fn is_exact(estimator: &Estimator) -> bool {
    let by = match estimator.alone() {
        Some(Technique::Lines(lines)) => lines.integration,
        Some(Technique::Points(_)) | None => None,
    };
    matches!(by, Some(Integration::Exact(_)))
}

/// Whether an estimator wants to know beforehand what hides a light: `hybrid`, and lines, which
/// take their direction from it.
pub(crate) fn looks_ahead(estimator: &Estimator) -> bool {
    let mut techniques = estimator.parts().iter().map(|part| &part.technique);
    techniques.any(|technique| match technique {
        Technique::Points(_) => false,
        Technique::Lines(lines) => match lines.integration {
            Some(Integration::Exact(options)) => options.limit != ExactOptions::NO_LIMIT,
            Some(Integration::Analytic | Integration::Cheapest) | None => true,
        },
    })
}

/// Whether the numbers of a light are finite, its emission is not negative, and its shape has a
/// size and a direction.
fn is_light(light: &Light) -> bool {
    let emission = light.emission().radiance;
    let is_place = |p: DVec3| p.abs().cmple(DVec3::splat(LARGEST)).all();
    let is_size = |r: f64| r > 0.0 && r <= LARGEST;
    let emits = emission.is_finite() && emission.min_element() >= 0.0;
    emits
        && match light {
            Light::Area(l) => l.polygon.vertices().iter().all(|&v| is_place(v)),
            Light::Linear(l) => {
                let ends = [l.segment.p0, l.segment.p1];
                ends.into_iter().all(is_place) && l.segment.length() > 0.0
            }
            Light::Sphere(l) => is_place(l.sphere.center) && is_size(l.sphere.radius),
            Light::Disk(l) => {
                let disk = &l.disk;
                is_place(disk.center) && is_size(disk.radius) && disk.normal.is_normalized()
            }
            Light::Cylinder(l) => {
                let axis = &l.cylinder.axis;
                let is_axis = [axis.p0, axis.p1].into_iter().all(is_place);
                is_axis && axis.length() > 0.0 && is_size(l.cylinder.radius)
            }
            Light::Point(l) => is_place(l.position),
            Light::Distant(l) => l.direction.is_normalized(),
            Light::Sky(l) => match &l.emission {
                SkyEmission::Constant(_) | SkyEmission::Image(_) => true,
                SkyEmission::Sun {
                    direction,
                    half_angle,
                    ..
                } => {
                    let is_angle = *half_angle > 0.0 && *half_angle <= std::f64::consts::FRAC_PI_2;
                    direction.is_normalized() && is_angle
                }
            },
        }
}

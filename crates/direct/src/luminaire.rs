//! A luminaire is a light in a scene, with everything that an estimate needs to know about it.

use crate::own_triangles::own_triangles;
use linelit_estimators::{EmissionTexture, Estimator, LightSource, OcclusionStats};
use linelit_geometry::{ConvexPolygon, DVec3, Margins};
use linelit_lights::{ImportanceImage, Light, Profile, TexturedSampler};
use linelit_visibility::Occluders;
use std::ops::Range;
use std::sync::Arc;

/// A light in a scene: its shape and emission, the triangles that it consists of, and the
/// statistics by which methods are chosen for it.
#[derive(Clone, Debug)]
pub struct Luminaire {
    /// Its number in the scene, which selects its random numbers.
    pub index: u32,
    /// Its shape and its emission.
    pub light: Arc<Light>,
    /// The light's own triangles among the occluders. They never hide it. The range is empty if it
    /// has none.
    pub triangles: Range<u32>,
    /// The emission of a polygon by position; `None` if it is the same everywhere.
    pub texture: Option<Texture>,
    /// The factor of the emission by direction, for a polygon, a disk, a sphere or a cylinder.
    pub profile: Option<Arc<Profile>>,
    /// The estimator for this light; `None` if it has the estimator of the settings.
    pub estimator: Option<Estimator>,
    /// Whether this light always gets all samples, even if one of the other lights is chosen at
    /// random for each sample ([`LightChoice`](crate::LightChoice)).
    pub is_apart: bool,
    /// The distances from the point and from the light within which occluders hide nothing.
    pub margins: Margins,
    /// Statistics of its occlusion, by which `hybrid` chooses a method ([`probe`](crate::probe)).
    pub occlusion: OcclusionStats,
}

/// The emission of a polygon by position, which copies of a light share.
#[derive(Clone, Debug)]
pub struct Texture(Arc<dyn SharedTexture>);

/// An emission by position that may be shared between threads.
trait SharedTexture: EmissionTexture + Send + Sync + std::fmt::Debug {}

impl<T: EmissionTexture + Send + Sync + std::fmt::Debug> SharedTexture for T {}

impl Texture {
    /// Wraps an emission by position so that it can be shared.
    pub fn new(texture: impl EmissionTexture + Send + Sync + std::fmt::Debug + 'static) -> Self {
        Self(Arc::new(texture))
    }
}

impl EmissionTexture for Texture {
    fn radiance(&self, on_light: DVec3) -> DVec3 {
        self.0.radiance(on_light)
    }

    fn points(&self) -> Option<TexturedSampler<'_>> {
        self.0.points()
    }

    fn fits(&self) -> bool {
        self.0.fits()
    }

    fn over(&self, part: &ConvexPolygon) -> Option<&ImportanceImage> {
        self.0.over(part)
    }
}

impl Luminaire {
    /// A light without triangles among the occluders, and with the margins [`Margins::DEFAULT`].
    #[must_use]
    pub fn new(index: u32, light: Arc<Light>) -> Self {
        Self {
            index,
            light,
            triangles: 0..0,
            texture: None,
            profile: None,
            estimator: None,
            is_apart: false,
            margins: Margins::DEFAULT,
            occlusion: OcclusionStats::FEW,
        }
    }

    /// The light in the form that estimators take.
    #[must_use]
    pub fn source(&self) -> LightSource<'_, Texture> {
        LightSource {
            light: &self.light,
            triangles: self.triangles.clone(),
            texture: self.texture.as_ref(),
            profile: self.profile.as_deref(),
            occlusion: self.occlusion,
        }
    }

    /// Sets the margins that the light needs among these occluders. They are narrow if all
    /// triangles in the light's plane are known to be its own. If no triangles have been given for
    /// a polygon or a disk, the triangles within it become its own, provided that their numbers are
    /// consecutive.
    pub fn find_own_triangles(&mut self, occluders: &Occluders) {
        let flat = match &*self.light {
            Light::Area(area) => Some(area.polygon),
            Light::Disk(disk) => ConvexPolygon::new(&disk.disk.around()).ok(),
            _ => None,
        };
        self.margins = Margins::excluding(&self.triangles);
        if let Some(flat) = flat {
            (self.triangles, self.margins) =
                own_triangles(occluders, &flat, self.triangles.clone());
        }
    }

    /// Returns whether the light's shape has a normal, about which a profile can be defined.
    #[must_use]
    pub fn takes_profile(&self) -> bool {
        self.light.normal(DVec3::ZERO).is_some()
    }

    /// Returns whether [`Estimator::exact`] gives the light's irradiance without noise. This is so
    /// for polygons with the same emission everywhere, and for lights without an area.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        use Light::{Area, Distant, Linear, Point};
        let is_even = self.profile.is_none() && self.texture.is_none();
        matches!(&*self.light, Area(_) if is_even)
            || matches!(&*self.light, Linear(_) | Point(_) | Distant(_))
    }
}

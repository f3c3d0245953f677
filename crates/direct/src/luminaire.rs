//! A light as it is placed in a scene.

use crate::own_triangles::own_triangles;
use linelit_estimators::{EmissionTexture, Estimator, LightSource, OcclusionStats};
use linelit_geometry::{ConvexPolygon, DVec3, Margins};
use linelit_lights::{ImportanceImage, Light, Profile, TexturedSampler};
use linelit_visibility::Occluders;
use std::ops::Range;
use std::sync::Arc;

/// A light as it is placed in a scene: its shape and emission, the triangles that it is made of,
/// and the statistics by which methods are chosen for it.
#[derive(Clone, Debug)]
pub struct Luminaire {
    /// Its number in the scene, which names its random numbers.
    pub index: u32,
    /// The shape and the emission.
    pub light: Arc<Light>,
    /// The light's own triangles among the occluders, which never hide it; empty if it has none.
    pub triangles: Range<u32>,
    /// The emission of a polygon by position, if it is not the same everywhere.
    pub texture: Option<Texture>,
    /// The factor of the emission of a polygon, a disk, a sphere or a cylinder by direction.
    pub profile: Option<Arc<Profile>>,
    /// The estimator of this light, if it has one of its own.
    pub estimator: Option<Estimator>,
    /// Whether it is sampled for itself, with all samples, where one of the other lights is chosen
    /// for each sample.
    pub is_apart: bool,
    /// The distances from point and light within which an occluder hides nothing.
    pub margins: Margins,
    /// Statistics of its occlusion, by which `hybrid` chooses ([`probe`](crate::probe)).
    pub occlusion: OcclusionStats,
}

/// The emission of a polygon by position, shared.
#[derive(Clone, Debug)]
pub struct Texture(Arc<dyn SharedTexture>);

/// An emission by position that threads can share.
trait SharedTexture: EmissionTexture + Send + Sync + std::fmt::Debug {}

impl<T: EmissionTexture + Send + Sync + std::fmt::Debug> SharedTexture for T {}

impl Texture {
    /// Shares an emission by position.
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
    /// A light that has no triangles among the occluders, with the margins
    /// [`Margins::DEFAULT`].
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

    /// The light as estimators take it.
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

    /// Sets the margins that the light needs among these occluders: narrow ones where all
    /// triangles in its plane are known to be its own. A polygon or a disk without triangles gets
    /// those that lie in it, if their numbers follow each other.
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

    /// Whether the light's shape has a normal that a profile can be about.
    #[must_use]
    pub fn takes_profile(&self) -> bool {
        self.light.normal(DVec3::ZERO).is_some()
    }

    /// Whether [`Estimator::exact`] gives the light's irradiance without noise: of polygons that
    /// emit alike everywhere, and of lights without an area.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        use Light::{Area, Distant, Linear, Point};
        let is_even = self.profile.is_none() && self.texture.is_none();
        matches!(&*self.light, Area(_) if is_even)
            || matches!(&*self.light, Linear(_) | Point(_) | Distant(_))
    }
}

//! Points of the surface of any light, by any density.

use super::texture::{EmissionTexture, TexturedPoints};
use super::{LightPoint, Shape, Surface, Viewer};
use crate::mixture::{DiskLobes, Lobes};
use crate::{AngularLines, AreaSampler, CylinderArea, CylinderLines, DiskArea, DiskChords};
use crate::{DiskCone, PointColumns, PointTechnique, PointsOnLines, ProxySampler};
use crate::{SkyPoints, SolidAngleSampler, SphereCap, SphereCone, SphereProjected, SurfaceMeasure};
use linelit_geometry::DVec3;

/// The density of points of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointDensity {
    /// Uniform on the light's area.
    Area,
    /// Uniform on the area that the shading point sees of a sphere or a cylinder.
    VisibleArea,
    /// Uniform on the triangles that a polygon spans at unit distance (Shirley & Wang 1991),
    /// nearly its solid angle; on other lights as [`PointDensity::SolidAngle`].
    Proxy,
    /// Uniform in the light's solid angle; of disks and cylinders within 1 %.
    SolidAngle,
    /// Uniform in the light's projected solid angle: no noise on diffuse surfaces that see all of
    /// the light; of disks within 2 %.
    ProjectedSolidAngle,
    /// Drawn by linearly transformed cosines that look like the reflection, and seldom uniform in
    /// the solid angle; as [`PointDensity::SolidAngle`] on cylinders, and where no lobe can draw.
    Lobes,
    /// Proportional to the texture of a polygon, uniform on the area of one without; on other
    /// lights as [`PointDensity::SolidAngle`].
    Texture,
}

/// A sampler of points of a light, ready for a shading point.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "few, in a buffer or on the stack"
)]
pub enum PointSource<'t> {
    /// A polygon's, uniform by area.
    Area(AreaSampler<'t>),
    /// A polygon's, by its proxy at unit distance.
    Proxy(ProxySampler),
    /// A polygon's, uniform in solid angle.
    SolidAngle(SolidAngleSampler),
    /// A polygon's, uniform in projected solid angle.
    Projected(PointsOnLines<AngularLines>),
    /// A polygon's, by the lobes of a reflection.
    Lobes(Lobes),
    /// A polygon's, by its texture.
    Texture(TexturedPoints<'t>),
    /// A sphere's, uniform by area.
    SphereCap(SphereCap),
    /// A sphere's, uniform in solid angle.
    SphereCone(SphereCone),
    /// A sphere's, uniform in projected solid angle.
    SphereProjected(SphereProjected),
    /// A disk's, uniform by area.
    DiskArea(DiskArea),
    /// A disk's, nearly uniform in solid angle.
    DiskCone(DiskCone),
    /// A disk's, nearly uniform in projected solid angle.
    DiskChords(DiskChords),
    /// A disk's, or a sphere's with this disk as its outline, by the lobes of a reflection.
    DiskLobes(DiskLobes),
    /// A cylinder's, uniform by area.
    CylinderArea(CylinderArea),
    /// A cylinder's, on lines along it.
    CylinderLines(CylinderLines),
    /// A sky's.
    Sky(SkyPoints<'t>),
}

/// A variant of [`PointSource`], whose methods these are.
pub(crate) trait Draw {
    /// A point and its density.
    fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)>;

    /// Points side by side: [`PointSource::sample_into`].
    fn columns(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        let _ = (u, out);
        None
    }

    /// The density per solid angle at any point of the light.
    fn density(&self, at: &LightPoint) -> f64;
}

impl<P: PointTechnique> Draw for P {
    #[inline]
    fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)> {
        let sample = PointTechnique::sample(self, u);
        let to_light = sample.point - x;
        let direction = if P::Measure::IS_LOCAL {
            to_light / to_light.length()
        } else {
            to_light.normalize_or_zero()
        };
        let at = LightPoint::towards(sample.point, to_light, direction, surface);
        Some((at, at.density(sample.pdf)))
    }

    fn columns(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        self.sample_into(u, out);
        Some(P::Measure::IS_LOCAL)
    }

    #[inline]
    fn density(&self, at: &LightPoint) -> f64 {
        at.density(self.pdf(at.point))
    }
}

impl<'t> PointSource<'t> {
    /// Creates points of a surface by a density, for any shading point.
    // Inlined, so that the few bytes of most densities are written where the source stays.
    #[inline(always)]
    #[must_use]
    pub fn new<T: EmissionTexture>(
        by: PointDensity,
        surface: Surface<'t>,
        texture: Option<&'t T>,
        from: &Viewer<'_>,
    ) -> Self {
        if let (PointDensity::Texture, Surface::Polygon(light), Some(texture)) =
            (by, surface, texture)
            && let Some(textured) = TexturedPoints::new(texture, light)
        {
            return Self::Texture(textured);
        }
        of!(Surface surface, shape => shape.points(by, from))
    }

    /// A point of the surface from two random numbers in [0, 1), and its density per solid angle
    /// at the shading point `x`; `None` where a draw missed the light.
    #[inline]
    pub fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)> {
        of!(PointSource self, source => source.draw(u, surface, x))
    }

    /// The points of [`PointSource::draw`] from many pairs of random numbers, eight side by side,
    /// as many as all columns hold. Densities are per area if the answer is `true`, else per solid
    /// angle; `None` where points are no function of the numbers and the source alone.
    pub fn sample_into(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        of!(PointSource self, source => source.columns(u, out))
    }

    /// The density per solid angle with which [`PointSource::draw`] gives a point of the light.
    #[inline]
    #[must_use]
    pub fn density(&self, at: &LightPoint) -> f64 {
        of!(PointSource self, source => source.density(at))
    }
}

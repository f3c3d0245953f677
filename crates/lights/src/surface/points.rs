//! This module draws points on the surface of any light, by any density: for each shape it chooses
//! the technique that has the density, or the nearest one.

use super::draw::Draw;
use super::lines::along_cylinder;
use super::texture::{EmissionTexture, TexturedPoints};
use super::{LightPoint, Surface, Viewer};
use crate::mixture::{DiskLtc, Lobes};
use crate::{
    AngularLines, AreaSampler, ChordMeasure, CylinderArea, CylinderLines, CylinderView, Disk,
    DiskArea, DiskChords, DiskCone, PointColumns, PointsOnLines, ProxySampler, SkyBy, SkyPoints,
    SkyView, SolidAngleSampler, Sphere, SphereCap, SphereCone, SphereProjected,
};
use PointDensity as By;
use linelit_geometry::{ConvexPolygon, DVec3, Frame};
use linelit_shading::ltc::LtcMixture;

/// The density by which points of a light are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointDensity {
    /// Uniform on the light's whole area.
    Area,
    /// Uniform on the area of a sphere or a cylinder that the shading point sees.
    VisibleArea,
    /// Uniform on the triangles that the directions to a polygon's corners span at unit distance
    /// (Shirley & Wang 1991), which is almost its solid angle. On other lights it is
    /// [`PointDensity::SolidAngle`].
    Proxy,
    /// Uniform in the light's solid angle; for disks and cylinders within 1 %.
    SolidAngle,
    /// Uniform in the light's projected solid angle, for disks within 2 %: a diffuse surface that
    /// sees all of the light has no noise.
    ProjectedSolidAngle,
    /// In proportion to the LTCs that approximate the reflection, with a small uniform part. It is
    /// [`PointDensity::SolidAngle`] on cylinders, and where no LTC can be sampled.
    Lobes,
    /// In proportion to the texture of a polygon, and uniform on the area of a polygon without
    /// texture. On other lights it is [`PointDensity::SolidAngle`].
    Texture,
}

/// A technique that draws points of a light, ready for one shading point.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "few, in a buffer or on the stack"
)]
pub enum PointSource<'t> {
    /// Points of a polygon, uniform by area.
    Area(AreaSampler<'t>),
    /// Points of a polygon, by its proxy at unit distance.
    Proxy(ProxySampler),
    /// Points of a polygon, uniform in solid angle.
    SolidAngle(SolidAngleSampler),
    /// Points of a polygon, uniform in projected solid angle.
    Projected(PointsOnLines<AngularLines>),
    /// Points of a polygon, by the LTCs of a reflection.
    Lobes(Lobes),
    /// Points of a polygon, by its texture.
    Texture(TexturedPoints<'t>),
    /// Points of a sphere, uniform by area.
    SphereCap(SphereCap),
    /// Points of a sphere, uniform in solid angle.
    SphereCone(SphereCone),
    /// Points of a sphere, uniform in projected solid angle.
    SphereProjected(SphereProjected),
    /// Points of a disk, uniform by area.
    DiskArea(DiskArea),
    /// Points of a disk, nearly uniform in solid angle.
    DiskCone(DiskCone),
    /// Points of a disk, nearly uniform in projected solid angle.
    DiskChords(DiskChords),
    /// Points of a disk, or of a sphere whose outline is this disk, by the LTCs of a reflection.
    DiskLtc(DiskLtc),
    /// Points of a cylinder, uniform by area.
    CylinderArea(CylinderArea),
    /// Points of a cylinder, on lines along it.
    CylinderLines(CylinderLines),
    /// Points of a sky.
    Sky(SkyPoints<'t>),
}

impl<'t> PointSource<'t> {
    /// Sets up the points of a surface by a density, for one shading point.
    // Inlined, so that the few bytes of most densities are written where the source is stored.
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
        match surface {
            Surface::Polygon(light) => polygon(light, by, from),
            Surface::Sphere(light) => sphere(light, by, from),
            Surface::Disk(light) => disk(light, by, from),
            Surface::Cylinder(light) => cylinder(light, by, from),
            Surface::Sky(light) => sky(*light, by, from),
        }
    }

    /// Draws a point of the surface from two random numbers in [0, 1), and returns it with its
    /// density per solid angle at the shading point `x`; `None` where the sample misses the light.
    #[inline]
    pub fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)> {
        of!(PointSource self, source => source.draw(u, surface, x))
    }

    /// Draws the points of [`PointSource::draw`] from many pairs of random numbers, in columns of
    /// eight; their number is the length of the shortest column. The densities are per area if the
    /// result is `true`, and per solid angle if it is `false`; `None` where the points depend on
    /// more than the numbers and the source.
    pub fn sample_into(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        of!(PointSource self, source => source.columns(u, out))
    }

    /// Returns the density per solid angle with which [`PointSource::draw`] gives a point of the
    /// light.
    #[inline]
    #[must_use]
    pub fn density(&self, at: &LightPoint) -> f64 {
        of!(PointSource self, source => source.density(at))
    }
}

/// Sets up the points of a polygon by a density.
#[inline(always)]
fn polygon<'t>(light: &'t ConvexPolygon, by: By, from: &Viewer<'_>) -> PointSource<'t> {
    let (x, n) = (from.position, from.normal);
    match by {
        By::Area | By::VisibleArea | By::Texture => PointSource::Area(AreaSampler::new(light)),
        By::Proxy => PointSource::Proxy(ProxySampler::new(light, x)),
        By::SolidAngle => PointSource::SolidAngle(SolidAngleSampler::new(light, x)),
        By::ProjectedSolidAngle => {
            let lines = AngularLines::by_projected_solid_angle(light, 0.0, x, n);
            PointSource::Projected(PointsOnLines(lines))
        }
        By::Lobes => {
            let nothing = LtcMixture::new(Frame::from_normal(n), DVec3::ZERO);
            PointSource::Lobes(Lobes::new(light, x, from.cosines.unwrap_or(&nothing)))
        }
    }
}

/// Sets up the points of a sphere by a density.
#[inline(always)]
fn sphere<'t>(light: &Sphere, by: By, from: &Viewer<'_>) -> PointSource<'t> {
    let x = from.position;
    let whole = || PointSource::SphereCap(SphereCap::whole(light));
    let by_angle = || PointSource::SphereCone(SphereCone::new(light, x));
    match by {
        By::Area => whole(),
        By::VisibleArea => PointSource::SphereCap(SphereCap::visible(light, x)),
        By::SolidAngle | By::Proxy | By::Texture => by_angle(),
        By::ProjectedSolidAngle => {
            let projected = SphereProjected::new(light, x, from.normal);
            projected.map_or_else(whole, PointSource::SphereProjected)
        }
        By::Lobes => {
            let lobes = light.outline(x).and_then(|seen| disk_lobes(&seen, from));
            lobes.map_or_else(by_angle, PointSource::DiskLtc)
        }
    }
}

/// Sets up the points of a disk by a density.
#[inline(always)]
fn disk<'t>(light: &Disk, by: By, from: &Viewer<'_>) -> PointSource<'t> {
    let x = from.position;
    let by_angle = || PointSource::DiskCone(DiskCone::new(light, x));
    match by {
        By::Area | By::VisibleArea => PointSource::DiskArea(DiskArea::new(light)),
        By::SolidAngle | By::Proxy | By::Texture => by_angle(),
        By::ProjectedSolidAngle => {
            PointSource::DiskChords(DiskChords::new(light, 0.0, x, &[from.normal]))
        }
        By::Lobes => disk_lobes(light, from).map_or_else(by_angle, PointSource::DiskLtc),
    }
}

/// Sets up the LTCs of the shading point's reflection over a disk, if points can be drawn by them.
fn disk_lobes(disk: &Disk, from: &Viewer<'_>) -> Option<DiskLtc> {
    let cosines = from.cosines.filter(|cosines| !cosines.lobes().is_empty())?;
    DiskLtc::new(disk, from.position, cosines)
}

/// Sets up the points of a cylinder by a density.
#[inline(always)]
fn cylinder<'t>(light: &CylinderView, by: By, from: &Viewer<'_>) -> PointSource<'t> {
    let by_area = PointSource::CylinderArea;
    let by_lines = |measure| PointSource::CylinderLines(along_cylinder(light, from, measure));
    match by {
        By::Area => by_area(CylinderArea::whole(light.cylinder())),
        By::VisibleArea => by_area(CylinderArea::visible(light.cylinder(), light.position())),
        By::ProjectedSolidAngle => by_lines(ChordMeasure::Projected),
        By::SolidAngle | By::Proxy | By::Lobes | By::Texture => by_lines(ChordMeasure::SolidAngle),
    }
}

/// Sets up the points of a sky by a density.
fn sky<'t>(light: SkyView<'t>, by: By, from: &Viewer<'_>) -> PointSource<'t> {
    let by = match by {
        By::ProjectedSolidAngle | By::Lobes => SkyBy::Projected(from.normal),
        _ => SkyBy::Radiance(from.normal),
    };
    PointSource::Sky(SkyPoints::new(light, by))
}

//! Lines on the surface of any light that has them, by any density.

use super::texture::EmissionTexture;
use super::{LightPoint, Surface, Viewer};
use crate::{
    AngularLines, ChordMeasure, CylinderLines, CylinderView, LineSample, LineSampler,
    LineTechnique, OffsetDensity, TextureAxis, TexturedLines, through,
};
use core::f64::consts::{FRAC_PI_2, PI};
use linelit_elementary::atan2;
use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines, Segment};

/// The measure in which lines, and points on them, are uniform where nothing occludes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineDensity {
    /// Area: points uniform in length (Salesin & Jarosz 2019, eq. 14).
    Area,
    /// Solid angle (eqs. 16–19), for any polygon and direction.
    SolidAngle,
    /// Nearly solid angle: offsets from a density that needs no iteration
    /// ([`AngularLines::by_warped_solid_angle`]); on cylinders as [`LineDensity::SolidAngle`].
    Warped,
    /// Projected solid angle of the part above the horizon.
    Projected,
    /// The light's texture: offsets by what is on the line, points by the texture along the visible
    /// part ([`TexturedLines`]); area where there is no texture, or where the light is no
    /// parallelogram that is wholly above the horizon.
    Texture,
}

/// The direction of parallel lines, and the density of their offsets where they are by area.
#[derive(Clone, Copy, Debug)]
pub struct LineSetup {
    /// The direction in half turns from the first edge of the whole light, which a texture covers.
    pub fraction: f64,
    /// The direction in radians from the first edge of the surface, which may be a part.
    pub angle: f64,
    /// Whether the direction was asked for, not drawn.
    pub fixed: bool,
    /// The density of offsets of [`LineDensity::Area`].
    pub offset: OffsetDensity,
}

/// Lines of one direction on a light, ready for a shading point.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "few, in a buffer or on the stack"
)]
pub enum LineFamily<'t> {
    /// Lines on a polygon, by area.
    Area(LineSampler),
    /// Lines on a polygon, by an angle.
    Angular(AngularLines),
    /// Lines on a polygon, by its texture.
    Texture(TexturedLines<'t>),
    /// Lines along a cylinder.
    Cylinder(CylinderLines),
}

impl<'t> LineFamily<'t> {
    /// Creates lines on a surface by a density, for any shading point; `None` if it has no lines.
    #[must_use]
    pub fn new<T: EmissionTexture>(
        by: LineDensity,
        surface: Surface<'t>,
        texture: Option<&'t T>,
        setup: LineSetup,
        from: &Viewer<'_>,
    ) -> Option<Self> {
        if let (LineDensity::Texture, Surface::Polygon(light), Some(texture)) =
            (by, surface, texture)
            && let Some(textured) = textured(texture, light, setup)
        {
            return Some(Self::Texture(textured));
        }
        match surface {
            Surface::Polygon(light) => Some(polygon(light, by, setup, from)),
            Surface::Cylinder(light) => Some(cylinder(light, by, setup, from)),
            Surface::Sphere(_) | Surface::Disk(_) | Surface::Sky(_) => None,
        }
    }

    /// The unit direction of the lines; zero where there are none.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        of!(LineFamily self, lines => lines.direction())
    }

    /// A line from one random number in [0, 1).
    #[must_use]
    pub fn sample(&self, u: f64) -> LineSample {
        of!(LineFamily self, lines => lines.sample(u))
    }

    /// A point of the visible parts of a line, from one random number in [0, 1), and the joint
    /// density of line and point per solid angle at the shading point `x`.
    #[must_use]
    pub fn point(
        &self,
        line: &LineSample,
        visible: &[Interval],
        u: f64,
        x: DVec3,
        surface: &Surface<'_>,
    ) -> (LightPoint, f64) {
        of!(LineFamily self, lines => {
            let sample = lines.point(line, visible, u);
            let at = LightPoint::new(sample.point, x, surface);
            (at, at.density(sample.pdf))
        })
    }

    /// The line through a point of the light.
    #[must_use]
    pub fn through(&self, point: DVec3) -> Segment {
        of!(LineFamily self, lines => lines.through(point))
    }

    /// The joint density per solid angle at a point whose line has these visible parts.
    #[must_use]
    pub fn density(&self, at: &LightPoint, visible: &[Interval]) -> f64 {
        of!(LineFamily self, lines => at.density(lines.joint_pdf(at.point, visible)))
    }

    /// The factor of an integral along a line, beside its offset's density: the height over the
    /// plane that touches a cylinder there; 1 on a polygon, whose lines share their plane.
    #[must_use]
    pub fn height(&self, line: &LineSample) -> f64 {
        match self {
            Self::Cylinder(lines) => lines.height(line),
            Self::Area(_) | Self::Angular(_) | Self::Texture(_) => 1.0,
        }
    }
}

impl Surface<'_> {
    /// Adds the lines across those of a direction, one through each point; of surfaces without
    /// lines none.
    pub fn lines_across(
        &self,
        direction: DVec3,
        points: impl Iterator<Item = DVec3>,
        out: &mut impl Extend<Segment>,
    ) {
        match self {
            Self::Polygon(light) => {
                let along = light.plane_frame().axes;
                let angle = atan2(along.y.dot(direction), along.x.dot(direction)) + FRAC_PI_2;
                let across = ParallelLines::new(light, angle);
                out.extend(points.map(|point| through(&across, point)));
            }
            Self::Cylinder(light) => out.extend(points.map(|point| light.across(point))),
            Self::Sphere(_) | Self::Disk(_) | Self::Sky(_) => {}
        }
    }
}

fn polygon<'t>(
    light: &ConvexPolygon,
    by: LineDensity,
    setup: LineSetup,
    from: &Viewer<'_>,
) -> LineFamily<'t> {
    let (angle, x, n) = (setup.angle, from.position, from.normal);
    LineFamily::Angular(match by {
        LineDensity::Area | LineDensity::Texture => {
            return LineFamily::Area(LineSampler::new(light, angle, setup.offset));
        }
        LineDensity::SolidAngle => AngularLines::by_solid_angle(light, angle, x),
        LineDensity::Warped => AngularLines::by_warped_solid_angle(light, angle, x),
        LineDensity::Projected => AngularLines::by_projected_solid_angle(light, angle, x, n),
    })
}

/// Lines on a polygon by its texture, along its edges unless a direction is asked for; `None` where
/// the image does not cover the polygon exactly.
fn textured<'t>(
    texture: &'t impl EmissionTexture,
    light: &ConvexPolygon,
    setup: LineSetup,
) -> Option<TexturedLines<'t>> {
    let image = texture.over(light)?;
    if setup.fixed {
        return TexturedLines::new(light, image, setup.fraction * PI);
    }
    let axis = match (2.0 * setup.fraction).rem_euclid(2.0) >= 1.0 {
        true => TextureAxis::V,
        false => TextureAxis::U,
    };
    TexturedLines::along(light, image, axis)
}

/// Lines along the axis, whatever the direction asked for.
fn cylinder<'t>(
    light: &CylinderView,
    by: LineDensity,
    setup: LineSetup,
    from: &Viewer<'_>,
) -> LineFamily<'t> {
    let measure = match by {
        LineDensity::SolidAngle | LineDensity::Warped => ChordMeasure::SolidAngle,
        LineDensity::Projected => ChordMeasure::Projected,
        LineDensity::Area | LineDensity::Texture => match setup.offset {
            OffsetDensity::Uniform => ChordMeasure::Uniform,
            OffsetDensity::Length => ChordMeasure::Length,
        },
    };
    LineFamily::Cylinder(along_cylinder(light, from, measure))
}

/// Lines of a measure along a cylinder, above both horizons of a viewer.
pub(super) fn along_cylinder(
    light: &CylinderView,
    from: &Viewer<'_>,
    measure: ChordMeasure,
) -> CylinderLines {
    CylinderLines::of(light, &[from.normal, from.geometric_normal], measure)
}

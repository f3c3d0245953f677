//! This module holds the lines on the surface of any light that has lines (polygons and cylinders),
//! by any density.

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

/// The measure in which lines, and points on them, are uniformly distributed where there are no
/// occluders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineDensity {
    /// Area: points are uniform in the length of the line (Salesin & Jarosz 2019, eq. 14).
    Area,
    /// Solid angle (Salesin & Jarosz 2019, eqs. 16–19), for any polygon and direction.
    SolidAngle,
    /// Approximately solid angle: the offsets have a density that can be inverted without iteration
    /// ([`AngularLines::by_warped_solid_angle`]). On cylinders this is [`LineDensity::SolidAngle`].
    Warped,
    /// Projected solid angle of the part of the light above the horizon.
    Projected,
    /// The light's texture: offsets in proportion to the texture's integral along the line, and
    /// points in proportion to the texture along the visible part ([`TexturedLines`]). Where there
    /// is no texture, or the light is not a parallelogram that is completely above the horizon,
    /// this is area.
    Texture,
}

/// The direction of parallel lines, and the density of their offsets if they are drawn by area.
#[derive(Clone, Copy, Debug)]
pub struct LineSetup {
    /// The direction in half turns from the first edge of the whole light, which a texture covers.
    pub fraction: f64,
    /// The direction in radians from the first edge of the surface, which may be a part of the
    /// light.
    pub angle: f64,
    /// Whether the direction was given by an option; otherwise it was drawn at random.
    pub fixed: bool,
    /// The density of the offsets for [`LineDensity::Area`].
    pub offset: OffsetDensity,
}

/// Parallel lines on a light, ready for one shading point.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "few, in a buffer or on the stack"
)]
pub enum LineFamily<'t> {
    /// Lines on a polygon, by area.
    Area(LineSampler),
    /// Lines on a polygon, by solid angle or projected solid angle.
    Angular(AngularLines),
    /// Lines on a polygon, by its texture.
    Texture(TexturedLines<'t>),
    /// Lines along a cylinder, parallel to its axis.
    Cylinder(CylinderLines),
}

impl<'t> LineFamily<'t> {
    /// Sets up the lines on a surface by a density, for a shading point; `None` if the surface has
    /// no lines.
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

    /// Returns the unit direction of the lines; zero where there are no lines.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        of!(LineFamily self, lines => lines.direction())
    }

    /// Samples a line from one random number in [0, 1).
    #[must_use]
    pub fn sample(&self, u: f64) -> LineSample {
        of!(LineFamily self, lines => lines.sample(u))
    }

    /// Samples a point of the visible parts of a line from one random number in [0, 1), and returns
    /// it with the joint density of line and point per solid angle at the shading point `x`.
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

    /// Returns the line through a point of the light.
    #[must_use]
    pub fn through(&self, point: DVec3) -> Segment {
        of!(LineFamily self, lines => lines.through(point))
    }

    /// Returns the joint density per solid angle at a point whose line has these visible parts.
    #[must_use]
    pub fn density(&self, at: &LightPoint, visible: &[Interval]) -> f64 {
        of!(LineFamily self, lines => at.density(lines.joint_pdf(at.point, visible)))
    }

    /// Returns the height of the shading point above the plane that touches a cylinder in the line.
    /// An integral along a line on a cylinder has this factor in addition to the density of the
    /// offset. It is 1 on a polygon, whose lines share one plane.
    #[must_use]
    pub fn height(&self, line: &LineSample) -> f64 {
        match self {
            Self::Cylinder(lines) => lines.height(line),
            Self::Area(_) | Self::Angular(_) | Self::Texture(_) => 1.0,
        }
    }
}

impl Surface<'_> {
    /// Adds, for each of some points, the line through it that is perpendicular to `direction`.
    /// Surfaces without lines add no line.
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

/// Sets up the lines on a polygon by a density.
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

/// Sets up lines on a polygon by its texture. They run along its edges unless a direction was
/// given; `None` where the image does not cover the polygon exactly.
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

/// Sets up the lines along a cylinder, which are parallel to its axis whichever direction was
/// given.
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

/// Sets up the lines along a cylinder, drawn by the given measure, above both horizons of the
/// shading point.
pub(super) fn along_cylinder(
    light: &CylinderView,
    from: &Viewer<'_>,
    measure: ChordMeasure,
) -> CylinderLines {
    CylinderLines::of(light, &[from.normal, from.geometric_normal], measure)
}

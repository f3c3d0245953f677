//! This module holds the surfaces of lights: the properties of each shape, and how points and lines
//! are drawn on it.
//!
//! A shape has one file in this folder, with the plain shape, the light that it makes and its
//! [`Shape`], and one variant of [`Surface`]. The files `points.rs` and `lines.rs` choose, in one
//! function for each shape, the technique that draws points or lines by a given density.

/// Runs the same code for each variant of `Surface`, `PointSource` or `LineFamily`.
macro_rules! of {
    (Surface $value:expr, $one:ident => $code:expr) => {
        of!(Surface: Polygon Sphere Disk Cylinder Sky; $value, $one => $code)
    };
    (LineFamily $value:expr, $one:ident => $code:expr) => {
        of!(LineFamily: Area Angular Texture Cylinder; $value, $one => $code)
    };
    (PointSource $value:expr, $one:ident => $code:expr) => {
        of!(PointSource: Area Proxy SolidAngle Projected Lobes Texture SphereCap SphereCone
            SphereProjected DiskArea DiskCone DiskChords DiskLtc CylinderArea CylinderLines Sky;
            $value, $one => $code)
    };
    ($of:ident: $($variant:ident)+; $value:expr, $one:ident => $code:expr) => {
        match $value {
            $($of::$variant($one) => $code,)+
        }
    };
}

pub(crate) mod cylinder;
pub(crate) mod disk;
pub(crate) mod draw;
pub(crate) mod lines;
pub(crate) mod points;
pub(crate) mod polygon;
pub(crate) mod shape;
pub(crate) mod sky;
pub(crate) mod sphere;
pub(crate) mod texture;

use crate::{CylinderView, Disk, Pdf, Shape, SkyView, Sphere, SurfaceMeasure};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_shading::ltc::LtcMixture;

/// A point of a light, with its direction and its distance from the shading point.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// The point, in the coordinates of the light.
    pub point: DVec3,
    /// The point relative to the shading point.
    pub to_light: DVec3,
    /// The unit direction from the shading point to the point.
    pub direction: DVec3,
    /// The square of the distance from the shading point.
    pub square: f64,
    /// The cosine between the light's normal at the point and the direction to the shading point.
    pub cos_light: f64,
}

impl LightPoint {
    /// Describes a point of a surface as seen from the shading point `x`.
    #[inline]
    #[must_use]
    pub fn new(point: DVec3, x: DVec3, surface: &Surface<'_>) -> Self {
        let to_light = point - x;
        Self::towards(point, to_light, to_light / to_light.length(), surface)
    }

    /// Describes a point of a surface when its direction is already known.
    #[inline]
    #[must_use]
    pub fn towards(point: DVec3, to_light: DVec3, direction: DVec3, surface: &Surface<'_>) -> Self {
        Self {
            point,
            to_light,
            direction,
            square: to_light.length_squared(),
            cos_light: -surface.normal(point).dot(direction),
        }
    }

    /// Converts a density of this point to the density per solid angle.
    #[inline]
    #[must_use]
    pub fn density<M: SurfaceMeasure>(&self, pdf: Pdf<M>) -> f64 {
        M::to_solid_angle(pdf, self.square, self.cos_light).value()
    }
}

/// The shading point from which a light is seen.
#[derive(Clone, Copy, Debug)]
pub struct Viewer<'a> {
    /// The position of the shading point.
    pub position: DVec3,
    /// The shading normal, a unit vector.
    pub normal: DVec3,
    /// The unit geometric normal of the surface at the point, which makes a second horizon.
    pub geometric_normal: DVec3,
    /// The reflection at the point as a sum of LTCs, if it is known and a density needs it.
    pub cosines: Option<&'a LtcMixture>,
}

/// The surface of a light, with one variant for each shape.
#[derive(Clone, Copy, Debug)]
pub enum Surface<'a> {
    /// A polygon, or the part of a polygon above the horizons.
    Polygon(&'a ConvexPolygon),
    /// A sphere.
    Sphere(&'a Sphere),
    /// A disk.
    Disk(&'a Disk),
    /// The side of a cylinder, as the shading point sees it.
    Cylinder(&'a CylinderView),
    /// A sky, as the shading point sees it.
    Sky(&'a SkyView<'a>),
}

/// The surface of a light as one shading point sees it: it owns the data that [`Surface`] borrows.
#[derive(Clone, Copy, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "one for each shading point, on the stack"
)]
pub enum SeenSurface<'a> {
    /// A surface that is the same for all shading points.
    Fixed(Surface<'a>),
    /// A cylinder.
    Cylinder(CylinderView),
    /// A sky.
    Sky(SkyView<'a>),
}

impl SeenSurface<'_> {
    /// Borrows the surface.
    #[inline]
    #[must_use]
    pub const fn surface(&self) -> Surface<'_> {
        match self {
            Self::Fixed(surface) => *surface,
            Self::Cylinder(view) => Surface::Cylinder(view),
            Self::Sky(view) => Surface::Sky(view),
        }
    }
}

impl Surface<'_> {
    /// Returns the unit normal at a point of the surface, on the side that emits.
    #[inline]
    #[must_use]
    pub fn normal(&self, point: DVec3) -> DVec3 {
        of!(Surface self, shape => Shape::normal(*shape, point))
    }

    /// Returns the normal if it is the same everywhere.
    #[must_use]
    pub fn flat(&self) -> Option<DVec3> {
        of!(Surface self, shape => shape.flat())
    }

    /// Returns the first point where a ray from the shading point `x` meets the surface; `None`
    /// from inside.
    #[must_use]
    pub fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        of!(Surface self, shape => Shape::meets(*shape, x, direction))
    }

    /// Whether a part of the surface may be above a horizon: see [`Shape::may_rise_above`].
    #[inline]
    #[must_use]
    pub fn may_rise_above(&self, x: DVec3, n: DVec3) -> bool {
        of!(Surface self, shape => shape.may_rise_above(x, n))
    }

    /// Returns half of the smaller width of the surface: see [`Shape::half_width`].
    #[must_use]
    pub fn half_width(&self) -> f64 {
        of!(Surface self, shape => shape.half_width())
    }

    /// Returns the product of `edge` over the distances from the borders: see [`Shape::border`].
    pub fn border(&self, point: DVec3, x: DVec3, edge: impl Fn(f64) -> f64) -> f64 {
        of!(Surface self, shape => shape.border(point, x, edge))
    }
}

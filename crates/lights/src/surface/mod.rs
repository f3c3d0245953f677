//! Surfaces of lights: the properties of each shape, and points and lines of any of them.
//!
//! A shape is one file of this folder, which holds the plain shape, the light that it makes and its
//! [`Shape`], and one arm of [`Surface`]. `points.rs` and `lines.rs` say what draws its points and
//! lines by each density, in one function for each shape.

/// The code for whichever variant of `Surface`, `PointSource` or `LineFamily` the value is.
macro_rules! of {
    (Surface $value:expr, $one:ident => $code:expr) => {
        of!(Surface: Polygon Sphere Disk Cylinder Sky; $value, $one => $code)
    };
    (LineFamily $value:expr, $one:ident => $code:expr) => {
        of!(LineFamily: Area Angular Texture Cylinder; $value, $one => $code)
    };
    (PointSource $value:expr, $one:ident => $code:expr) => {
        of!(PointSource: Area Proxy SolidAngle Projected Lobes Texture SphereCap SphereCone
            SphereProjected DiskArea DiskCone DiskChords DiskLobes CylinderArea CylinderLines Sky;
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
use linelit_shading::ltc::TransformedCosines;

/// A point of a light, and the direction from the shading point to it.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// The point, in the coordinates of the light.
    pub point: DVec3,
    /// The point relative to the shading point.
    pub to_light: DVec3,
    /// The unit direction from the shading point.
    pub direction: DVec3,
    /// The square of the distance.
    pub square: f64,
    /// The cosine between the light's normal and the direction to the shading point.
    pub cos_light: f64,
}

impl LightPoint {
    /// A point of a surface as the shading point `x` meets it.
    #[inline]
    #[must_use]
    pub fn new(point: DVec3, x: DVec3, surface: &Surface<'_>) -> Self {
        let to_light = point - x;
        Self::towards(point, to_light, to_light / to_light.length(), surface)
    }

    /// A point of a surface of which the direction is known.
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

    /// A density of this point per solid angle.
    #[inline]
    #[must_use]
    pub fn density<M: SurfaceMeasure>(&self, pdf: Pdf<M>) -> f64 {
        M::to_solid_angle(pdf, self.square, self.cos_light).value()
    }
}

/// The shading point that looks at a light.
#[derive(Clone, Copy, Debug)]
pub struct Viewer<'a> {
    /// The place of the shading point.
    pub position: DVec3,
    /// The shading normal, a unit vector.
    pub normal: DVec3,
    /// The unit normal of the surface that the point lies on: another horizon.
    pub geometric_normal: DVec3,
    /// The point's reflection, if that is known and a density asks for it.
    pub cosines: Option<&'a TransformedCosines>,
}

/// The surface of a light: one arm for each shape.
#[derive(Clone, Copy, Debug)]
pub enum Surface<'a> {
    /// A polygon, or the part of it above the horizons.
    Polygon(&'a ConvexPolygon),
    /// A sphere.
    Sphere(&'a Sphere),
    /// A disk.
    Disk(&'a Disk),
    /// The side of a cylinder, as its shading point sees it.
    Cylinder(&'a CylinderView),
    /// A sky, as its shading point sees it.
    Sky(&'a SkyView<'a>),
}

/// The surface of a light as one shading point sees it: what [`Surface`] borrows.
#[derive(Clone, Copy, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "one for each shading point, on the stack"
)]
pub enum SeenSurface<'a> {
    /// A surface that is the same from everywhere.
    Fixed(Surface<'a>),
    /// A cylinder.
    Cylinder(CylinderView),
    /// A sky.
    Sky(SkyView<'a>),
}

impl SeenSurface<'_> {
    /// The surface.
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
    /// The unit normal at one of its points, on the side that emits.
    #[inline]
    #[must_use]
    pub fn normal(&self, point: DVec3) -> DVec3 {
        of!(Surface self, shape => Shape::normal(*shape, point))
    }

    /// The normal, if it is the same everywhere.
    #[must_use]
    pub fn flat(&self) -> Option<DVec3> {
        of!(Surface self, shape => shape.flat())
    }

    /// The place where a ray from the shading point `x` meets it first; none from inside.
    #[must_use]
    pub fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        of!(Surface self, shape => Shape::meets(*shape, x, direction))
    }

    /// Whether some of it may be above a horizon: see [`Shape::may_rise_above`].
    #[inline]
    #[must_use]
    pub fn may_rise_above(&self, x: DVec3, n: DVec3) -> bool {
        of!(Surface self, shape => shape.may_rise_above(x, n))
    }

    /// Half the smaller extent: see [`Shape::half_width`].
    #[must_use]
    pub fn half_width(&self) -> f64 {
        of!(Surface self, shape => shape.half_width())
    }

    /// The product of `edge` of the distances from the borders: see [`Shape::border`].
    pub fn border(&self, point: DVec3, x: DVec3, edge: impl Fn(f64) -> f64) -> f64 {
        of!(Surface self, shape => shape.border(point, x, edge))
    }
}

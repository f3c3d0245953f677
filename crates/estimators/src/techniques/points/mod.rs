//! Techniques of points: what each does on each kind of light.

pub(crate) mod area;
pub(crate) mod bsdf;
pub(crate) mod linear;
pub(crate) mod ltc;
pub(crate) mod projected;
pub(crate) mod proxy;
pub(crate) mod round;
pub(crate) mod solid_angle;
pub(crate) mod texture;
pub(crate) mod visible_area;

use crate::light::Shape;
use crate::point_block::Columns;
use crate::techniques::point_techniques;
use crate::text::{Options, Result};
use crate::{EmissionTexture, LinearOptions, PointBy, ShadingPoint};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{
    AreaSampler, ChordMeasure, CylinderLines, CylinderView, Disk, DiskCone, Pdf, PointColumns,
    PointTechnique, Sphere, SphereCone, SurfaceMeasure,
};
use round::{RoundPoints, Viewer};

/// Points, and how their visibility is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Points {
    /// How they are drawn.
    pub by: PointBy,
    /// Whether points of a technique that stands alone share a shaft in place of shadow rays; where
    /// the shaft is empty, the closed form. Points of a combination share its shaft anyway.
    pub in_shaft: bool,
}

impl Points {
    /// Points of a density, with a shadow ray each.
    #[must_use]
    pub const fn by(by: PointBy) -> Self {
        Self {
            by,
            in_shaft: false,
        }
    }

    /// Directions drawn from the BSDF.
    #[must_use]
    pub const fn bsdf() -> Self {
        Self::by(PointBy::Bsdf)
    }
}

impl PointBy {
    /// Which technique of linear lights it stands for.
    pub(crate) fn on_linear(self) -> LinearOptions {
        point_techniques! { dispatch [self, technique => technique.on_linear()] }
    }
}

impl Points {
    /// With the options that a text says.
    pub(crate) fn read(self, options: &mut Options<'_>) -> Result<Self> {
        let by = self.by.read(options)?;
        let mut in_shaft = self.in_shaft;
        if point_techniques! { constant [self.by, HAS_VISIBILITY] } {
            let ways = [("rays", false), ("shaft", true)];
            options.choose("visibility", ways, &mut in_shaft)?;
        }
        Ok(Self { by, in_shaft })
    }

    /// The options that are not the default, as `key=value`.
    pub(crate) fn write(self, out: &mut Vec<String>) {
        self.by.write(out);
        if self.in_shaft {
            out.push("visibility=shaft".to_owned());
        }
    }
}

/// A density of points, for all kinds of lights: all there is to know about one technique.
///
/// Wherever a technique has nothing of its own to say it is another one: where it gives `None` on a
/// surface, points uniform on the area. Nothing is black unless said. A technique with options of
/// its own implements [`OwnOptions`](crate::text::OwnOptions) as well.
pub(crate) trait PointDensity: Copy + Default {
    /// The name in texts.
    const NAME: &'static str;

    /// Whether its samples need no weights as an estimator's only technique: see
    /// [`Weights::Alone`](crate::Weights::Alone). One that does is then a combination of one.
    const STANDS_ALONE: bool = true;

    /// Whether it has the option `visibility`: alone, its points may share a shaft.
    const HAS_VISIBILITY: bool = false;

    /// Whether it asks for [`Polygon::cosines`] and [`Viewer::cosines`].
    const ASKS_FOR_COSINES: bool = false;

    /// Whether the option `mis` is one of its own.
    const HAS_OWN_MIS: bool = false;

    /// What draws points of a polygon in one estimate; `'t` is the life of the polygon and its
    /// texture.
    type OnPolygon<'t>: DrawPoints<ConvexPolygon>;

    /// On a polygon: the whole light for a technique that stands alone, in a combination the part
    /// of it above the horizon.
    fn on_polygon<'t, T: EmissionTexture>(
        self,
        light: &Polygon<'t, T>,
    ) -> Option<Self::OnPolygon<'t>>;

    /// On a sphere; as [`PointBy::SolidAngle`] unless said.
    fn on_sphere(self, sphere: &Sphere, viewer: &Viewer<'_>) -> Option<RoundPoints> {
        Some(SphereCone::new(sphere, viewer.position).into())
    }

    /// On a disk; as [`PointBy::SolidAngle`] unless said.
    fn on_disk(self, disk: &Disk, viewer: &Viewer<'_>) -> Option<RoundPoints> {
        Some(DiskCone::new(disk, viewer.position).into())
    }

    /// On what a shading point sees of a cylinder, with its horizons, the shading normal's first;
    /// as [`PointBy::SolidAngle`] unless said.
    fn on_cylinder(self, seen: &CylinderView, horizons: &[DVec3; 2]) -> RoundPoints {
        CylinderLines::of(seen, horizons, ChordMeasure::SolidAngle).into()
    }

    /// Which technique of linear lights it stands for; their projected solid angle unless said.
    fn on_linear(self) -> LinearOptions {
        LinearOptions::default()
    }
}

/// A polygon to draw from, the light or the part of it above the horizons, and who looks at it.
pub(crate) struct Polygon<'t, T> {
    pub polygon: &'t ConvexPolygon,
    /// Radians from the first edge of this part to that of the whole light, counter-clockwise about
    /// the normal: added to a direction's angle from the latter, it gives that from the former.
    pub turn: f64,
    /// The texture of the whole light.
    pub texture: Option<&'t T>,
    /// The shading point.
    pub position: DVec3,
    /// Its shading normal.
    pub normal: DVec3,
    /// What it reflects, if that is known and a technique asks for it.
    pub cosines: Option<TransformedCosines>,
}

/// A point of a light, and the direction from the shading point to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightPoint {
    pub point: DVec3,
    /// The point relative to the shading point.
    pub to_light: DVec3,
    pub direction: DVec3,
    /// The square of the distance.
    pub square: f64,
    /// The cosine between the light's normal and the direction to the shading point: positive on
    /// the side that the normal points to.
    pub cos_light: f64,
}

impl LightPoint {
    /// A point of a surface as the shading point `x` meets it.
    #[inline]
    pub(crate) fn new(point: DVec3, x: DVec3, surface: &impl Shape) -> Self {
        let to_light = point - x;
        Self::towards(point, to_light, to_light / to_light.length(), surface)
    }

    /// The same, the direction known.
    #[inline]
    pub(crate) fn towards(
        point: DVec3,
        to_light: DVec3,
        direction: DVec3,
        surface: &impl Shape,
    ) -> Self {
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
    pub(crate) fn density<M: SurfaceMeasure>(&self, pdf: Pdf<M>) -> f64 {
        M::to_solid_angle(pdf, self.square, self.cos_light).value()
    }
}

/// A point of a light and its density per solid angle; `None` where a draw missed the light.
pub(crate) type Drawn = Option<(LightPoint, f64)>;

/// What draws points of a surface, ready for a shading point.
pub(crate) trait DrawPoints<S> {
    /// A point from two random numbers.
    fn draw<R: Reflection>(&self, u: [f64; 2], surface: &S, point: &ShadingPoint<R>) -> Drawn;

    /// Points from eight pairs of random numbers a row, with their densities, per area if the
    /// answer is `true`, else per solid angle; `None` where points are no function of the numbers
    /// and the source alone.
    fn draw_columns(&self, rows: usize, columns: &mut Columns) -> Option<bool> {
        let _ = (rows, columns);
        None
    }

    /// The density per solid angle of any point of the light.
    fn density<R: Reflection>(&self, at: &LightPoint, point: &ShadingPoint<R>) -> f64;
}

impl<S: Shape, P: PointTechnique> DrawPoints<S> for P {
    #[inline]
    fn draw<R: Reflection>(&self, u: [f64; 2], surface: &S, point: &ShadingPoint<R>) -> Drawn {
        let sample = self.sample(u);
        let to_light = sample.point - point.position;
        let direction = if P::Measure::IS_LOCAL {
            to_light / to_light.length()
        } else {
            to_light.normalize_or_zero()
        };
        let at = LightPoint::towards(sample.point, to_light, direction, surface);
        Some((at, at.density(sample.pdf)))
    }

    fn draw_columns(&self, rows: usize, columns: &mut Columns) -> Option<bool> {
        let Columns {
            u, point, density, ..
        } = columns;
        let out = PointColumns {
            point: point.each_mut().map(|column| &mut column[..rows]),
            pdf: &mut density[..rows],
        };
        self.sample_into(u.each_ref().map(|column| &column[..rows]), out);
        Some(P::Measure::IS_LOCAL)
    }

    #[inline]
    fn density<R: Reflection>(&self, at: &LightPoint, _: &ShadingPoint<R>) -> f64 {
        at.density(self.pdf(at.point))
    }
}

point_techniques! { sources [
    /// What a technique of points draws from on a polygon.
    PointSource
] }

impl<'t> PointSource<'t> {
    pub(crate) fn new<T: EmissionTexture>(by: PointBy, light: &Polygon<'t, T>) -> Self {
        let source = point_techniques! { prepare
            [by, PointSource, technique => technique.on_polygon(light)]
        };
        source.unwrap_or_else(|| Self::Area(AreaSampler::new(light.polygon)))
    }
}

impl DrawPoints<ConvexPolygon> for PointSource<'_> {
    fn draw<R: Reflection>(
        &self,
        u: [f64; 2],
        polygon: &ConvexPolygon,
        point: &ShadingPoint<R>,
    ) -> Drawn {
        point_techniques! { with_source
            [self, PointSource, source => source.draw(u, polygon, point)]
        }
    }

    fn draw_columns(&self, rows: usize, columns: &mut Columns) -> Option<bool> {
        point_techniques! { with_source
            [self, PointSource, source => {
                DrawPoints::<ConvexPolygon>::draw_columns(source, rows, columns)
            }]
        }
    }

    fn density<R: Reflection>(&self, at: &LightPoint, point: &ShadingPoint<R>) -> f64 {
        point_techniques! { with_source
            [self, PointSource, source => DrawPoints::<ConvexPolygon>::density(source, at, point)]
        }
    }
}

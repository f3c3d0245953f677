//! This module holds [`Light`], the enum of all kinds of light, with constructors from plain
//! numbers, emission and power.
//!
//! Each shape with a surface has its own file in `surface`. Linear lights are in `light`, delta
//! lights (points and parallel light) in `delta`, and light from infinity in `sky`.

#![allow(clippy::disallowed_types, reason = "points share their profiles")]

use crate::surface::shape::{Extent, Normals, ShapeLight, bounded, bounds_of, is_position};
use crate::{
    Area, AreaLight, AreaSampler, Cylinder, CylinderArea, CylinderLight, CylinderView, DeltaSample,
    Disk, DiskArea, DiskLight, DistantLight, Emission, Falloff, LinearLight, PointDensity,
    PointLight, PointSample, PointTechnique, Profile, ProfileKind, SeenSurface, Sky, SkyEmission,
    SkyView, Sphere, SphereCap, SphereLight, Surface,
};
use core::f64::consts::{FRAC_PI_2, PI};
use linelit_elementary::cos;
use linelit_geometry::{ConvexPolygon, DVec3, Frame, PolygonError, Segment, Vector3, predicates};
use std::sync::Arc;

/// A light of any kind that the renderer can sample.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "lights are few")]
pub enum Light {
    /// A convex polygon.
    Area(AreaLight),
    /// A linear light: a segment that shines like an infinitely thin cylinder.
    Linear(LinearLight),
    /// A sphere that emits outwards.
    Sphere(SphereLight),
    /// A disk.
    Disk(DiskLight),
    /// The side of a cylinder, which emits outwards.
    Cylinder(CylinderLight),
    /// A point that emits in all directions, or by a profile.
    Point(PointLight),
    /// Parallel light, as from a star.
    Distant(DistantLight),
    /// An environment, or a sun.
    Sky(Sky),
}

/// Matches on a [`Light`]: evaluates the same expression for each kind of light that has a surface,
/// and the other arms for the other kinds.
macro_rules! with_surface {
    ($light:expr, $one:ident => $code:expr, $($others:tt)+) => {
        match $light {
            Light::Area($one) => $code,
            Light::Sphere($one) => $code,
            Light::Disk($one) => $code,
            Light::Cylinder($one) => $code,
            $($others)+
        }
    };
}

impl Light {
    /// Returns the name of the kind of light, in one word.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Area(_) => "polygon",
            Self::Linear(_) => "line",
            Self::Sphere(_) => "sphere",
            Self::Disk(_) => "disk",
            Self::Cylinder(_) => "cylinder",
            Self::Point(_) => "point",
            Self::Distant(_) => "distant",
            Self::Sky(_) => "sky",
        }
    }

    /// Returns the emission of each point of the light. Kinds without a radiance have another
    /// quantity in its field: linear lights have radiance times radius, points intensity, parallel
    /// light irradiance, and skies their mean radiance.
    #[inline]
    #[must_use]
    pub fn emission(&self) -> Emission {
        with_surface!(self, l => l.emission(),
            Self::Linear(l) => Emission::one_sided(l.radiance_radius),
            Self::Point(l) => Emission::one_sided(l.intensity),
            Self::Distant(l) => Emission::one_sided(l.irradiance),
            Self::Sky(l) => Emission::one_sided(l.mean()),
        )
    }

    /// Returns the light that arrives at the point `x` from a delta light (a point or parallel
    /// light); `None` for other lights, and where no light arrives.
    #[must_use]
    pub fn beam(&self, x: DVec3) -> Option<DeltaSample> {
        match self {
            Self::Point(l) => l.beam(x),
            Self::Distant(l) => l.beam(x),
            _ => None,
        }
    }

    /// Sets the ball that holds the scene, which light from infinity needs; other lights ignore it.
    pub const fn set_scene(&mut self, ball: Sphere) {
        match self {
            Self::Distant(l) => l.scene = ball,
            Self::Sky(l) => l.scene = ball,
            _ => {}
        }
    }

    /// Returns the area of the surface that emits. If both sides emit, it is the area of one side;
    /// it is zero for lights without a surface.
    #[must_use]
    pub fn area(&self) -> f64 {
        with_surface!(self, l => l.area(),
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) | Self::Sky(_) => 0.0,
        )
    }

    /// Returns the unit normal at a point of the surface, on the side that emits; `None` for lights
    /// without sides: linear lights, points and light from infinity.
    #[inline]
    #[must_use]
    pub fn normal(&self, point: DVec3) -> Option<DVec3> {
        with_surface!(self, l => Some(ShapeLight::normal(l, point)),
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) | Self::Sky(_) => None,
        )
    }

    /// Whether the whole surface lies in one plane.
    #[must_use]
    pub const fn is_flat(&self) -> bool {
        matches!(self, Self::Area(_) | Self::Disk(_))
    }

    /// Returns the densities by which points can be drawn on the shape of this light, except the
    /// densities that follow a texture or a reflection. The list is empty for lights without sides.
    #[must_use]
    pub const fn densities(&self) -> &'static [PointDensity] {
        use PointDensity::{Area, ProjectedSolidAngle, Proxy, SolidAngle, VisibleArea};
        match self {
            Self::Area(_) => &[Area, Proxy, SolidAngle, ProjectedSolidAngle],
            Self::Disk(_) => &[Area, SolidAngle, ProjectedSolidAngle],
            Self::Sphere(_) | Self::Cylinder(_) => {
                &[Area, VisibleArea, SolidAngle, ProjectedSolidAngle]
            }
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) | Self::Sky(_) => &[],
        }
    }

    /// Returns the surface as the shading point `x` sees it; `None` for lights without a surface,
    /// and for a cylinder that is seen from inside.
    #[inline]
    #[must_use]
    pub fn seen_from(&self, x: DVec3) -> Option<SeenSurface<'_>> {
        Some(match self {
            Self::Area(l) => SeenSurface::Fixed(Surface::Polygon(&l.polygon)),
            Self::Sphere(l) => SeenSurface::Fixed(Surface::Sphere(&l.sphere)),
            Self::Disk(l) => SeenSurface::Fixed(Surface::Disk(&l.disk)),
            Self::Cylinder(l) => SeenSurface::Cylinder(CylinderView::new(&l.cylinder, x)?),
            Self::Sky(l) => SeenSurface::Sky(SkyView::new(l, x)),
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) => return None,
        })
    }

    /// Whether any point of the light can light a surface at `x` with the unit normal `n` when
    /// there are no occluders: a part of the light is above the tangent plane, and `x` is on a side
    /// that emits.
    #[must_use]
    pub fn can_light(&self, x: DVec3, n: DVec3) -> bool {
        with_surface!(self, l => l.can_light(x, n),
            Self::Linear(l) => {
                let ends = [l.segment.p0, l.segment.p1];
                ends.iter().any(|v| n.dot(*v - x) > 0.0)
            }
            Self::Point(_) | Self::Distant(_) => {
                self.beam(x).is_some_and(|beam| n.dot(beam.direction) > 0.0)
            }
            Self::Sky(l) => l.is_above(x, n),
        )
    }

    /// Samples a point uniformly on the area that `x` sees, from two random numbers in [0, 1). Of a
    /// convex light (a sphere or a cylinder) this is the part that faces `x`; of a flat light it is
    /// the whole area. `None` for lights without an area.
    #[must_use]
    pub fn sample_area(&self, x: DVec3, u: [f64; 2]) -> Option<PointSample<Area>> {
        Some(match self {
            Self::Area(l) => AreaSampler::new(&l.polygon).sample(u),
            Self::Sphere(l) => SphereCap::visible(&l.sphere, x).sample(u),
            Self::Disk(l) => DiskArea::new(&l.disk).sample(u),
            Self::Cylinder(l) => CylinderArea::visible(&l.cylinder, x).sample(u),
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) | Self::Sky(_) => return None,
        })
    }

    /// Returns the centre of the part of the surface that `x` sees, and the projected area of this
    /// part as a fraction of the surface's area: one for flat lights, a quarter for spheres. `None`
    /// for lights without an area.
    #[must_use]
    pub fn middle(&self, x: DVec3) -> Option<(DVec3, f64)> {
        with_surface!(self, l => Some(l.middle(x)),
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) | Self::Sky(_) => None,
        )
    }

    /// Whether the emission is finite and not negative, the shape has a size and a direction, and
    /// no coordinate is larger than `largest` in magnitude.
    #[must_use]
    pub fn is_valid(&self, largest: f64) -> bool {
        let emission = self.emission().radiance;
        let emits = emission.is_finite() && emission.min_element() >= 0.0;
        emits
            && with_surface!(self, l => l.is_valid(largest),
                Self::Linear(l) => {
                    let ends = [l.segment.p0, l.segment.p1];
                    ends.iter().all(|p| is_position(*p, largest)) && l.segment.length() > 0.0
                }
                Self::Point(l) => is_position(l.position, largest),
                Self::Distant(l) => l.direction.is_normalized(),
                Self::Sky(l) => match l.emission {
                    SkyEmission::Constant(_) | SkyEmission::Image(_) => true,
                    SkyEmission::Sun { direction, half_angle, .. } => {
                        direction.is_normalized() && half_angle > 0.0 && half_angle <= FRAC_PI_2
                    }
                },
            )
    }

    /// Returns the light's bounding box, the mean position and the variance of its points, and the
    /// set of its normals. Light from infinity counts as spread over the ball that holds the scene.
    #[must_use]
    pub fn extent(&self) -> Extent {
        with_surface!(self, l => l.extent(),
            Self::Linear(l) => Extent {
                bounds: bounds_of(&[l.segment.p0, l.segment.p1]),
                mean: l.segment.at(0.5),
                variance: l.segment.vector().length_squared() / 12.0,
                normals: Normals::Around,
            },
            Self::Point(l) => {
                let (center, radius) = (l.position, 0.0);
                Sphere { center, radius }.extent()
            }
            Self::Distant(l) => l.scene.extent(),
            Self::Sky(l) => l.scene.extent(),
        )
    }

    /// Returns the emitted power in W, averaged over the channels: π A L for each side that emits,
    /// with the area A and the radiance L. A linear light of the length l and the radius R has the
    /// area 2πR l of its cylinder's surface. A point with the intensity I has the power 4π I, and
    /// light from infinity the power that falls on the ball that holds the scene. For every kind of
    /// light the result is `f64::MAX` where it overflows, and zero where it is negative or not a
    /// number.
    #[must_use]
    pub fn power(&self) -> f64 {
        let (factor, emission) = self.power_factors();
        bounded(factor * (emission.element_sum() / 3.0))
    }

    /// Returns the emitted power in W of each channel, linear RGB; the mean of the three is
    /// [`Light::power`].
    #[must_use]
    pub fn power_by_channel(&self) -> DVec3 {
        let (factor, emission) = self.power_factors();
        (factor * emission).map(bounded)
    }

    /// Returns a factor and an emission by channel whose product is the power in W.
    fn power_factors(&self) -> (f64, DVec3) {
        let emission = self.emission();
        let sides = if emission.two_sided { 2.0 } else { 1.0 };
        let surface = match self {
            Self::Linear(l) => 2.0 * PI.powi(2) * l.segment.length(),
            Self::Point(l) => return (1.0, l.power()),
            Self::Distant(l) => return (1.0, l.power()),
            Self::Sky(l) => return (1.0, l.power()),
            with_surface => sides * PI * with_surface.area(),
        };
        (surface, emission.radiance)
    }
}

/// The ball that stands in for the scene's until [`Light::set_scene`] sets it.
const NO_SCENE: Sphere = Sphere {
    center: DVec3::ZERO,
    radius: 0.0,
};

/// Constructors from plain numbers, in linear RGB. Lights that could emit from two sides emit from
/// the side that their normal points to, unless [`Light::two_sided`] makes both sides emit.
impl Light {
    /// Makes a convex polygon with a radiance in W/(m² sr). The corners run counter-clockwise as
    /// seen from the side that emits.
    ///
    /// ```
    /// use linelit_lights::Light;
    /// let light = Light::polygon(&[[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], [5.0; 3])?;
    /// assert!((light.power() - std::f64::consts::PI * 0.5 * 5.0).abs() < 1e-12);
    /// # Ok::<(), linelit_geometry::PolygonError>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`ConvexPolygon::new`]: there must be 3 to 16 finite corners that make a flat,
    /// convex polygon.
    pub fn polygon(
        corners: &[impl Vector3 + Copy],
        radiance: impl Vector3,
    ) -> Result<Self, PolygonError> {
        Ok(Self::Area(AreaLight {
            polygon: ConvexPolygon::new(corners)?,
            emission: Emission::one_sided(radiance.dvec3()),
        }))
    }

    /// Makes the parallelogram `corner`, `corner + u`, `corner + u + v`, `corner + v` with a
    /// radiance in W/(m² sr). It emits along `u × v`.
    ///
    /// # Errors
    /// The errors of [`ConvexPolygon::parallelogram`].
    pub fn rectangle(
        corner: impl Vector3,
        u: impl Vector3,
        v: impl Vector3,
        radiance: impl Vector3,
    ) -> Result<Self, PolygonError> {
        Ok(Self::Area(AreaLight {
            polygon: ConvexPolygon::parallelogram(corner, u, v)?,
            emission: Emission::one_sided(radiance.dvec3()),
        }))
    }

    /// Makes a disk with a radiance in W/(m² sr). It emits along its normal, which may have any
    /// length but zero.
    #[must_use]
    pub fn disk(
        center: impl Vector3,
        normal: impl Vector3,
        radius: f64,
        radiance: impl Vector3,
    ) -> Self {
        Self::Disk(DiskLight {
            disk: Disk {
                center: center.dvec3(),
                normal: unit(normal),
                radius,
            },
            emission: Emission::one_sided(radiance.dvec3()),
        })
    }

    /// Makes a sphere with a radiance in W/(m² sr). It emits outwards, so that points inside it
    /// receive no light from it.
    #[must_use]
    pub fn sphere(center: impl Vector3, radius: f64, radiance: impl Vector3) -> Self {
        Self::Sphere(SphereLight {
            sphere: Sphere {
                center: center.dvec3(),
                radius,
            },
            radiance: radiance.dvec3(),
        })
    }

    /// Makes the side of a cylinder, without caps, around the axis between two points, with a
    /// radiance in W/(m² sr). It emits outwards, so that points inside it receive no light from it.
    #[must_use]
    pub fn cylinder(
        from: impl Vector3,
        to: impl Vector3,
        radius: f64,
        radiance: impl Vector3,
    ) -> Self {
        Self::Cylinder(CylinderLight {
            cylinder: Cylinder {
                axis: Segment::new(from.dvec3(), to.dvec3()),
                radius,
            },
            radiance: radiance.dvec3(),
        })
    }

    /// Makes a linear light between two points: a cylinder so thin that only the product of its
    /// radiance and its radius matters, in W/(m sr).
    #[must_use]
    pub fn line(from: impl Vector3, to: impl Vector3, radiance_radius: impl Vector3) -> Self {
        Self::Linear(LinearLight {
            segment: Segment::new(from.dvec3(), to.dvec3()),
            radiance_radius: radiance_radius.dvec3(),
        })
    }

    /// Makes a point light with an intensity in W/sr that is the same in all directions.
    #[must_use]
    pub fn point(position: impl Vector3, intensity: impl Vector3) -> Self {
        Self::Point(PointLight {
            position: position.dvec3(),
            intensity: intensity.dvec3(),
            profile: None,
        })
    }

    /// Makes a spot: a point light with an intensity in W/sr along a direction of any length but
    /// zero. Between two angles to this direction, in radians, the intensity falls to zero as in
    /// pbrt-v4.
    #[must_use]
    pub fn spot(
        position: impl Vector3,
        direction: impl Vector3,
        [inner_rad, outer_rad]: [f64; 2],
        intensity: impl Vector3,
    ) -> Self {
        let kind = ProfileKind::Cone {
            cos_inner: cos(inner_rad),
            cos_outer: cos(outer_rad),
            falloff: Falloff::Smooth,
        };
        let frame = Frame::from_normal(unit(direction));
        Self::Point(PointLight {
            position: position.dvec3(),
            intensity: intensity.dvec3(),
            profile: Some(Arc::new(Profile::new(kind, frame))),
        })
    }

    /// Makes parallel light. The direction points towards the light and may have any length but
    /// zero; the irradiance, in W/m², is the irradiance of a surface that faces the light.
    #[must_use]
    pub fn distant(direction: impl Vector3, irradiance: impl Vector3) -> Self {
        Self::Distant(DistantLight {
            direction: unit(direction),
            irradiance: irradiance.dvec3(),
            scene: NO_SCENE,
        })
    }

    /// Makes a sky with a radiance in W/(m² sr) that is the same in all directions.
    #[must_use]
    pub fn sky(radiance: impl Vector3) -> Self {
        let emission = SkyEmission::Constant(radiance.dvec3());
        Self::from(emission)
    }

    /// Makes a sun: a disk at infinity with a radiance in W/(m² sr). The direction points towards
    /// its centre and may have any length but zero; `half_angle_rad` is half of the angle under
    /// which the sun is seen, in radians, above 0 and up to π/2.
    #[must_use]
    pub fn sun(direction: impl Vector3, half_angle_rad: f64, radiance: impl Vector3) -> Self {
        let (direction, radiance) = (unit(direction), radiance.dvec3());
        Self::from(SkyEmission::Sun {
            direction,
            half_angle: half_angle_rad,
            radiance,
        })
    }

    /// Returns this light with both sides emitting if it is a polygon or a disk; lights of other
    /// kinds do not change.
    #[must_use]
    pub fn two_sided(mut self) -> Self {
        match &mut self {
            Self::Area(l) => l.emission.two_sided = true,
            Self::Disk(l) => l.emission.two_sided = true,
            _ => {}
        }
        self
    }
}

impl From<SkyEmission> for Light {
    fn from(emission: SkyEmission) -> Self {
        Self::Sky(Sky {
            emission,
            portal: None,
            scene: NO_SCENE,
        })
    }
}

/// Returns the unit vector along `v`, or zero if `v` is zero.
fn unit(v: impl Vector3) -> DVec3 {
    predicates::normalize(v.dvec3()).unwrap_or(DVec3::ZERO)
}

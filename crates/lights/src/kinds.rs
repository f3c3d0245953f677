//! A light of any kind, made of plain numbers; its emission and its power.
//!
//! Lights with a surface are in `surface`, one file for each shape; lines in `light`, lights
//! without size in `delta`, and light from infinity in `sky`.

#![allow(clippy::disallowed_types, reason = "points share their profiles")]

use crate::surface::shape::{Extent, Normals, ShapeLight, bounded, bounds_of, is_position};
use crate::{
    Area, AreaLight, AreaSampler, Beam, Cylinder, CylinderArea, CylinderLight, CylinderView, Disk,
    DiskArea, DiskLight, DistantLight, Emission, Falloff, LinearLight, PointDensity, PointLight,
    PointSample, PointTechnique, Profile, ProfileKind, SeenSurface, Sky, SkyEmission, SkyView,
    Sphere, SphereCap, SphereLight, Surface,
};
use core::f64::consts::{FRAC_PI_2, PI};
use linelit_elementary::cos;
use linelit_geometry::{ConvexPolygon, DVec3, Frame, PolygonError, Segment, Vector3, predicates};
use std::sync::Arc;

/// A light of any kind that the renderer can sample.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "lights are few")]
pub enum Light {
    /// A polygon.
    Area(AreaLight),
    /// A line.
    Linear(LinearLight),
    /// A sphere.
    Sphere(SphereLight),
    /// A disk.
    Disk(DiskLight),
    /// A cylinder.
    Cylinder(CylinderLight),
    /// A point.
    Point(PointLight),
    /// Parallel light.
    Distant(DistantLight),
    /// An environment, or a sun.
    Sky(Sky),
}

/// The code for a light with a surface, whatever its shape, and what is said of the other kinds.
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
    /// The name of its kind, in one word.
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

    /// Returns the emission of each point; in place of radiance, of linear lights radiance times
    /// radius, of points intensity, of parallel light irradiance, and of skies the mean radiance.
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

    /// The light of a source without size at the point `x`, if it is one and light arrives.
    #[must_use]
    pub fn beam(&self, x: DVec3) -> Option<Beam> {
        match self {
            Self::Point(l) => l.beam(x),
            Self::Distant(l) => l.beam(x),
            _ => None,
        }
    }

    /// Sets the ball that holds the scene, of light from infinity; other lights have none.
    pub const fn set_scene(&mut self, ball: Sphere) {
        match self {
            Self::Distant(l) => l.scene = ball,
            Self::Sky(l) => l.scene = ball,
            _ => {}
        }
    }

    /// The area of the surface that emits, of one side if both do; zero of lights without a
    /// surface.
    #[must_use]
    pub fn area(&self) -> f64 {
        with_surface!(self, l => l.area(),
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) | Self::Sky(_) => 0.0,
        )
    }

    /// The unit normal at a point of the surface, on the side that emits; `None` of lights without
    /// sides: lines, points and light from infinity.
    #[inline]
    #[must_use]
    pub fn normal(&self, point: DVec3) -> Option<DVec3> {
        with_surface!(self, l => Some(ShapeLight::normal(l, point)),
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) | Self::Sky(_) => None,
        )
    }

    /// Whether all of its surface is in one plane.
    #[must_use]
    pub const fn is_flat(&self) -> bool {
        matches!(self, Self::Area(_) | Self::Disk(_))
    }

    /// The densities of points that its shape has, without those of textures and reflections; none
    /// of lights without sides.
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

    /// The surface as the shading point `x` sees it; `None` of lights without one, and of a
    /// cylinder from inside.
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

    /// Whether any point of the light can light a surface at `x` with the unit normal `n`, if
    /// nothing is in between: some of it is above the tangent plane, and `x` is on a side that
    /// emits.
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

    /// A point uniform on the area that `x` sees, of a convex light on all of it, from two random
    /// numbers in [0, 1); `None` of lights without an area.
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

    /// The middle of the part of the surface that `x` sees, and the fraction of the area that it
    /// stands for as seen across: one of flat lights, a quarter of spheres. `None` of lights
    /// without an area.
    #[must_use]
    pub fn middle(&self, x: DVec3) -> Option<(DVec3, f64)> {
        with_surface!(self, l => Some(l.middle(x)),
            Self::Linear(_) | Self::Point(_) | Self::Distant(_) | Self::Sky(_) => None,
        )
    }

    /// Whether its emission is finite and not negative, its shape has a size and a direction, and
    /// no coordinate is beyond `largest`.
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

    /// Where it is, and where it shines. Light from infinity counts as spread over the ball that
    /// holds the scene.
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

    /// Emitted power in W, averaged over the channels: π A L for each side that emits, where the
    /// area A of a linear light is that of the cylinder's surface, 2πR l. A point's is 4π I, and
    /// that of light from infinity what falls on the ball that holds the scene. Of every kind of
    /// light, it is `f64::MAX` where it overflows, and zero where it is negative or no number.
    #[must_use]
    pub fn power(&self) -> f64 {
        let (factor, emission) = self.power_factors();
        bounded(factor * (emission.element_sum() / 3.0))
    }

    /// Emitted power in W of each channel, linear RGB; their mean is [`Light::power`].
    #[must_use]
    pub fn power_by_channel(&self) -> DVec3 {
        let (factor, emission) = self.power_factors();
        (factor * emission).map(bounded)
    }

    /// A measure of the light and its emission, whose product is the power.
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

/// The ball of a scene that is not known yet ([`Light::set_scene`]).
const NO_SCENE: Sphere = Sphere {
    center: DVec3::ZERO,
    radius: 0.0,
};

/// Lights from plain numbers, in linear RGB. Those with two sides emit from the one that their
/// normal points to ([`Light::two_sided`] makes both emit).
impl Light {
    /// A convex polygon of a radiance in W/(m² sr). Its corners run counter-clockwise as seen from
    /// the side that emits.
    ///
    /// ```
    /// use linelit_lights::Light;
    /// let light = Light::polygon(&[[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], [5.0; 3])?;
    /// assert!((light.power() - std::f64::consts::PI * 0.5 * 5.0).abs() < 1e-12);
    /// # Ok::<(), linelit_geometry::PolygonError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`ConvexPolygon::new`]: 3 to 16 finite corners that make a flat, convex polygon.
    pub fn polygon(
        corners: &[impl Vector3 + Copy],
        radiance: impl Vector3,
    ) -> Result<Self, PolygonError> {
        Ok(Self::Area(AreaLight {
            polygon: ConvexPolygon::new(corners)?,
            emission: Emission::one_sided(radiance.dvec3()),
        }))
    }

    /// The parallelogram `corner`, `corner + u`, `corner + u + v`, `corner + v` of a radiance in
    /// W/(m² sr), which emits along `u × v`.
    ///
    /// # Errors
    /// Those of [`ConvexPolygon::parallelogram`].
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

    /// A disk of a radiance in W/(m² sr), which emits along its normal, of any length but zero.
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

    /// A sphere of a radiance in W/(m² sr), which emits outwards: points inside it get nothing of
    /// it.
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

    /// The side of a cylinder of a radiance in W/(m² sr), around the axis between two points, which
    /// emits outwards: points inside it get nothing of it.
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

    /// A linear light between two points: a cylinder so thin that only its radiance times its
    /// radius counts, in W/(m sr).
    #[must_use]
    pub fn line(from: impl Vector3, to: impl Vector3, radiance_radius: impl Vector3) -> Self {
        Self::Linear(LinearLight {
            segment: Segment::new(from.dvec3(), to.dvec3()),
            radiance_radius: radiance_radius.dvec3(),
        })
    }

    /// A point of an intensity in W/sr, the same in all directions.
    #[must_use]
    pub fn point(position: impl Vector3, intensity: impl Vector3) -> Self {
        Self::Point(PointLight {
            position: position.dvec3(),
            intensity: intensity.dvec3(),
            profile: None,
        })
    }

    /// A point of an intensity in W/sr along a direction of any length but zero, which falls to
    /// nothing, as pbrt-v4's spots do, between two angles to it, in radians.
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

    /// Parallel light from a direction, of any length but zero, that points towards the light. The
    /// irradiance, in W/m², is that of a surface which faces it.
    #[must_use]
    pub fn distant(direction: impl Vector3, irradiance: impl Vector3) -> Self {
        Self::Distant(DistantLight {
            direction: unit(direction),
            irradiance: irradiance.dvec3(),
            scene: NO_SCENE,
        })
    }

    /// A sky of a radiance in W/(m² sr), the same in all directions.
    #[must_use]
    pub fn sky(radiance: impl Vector3) -> Self {
        let emission = SkyEmission::Constant(radiance.dvec3());
        Self::from(emission)
    }

    /// A sun: a disk at infinity of a radiance in W/(m² sr), around a direction of any length but
    /// zero that points towards it. `half_angle_rad` is half of the angle that it is seen under, in
    /// radians, above 0 and up to π/2.
    #[must_use]
    pub fn sun(direction: impl Vector3, half_angle_rad: f64, radiance: impl Vector3) -> Self {
        let (direction, radiance) = (unit(direction), radiance.dvec3());
        Self::from(SkyEmission::Sun {
            direction,
            half_angle: half_angle_rad,
            radiance,
        })
    }

    /// Makes both sides emit, of a polygon or a disk; others have one side.
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

/// The unit vector along `v`; zero of zero.
fn unit(v: impl Vector3) -> DVec3 {
    predicates::normalize(v.dvec3()).unwrap_or(DVec3::ZERO)
}

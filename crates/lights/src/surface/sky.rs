//! This module holds skies as surfaces of lights, and draws points of them. A sky is treated as a
//! sphere about the shading point that is larger than the scene: each point of it represents a
//! direction, and densities are per solid angle.

use super::shape::Shape;
use crate::density::{Pdf, SolidAngle};
use crate::sky::{Sky, SkyEmission, SkyImage, below_cap, cap_height};
use crate::{PointSample, PointTechnique, SolidAngleSampler};
use core::f64::consts::{FRAC_1_PI, TAU};
use linelit_elementary::{atan2, sin_cos};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{DVec3, Frame};

/// A sky as one shading point sees it: a sphere about the point that is larger than the scene.
#[derive(Clone, Copy, Debug)]
pub struct SkyView<'a> {
    sky: &'a Sky,
    x: DVec3,
    radius: f64,
}

impl<'a> SkyView<'a> {
    /// Makes the view of a sky from `x`.
    #[must_use]
    pub fn new(sky: &'a Sky, x: DVec3) -> Self {
        let radius = sky.scene.beyond(x);
        Self { sky, x, radius }
    }

    /// Returns the point that represents a direction.
    fn point(&self, w: DVec3) -> DVec3 {
        self.x + w * self.radius
    }

    /// Returns the direction that a point represents.
    fn direction(&self, point: DVec3) -> DVec3 {
        (point - self.x).normalize_or_zero()
    }
}

impl Shape for SkyView<'_> {
    fn normal(&self, point: DVec3) -> DVec3 {
        -self.direction(point)
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        self.sky.shows(x, direction).then(|| self.point(direction))
    }

    fn may_rise_above(&self, x: DVec3, n: DVec3) -> bool {
        self.sky.is_above(x, n)
    }

    fn half_width(&self) -> f64 {
        self.radius
    }

    /// Skies have no border that weights could smooth: a sun's border is as sharp as the light
    /// itself.
    fn border(&self, _: DVec3, _: DVec3, _: impl Fn(f64) -> f64) -> f64 {
        1.0
    }
}

/// The density of directions of a sky. It has no effect on suns, which are uniform in their solid
/// angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyBy {
    /// In proportion to the radiance, without the cosine. A constant sky is uniform over the
    /// hemisphere about this unit normal.
    Radiance(DVec3),
    /// In proportion to the radiance and, approximately, to the cosine with this unit normal.
    Projected(DVec3),
}

/// A technique that draws points of a sky for one shading point.
///
/// Suns are sampled uniformly in their solid angle, constant skies uniformly over the hemisphere or
/// in proportion to the cosine, and images by a hierarchy ([`SkyImage`](crate::SkyImage)). Behind a
/// portal, a constant sky is sampled uniformly in the portal's solid angle. Of an image behind a
/// portal one half of the samples is uniform in the portal's solid angle, and the other half
/// follows the image, which finds bright parts that are seen through the portal. Directions of an
/// image or a sun that do not pass through the portal have the density zero, so that the density
/// integrates to less than one.
///
/// ```
/// use linelit_lights::geometry::DVec3;
/// use linelit_lights::{Light, PointTechnique, SkyBy, SkyPoints, SkyView};
/// let Light::Sky(sky) = Light::sky([1.0; 3]) else { unreachable!() };
/// let points = SkyPoints::new(SkyView::new(&sky, DVec3::ZERO), SkyBy::Projected(DVec3::Z));
/// let sample = points.sample([0.3, 0.6]);
/// // In proportion to the cosine.
/// let cosine = sample.point.normalize().z;
/// assert!((sample.pdf.value() / (cosine / std::f64::consts::PI) - 1.0).abs() < 1e-12);
/// ```
#[derive(Clone, Debug)]
pub struct SkyPoints<'a> {
    view: SkyView<'a>,
    kind: Kind<'a>,
}

/// The distributions by which directions of a sky are drawn.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "one for each shading point, on the stack"
)]
enum Kind<'a> {
    /// A cap about an axis, uniform in solid angle; its height is 1 − cos of its half angle.
    Cap(Frame, f64),
    /// A hemisphere about an axis, in proportion to the cosine.
    Cosine(Frame),
    /// The solid angle of a portal, uniformly.
    Portal(SolidAngleSampler),
    /// An image, in proportion to the cosine with this normal, too, if there is one.
    Image(&'a SkyImage, Option<DVec3>),
    /// An image, and the solid angle of a portal, with one half of the samples each.
    Shown(&'a SkyImage, Option<DVec3>, SolidAngleSampler),
}

impl<'a> SkyPoints<'a> {
    /// Sets up the technique for the shading point of a view.
    #[must_use]
    pub fn new(view: SkyView<'a>, by: SkyBy) -> Self {
        // A sun ignores the density and the portal, and an image a portal that is seen edge-on;
        // [`Self::shows`] tests the portal for each direction.
        let kind = match (&view.sky.emission, &view.sky.portal, by) {
            (
                SkyEmission::Sun {
                    direction,
                    half_angle,
                    ..
                },
                _,
                _,
            ) => Kind::Cap(Frame::from_normal(*direction), cap_height(*half_angle)),
            (SkyEmission::Image(image), portal, by) => {
                let normal = match by {
                    SkyBy::Radiance(_) => None,
                    SkyBy::Projected(n) => Some(n),
                };
                let portal = portal.map(|portal| SolidAngleSampler::new(&portal, view.x));
                match portal.filter(|sampler| density(sampler) > 0.0) {
                    Some(sampler) => Kind::Shown(image, normal, sampler),
                    None => Kind::Image(image, normal),
                }
            }
            (SkyEmission::Constant(_), Some(portal), _) => {
                Kind::Portal(SolidAngleSampler::new(portal, view.x))
            }
            (SkyEmission::Constant(_), None, SkyBy::Radiance(n)) => {
                Kind::Cap(Frame::from_normal(n), 1.0)
            }
            (SkyEmission::Constant(_), None, SkyBy::Projected(n)) => {
                Kind::Cosine(Frame::from_normal(n))
            }
        };
        Self { view, kind }
    }

    /// Whether a direction passes through the portal, if there is one, and is of the sun, if the
    /// sky is one. Suns and cells of images extend beyond the portal, which also is opaque from
    /// behind.
    fn shows(&self, w: DVec3) -> bool {
        self.view.sky.portal.is_none() || self.view.sky.shows(self.view.x, w)
    }

    /// Returns a direction in the solid angle of the portal.
    fn through(&self, sampler: &SolidAngleSampler, u: [f64; 2]) -> DVec3 {
        self.view.direction(sampler.sample(u).point)
    }

    /// Returns the random numbers of a direction in the solid angle of the portal.
    fn back(&self, sampler: &SolidAngleSampler, w: DVec3) -> Option<[f64; 2]> {
        sampler.invert(sampler.polygon().meets(self.view.x, w)?)
    }
}

/// Returns the density in the solid angle of a portal.
fn density(sampler: &SolidAngleSampler) -> f64 {
    sampler.pdf(sampler.polygon().vertices()[0]).value()
}

/// Returns a direction about the axis of a frame from 1 − cos and the turn in [0, 1).
fn about(frame: &Frame, height: f64, turn: f64) -> DVec3 {
    let sine = (height * (2.0 - height)).max(0.0).sqrt();
    let (s, c) = sin_cos(TAU * turn);
    frame.to_world(DVec3::new(sine * c, sine * s, 1.0 - height))
}

/// Returns the turn of a direction about the axis of a frame, in [0, 1).
fn turn(frame: &Frame, w: DVec3) -> f64 {
    let local = frame.to_local(w);
    let turn = atan2(local.y, local.x) / TAU;
    below_one(if turn < 0.0 { turn + 1.0 } else { turn })
}

impl PointTechnique for SkyPoints<'_> {
    type Measure = SolidAngle;

    fn sample(&self, u: [f64; 2]) -> PointSample<SolidAngle> {
        let u = u.map(fraction);
        let (w, pdf) = match &self.kind {
            Kind::Cap(frame, height) => {
                let w = about(frame, height * u[0], u[1]);
                (w, 1.0 / (TAU * height))
            }
            Kind::Cosine(frame) => {
                // With this density cos² θ, and so sin² θ, is uniform.
                let sine2 = u[0];
                let cosine = (1.0 - sine2).sqrt();
                let w = about(frame, sine2 / (1.0 + cosine), u[1]);
                (w, cosine * FRAC_1_PI)
            }
            Kind::Portal(sampler) => (self.through(sampler, u), density(sampler)),
            Kind::Image(image, normal) => image.sample(u, *normal),
            Kind::Shown(image, normal, sampler) if u[0] < 0.5 => {
                let w = self.through(sampler, [2.0 * u[0], u[1]]);
                (w, 0.5 * (density(sampler) + image.pdf(w, *normal)))
            }
            Kind::Shown(image, normal, sampler) => {
                let (w, pdf) = image.sample([2.0 * u[0] - 1.0, u[1]], *normal);
                (w, 0.5 * (density(sampler) + pdf))
            }
        };
        let pdf = if self.shows(w) { pdf } else { 0.0 };
        PointSample::at(self.view.point(w), Pdf::new(pdf))
    }

    fn pdf(&self, point: DVec3) -> Pdf<SolidAngle> {
        let w = self.view.direction(point);
        if !self.shows(w) {
            return Pdf::ZERO;
        }
        Pdf::new(match &self.kind {
            Kind::Cap(frame, height) if below_cap(frame.z, w) <= *height => 1.0 / (TAU * height),
            Kind::Cap(..) => 0.0,
            Kind::Cosine(frame) => frame.z.dot(w).max(0.0) * FRAC_1_PI,
            Kind::Portal(sampler) => density(sampler),
            Kind::Image(image, normal) => image.pdf(w, *normal),
            Kind::Shown(image, normal, sampler) => 0.5 * (density(sampler) + image.pdf(w, *normal)),
        })
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        let w = self.view.direction(point);
        if !self.pdf(point).is_positive() {
            return None;
        }
        match &self.kind {
            Kind::Cap(frame, height) => {
                Some([below_one(below_cap(frame.z, w) / height), turn(frame, w)])
            }
            Kind::Cosine(frame) => {
                let sine2 = frame.z.cross(w).length_squared();
                Some([below_one(sine2), turn(frame, w)])
            }
            Kind::Portal(sampler) => self.back(sampler, w),
            Kind::Image(image, normal) => image.invert(w, *normal),
            Kind::Shown(_, _, sampler) => {
                let [a, b] = self.back(sampler, w)?;
                Some([0.5 * a, b])
            }
        }
    }
}

//! This module estimates the light that a surface reflects from an unoccluded light, by LTCs, for
//! the choice among lights.

use crate::DEFENCE;
use crate::contribution::{Receiver, can_contribute, positive_part, spread};
use linelit_bsdf::{LtcLobe, LtcMixture, Reflection};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame, Segment};
use linelit_lights::{Cylinder, DiskLight, Light, Sky, SkyEmission, SphereLight};
use linelit_shading::{cylinder, ltc::Ltc, polygon};
use std::f64::consts::{FRAC_1_PI, PI};

/// Makes the receiver of a surface with a reflection, for estimates from points of lights: the
/// function of `position`, the unit normal, and the direction `wo` into which light is reflected.
pub fn reflecting<R: Reflection>(
    bsdf: &R,
    position: DVec3,
    normal: DVec3,
    wo: DVec3,
) -> Receiver<impl Fn(DVec3) -> DVec3> {
    Receiver {
        position,
        normal,
        reflected: move |w| bsdf.eval(w, wo, normal) * normal.dot(w).max(0.0),
    }
}

/// A surface whose reflection is a sum of LTCs, whose integrals over lights and means over
/// directions are known.
#[derive(Clone, Debug)]
pub struct LtcReceiver {
    position: DVec3,
    normal: DVec3,
    cosines: LtcMixture,
    lobes: [Option<Lobe>; LtcMixture::MAX],
    /// The approximate albedo.
    albedo: DVec3,
}

impl LtcReceiver {
    /// Approximates the reflection at `position` with the unit normal `n` into the direction `wo`.
    #[must_use]
    pub fn new<R: Reflection>(bsdf: &R, position: DVec3, n: DVec3, wo: DVec3) -> Self {
        // A reflection without LTCs counts as diffuse.
        let cosines = bsdf.transformed_cosines(wo, n);
        let white = || LtcMixture::new(Frame::from_normal(n), DVec3::ONE);
        let cosines = cosines.unwrap_or_else(white);
        let frame = cosines.frame;
        let to_local = DMat3::from_cols(frame.x, frame.y, frame.z).transpose();
        let mut lobes = [None; LtcMixture::MAX];
        let mut albedo = cosines.diffuse;
        for (slot, lobe) in lobes.iter_mut().zip(cosines.lobes()) {
            *slot = Some(Lobe::new(lobe, to_local));
            albedo += lobe.albedo;
        }
        Self {
            position,
            normal: n,
            cosines,
            lobes,
            albedo,
        }
    }

    /// Returns the receiver of this surface with means over directions, scaled so that its integral
    /// is about π.
    pub fn receiver(&self) -> Receiver<impl Fn(DVec3) -> DVec3> {
        let n = self.normal;
        let albedo = mean(self.albedo);
        let scale = if albedo > 0.0 { PI / albedo } else { 0.0 };
        Receiver {
            position: self.position,
            normal: n,
            reflected: move |w: DVec3| {
                let diffuse = FRAC_1_PI * positive_part(n.dot(w), spread(w));
                (self.cosines.diffuse * diffuse + self.glossy(|lobe| lobe.mean(w))) * scale
            },
        }
    }

    /// Returns the sum over the LTCs of the albedo times an integral.
    fn glossy(&self, integral: impl Fn(&Lobe) -> f64) -> DVec3 {
        let lobes = self.lobes.iter().flatten();
        lobes.fold(DVec3::ZERO, |sum, lobe| sum + lobe.albedo * integral(lobe))
    }

    /// Returns the light that the surface reflects without occluders, averaged over the channels,
    /// plus a small part as from a diffuse surface. It is in closed form for polygons and linear
    /// lights. For round lights it is an estimate for the whole light in the direction of its
    /// centre, raised where the centre is below the horizon. It is zero only where the light cannot
    /// contribute, and always finite.
    #[must_use]
    pub fn light(&self, light: &Light) -> f64 {
        let (x, n) = (self.position, self.normal);
        if !can_contribute(light, x, n) {
            return 0.0;
        }
        let frame = &self.cosines.frame;
        // Estimate round lights by a cap; raise the cosine where the centre is below the horizon.
        let cap = |cap: Cap| {
            let cosine = n.dot(cap.w).max(0.2 * cap.reach.min(1.0));
            let mean = mean_of_cap(cap.w, cap.seen);
            let glossy = self.glossy(|lobe| lobe.mean(mean) * cap.seen);
            (cap.radiance, cap.seen * cosine, glossy)
        };
        // Find the irradiance and the glossy part by kind of light.
        let (radiance, irradiance, glossy) = match light {
            Light::Area(area) => {
                let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
                let relative = area.polygon.relative_to(x, &mut relative);
                (
                    area.emission.radiance,
                    polygon::irradiance(relative, n),
                    self.glossy(|lobe| lobe.ltc.polygon_by_edges(frame, relative)),
                )
            }
            Light::Linear(line) => {
                let relative = line.segment.relative_to(x);
                let (p0, p1) = (relative.p0, relative.p1);
                (
                    line.radiance_radius,
                    cylinder::irradiance(p0, p1, n),
                    self.glossy(|lobe| lobe.ltc.line(frame, p0, p1)),
                )
            }
            Light::Cylinder(light) => {
                let Cylinder { axis, radius } = light.cylinder;
                let Segment { p0, p1 } = axis.relative_to(x);
                (
                    light.radiance * radius,
                    around_axis(p0, p1, radius, n),
                    self.glossy(|lobe| lobe.ltc.line(frame, p0, p1)),
                )
            }
            Light::Sphere(light) => cap(Cap::of_sphere(light, x)),
            Light::Disk(light) => cap(Cap::of_disk(light, x)),
            Light::Sky(light) => cap(Cap::of_sky(light, n)),
            Light::Point(_) | Light::Distant(_) => {
                let beam = light.beam(x);
                let (w, irradiance) =
                    beam.map_or((n, DVec3::ZERO), |b| (b.direction, b.irradiance));
                (
                    irradiance,
                    n.dot(w).max(0.0),
                    self.glossy(|lobe| lobe.mean(w)),
                )
            }
        };
        // Treat a small part of the albedo as diffuse.
        let diffuse = self.cosines.diffuse + self.albedo * DEFENCE;
        let value = mean(radiance * (diffuse * (FRAC_1_PI * irradiance) + glossy));
        // Grazing light may round to zero, and the result may overflow or be NaN: it must be
        // positive.
        if value > f64::MIN_POSITIVE {
            value.min(f64::MAX)
        } else {
            f64::MIN_POSITIVE
        }
    }
}

/// A light approximated by a circular cap of directions, as seen from a surface point.
#[derive(Clone, Copy, Debug)]
struct Cap {
    radiance: DVec3,
    /// The unit direction to the cap's centre.
    w: DVec3,
    /// The sine of the angle between its centre and its border.
    reach: f64,
    /// The solid angle of the cap, projected onto the plane perpendicular to the direction.
    seen: f64,
}

impl Cap {
    /// Makes the cap under which a sphere is seen from `x`.
    fn of_sphere(light: &SphereLight, x: DVec3) -> Self {
        let to = light.sphere.center - x;
        let reach = (light.sphere.radius / to.length()).min(1.0);
        Self {
            radiance: light.radiance,
            w: to.normalize_or_zero(),
            reach,
            seen: PI * reach * reach,
        }
    }

    /// Makes the cap under which a disk is seen from `x`.
    fn of_disk(light: &DiskLight, x: DVec3) -> Self {
        let to = light.disk.center - x;
        let (w, reach) = (to.normalize_or_zero(), light.disk.radius / to.length());
        Self {
            radiance: light.emission.radiance,
            w,
            reach,
            seen: PI * reach * reach * light.disk.normal.dot(w).abs(),
        }
    }

    /// Makes the cap of a sun, or of the half of a sky above the horizon of `n`.
    fn of_sky(light: &Sky, n: DVec3) -> Self {
        let (w, reach) = match light.emission {
            SkyEmission::Sun {
                direction,
                half_angle,
                ..
            } => (direction, half_angle.min(1.0)),
            SkyEmission::Constant(_) | SkyEmission::Image(_) => (n, 1.0),
        };
        Self {
            radiance: light.mean(),
            w,
            reach,
            seen: light.solid_angle().min(PI),
        }
    }
}

/// Returns the irradiance of a cylinder about an axis between two points, divided by its radius, as
/// if it were a linear light. Where the axis is below the horizon, a fraction of the irradiance of
/// a raised line is used.
fn around_axis(p0: DVec3, p1: DVec3, radius: f64, n: DVec3) -> f64 {
    let along = (p1 - p0).normalize_or_zero();
    let up = (n - along * along.dot(n)).normalize_or_zero() * radius;
    let raised = 0.2 * cylinder::irradiance(p0 + up, p1 + up, n);
    cylinder::irradiance(p0, p1, n).max(raised)
}

/// A lobe of the receiver: an LTC whose integral is one, and its albedo.
#[derive(Clone, Copy, Debug)]
struct Lobe {
    ltc: Ltc,
    albedo: DVec3,
    /// The inverse map M⁻¹ of the LTC, from directions of the world to cosine space; the next field
    /// is |det M⁻¹|.
    inverse: DMat3,
    determinant: f64,
    /// |M z|²/|M x|² and |M z|²/|M y|², which are large for a narrow lobe.
    narrow: [f64; 2],
}

impl Lobe {
    fn new(lobe: &LtcLobe, to_local: DMat3) -> Self {
        let inverse = lobe.map.inverse();
        let [x, y, z] = [0, 1, 2].map(|k| lobe.map.col(k).length_squared());
        Self {
            ltc: Ltc::new(lobe.map, 1.0),
            albedo: lobe.albedo,
            inverse: inverse * to_local,
            determinant: inverse.determinant().abs(),
            narrow: [z / x, z / y],
        }
    }

    /// Returns approximately the mean of the LTC's density over directions with the mean `w`. The
    /// density is widened across its axis by the spread of the directions, where the squares of the
    /// widths add up: the squared width of a cap is twice its spread, so that a narrow lobe becomes
    /// as high as one over the cap's solid angle. For a unit vector it is the density itself.
    fn mean(&self, w: DVec3) -> f64 {
        let spread = spread(w);
        let [x, y] = self.narrow.map(|k| (1.0 + 2.0 * k * spread).sqrt().recip());
        let c = self.inverse * w.normalize_or_zero() * DVec3::new(x, y, 1.0);
        let r2 = c.length_squared();
        let r = r2.sqrt();
        let cosine = positive_part(c.z / r, spread);
        let density = FRAC_1_PI * self.determinant * x * y * cosine / (r2 * r);
        if density.is_finite() { density } else { 0.0 }
    }
}

/// Returns the mean of the directions to a disk about the direction `w` from its solid angle, of a
/// hemisphere at most. Its length is 1 − Ω/4π, as for a cap.
fn mean_of_cap(w: DVec3, solid_angle: f64) -> DVec3 {
    w * (1.0 - solid_angle.min(2.0 * PI) / (4.0 * PI))
}

/// Returns the mean of the three channels.
fn mean(rgb: DVec3) -> f64 {
    rgb.element_sum() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::quadrature::cubature;
    use std::f64::consts::TAU;

    /// The mean for a unit vector is the density, and the mean over a cap agrees with cubature to
    /// 25 %, for caps of 2° to 30° on the axes of lobes of 3° to 45° and away from them.
    #[test]
    fn means_of_a_lobe_are_near() {
        let mut worst = 1.0_f64;
        for across in [0.05, 0.3, 1.0] {
            let axis = Frame::from_normal(DVec3::new(0.6, 0.0, 0.8));
            let map = DMat3::from_cols(axis.x * across, axis.y * across, axis.z);
            let albedo = DVec3::ONE;
            let fitted = LtcLobe { map, albedo };
            let lobe = Lobe::new(&fitted, DMat3::IDENTITY);
            for off in [0.0, 0.5, 1.0] {
                let tilt = (across * off).atan();
                let w = axis.z * tilt.cos() + axis.x * tilt.sin();
                let (one, density) = (lobe.mean(w), fitted.density(w));
                // Rounding, but for 1 − |w|² of an ε, of which the square of a narrow lobe's width
                // makes 400.
                assert!(
                    (one / density - 1.0).abs() < 1e4 * f64::EPSILON,
                    "{one} {density}"
                );
                for half in [0.03_f64, 0.2, 0.5] {
                    let about = Frame::from_normal(w);
                    let cap = 1.0 - half.cos();
                    let value = |z: f64, turn: f64| {
                        let sine = ((1.0 - z) * (1.0 + z)).sqrt();
                        let (s, c) = (TAU * turn).sin_cos();
                        fitted.density(about.to_world(DVec3::new(sine * c, sine * s, z)))
                    };
                    let want = cubature(value, [1.0 - cap, 1.0], [0.0, 1.0], 1e-6, 12).value / cap;
                    let ratio = lobe.mean(mean_of_cap(w, TAU * cap)) / want;
                    worst = worst.max(ratio).max(ratio.recip());
                }
            }
        }
        assert!(worst < 1.25, "{worst}");
    }
}

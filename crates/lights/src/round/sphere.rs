//! This module samples spheres by the three densities of Shirley & Wang 1991, Figs. 2–3: on the
//! whole surface, on the visible cap, and by solid angle.

use crate::{Area, Pdf, PointSample, PointTechnique, SolidAngle, Sphere};
use core::f64::consts::PI;
use linelit_elementary::{atan2, sin_cos};
use linelit_geometry::finite::{below_one, fraction, power_of_two_over};
use linelit_geometry::{DVec3, Frame, predicates};

/// Returns the point of the sphere whose outward unit normal is `n`.
pub(crate) fn at(sphere: &Sphere, n: DVec3) -> DVec3 {
    sphere.center + n * sphere.radius
}

/// Whether a point of the surface faces `x`, which is outside; `scale` brings lengths to a size
/// whose products do not overflow.
pub(crate) fn faces(sphere: &Sphere, point: DVec3, x: DVec3, scale: f64) -> bool {
    let (out, to_x) = ((point - sphere.center) * scale, (x - point) * scale);
    out.dot(to_x) >= 0.0
}

/// Returns the distance of `x` from the centre, and a frame whose z axis points from the centre to
/// x.
fn seen_from(sphere: &Sphere, x: DVec3) -> (f64, Frame) {
    let to_x = x - sphere.center;
    let square = to_x.length_squared();
    // One root serves for both where squares do not overflow or underflow; the bits are the same.
    let (d, z) = if square > 1e-270 && square < f64::INFINITY {
        let d = square.sqrt();
        (d, to_x * (1.0 / d))
    } else {
        extreme(to_x)
    };
    (d, Frame::from_normal(z))
}

/// Returns the length and the direction of a vector that is zero or not finite, or whose squares
/// overflow or underflow.
#[cold]
#[inline(never)]
fn extreme(v: DVec3) -> (f64, DVec3) {
    let z = predicates::normalize(v).unwrap_or(DVec3::Z);
    (predicates::length(v), z)
}

/// Returns a unit vector at the azimuth 2πu with the given z and sine.
fn around(frame: &Frame, z: f64, sine: f64, u: f64) -> DVec3 {
    let (s, c) = sin_cos(2.0 * PI * u);
    frame.x * (c * sine) + frame.y * (s * sine) + frame.z * z
}

/// Returns the azimuth of a direction as a fraction of 2π, in [0, 1).
fn azimuth(frame: &Frame, v: DVec3) -> f64 {
    let turn = atan2(v.dot(frame.y), v.dot(frame.x)) / (2.0 * PI);
    below_one(if turn < 0.0 { turn + 1.0 } else { turn })
}

/// Returns `1 − cos` of the angle between a direction of length `r` and the z axis, with a small
/// relative error.
fn one_minus_cos(frame: &Frame, v: DVec3, r: f64) -> f64 {
    let (x, y, z) = (v.dot(frame.x), v.dot(frame.y), v.dot(frame.z));
    if z > 0.0 {
        (x * x + y * y) / (r * (r + z))
    } else {
        1.0 - z / r
    }
}

/// Samples uniformly by area the part of a sphere that faces `x`, or the whole sphere.
///
/// The visible cap (with `x` outside at the distance d) holds the points whose normal has at least
/// the cosine s = R/d to the direction towards x; its density is `1/(2πR²(1 − s))`, and zero
/// outside the cap. For the whole surface, or with `x` inside, the density is `1/(4πR²)`; at least
/// half of the samples of the whole surface are invisible from outside.
///
/// ```
/// use linelit_lights::geometry::DVec3;
/// use linelit_lights::{PointTechnique, Sphere, SphereCap};
/// let sphere = Sphere { center: DVec3::new(0.0, 0.0, 4.0), radius: 1.0 };
/// let cap = SphereCap::visible(&sphere, DVec3::ZERO);
/// let s = cap.sample([0.2, 0.9]);
/// assert!(sphere.normal(s.point).z <= -0.25 + 1e-15);
/// let u = cap.invert(s.point).unwrap();
/// assert!((u[0] - 0.2).abs() < 1e-14 && (u[1] - 0.9).abs() < 1e-14);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SphereCap {
    sphere: Sphere,
    frame: Frame,
    /// 1 − cos of the cap's half angle at the centre.
    k: f64,
    density: Pdf<Area>,
}

impl SphereCap {
    /// Samples the cap that `x` sees.
    #[must_use]
    pub fn visible(sphere: &Sphere, x: DVec3) -> Self {
        let (d, frame) = seen_from(sphere, x);
        let outside = d > sphere.radius;
        let k = if outside {
            (d - sphere.radius) / d
        } else {
            2.0
        };
        Self::new(sphere, frame, k)
    }

    /// Samples the whole surface.
    #[must_use]
    pub fn whole(sphere: &Sphere) -> Self {
        Self::new(sphere, Frame::from_normal(DVec3::Z), 2.0)
    }

    fn new(sphere: &Sphere, frame: Frame, k: f64) -> Self {
        Self {
            sphere: *sphere,
            frame,
            k,
            density: Pdf::new(1.0 / (2.0 * PI * sphere.radius * sphere.radius * k)),
        }
    }
}

impl PointTechnique for SphereCap {
    type Measure = Area;

    #[inline]
    fn sample(&self, u: [f64; 2]) -> PointSample<Area> {
        let u = u.map(fraction);
        let m = u[0] * self.k;
        let n = around(&self.frame, 1.0 - m, (m * (2.0 - m)).sqrt(), u[1]);
        PointSample::at(at(&self.sphere, n), self.density)
    }

    fn pdf(&self, point: DVec3) -> Pdf<Area> {
        let v = point - self.sphere.center;
        let m = one_minus_cos(&self.frame, v, v.length());
        // The rim itself is rounded: a point that is drawn at the rim counts as inside.
        if m <= self.k + 8.0 * f64::EPSILON {
            self.density
        } else {
            Pdf::ZERO
        }
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        let v = point - self.sphere.center;
        let m = one_minus_cos(&self.frame, v, v.length());
        self.pdf(point)
            .is_positive()
            .then(|| [below_one(m / self.k), azimuth(&self.frame, v)])
    }
}

/// Samples a sphere uniformly by solid angle: in the cone of directions from `x` that meet the
/// sphere, or, from inside, in all directions.
///
/// **Formula**: `1/(2πk)` with `k = 1 − cos θ_max = s²/(1 + √(1 − s²))`, s = R/d, `1 − s² = (d −
/// R)(d + R)/d²`. This is accurate relative to its size, from the inside to cones of any smallness.
/// The point is placed by its normal, from the central angle, with `s² − sin² θ = k(1 − ξ)(2 −
/// k(1 + ξ))`, so that no direction misses at the rim and no digits are lost far from the origin.
/// The density is zero on the side that faces away. (Wang 1992; Shirley & Wang 1991, Fig. 3.)
///
/// ```
/// use linelit_lights::geometry::DVec3;
/// use linelit_lights::{PointTechnique, Sphere, SphereCone};
/// let moon = Sphere { center: DVec3::new(0.0, 0.0, 1e9), radius: 1.0 };
/// let cone = SphereCone::new(&moon, DVec3::ZERO);
/// // Ω = π (R/d)² to 16 digits, where 1 − cos θ would be zero.
/// assert!((cone.solid_angle() / (std::f64::consts::PI * 1e-18) - 1.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SphereCone {
    sphere: Sphere,
    x: DVec3,
    frame: Frame,
    /// A power of two; with this scale, the distance of the centre and the radius. The larger of
    /// them has a size whose products do not overflow.
    scale: f64,
    d: f64,
    r: f64,
    /// 1 − cos θ_max; 2 from inside.
    k: f64,
    density: Pdf<SolidAngle>,
}

impl SphereCone {
    /// Sets the technique up for one light and shading point.
    #[must_use]
    pub fn new(sphere: &Sphere, x: DVec3) -> Self {
        let (d, frame) = seen_from(sphere, x);
        // Scale lengths whose products would overflow or underflow.
        let size = if d > sphere.radius { d } else { sphere.radius };
        let scale = if size > 1e-30 && size < 1e30 {
            1.0
        } else {
            power_of_two_over(size)
        };
        let (d, r) = (d * scale, sphere.radius * scale);
        // Compute 1 − cos θ_max from terms of one sign.
        let k = if d >= r {
            let s = r / d;
            s * s / (1.0 + ((d - r) * (d + r)).sqrt() / d)
        } else {
            2.0
        };
        Self {
            sphere: *sphere,
            x,
            frame,
            scale,
            d,
            r,
            k,
            density: Pdf::new(1.0 / (2.0 * PI * k)),
        }
    }

    /// Returns the solid angle 2πk in sr; 4π from inside.
    #[must_use]
    pub fn solid_angle(&self) -> f64 {
        2.0 * PI * self.k
    }

    fn inside(&self) -> bool {
        self.d < self.r
    }
}

impl PointTechnique for SphereCone {
    type Measure = SolidAngle;

    #[inline]
    fn sample(&self, u: [f64; 2]) -> PointSample<SolidAngle> {
        let (r, d, k) = (self.r, self.d, self.k);
        let u = u.map(fraction);
        let m = u[0] * k;
        let (cos, sine) = (1.0 - m, (m * (2.0 - m)).sqrt());
        let n = if self.inside() {
            // Compute the distance to the far side; the direction is −z at ξ = 0.
            let root = ((r - d * sine) * (r + d * sine)).sqrt();
            let t = d * cos + root;
            around(&self.frame, (d - t * cos) / r, t * sine / r, u[1])
        } else {
            let root = d * (k * (1.0 - u[0]) * (2.0 - k * (1.0 + u[0]))).sqrt();
            let t = (d - r) * (d + r) / (d * cos + root);
            let axial = (d * sine * sine + cos * root) / r;
            around(&self.frame, axial, t * sine / r, u[1])
        };
        PointSample::at(at(&self.sphere, n), self.density)
    }

    fn pdf(&self, point: DVec3) -> Pdf<SolidAngle> {
        if self.inside() || faces(&self.sphere, point, self.x, self.scale) {
            self.density
        } else {
            Pdf::ZERO
        }
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        if !self.pdf(point).is_positive() {
            return None;
        }
        let v = (point - self.sphere.center) * self.scale;
        // As seen from x, the distance across the axis is the same as from the centre; along the
        // axis it is the distance of the centre minus the point's height.
        let (across, along) = {
            let (a, b) = (v.dot(self.frame.x), v.dot(self.frame.y));
            (a * a + b * b, self.d - v.dot(self.frame.z))
        };
        let t = (across + along * along).sqrt();
        let m = if along > 0.0 {
            across / (t * (t + along))
        } else {
            1.0 - along / t
        };
        Some([below_one(m / self.k), azimuth(&self.frame, v)])
    }
}

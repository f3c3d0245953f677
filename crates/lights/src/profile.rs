//! This module holds profiles: factors of a light's emission that depend on the direction, such as
//! cones, powers of the cosine, measured tables (IES) and images.
#![allow(
    clippy::disallowed_types,
    clippy::disallowed_macros,
    reason = "tables of a luminaire, built with it and shared by lights"
)]

use crate::LightSpace;
use crate::directions::{Raster, SkyFilter, SkyMapping};
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use core::fmt;
use linelit_elementary::{atan2, hypot, pow, sin, sin_cos};
use linelit_geometry::DVec3;
use std::sync::Arc;

/// A factor of the emission, in linear RGB, that depends on the direction in which light leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    space: LightSpace,
    kind: ProfileKind,
    scale: f64,
    /// The mean of the factor over all directions of the light's own space, before `scale`.
    mean: DVec3,
}

/// The factor of a [`Profile`] as a function of directions in the light's own space, whose z axis
/// is the light's axis.
#[derive(Clone, Debug, PartialEq)]
pub enum ProfileKind {
    /// A cone: the factor is one within the inner cone, zero outside the outer cone, and between
    /// them a function of t = (cos θ − `cos_outer`)/(`cos_inner` − `cos_outer`).
    Cone {
        /// The cosine of the half angle of the inner cone.
        cos_inner: f64,
        /// The cosine of the half angle of the outer cone.
        cos_outer: f64,
        /// The function of t between the cones.
        falloff: Falloff,
    },
    /// The power max(0, cos θ)ⁿ (`UsdLux`'s `shaping:focus`). An exponent that is negative or not a
    /// number counts as zero.
    CosinePower(f64),
    /// A table over angles, as IES files have it.
    Table(Arc<ProfileTable>),
    /// An image over all directions.
    Map(Arc<ProfileMap>),
}

/// The function by which the factor of a spot decreases between its cones, from t = 1 to t = 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Falloff {
    /// 3 t² − 2 t³ (pbrt-v4).
    Smooth,
    /// t⁴ (pbrt-v3).
    Quartic,
    /// t² (glTF's `KHR_lights_punctual`).
    Quadratic,
}

impl Falloff {
    /// Returns the coefficients of t², t³ and t⁴.
    const fn polynomial(self) -> [f64; 3] {
        match self {
            Self::Smooth => [3.0, -2.0, 0.0],
            Self::Quartic => [0.0, 0.0, 1.0],
            Self::Quadratic => [1.0, 0.0, 0.0],
        }
    }
}

impl Profile {
    /// Makes a profile about the z axis of a light's space or of a frame.
    #[must_use]
    pub fn new(kind: ProfileKind, space: impl Into<LightSpace>) -> Self {
        let mut profile = Self {
            space: space.into(),
            kind,
            scale: 1.0,
            mean: DVec3::ZERO,
        };
        profile.mean = 0.5 * profile.integral(false);
        profile
    }

    /// Returns the profile multiplied by a factor ≥ 0.
    #[must_use]
    pub fn scaled(mut self, by: f64) -> Self {
        self.scale *= by.max(0.0);
        self
    }

    /// Returns the profile of a light that the transform `to_world` moves into the world.
    #[must_use]
    pub fn placed(mut self, to_world: &LightSpace) -> Self {
        self.space = self.space.within(to_world);
        self
    }

    /// Whether the profile is a table or an image, in contrast to a function of the angle to the
    /// axis alone.
    #[must_use]
    pub const fn has_angles(&self) -> bool {
        matches!(self.kind, ProfileKind::Table(_) | ProfileKind::Map(_))
    }

    /// Returns the factor for light that leaves in the unit direction `w`. It is finite and not
    /// negative, and zero where `w` is not a number.
    #[must_use]
    pub fn factor(&self, w: DVec3) -> DVec3 {
        self.value(self.space.to_light(w))
    }

    /// Returns the factor for light that leaves a surface in the direction `w`, where the unit
    /// normal `n` of the surface serves as the profile's axis. Horizontal angles begin at the
    /// tangent of the surface next to the x axis of the light's space, and run from there towards n
    /// × x, or the other way round if the light's transform is a reflection.
    #[must_use]
    pub fn on_surface(&self, n: DVec3, w: DVec3) -> DVec3 {
        self.value(match self.kind {
            // These depend on the angle to the axis alone.
            ProfileKind::Cone { .. } | ProfileKind::CosinePower(_) => {
                DVec3::new(0.0, 0.0, n.dot(w))
            }
            ProfileKind::Table(_) | ProfileKind::Map(_) => self.space.on_surface(n).to_local(w),
        })
    }

    /// Returns the factor in a direction of the light's own space.
    fn value(&self, w: DVec3) -> DVec3 {
        let factor = match &self.kind {
            ProfileKind::Cone {
                cos_inner,
                cos_outer,
                falloff,
            } => DVec3::splat(if w.z >= *cos_inner {
                1.0
            } else if w.z > *cos_outer {
                let t = (w.z - cos_outer) / (cos_inner - cos_outer);
                let [a, b, c] = falloff.polynomial();
                t * t * (a + t * (b + t * c))
            } else {
                0.0
            }),
            ProfileKind::CosinePower(power) if w.z > 0.0 => DVec3::splat(pow(w.z, power.max(0.0))),
            ProfileKind::CosinePower(_) => DVec3::ZERO,
            ProfileKind::Table(table) => DVec3::splat(table.at(w)),
            ProfileKind::Map(map) => map.at(w),
        };
        (factor * self.scale).max(DVec3::ZERO).min(DVec3::MAX)
    }

    /// Returns the mean of the factor over all directions of the light's own space. The power of a
    /// point light is 4π times this mean, unless its transform scales unevenly. (pbrt's `power`
    /// uses this mean under any transform.)
    ///
    /// **Error**: 10⁻¹² of the mean, in closed form: tables are linear between their angles,
    /// however narrow these are.
    #[must_use]
    pub fn mean(&self) -> DVec3 {
        self.scale * self.mean
    }

    /// Returns (1/π) ∫ p cos θ dω over the hemisphere about the axis, averaged over the channels:
    /// the power of a surface with this profile divided by the power of a Lambertian surface.
    ///
    /// **Error**: the error of [`Profile::mean`]; for images without sharp borders, 10⁻⁵ of their
    /// mean.
    #[must_use]
    pub fn lambertian_mean(&self) -> f64 {
        self.scale * self.integral(true).element_sum() / 3.0
    }

    /// Returns the fraction of a point light with this profile that leaves below the horizon of the
    /// axis. A surface does not send this fraction. It is zero for profiles that are not tables.
    #[must_use]
    pub fn part_behind(&self) -> f64 {
        let above = match &self.kind {
            ProfileKind::Table(table) => rings_integral(&table.rings(), 1.0, FRAC_PI_2),
            _ => return 0.0,
        };
        (1.0 - above.x / (2.0 * self.mean.x)).max(0.0)
    }

    /// Returns the integral over c = cos θ of the factor's mean around the axis: over all c, or,
    /// for a Lambertian surface, over c ≥ 0 with the weight 2c.
    fn integral(&self, is_lambertian: bool) -> DVec3 {
        match &self.kind {
            ProfileKind::Cone {
                cos_inner,
                cos_outer,
                falloff,
            } => {
                // Integrate the weight one + slope · c over the inner cone.
                let ([one, slope], lowest) = match is_lambertian {
                    true => ([0.0, 2.0], 0.0_f64),
                    false => ([1.0, 0.0], -1.0),
                };
                let inner = cos_inner.max(lowest);
                let whole = (1.0 - inner) * (one + 0.5 * slope * (1.0 + inner));
                let height = cos_inner - cos_outer;
                if height.is_nan() || height <= 0.0 {
                    return DVec3::splat(whole);
                }
                // Between the cones substitute c = outer + height · t, and integrate from t = first
                // to 1.
                let first = ((lowest - cos_outer) / height).clamp(0.0, 1.0);
                let (flat, rise) = (one + slope * cos_outer, slope * height);
                let moment = |n: i32| (1.0 - first.powi(n + 1)) / f64::from(n + 1);
                let terms = falloff.polynomial().into_iter().zip(2..);
                let sum = terms.map(|(k, n)| k * (flat * moment(n) + rise * moment(n + 1)));
                DVec3::splat(whole + height * sum.sum::<f64>())
            }
            ProfileKind::CosinePower(power) => DVec3::splat(match is_lambertian {
                true => 2.0 / (power.max(0.0) + 2.0),
                false => 1.0 / (power.max(0.0) + 1.0),
            }),
            // For a Lambertian surface the weight 2 cos θ sin θ is the sine of twice the angle.
            ProfileKind::Table(table) => {
                rings_integral(&table.rings(), if is_lambertian { 2.0 } else { 1.0 }, PI)
            }
            ProfileKind::Map(map) => map.integral(is_lambertian),
        }
    }
}

/// Returns the integral over θ, as long as `turns` θ ≤ `end`, of f(θ) sin(`turns` θ), where f is
/// linear between rings. A ring is an angle from the axis with the mean of the factor around the
/// axis.
///
/// On the interval between two neighbouring rings, with the midpoint m, the half width h and the
/// values p and q at the ends, ∫ f sin θ dθ = (p + q) sin m sin h + (q − p) cos m (sin h − h cos
/// h)/h, without cancellation.
fn rings_integral(rings: &[(f64, DVec3)], turns: f64, end: f64) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for pair in rings.windows(2) {
        let [a, b] = [pair[0].0, pair[1].0].map(|theta| turns * theta);
        let to = b.min(end);
        if !(a < to) {
            continue;
        }
        let (p, q) = (pair[0].1, pair[0].1.lerp(pair[1].1, (to - a) / (b - a)));
        let (sin_m, cos_m) = sin_cos(0.5 * (a + to));
        let h = 0.5 * (to - a);
        sum += (p + q) * (sin_m * sin(h)) + (q - p) * (cos_m * rise(h));
    }
    sum / turns
}

/// Returns (sin h − h cos h)/h, by the Taylor series where the difference would cancel.
fn rise(h: f64) -> f64 {
    let square = h * h;
    if h < 0.1 {
        let rest = 1.0 / 30.0 - square * (1.0 / 840.0 - square / 45360.0);
        return square * (1.0 / 3.0 - square * rest);
    }
    let (sin, cos) = sin_cos(h);
    sin / h - cos
}

/// The reason why a table or an image of numbers cannot be a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileError {
    /// The number of values is zero, or differs from the number of angles or pixels.
    Count,
    /// The angle with this index is not greater than the angle before it, or it is out of range.
    Angle(usize),
    /// The value with this index is negative, infinite or not a number.
    Value(usize),
}

impl fmt::Display for ProfileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count => f.write_str("the number of values does not fit"),
            Self::Angle(k) => write!(f, "angle {k} does not ascend or is out of range"),
            Self::Value(k) => write!(f, "value {k} is negative, infinite or not a number"),
        }
    }
}

impl core::error::Error for ProfileError {}

fn check_values(values: &[f32]) -> Result<(), ProfileError> {
    let bad = values.iter().position(|v| !(*v >= 0.0 && v.is_finite()));
    bad.map_or(Ok(()), |k| Err(ProfileError::Value(k)))
}

/// A table of values over vertical and horizontal angles, with linear interpolation between them.
/// It is zero beyond the vertical angles.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileTable {
    vertical: Vec<f64>,
    horizontal: Vec<f64>,
    values: Vec<f32>,
}

impl ProfileTable {
    /// Makes a table of ascending angles in radians. Vertical angles are measured from the axis, in
    /// [0, π], and horizontal angles from x towards y, in [0, 2π]; a single horizontal angle means
    /// that all of them are alike. The values of the first horizontal angle come first. Between the
    /// last horizontal angle and the first the table continues around the axis.
    ///
    /// # Errors
    /// Returns an error if the number of values, an angle or a value is not valid.
    pub fn new(
        vertical: Vec<f64>,
        horizontal: Vec<f64>,
        values: Vec<f32>,
    ) -> Result<Self, ProfileError> {
        if values.is_empty() || vertical.len().checked_mul(horizontal.len()) != Some(values.len()) {
            return Err(ProfileError::Count);
        }
        // Check that angles ascend within their range, to rounding.
        for (angles, most) in [(&vertical, PI), (&horizontal, TAU)] {
            let most = most * (1.0 + 1e-9);
            let is_bad = |k: &usize| {
                let after = *k == 0 || angles[*k] > angles[*k - 1];
                !(after && angles[*k] >= 0.0 && angles[*k] <= most)
            };
            if let Some(k) = (0..angles.len()).find(is_bad) {
                return Err(ProfileError::Angle(k));
            }
        }
        check_values(&values)?;
        Ok(Self {
            vertical,
            horizontal,
            values,
        })
    }

    /// Returns the value in a direction of the light's own space.
    fn at(&self, w: DVec3) -> f64 {
        // Next to the axis the cosine does not determine the angle, but the tangent does.
        let theta = atan2(hypot(w.x, w.y), w.z);
        let (first, last) = (self.vertical[0], self.vertical[self.vertical.len() - 1]);
        // Allow for rounding at the poles and at right angles.
        if !(theta >= first - 1e-9 && theta <= last + 1e-9) {
            return 0.0;
        }
        // Interpolate along the two columns of values on either side, and then between them.
        let (i, a) = between(&self.vertical, theta);
        let (j, next, b) = self.around(atan2(w.y, w.x));
        let rows = self.vertical.len();
        let value = |j: usize, i: usize| f64::from(self.values[j * rows + i.min(rows - 1)]);
        let column = |j: usize| value(j, i) * (1.0 - a) + value(j, i + 1) * a;
        column(j) * (1.0 - b) + column(next) * b
    }

    /// Returns the vertical angles, each with the mean of the values around the axis.
    fn rings(&self) -> Vec<(f64, DVec3)> {
        let (angles, rows) = (&self.horizontal, self.vertical.len());
        let mean = |i: usize| {
            let value = |j: usize| f64::from(self.values[j * rows + i]);
            let last = angles.len() - 1;
            let gaps = (0..last).map(|j| (angles[j + 1] - angles[j]) * (value(j) + value(j + 1)));
            let around = (angles[0] + TAU - angles[last]) * (value(last) + value(0));
            (gaps.sum::<f64>() + around) / (2.0 * TAU)
        };
        let rings = self.vertical.iter().enumerate();
        rings
            .map(|(i, theta)| (*theta, DVec3::splat(mean(i))))
            .collect()
    }

    /// Returns the indices of the horizontal angles on both sides of `phi`, and the fraction of the
    /// way from the first to the second.
    fn around(&self, phi: f64) -> (usize, usize, f64) {
        let angles = &self.horizontal;
        let (first, last) = (angles[0], angles[angles.len() - 1]);
        let phi = if phi < first { phi + TAU } else { phi };
        if phi >= last {
            // Between the last angle and the first the table continues around the axis.
            let gap = first + TAU - last;
            let place = if gap > 1e-9 { (phi - last) / gap } else { 0.0 };
            return (angles.len() - 1, 0, place.clamp(0.0, 1.0));
        }
        let (j, b) = between(angles, phi);
        (j, (j + 1).min(angles.len() - 1), b)
    }
}

/// Returns the index of the last of ascending numbers that is not greater than `x`, and the
/// fraction of the way from it to the next one.
fn between(angles: &[f64], x: f64) -> (usize, f64) {
    let i = angles.partition_point(|a| *a <= x).saturating_sub(1);
    let Some(next) = angles.get(i + 1) else {
        return (i, 0.0);
    };
    (i, ((x - angles[i]) / (next - angles[i])).clamp(0.0, 1.0))
}

/// An image of directions, in grey or linear RGB, interpolated between its pixels unless it is
/// [`nearest`](Self::nearest).
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileMap {
    raster: Raster,
    /// One value or three for each pixel.
    values: Vec<f32>,
}

impl ProfileMap {
    /// Makes a square image by the equal-area octahedral map
    /// ([`square_to_sphere`](crate::octahedral::square_to_sphere)), first row first, with one value
    /// or three for each pixel.
    ///
    /// # Errors
    /// Returns an error if the number of values, or a value, is not valid.
    pub fn octahedral(side: usize, values: Vec<f32>) -> Result<Self, ProfileError> {
        Self::of([side; 2], SkyMapping::EqualArea, values)
    }

    /// Makes an image whose columns run by longitude, from x towards y, and whose rows run by the
    /// angle from the axis, with one value or three for each pixel.
    ///
    /// # Errors
    /// Returns an error if the number of values, or a value, is not valid.
    pub fn equirectangular(size: [usize; 2], values: Vec<f32>) -> Result<Self, ProfileError> {
        Self::of(size, SkyMapping::Equirectangular, values)
    }

    /// Returns the image without interpolation: a direction gets the value of the pixel that it
    /// lies in.
    #[must_use]
    pub const fn nearest(mut self) -> Self {
        self.raster.filter = SkyFilter::Nearest;
        self
    }

    /// Makes an image of any mapping, and checks its size and its values.
    fn of(size: [usize; 2], mapping: SkyMapping, values: Vec<f32>) -> Result<Self, ProfileError> {
        let pixels = size[0].checked_mul(size[1]);
        let fits = |n: usize| values.len() == n || Some(values.len()) == n.checked_mul(3);
        if values.is_empty() || !pixels.is_some_and(fits) {
            return Err(ProfileError::Count);
        }
        check_values(&values)?;
        let filter = SkyFilter::Linear;
        let raster = Raster {
            size,
            mapping,
            filter,
        };
        Ok(Self { raster, values })
    }

    /// Returns the value of a pixel in linear RGB.
    fn pixel(&self, k: usize) -> DVec3 {
        let channels = self.values.len() / (self.raster.size[0] * self.raster.size[1]);
        let value = |i: usize| f64::from(self.values[channels * k + (channels - 1) / 2 * i]);
        DVec3::new(value(0), value(1), value(2))
    }

    fn at(&self, w: DVec3) -> DVec3 {
        self.raster.lookup(w, |k| self.pixel(k))
    }

    /// Returns twice the mean over all directions or, for a Lambertian surface, the integral
    /// weighted by max(0, cos θ), divided by π.
    fn integral(&self, is_lambertian: bool) -> DVec3 {
        if is_lambertian {
            return 4.0 * self.raster.weighted(|k| self.pixel(k), |w| w.z.max(0.0));
        }
        let mut mean = DVec3::ZERO;
        self.raster
            .cells(1, |k| self.pixel(k), |_, value| mean += value);
        2.0 * mean
    }
}

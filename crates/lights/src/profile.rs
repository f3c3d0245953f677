//! Emission that depends on direction: cones, powers of the cosine, measured tables and images.
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

/// A factor by which emission depends on the direction in which light leaves, in linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    space: LightSpace,
    kind: ProfileKind,
    scale: f64,
    /// The mean over all directions of the light's space, before it is scaled.
    mean: DVec3,
}

/// The factor as a function of directions in the space of a [`Profile`], whose z is the axis.
#[derive(Clone, Debug, PartialEq)]
pub enum ProfileKind {
    /// One within the inner cone, zero beyond the outer, and between them a function of
    /// t = (cos θ − `cos_outer`)/(`cos_inner` − `cos_outer`).
    Cone {
        /// The cosine of the half angle of the inner cone.
        cos_inner: f64,
        /// The cosine of the half angle of the outer cone.
        cos_outer: f64,
        /// The function.
        falloff: Falloff,
    },
    /// max(0, cos θ) to a power (`UsdLux`'s `shaping:focus`); one below zero, or no number, counts
    /// as zero.
    CosinePower(f64),
    /// A table of angles, as IES files have it.
    Table(Arc<ProfileTable>),
    /// An image of directions.
    Map(Arc<ProfileMap>),
}

/// The decrease between the cones of a spot.
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
    /// The coefficients of t², t³ and t⁴.
    const fn polynomial(self) -> [f64; 3] {
        match self {
            Self::Smooth => [3.0, -2.0, 0.0],
            Self::Quartic => [0.0, 0.0, 1.0],
            Self::Quadratic => [1.0, 0.0, 0.0],
        }
    }
}

impl Profile {
    /// A profile about the z axis of a light's space, or of a frame.
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

    /// Returns the profile of a light that is placed in the world by `to_world`.
    #[must_use]
    pub fn placed(mut self, to_world: &LightSpace) -> Self {
        self.space = self.space.within(to_world);
        self
    }

    /// Whether it is a table or an image, not a function of the angle to the axis alone.
    #[must_use]
    pub const fn has_angles(&self) -> bool {
        matches!(self.kind, ProfileKind::Table(_) | ProfileKind::Map(_))
    }

    /// The factor for light that leaves in the unit direction `w`: finite and not negative; zero
    /// where `w` is not a number.
    #[must_use]
    pub fn factor(&self, w: DVec3) -> DVec3 {
        self.value(self.space.to_light(w))
    }

    /// The factor where the axis is the unit normal `n` of a surface, in place of the profile's
    /// own. Horizontal angles begin as near to the x axis of the light's space as the surface
    /// allows, and run from there towards n × x; under a reflection the other way round.
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

    /// The factor in a direction of the light's space.
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

    /// The mean of the factor over all directions of the light's own space: the power of a point
    /// light is 4π times it, as long as its transform has no uneven scale. (pbrt's `power` is by
    /// this mean under any transform.)
    ///
    /// **Error**: 10⁻¹² of it, in closed form: tables are linear between their angles, however
    /// narrow.
    #[must_use]
    pub fn mean(&self) -> DVec3 {
        self.scale * self.mean
    }

    /// The mean of the factor over the hemisphere about the axis, weighted by the cosine,
    /// (1/π) ∫ p cos θ dω, and over the channels: the power of a surface over that of a Lambertian
    /// one.
    ///
    /// **Error**: as of [`Profile::mean`]; of images without sharp borders, 10⁻⁵ of their mean.
    #[must_use]
    pub fn lambertian_mean(&self) -> f64 {
        self.scale * self.integral(true).element_sum() / 3.0
    }

    /// The part of the light of a point with this profile that leaves below the horizon of the
    /// axis, which a surface does not send.
    #[must_use]
    pub fn part_behind(&self) -> f64 {
        let above = match &self.kind {
            ProfileKind::Table(table) => rings_integral(&table.rings(), 1.0, FRAC_PI_2),
            _ => return 0.0,
        };
        (1.0 - above.x / (2.0 * self.mean.x)).max(0.0)
    }

    /// The integral over c = cos θ of the factor's mean around the axis: over all c, or, of a
    /// Lambertian surface, over c ≥ 0 with the weight 2c.
    fn integral(&self, is_lambertian: bool) -> DVec3 {
        match &self.kind {
            ProfileKind::Cone {
                cos_inner,
                cos_outer,
                falloff,
            } => {
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
                // With c = outer + height t, from t = first on.
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
            // The weight 2 cos θ sin θ is the sine of twice the angle.
            ProfileKind::Table(table) => {
                rings_integral(&table.rings(), if is_lambertian { 2.0 } else { 1.0 }, PI)
            }
            ProfileKind::Map(map) => map.integral(is_lambertian),
        }
    }
}

/// The integral over θ, while `turns` θ ≤ `end`, of f(θ) sin(`turns` θ), where f is linear between
/// rings: angles from the axis, each with the mean of a factor around it.
///
/// With the middle m and the half width h of a piece, and its values p and q at the ends,
/// ∫ f sin θ dθ = (p + q) sin m sin h + (q − p) cos m (sin h − h cos h)/h, without cancellation.
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

/// (sin h − h cos h)/h, by its series where that would cancel.
fn rise(h: f64) -> f64 {
    let square = h * h;
    if h < 0.1 {
        let rest = 1.0 / 30.0 - square * (1.0 / 840.0 - square / 45360.0);
        return square * (1.0 / 3.0 - square * rest);
    }
    let (sin, cos) = sin_cos(h);
    sin / h - cos
}

/// The reason why numbers are no profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileError {
    /// The number of values is not that of the angles, or of the pixels, or zero.
    Count,
    /// The angle of this number is not greater than the one before, or out of range.
    Angle(usize),
    /// The value of this number is negative, infinite or not a number.
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

/// Values over vertical and horizontal angles, interpolated between them; zero beyond the vertical
/// angles.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileTable {
    vertical: Vec<f64>,
    horizontal: Vec<f64>,
    values: Vec<f32>,
}

impl ProfileTable {
    /// A table of ascending angles in radians: vertical ones from the axis, in [0, π], and
    /// horizontal ones from x towards y, in [0, 2π]; a single horizontal angle is all of them. The
    /// values of the first horizontal angle come first. Between the last horizontal angle and the
    /// first the table goes on around the axis.
    ///
    /// # Errors
    /// Where counts, angles or values do not fit.
    pub fn new(
        vertical: Vec<f64>,
        horizontal: Vec<f64>,
        values: Vec<f32>,
    ) -> Result<Self, ProfileError> {
        if values.is_empty() || vertical.len().checked_mul(horizontal.len()) != Some(values.len()) {
            return Err(ProfileError::Count);
        }
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

    /// The value in a direction of the light's space.
    fn at(&self, w: DVec3) -> f64 {
        // Next to the axis the cosine does not determine the angle.
        let theta = atan2(hypot(w.x, w.y), w.z);
        let (first, last) = (self.vertical[0], self.vertical[self.vertical.len() - 1]);
        // Rounding of the poles and of right angles.
        if !(theta >= first - 1e-9 && theta <= last + 1e-9) {
            return 0.0;
        }
        let (i, a) = between(&self.vertical, theta);
        let (j, next, b) = self.around(atan2(w.y, w.x));
        let rows = self.vertical.len();
        let value = |j: usize, i: usize| f64::from(self.values[j * rows + i.min(rows - 1)]);
        let column = |j: usize| value(j, i) * (1.0 - a) + value(j, i + 1) * a;
        column(j) * (1.0 - b) + column(next) * b
    }

    /// The vertical angles, each with the mean of the values around the axis.
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

    /// The horizontal angles on both sides of one, and the place between them.
    fn around(&self, phi: f64) -> (usize, usize, f64) {
        let angles = &self.horizontal;
        let (first, last) = (angles[0], angles[angles.len() - 1]);
        let phi = if phi < first { phi + TAU } else { phi };
        if phi >= last {
            // On from the last angle to the first.
            let gap = first + TAU - last;
            let place = if gap > 1e-9 { (phi - last) / gap } else { 0.0 };
            return (angles.len() - 1, 0, place.clamp(0.0, 1.0));
        }
        let (j, b) = between(angles, phi);
        (j, (j + 1).min(angles.len() - 1), b)
    }
}

/// The place of a number among ascending ones: the index of the last that is not greater, and the
/// fraction of the way to the next.
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
    /// A square image by the equal-area octahedral map
    /// ([`square_to_sphere`](crate::octahedral::square_to_sphere)), first row first, with one value
    /// for each pixel, or three.
    ///
    /// # Errors
    /// Where count or values do not fit.
    pub fn octahedral(side: usize, values: Vec<f32>) -> Result<Self, ProfileError> {
        Self::of([side; 2], SkyMapping::EqualArea, values)
    }

    /// An image with columns by longitude, from x towards y, and rows by the angle from the axis,
    /// with one value for each pixel, or three.
    ///
    /// # Errors
    /// Where count or values do not fit.
    pub fn equirectangular(size: [usize; 2], values: Vec<f32>) -> Result<Self, ProfileError> {
        Self::of(size, SkyMapping::Equirectangular, values)
    }

    /// Returns the image with the value of the pixel that a direction lies in, not interpolated.
    #[must_use]
    pub const fn nearest(mut self) -> Self {
        self.raster.filter = SkyFilter::Nearest;
        self
    }

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

    /// The value of a pixel.
    fn pixel(&self, k: usize) -> DVec3 {
        let channels = self.values.len() / (self.raster.size[0] * self.raster.size[1]);
        let value = |i: usize| f64::from(self.values[channels * k + (channels - 1) / 2 * i]);
        DVec3::new(value(0), value(1), value(2))
    }

    fn at(&self, w: DVec3) -> DVec3 {
        self.raster.lookup(w, |k| self.pixel(k))
    }

    /// Twice the mean over all directions, or, of a Lambertian surface, over π the integral
    /// weighted by max(0, cos θ).
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

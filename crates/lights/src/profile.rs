//! Emission that depends on direction: cones, powers of the cosine, measured tables and images.
#![allow(
    clippy::disallowed_types,
    clippy::disallowed_macros,
    reason = "tables of a luminaire, built with it and shared by lights"
)]

use crate::octahedral::{sphere_to_square, wrap_texel};
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use core::fmt;
use linelit_elementary::{acos, atan2, cos, pow, sin};
use linelit_geometry::{DVec3, Frame};
use std::sync::Arc;

/// A factor by which emission depends on the direction in which light leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    frame: Frame,
    kind: ProfileKind,
    scale: f64,
    /// The mean over all directions, before it is scaled.
    mean: f64,
}

/// The factor as a function of directions in the frame of a [`Profile`], whose z is the axis.
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
    /// A profile about the z axis of a frame.
    #[must_use]
    pub fn new(kind: ProfileKind, frame: Frame) -> Self {
        let mut profile = Self {
            frame,
            kind,
            scale: 1.0,
            mean: 0.0,
        };
        profile.mean = 0.5 * profile.integral([1.0, 0.0], -1.0);
        profile
    }

    /// Returns the profile multiplied by a factor ≥ 0.
    #[must_use]
    pub fn scaled(mut self, by: f64) -> Self {
        self.scale *= by.max(0.0);
        self
    }

    /// The factor for light that leaves in the unit direction `w`: finite and not negative; zero
    /// where `w` is not a number.
    #[must_use]
    pub fn factor(&self, w: DVec3) -> f64 {
        self.about(&self.frame, w)
    }

    /// The factor where the axis is the unit normal `n` of a surface, whatever the profile's own;
    /// horizontal angles begin as near to the profile's x axis as the surface allows.
    #[must_use]
    pub fn on_surface(&self, n: DVec3, w: DVec3) -> f64 {
        let frame = match self.kind {
            // These ask for the axis alone.
            ProfileKind::Cone { .. } | ProfileKind::CosinePower(_) => Frame { z: n, ..self.frame },
            ProfileKind::Table(_) | ProfileKind::Map(_) => {
                Frame::from_normal_and_tangent(n, self.frame.x)
            }
        };
        self.about(&frame, w)
    }

    fn about(&self, frame: &Frame, w: DVec3) -> f64 {
        let factor = match &self.kind {
            ProfileKind::Cone {
                cos_inner,
                cos_outer,
                falloff,
            } => {
                let c = frame.z.dot(w);
                if c >= *cos_inner {
                    1.0
                } else if c > *cos_outer {
                    let t = (c - cos_outer) / (cos_inner - cos_outer);
                    let [a, b, c] = falloff.polynomial();
                    t * t * (a + t * (b + t * c))
                } else {
                    0.0
                }
            }
            ProfileKind::CosinePower(power) => match frame.z.dot(w) {
                c if c > 0.0 => pow(c, power.max(0.0)),
                _ => 0.0,
            },
            ProfileKind::Table(table) => table.at(frame.to_local(w)),
            ProfileKind::Map(map) => map.at(frame.to_local(w)),
        };
        let scaled = factor * self.scale;
        if scaled > 0.0 {
            scaled.min(f64::MAX)
        } else {
            0.0
        }
    }

    /// The mean of the factor over all directions: the power of a point light is 4π times it.
    ///
    /// **Error**: of tables and images, that of sums over 2 · 10⁵ directions.
    #[must_use]
    pub const fn mean(&self) -> f64 {
        self.scale * self.mean
    }

    /// The mean of the factor over the hemisphere about the axis, weighted by the cosine,
    /// (1/π) ∫ p cos θ dω: the power of a surface over that of a Lambertian one.
    ///
    /// **Error**: as of [`Profile::mean`].
    #[must_use]
    pub fn lambertian_mean(&self) -> f64 {
        self.scale * self.integral([0.0, 2.0], 0.0)
    }

    /// The integral over c = cos θ, from `lowest` to 1, of the factor (its mean around the axis)
    /// times one + slope c.
    fn integral(&self, [one, slope]: [f64; 2], lowest: f64) -> f64 {
        match &self.kind {
            ProfileKind::Cone {
                cos_inner,
                cos_outer,
                falloff,
            } => {
                let inner = cos_inner.max(lowest);
                let whole = (1.0 - inner) * (one + 0.5 * slope * (1.0 + inner));
                let height = cos_inner - cos_outer;
                if height.is_nan() || height <= 0.0 {
                    return whole;
                }
                // With c = outer + height t, from t = first on.
                let first = ((lowest - cos_outer) / height).clamp(0.0, 1.0);
                let (flat, rise) = (one + slope * cos_outer, slope * height);
                let moment = |n: i32| (1.0 - first.powi(n + 1)) / f64::from(n + 1);
                let terms = falloff.polynomial().into_iter().zip(2..);
                let sum = terms.map(|(k, n)| k * (flat * moment(n) + rise * moment(n + 1)));
                whole + height * sum.sum::<f64>()
            }
            ProfileKind::CosinePower(power) => {
                let power = power.max(0.0);
                one / (power + 1.0) + slope / (power + 2.0)
            }
            ProfileKind::Table(table) => numeric(
                |w| table.at(w),
                |c| if c > lowest { one + slope * c } else { 0.0 },
            ),
            ProfileKind::Map(map) => numeric(
                |w| map.at(w),
                |c| if c > lowest { one + slope * c } else { 0.0 },
            ),
        }
    }
}

/// The integral over the cosine of a factor's mean around the axis times a weight of the cosine, by
/// the midpoint rule in angles: 450 × 450 places.
fn numeric(factor: impl Fn(DVec3) -> f64, weight: impl Fn(f64) -> f64) -> f64 {
    const COUNT: u32 = 450;
    let n = f64::from(COUNT);
    let mut sum = 0.0;
    for i in 0..COUNT {
        let theta = PI * (f64::from(i) + 0.5) / n;
        let (s, c) = (sin(theta), cos(theta));
        for j in 0..COUNT {
            let phi = TAU * (f64::from(j) + 0.5) / n;
            sum += factor(DVec3::new(s * cos(phi), s * sin(phi), c)) * weight(c) * s;
        }
    }
    sum * PI / (n * n)
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

    /// The value in a direction of the profile's frame.
    fn at(&self, w: DVec3) -> f64 {
        let theta = acos((w.z / w.length()).clamp(-1.0, 1.0));
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

/// An image of directions in grey, interpolated between its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileMap {
    size: [usize; 2],
    is_octahedral: bool,
    values: Vec<f32>,
}

impl ProfileMap {
    /// A square image by the equal-area octahedral map
    /// ([`square_to_sphere`](crate::octahedral::square_to_sphere)), first row first.
    ///
    /// # Errors
    /// Where count or values do not fit.
    pub fn octahedral(side: usize, values: Vec<f32>) -> Result<Self, ProfileError> {
        Self::of([side; 2], true, values)
    }

    /// An image with columns by longitude, from x towards y, and rows by the angle from the axis.
    ///
    /// # Errors
    /// Where count or values do not fit.
    pub fn equirectangular(size: [usize; 2], values: Vec<f32>) -> Result<Self, ProfileError> {
        Self::of(size, false, values)
    }

    fn of(size: [usize; 2], is_octahedral: bool, values: Vec<f32>) -> Result<Self, ProfileError> {
        if values.is_empty() || size[0].checked_mul(size[1]) != Some(values.len()) {
            return Err(ProfileError::Count);
        }
        check_values(&values)?;
        Ok(Self {
            size,
            is_octahedral,
            values,
        })
    }

    fn at(&self, w: DVec3) -> f64 {
        interpolate(self.size, self.is_octahedral, w, |k| {
            DVec3::splat(f64::from(self.values[k]))
        })
        .x
    }
}

/// The place of a direction in an image by longitude, from x towards y, and the angle from z.
fn by_angles(w: DVec3) -> [f64; 2] {
    let turn = atan2(w.y, w.x) / TAU;
    let turn = if turn < 0.0 { turn + 1.0 } else { turn };
    // Next to the poles the cosine tells nothing of the angle.
    let angle = FRAC_PI_2 - atan2(w.z, (w.x * w.x + w.y * w.y).sqrt());
    [turn, angle / PI]
}

/// An image of directions at `w`, between the centres of its pixels: by the equal-area map, or by
/// angles.
pub(crate) fn interpolate(
    size: [usize; 2],
    is_octahedral: bool,
    w: DVec3,
    pixel: impl Fn(usize) -> DVec3,
) -> DVec3 {
    if !w.is_finite() {
        return DVec3::ZERO;
    }
    let place = match is_octahedral {
        true => sphere_to_square(w),
        false => by_angles(w),
    };
    let [(i, a), (j, b)] = [0, 1].map(|k| {
        let x = place[k] * size[k] as f64 - 0.5;
        #[allow(clippy::cast_possible_truncation, reason = "within the image's size")]
        let first = x.floor() as isize;
        (first, x - x.floor())
    });
    let at = |i: isize, j: isize| {
        let [width, height] = size.map(usize::cast_signed);
        let [i, j] = match is_octahedral {
            true => wrap_texel([i, j], size[0]),
            // Beyond a pole the sphere goes on half a turn away; the row itself is as good.
            false => [i.rem_euclid(width), j.clamp(0, height - 1)].map(isize::cast_unsigned),
        };
        pixel(j * size[0] + i)
    };
    let row = |j: isize| at(i, j) * (1.0 - a) + at(i + 1, j) * a;
    row(j) * (1.0 - b) + row(j + 1) * b
}

//! This module holds the plane fan of directions from the shading point to a segment, clipped to
//! several half-spaces. All integrals with a lobe begin with it.

use crate::exact::{area_vector, direction, dot, length, value_at_crossing};
use crate::horizon::crossing;
use crate::span::{LEAST_LENGTH, power_of_two_unit, scale_of_ends};
use linelit_elementary::{atan2, sin};
use linelit_geometry::{DVec3, predicates};

/// A segment clipped to the half-spaces `k·p ≥ 0` of N vectors k, with `k·p` at its ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fan<const N: usize> {
    /// The ends of the segment after clipping.
    pub(crate) ends: [DVec3; 2],
    /// The distances of the ends from the shading point.
    pub(crate) radii: [f64; 2],
    /// For each of the N vectors, `k·p` at both ends: not negative, and with a small relative
    /// error.
    pub(crate) values: [[f64; 2]; N],
    /// The length after clipping.
    pub(crate) length: f64,
    /// The unit normal of the fan; zero where its plane is not defined.
    pub(crate) normal: DVec3,
    /// sin δ with a small relative error, where δ is the angle between the ends.
    pub(crate) sine: f64,
    /// The angle δ in radians.
    pub(crate) angle: f64,
    /// sin(δ/2).
    pub(crate) half_sine: f64,
    /// The power of two with which lengths were multiplied.
    pub(crate) unit: f64,
}

impl<const N: usize> Fan<N> {
    /// Clips the segment; `None` where no part is left, where it has no length, and where an end is
    /// the shading point.
    ///
    /// With `widths`, a quantity that is linear between these values at the ends, not negative,
    /// replaces `k·p` for the second vector.
    pub(crate) fn new(
        p0: DVec3,
        p1: DVec3,
        vectors: &[DVec3; N],
        widths: Option<[f64; 2]>,
    ) -> Option<Self> {
        // Scale by a power of two if coordinates are very large or very small.
        let largest = p0.abs().max(p1.abs()).max_element();
        let unit = if (1e-60..1e60).contains(&largest) {
            1.0
        } else {
            power_of_two_unit(largest)?
        };
        let whole = [p0 * unit, p1 * unit];
        let mut ends = whole;
        let mut values = vectors.map(|k| [dot(k, whole[0]), dot(k, whole[1])]);
        if let (Some(widths), Some(second)) = (widths, values.get_mut(1)) {
            *second = widths.map(|w| w * unit);
        }
        let mut fraction = 1.0;
        let base = values;
        // Clip at each half-space, and move the values to the new end.
        for (i, k) in vectors.iter().enumerate() {
            let [c0, c1] = values[i];
            if !(c0 > 0.0 || c1 > 0.0) {
                return None;
            }
            if c0 >= 0.0 && c1 >= 0.0 {
                continue;
            }
            let span = c1 - c0;
            let end = usize::from(c0 > 0.0);
            fraction *= if end == 0 { c1 / span } else { -c0 / span };
            // Start from the given ends, not from rounded ones: this matters near the shading
            // point.
            let q = crossing(whole[0], whole[1], *k, base[i][0], base[i][1]);
            ends[end] = q;
            for (j, value) in values.iter_mut().enumerate() {
                // If the values have the same sign, interpolation does not cancel.
                value[end] = if value[0] * value[1] >= 0.0 {
                    value[0] * (c1 / span) + value[1] * (-c0 / span)
                } else {
                    value_at_crossing(vectors[j], *k, whole[0], whole[1])
                };
            }
            values[i][end] = 0.0;
        }
        Self::measure(ends, whole, values, fraction, unit)
    }

    /// Makes the fan of clipped ends; a fan with an end near the shading point is scaled first.
    fn measure(
        ends: [DVec3; 2],
        whole: [DVec3; 2],
        values: [[f64; 2]; N],
        fraction: f64,
        unit: f64,
    ) -> Option<Self> {
        let radii = ends.map(DVec3::length);
        if radii[0].min(radii[1]) > LEAST_LENGTH {
            Self::of(ends, radii, whole, values, fraction, unit)
        } else {
            Self::near_or_far(ends, whole, values, fraction, unit)
        }
    }

    /// Makes the fan of clipped ends, as [`Self::measure`] does, where squares of distances may
    /// underflow or overflow.
    #[cold]
    #[inline(never)]
    fn near_or_far(
        ends: [DVec3; 2],
        whole: [DVec3; 2],
        values: [[f64; 2]; N],
        fraction: f64,
        unit: f64,
    ) -> Option<Self> {
        let scale = scale_of_ends(ends)?;
        let values = values.map(|pair| pair.map(|c| c * scale));
        let [ends, whole] = [ends, whole].map(|pair| pair.map(|p| p * scale));
        let radii = ends.map(length);
        Self::of(ends, radii, whole, values, fraction, unit * scale)
    }

    /// Makes the fan of clipped ends for which squares of distances neither underflow nor overflow.
    #[inline(always)]
    fn of(
        ends: [DVec3; 2],
        radii: [f64; 2],
        whole: [DVec3; 2],
        values: [[f64; 2]; N],
        fraction: f64,
        unit: f64,
    ) -> Option<Self> {
        // Refuse a segment without length, and one with an end at the shading point.
        let span = length(whole[1] - whole[0]) * fraction;
        let product = radii[0] * radii[1];
        if !(product > 0.0 && span > 0.0) {
            return None;
        }
        // Compute the angle and the plane of the fan from the whole segment, which is not rounded.
        let area = area_vector(whole[0], whole[1]);
        let sine = (length(area) * fraction / product).min(1.0);
        let angle = atan2(sine, (ends[0].dot(ends[1]) / product).clamp(-1.0, 1.0));
        let normal = direction(area);
        if sine <= 0.0 && angle > 1.0 {
            return None;
        }
        Some(Self {
            ends,
            radii,
            values,
            length: span,
            normal,
            sine,
            angle,
            half_sine: sin(0.5 * angle),
            unit,
        })
    }

    /// Returns l/(r0 r1) = (1/h) sin δ, which is finite also for h → 0.
    pub(crate) fn reach(&self) -> f64 {
        self.length / self.radii[0] / self.radii[1]
    }

    /// Returns `k·ω` at an end.
    pub(crate) fn cosine(&self, vector: usize, end: usize) -> f64 {
        self.values[vector][end] / self.radii[end]
    }

    /// Returns the weights of the values at the ends for the cosine at the arc angle `v` from the
    /// first end. Both are positive. They are computed from the midpoint of the arc and the nearer
    /// end, so that no angle near π occurs.
    pub(crate) fn weights(&self, v: f64) -> [f64; 2] {
        if v <= 0.0 || self.sine <= 0.0 {
            return [1.0, 0.0];
        }
        let half = 0.5 * self.angle;
        let w = if v <= half { v } else { self.angle - v };
        if w <= 0.0 {
            return [0.0, 1.0];
        }
        let middle = sin(w) / self.sine;
        let near = sin((half - w).max(0.0)) / self.half_sine + middle;
        if v <= half {
            [near, middle]
        } else {
            [middle, near]
        }
    }

    /// Returns `k·ω` at the arc angle `v` from its values at the ends.
    pub(crate) fn cosine_at(&self, ends: [f64; 2], v: f64) -> f64 {
        let [w0, w1] = self.weights(v);
        w0 * ends[0] + w1 * ends[1]
    }

    /// Returns the derivative of `k·ω` by the arc angle at an end, towards the other end: `k·t` for
    /// the unit tangent t.
    pub(crate) fn slope(&self, k: DVec3, end: usize) -> f64 {
        let tangent = predicates::cross(self.normal, self.ends[end] / self.radii[end]);
        dot(k, if end == 0 { tangent } else { -tangent })
    }
}

impl Fan<2> {
    /// Makes the fan of a segment above both half-spaces from rounded ends and the exact values and
    /// length. `None` if an end is the shading point.
    pub(crate) fn rounded(ends: [DVec3; 2], values: [[f64; 2]; 2], length: f64) -> Option<Self> {
        let [p0, p1] = ends;
        // Ends that rounding has made equal are a direction without a plane.
        let fan = Fan::new(p0, p1, &[], None).or_else(|| {
            let radii = ends.map(DVec3::length);
            (p0 == p1 && radii[0] > LEAST_LENGTH).then_some(Fan {
                ends,
                radii,
                values: [],
                length,
                normal: DVec3::ZERO,
                sine: 0.0,
                angle: 0.0,
                half_sine: 0.0,
                unit: 1.0,
            })
        })?;
        Some(Self {
            ends: fan.ends,
            radii: fan.radii,
            values: values.map(|pair| pair.map(|value| value * fan.unit)),
            length: length * fan.unit,
            normal: fan.normal,
            sine: fan.sine,
            angle: fan.angle,
            half_sine: fan.half_sine,
            unit: fan.unit,
        })
    }

    /// Inserts a constant (one or a distance) as a further function between the two: divided by |p|
    /// it changes like a cosine.
    pub(crate) fn with_constant(self, constant: f64) -> Fan<3> {
        Fan {
            ends: self.ends,
            radii: self.radii,
            values: [self.values[0], [constant; 2], self.values[1]],
            length: self.length,
            normal: self.normal,
            sine: self.sine,
            angle: self.angle,
            half_sine: self.half_sine,
            unit: self.unit,
        }
    }
}

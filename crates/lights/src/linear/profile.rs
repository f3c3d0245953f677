//! Emission that varies along and across a linear light.
#![allow(
    clippy::disallowed_types,
    reason = "tables of a profile, built with it"
)]

use super::projected::ProjectedLine;
use super::{LinearSample, view_from};
use crate::LinearPointTechnique;
use crate::density::{Pdf, ThinSolidAngle};
use linelit_geometry::finite::{BELOW_ONE, below_one, fraction};
use linelit_geometry::{DVec3, Segment, predicates};

/// Relative radiance along a linear light: constant on equal cells, each value ≥ 0.
#[derive(Clone, Debug, PartialEq)]
pub struct AlongProfile {
    values: Vec<f64>,
}

impl AlongProfile {
    /// A profile with these values from the first end to the second. `None` if there are none, one
    /// is negative or not finite, or all are zero. (Allocates; made once per light.)
    #[must_use]
    pub fn new(values: &[f64]) -> Option<Self> {
        let usable = values.iter().all(|v| *v >= 0.0 && v.is_finite());
        (usable && values.iter().any(|v| *v > 0.0)).then(|| Self {
            values: values.to_vec(),
        })
    }

    /// The relative radiance at the fraction `t` of the light.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        self.values[self.cell(t)]
    }

    fn cell(&self, t: f64) -> usize {
        let n = self.values.len();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a float-to-integer cast saturates, and the minimum follows"
        )]
        let i = (t * n as f64) as usize;
        i.min(n - 1)
    }

    #[allow(clippy::cast_precision_loss, reason = "far fewer than 2^53 cells")]
    fn edge(&self, i: usize) -> f64 {
        i as f64 / self.values.len() as f64
    }
}

/// A profile across the light: relative radiance `sin^k γ` for the angle γ between the light's axis
/// and the emitted unit direction, `k = 0` a Lambertian surface, larger `k` a louvre that hides the
/// lamp from along its axis. In [0, 1]: `k` < 0, which would shine without bound along the axis,
/// and NaN count as 0.
///
/// It multiplies the radiance; no technique here samples by it, as Peters 2021, §3.1 recommends
/// ("possibly at the cost of increased variance").
#[must_use]
pub fn across_lambert(axis: DVec3, direction: DVec3, k: f64) -> f64 {
    let axis = predicates::normalize(axis).unwrap_or(DVec3::ZERO);
    let sine = predicates::length(predicates::cross(axis, direction));
    fraction(sine).powf(k.max(0.0))
}

/// Samples a linear light proportionally to cosine × profile: zero variance on a diffuse surface
/// for any profile.
///
/// The light is cut at the cells of the profile; each cell is a line of its own, of which the
/// projected solid angle times the value is the probability. Costs one projected solid angle per
/// cell and set-up, and again per sample for the search (linear in the cells; no allocation).
#[derive(Clone, Copy, Debug)]
pub struct ProfiledLine<'p> {
    light: Segment,
    x: DVec3,
    normal: DVec3,
    profile: &'p AlongProfile,
    total: f64,
}

impl<'p> ProfiledLine<'p> {
    /// The per-light part. `None` if no cell that emits is above the horizon.
    #[must_use]
    pub fn new(
        light: &Segment,
        x: DVec3,
        normal: DVec3,
        profile: &'p AlongProfile,
    ) -> Option<Self> {
        let mut out = Self {
            light: *light,
            x,
            normal,
            profile,
            total: 0.0,
        };
        out.total = (0..profile.values.len()).map(|i| out.weight(i)).sum();
        (out.total > 0.0 && out.total.is_finite()).then_some(out)
    }

    /// Irradiance for unit radiance × radius: Σ value × projected solid angle per radius, in sr/m.
    #[must_use]
    pub const fn irradiance(&self) -> f64 {
        self.total
    }

    fn cell(&self, i: usize) -> Option<ProjectedLine<f64>> {
        let piece = self
            .light
            .piece(self.profile.edge(i), self.profile.edge(i + 1));
        let view = view_from(&piece, self.x, Some(self.normal))?;
        ProjectedLine::of(view)
    }

    fn weight(&self, i: usize) -> f64 {
        let value = self.profile.values[i];
        if value > 0.0 {
            self.cell(i)
                .map_or(0.0, |c| value * c.projected_solid_angle())
        } else {
            0.0
        }
    }

    fn sample_cell(&self, i: usize, xi: f64) -> LinearSample {
        let Some(line) = self.cell(i) else {
            return LinearSample::default();
        };
        let arc = line.sample(xi);
        let (a, b) = (self.profile.edge(i), self.profile.edge(i + 1));
        let place = line.view().whole_fraction(arc.lambda);
        LinearSample {
            t: a * (1.0 - place) + b * place,
            offset: DVec3::from(arc.point),
            direction: DVec3::from(arc.direction),
            pdf: Pdf::new(line.view().cosine(arc.lambda) * self.profile.values[i] / self.total),
        }
    }
}

impl LinearPointTechnique for ProfiledLine<'_> {
    fn sample(&self, xi: f64) -> LinearSample {
        let mut rest = fraction(xi) * self.total;
        let mut last = 0;
        for i in 0..self.profile.values.len() {
            let w = self.weight(i);
            if w > 0.0 {
                if rest < w {
                    return self.sample_cell(i, rest / w);
                }
                last = i;
            }
            rest -= w;
        }
        self.sample_cell(last, BELOW_ONE)
    }

    fn pdf(&self, t: f64) -> Pdf<ThinSolidAngle> {
        if !(0.0..=1.0).contains(&t) {
            return Pdf::ZERO;
        }
        let p = self.light.at(t) - self.x;
        let cosine = self.normal.dot(p) / p.length();
        Pdf::new(cosine * self.profile.at(t) / self.total)
    }

    fn invert(&self, t: f64) -> Option<f64> {
        if !(0.0..=1.0).contains(&t) {
            return None;
        }
        let i = self.profile.cell(t);
        let before: f64 = (0..i).map(|j| self.weight(j)).sum();
        let w = self.weight(i);
        let line = self.cell(i).filter(|_| w > 0.0)?;
        let (a, b) = (self.profile.edge(i), self.profile.edge(i + 1));
        let lambda = line.view().clipped_fraction((t - a) / (b - a))?;
        Some(below_one((before + w * line.invert(lambda)) / self.total))
    }
}

//! This crate chooses one light among many, so that one sample serves for the union of N lights
//! (Shirley & Wang 1991, §3).
//!
//! Light i is chosen with the probability αᵢ, and a point of it with its own density pᵢ, so that
//! the density on the union is αᵢ pᵢ (eq. 7). This crate has several ways to choose α. Each can
//! return the probability of any light, which MIS needs.
//!
//! | way | α | cost |
//! |---|---|---|
//! | [`Discrete::uniform`] | 1/N | O(1) |
//! | [`Discrete::by_power`] | emitted power | O(log N) |
//! | [`Estimated`] | unshadowed contribution of a random point, with a floor | O(N) per shading point |
//! | [`LightTree`] | a hierarchy of moments and bounds | O(log N) |
//!
//! ```
//! use linelit_selection::Discrete;
//! let lights = Discrete::new(&[1.0, 0.0, 3.0]).unwrap();
//! let picked = lights.pick(0.5).unwrap();
//! assert_eq!((picked.index, picked.probability), (2, 0.75));
//! // The rest of the random number is fresh: it can place the point.
//! assert!((picked.rest - 1.0 / 3.0).abs() < 1e-15);
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod bounds;
mod contribution;
mod ranges;
mod reflected;
mod tree;

pub use contribution::{
    Receiver, can_contribute, diffuse, positive_part, spread, unshadowed, unshadowed_at_center,
};
pub use ranges::LightRanges;
pub use reflected::{LtcReceiver, reflecting};
pub use tree::LightTree;

// Their types appear in public signatures: with these exports a caller needs one dependency.
pub use {linelit_bsdf as bsdf, linelit_geometry as geometry, linelit_lights as lights};

use linelit_geometry::finite::BELOW_ONE;
use linelit_lights::Light;

/// A light that has been chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picked {
    /// The index of the light.
    pub index: usize,
    /// The probability α > 0 of the light.
    pub probability: f64,
    /// The random number, rescaled to [0, 1) for further use.
    pub rest: f64,
}

/// Clamps a random number to [0, 1); NaN becomes zero.
fn unit(u: f64) -> f64 {
    if u > 0.0 { u.min(BELOW_ONE) } else { 0.0 }
}

/// A fixed discrete distribution, stored as a table of running sums. It allocates when it is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Discrete {
    sums: Vec<f64>,
}

impl Discrete {
    /// Makes the distribution with probabilities proportional to `weights` ≥ 0. They are positive
    /// for every positive weight: a weight that would be lost by rounding is raised to an ulp of
    /// the sum. `None` if a weight is negative or not finite, or all are zero.
    #[must_use]
    pub fn new(weights: &[f64]) -> Option<Self> {
        if weights.iter().any(|w| *w < 0.0 || !w.is_finite()) {
            return None;
        }
        let table = Self::with_scale(weights, 1.0);
        let table = if table.total().is_finite() {
            table
        } else {
            // Scale down: 2⁶⁴ of the largest weights then add up to less than the largest number.
            Self::with_scale(weights, 0.5_f64.powi(70))
        };
        (table.total() > 0.0).then_some(table)
    }

    /// Makes running sums of `weights` × `scale`, where each positive weight is at least an ulp of
    /// the sum.
    fn with_scale(weights: &[f64], scale: f64) -> Self {
        let mut total = 0.0_f64;
        let mut sums = Vec::with_capacity(weights.len() + 1);
        sums.push(0.0);
        for &w in weights {
            if w > 0.0 {
                total = (total + w * scale).max(total.next_up());
            }
            sums.push(total);
        }
        Self { sums }
    }

    /// Makes the uniform distribution over `n` lights; `None` for `n` = 0.
    #[must_use]
    pub fn uniform(n: usize) -> Option<Self> {
        Self::new(&vec![1.0; n])
    }

    /// Makes the distribution by emitted power; `None` if no light emits.
    #[must_use]
    pub fn by_power(lights: &[Light]) -> Option<Self> {
        let weights: Vec<f64> = lights.iter().map(Light::power).collect();
        Self::new(&weights)
    }

    fn total(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// Returns the light that a random number in [0, 1) chooses, with its probability; `None` if
    /// the distribution is empty.
    #[must_use]
    pub fn pick(&self, u: f64) -> Option<Picked> {
        let target = unit(u) * self.total();
        let mut i = self
            .sums
            .partition_point(|&s| s <= target)
            .clamp(1, self.sums.len() - 1)
            - 1;
        // At the very end, rounding can lead to a light without weight.
        while i > 0 && self.probability(i) <= 0.0 {
            i -= 1;
        }
        let weight = self.sums[i + 1] - self.sums[i];
        (weight > 0.0).then(|| Picked {
            index: i,
            probability: self.probability(i),
            rest: ((target - self.sums[i]) / weight).clamp(0.0, BELOW_ONE),
        })
    }

    /// Returns the probability α of light `index`; zero if its weight is zero, or if there is no
    /// such light.
    #[must_use]
    pub fn probability(&self, index: usize) -> f64 {
        match (self.sums.get(index), self.sums.get(index + 1)) {
            (Some(a), Some(b)) if b > a => ((b - a) / self.total()).max(f64::MIN_POSITIVE),
            _ => 0.0,
        }
    }
}

/// The sum of the least probabilities of [`Estimated`]: every one of N lights that may contribute
/// gets at least this fraction of the sum, divided by N.
pub const FLOOR: f64 = 0.05;

/// The largest power or estimate of one light; larger values are clamped to it, so that sums over
/// all lights are finite.
pub(crate) const LARGEST: f64 = 1e280;

/// The factor of a conservative estimate that is added to a more precise one, so that a light for
/// which the precise estimate is too small is not chosen much too seldom.
pub(crate) const DEFENCE: f64 = 0.05;

/// A distribution in proportion to an estimate of every light's unshadowed contribution at one
/// shading point, made anew for each point.
///
/// **False zeros** (Shirley & Wang 1991, §3): an estimate from one random point may be zero
/// although other points of the light contribute. αᵢ may be zero only if *no* point can
/// ([`can_contribute`]). Every other light gets at least [`FLOOR`]/N of the sum before normalising.
/// If α is to serve as a density for MIS, the point of the estimate must not be used again for the
/// shadow ray.
///
/// The caller provides the buffer, so that this does not allocate.
///
/// ```
/// use linelit_selection::Estimated;
/// let mut buffer = [0.0; 3];
/// // Light 1 happened to give zero, light 2 cannot be seen at all.
/// let alpha = Estimated::new(&mut buffer, |i| [4.0, 0.0, 0.0][i], |i| i < 2);
/// assert!(alpha.probability(1) > 0.0 && alpha.probability(2) == 0.0);
/// ```
#[derive(Debug)]
pub struct Estimated<'b> {
    weights: &'b [f64],
    total: f64,
}

impl<'b> Estimated<'b> {
    /// Fills `buffer`, which has one entry for each light, from `estimate(i)` ≥ 0 and
    /// `possible(i)`.
    pub fn new(
        buffer: &'b mut [f64],
        mut estimate: impl FnMut(usize) -> f64,
        mut possible: impl FnMut(usize) -> bool,
    ) -> Self {
        let mut sum = 0.0;
        for (i, w) in buffer.iter_mut().enumerate() {
            // A negative weight marks a light that cannot contribute, until the floor is known.
            *w = if possible(i) {
                let e = estimate(i);
                // Clamp the estimate so that sums are finite; NaN counts as zero.
                if e > 0.0 { e.min(LARGEST) } else { 0.0 }
            } else {
                -1.0
            };
            sum += w.max(0.0);
        }
        #[allow(clippy::cast_precision_loss, reason = "far fewer than 2^53 lights")]
        let floor = if sum > 0.0 {
            (FLOOR * sum / buffer.len() as f64).max(f64::MIN_POSITIVE)
        } else {
            1.0
        };
        // Raise the estimates to the floor.
        let mut total = 0.0;
        for w in buffer.iter_mut() {
            *w = if *w < 0.0 { 0.0 } else { w.max(floor) };
            total += *w;
        }
        Self {
            weights: buffer,
            total,
        }
    }

    /// Returns the light for a random number in [0, 1); `None` if no light can contribute.
    #[must_use]
    pub fn pick(&self, u: f64) -> Option<Picked> {
        let mut rest = unit(u) * self.total;
        let mut last = None;
        for (index, &w) in self.weights.iter().enumerate() {
            if w > 0.0 {
                let probability = w / self.total;
                last = Some(Picked {
                    index,
                    probability,
                    rest: BELOW_ONE,
                });
                if rest < w {
                    let rest = (rest / w).min(BELOW_ONE);
                    return last.map(|p| Picked { rest, ..p });
                }
                rest -= w;
            }
        }
        last
    }

    /// Returns the probability α of light `index`.
    #[must_use]
    pub fn probability(&self, index: usize) -> f64 {
        match self.weights.get(index) {
            Some(w) if self.total > 0.0 => w / self.total,
            _ => 0.0,
        }
    }
}

/// The README's example is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

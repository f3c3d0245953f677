//! This module holds a reflection that is a sum of other reflections.

use crate::lobe::{Model, by_cosine};
use crate::microfacet::TrowbridgeReitz;
use crate::{Lobe, LtcMixture, Peaks, numbers};
use linelit_geometry::finite::{nonnegative, nonnegative_vector};
use linelit_geometry::{DVec3, Frame, Segment};
use smallvec::SmallVec;
use std::f64::consts::FRAC_1_PI;

/// The fraction of a sample's probability that is divided equally between the lobes. It bounds the
/// weight of a sample where the estimated albedos are wrong.
const EVEN: f64 = 0.1;

/// A sum of a diffuse reflection and up to [`Layers::MAX`] other lobes, each scaled by a colour.
///
/// All lobes share the tangent to which anisotropic ones refer. A direction ω_o below the horizon
/// of the shading normal (which smooth normals cause at a silhouette) counts as mirrored above it,
/// and the reflection is zero for ω_i there. The sum is therefore reciprocal, if its lobes are,
/// only for directions above the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    diffuse: DVec3,
    tangent: DVec3,
    /// The lobes and their scales. One is stored inline, which is enough for all materials except
    /// mixtures: inline lobes are copied with every shading point of any material.
    lobes: SmallVec<[(DVec3, Lobe); 1]>,
}

/// The probabilities with which a direction is drawn by the diffuse part and by each lobe.
struct Choice {
    diffuse: f64,
    lobes: [f64; Layers::MAX],
}

impl Layers {
    /// The largest number of lobes in addition to the diffuse one.
    pub const MAX: usize = LtcMixture::MAX;

    /// Makes a black reflection, with the direction (in the world, of any length) that anisotropic
    /// lobes use as x; zero if there are none.
    #[must_use]
    pub fn new(tangent: DVec3) -> Self {
        Self {
            tangent,
            ..Self::default()
        }
    }

    /// Returns the direction that anisotropic lobes use as x; zero if there is none.
    #[must_use]
    pub const fn tangent(&self) -> DVec3 {
        self.tangent
    }

    /// Sets the direction that anisotropic lobes use as x.
    pub const fn set_tangent(&mut self, tangent: DVec3) {
        self.tangent = tangent;
    }

    /// Adds a diffuse reflection.
    pub fn add_diffuse(&mut self, albedo: DVec3) {
        self.diffuse += albedo;
    }

    /// Adds a lobe with a scale; a black lobe is left out. Returns `false`, without adding the
    /// lobe, if there are [`Self::MAX`] lobes already.
    #[must_use = "a lobe that does not fit is lost"]
    pub fn add(&mut self, scale: DVec3, lobe: Lobe) -> bool {
        if scale == DVec3::ZERO || lobe.is_black() {
            return true;
        }
        let fits = self.lobes.len() < Self::MAX;
        if fits {
            self.lobes.push((scale, lobe));
        }
        fits
    }

    /// Returns the albedo of the diffuse part.
    #[must_use]
    pub const fn diffuse(&self) -> DVec3 {
        self.diffuse
    }

    /// Returns the lobes with their scales.
    pub fn lobes(&self) -> impl Iterator<Item = (DVec3, &Lobe)> {
        self.lobes.iter().map(|(scale, lobe)| (*scale, lobe))
    }

    /// Returns the lobes with their scales as a slice.
    pub(crate) fn as_slice(&self) -> &[(DVec3, Lobe)] {
        &self.lobes
    }

    /// Whether the sum reflects no light.
    #[must_use]
    pub fn is_black(&self) -> bool {
        self.lobes.is_empty() && self.diffuse == DVec3::ZERO
    }

    /// Returns the frame of the surface, with the tangent as x if there is one.
    fn frame(&self, n: DVec3) -> Frame {
        if self.tangent == DVec3::ZERO {
            Frame::from_normal(n)
        } else {
            Frame::from_normal_and_tangent(n, self.tangent)
        }
    }

    /// Returns f(ω_i, ω_o) in 1/sr.
    pub(crate) fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3 {
        let frame = self.frame(n);
        let (wi, wo) = (frame.to_local(wi), above(frame.to_local(wo)));
        let flat = self.diffuse * FRAC_1_PI;
        nonnegative_vector(
            self.lobes()
                .fold(flat, |sum, (scale, lobe)| sum + scale * lobe.value(wi, wo)),
        )
    }

    /// Adds the positions along a segment, given relative to the point, at which lobes are largest
    /// or have kinks.
    pub(crate) fn add_peaks(&self, line: &Segment, wo: DVec3, n: DVec3, peaks: &mut Peaks) {
        let frame = self.frame(n);
        let [p0, p1] = [line.p0, line.p1].map(|p| frame.to_local(p));
        let (line, wo) = (Segment::new(p0, p1), above(frame.to_local(wo)));
        for (_, lobe) in self.lobes() {
            lobe.add_peaks(&line, wo, peaks);
        }
    }

    /// Draws ω_i by one of the lobes, for the choice of which `u[0]` is split and rescaled.
    pub(crate) fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3> {
        let frame = self.frame(n);
        let wo = above(frame.to_local(wo));
        let choice = self.choice(wo)?;
        // Draw by the cosine if the diffuse part is chosen.
        let mut rest = u[0];
        let rescaled = |rest: f64, share: f64| [(rest / share).min(crate::ONE_MINUS), u[1]];
        if rest < choice.diffuse || self.lobes.is_empty() {
            let wi = by_cosine(rescaled(rest, choice.diffuse));
            return numbers(frame.to_world(wi));
        }
        // Otherwise find the lobe that the number falls into.
        rest -= choice.diffuse;
        let mut chosen = None;
        for (i, (_, lobe)) in self.lobes().enumerate() {
            if choice.lobes[i] > 0.0 {
                chosen = Some((lobe, rescaled(rest.max(0.0), choice.lobes[i])));
                if rest < choice.lobes[i] {
                    break;
                }
                rest -= choice.lobes[i];
            }
        }
        let (lobe, u) = chosen?;
        lobe.sample(wo, u)
            .and_then(|wi| numbers(frame.to_world(wi)))
    }

    /// Returns the density of [`sample`](Self::sample), per solid angle.
    pub(crate) fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64 {
        let frame = self.frame(n);
        let (wi, wo) = (frame.to_local(wi), above(frame.to_local(wo)));
        let Some(choice) = self.choice(wo) else {
            return 0.0;
        };
        let diffuse = choice.diffuse * wi.z.max(0.0) * FRAC_1_PI;
        nonnegative(
            self.lobes()
                .zip(choice.lobes)
                .filter(|(_, share)| *share > 0.0)
                .fold(diffuse, |sum, ((_, lobe), share)| {
                    sum + share * lobe.pdf(wi, wo)
                }),
        )
    }

    /// Returns the LTCs of all lobes; their nearly diffuse parts are summed into one cosine.
    pub(crate) fn transformed_cosines(&self, wo: DVec3, n: DVec3) -> LtcMixture {
        let frame = self.frame(n);
        let wo = above(frame.to_local(wo));
        let mut sum = LtcMixture::new(frame, self.diffuse);
        for (scale, lobe) in self.lobes() {
            let (diffuse, glossy) = lobe.cosines(wo);
            sum.diffuse += scale * diffuse;
            if let Some(glossy) = glossy {
                sum.add(glossy.scaled(scale));
            }
        }
        sum
    }

    /// Whether any lobe [bends](TrowbridgeReitz::bends).
    pub(crate) fn is_unlike_cosines(&self, wo: DVec3, n: DVec3) -> bool {
        let stretched = || {
            let facets = self.lobes().filter_map(|(_, lobe)| lobe.facets());
            facets.filter(TrowbridgeReitz::is_stretched)
        };
        stretched().next().is_some() && {
            let wo = above(self.frame(n).to_local(wo));
            stretched().any(|facets| facets.bends(wo))
        }
    }

    /// Returns probabilities of the lobes in proportion to their approximate albedos, plus an even
    /// part for all lobes that are sampled, since some report an albedo of about zero. `None` for a
    /// black reflection.
    fn choice(&self, wo: DVec3) -> Option<Choice> {
        // Sum the diffuse parts of all lobes, and collect their glossy parts.
        let mut diffuse = self.diffuse.element_sum();
        let mut lobes = [(0.0, false); Self::MAX];
        for ((scale, lobe), (share, drawn)) in self.lobes().zip(&mut lobes) {
            let [flat, glossy] = lobe.shares(wo).map(|part| (scale * part).element_sum());
            diffuse += flat;
            *share = glossy;
            *drawn = glossy > 0.0 || flat <= 0.0;
        }
        // Turn them into probabilities.
        let total = diffuse + lobes.iter().map(|(share, _)| share).sum::<f64>();
        let used = lobes.iter().filter(|(_, drawn)| *drawn).count() + usize::from(diffuse > 0.0);
        if used == 0 || total.is_nan() {
            return None;
        }
        #[allow(clippy::cast_precision_loss, reason = "at most nine")]
        let used = used as f64;
        let probability = |share: f64, drawn: bool| match drawn {
            false => 0.0,
            true if total > 0.0 => (1.0 - EVEN) * share / total + EVEN / used,
            true => 1.0 / used,
        };
        Some(Choice {
            diffuse: probability(diffuse, diffuse > 0.0),
            lobes: lobes.map(|(share, drawn)| probability(share, drawn)),
        })
    }
}

/// Returns ω_o, mirrored above the horizon.
fn above(wo: DVec3) -> DVec3 {
    DVec3::new(wo.x, wo.y, wo.z.abs())
}

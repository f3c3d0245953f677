//! This module holds factors that smooth weights at discontinuities (Salesin & Jarosz 2019, section
//! 4.3, with corrected widths in eq. 24).

use crate::heuristics::{score, share};
/// Returns the value of the quadratic ease-out curve.
///
/// **Formula.** m(t) = c(2 − c), c = t clamped to [0, 1]: from 0 to 1 with slope 2 at 0 and slope 0
/// at 1. NaN gives 0. **Reference.** Salesin & Jarosz 2019, below eq. 23.
///
/// ```
/// use linelit_mis::smoothing::ease;
/// assert_eq!([ease(-1.0), ease(0.5), ease(7.0)], [0.0, 0.75, 1.0]);
/// ```
#[inline]
#[must_use]
pub fn ease(t: f64) -> f64 {
    let c = if t > 0.0 { t.min(1.0) } else { 0.0 };
    c * (2.0 - c)
}

/// Smooths one edge: returns [`ease`] of the distance from it, relative to a width; 1 (no
/// smoothing) if the width is not positive.
///
/// `distance` is signed, positive inside, in the unit of `width`.
#[inline]
#[must_use]
pub fn edge(distance: f64, width: f64) -> f64 {
    if width > 0.0 {
        ease(distance / width)
    } else {
        1.0
    }
}

/// Returns the smoothing factor for the borders of the light in one direction.
///
/// **Formula.** m̂(u) = m((u − u_lo)/d_m) m((u_hi − u)/d_m): Salesin & Jarosz 2019, eq. 23.
/// **Units.** All arguments are in one unit of length along the line (not a parameter in [0, 1],
/// unless d_m is given in it, too). The paper recommends half the smallest dimension of the light
/// for d_m. **Domain.** 0 outside the light; 1 everywhere for d_m ≤ 0.
///
/// ```
/// use linelit_mis::smoothing::border;
/// assert_eq!([0.0, 0.5, 2.0].map(|u| border(u, 0.0, 4.0, 1.0)), [0.0, 0.75, 1.0]);
/// ```
#[inline]
#[must_use]
pub fn border(u: f64, lo: f64, hi: f64, d_m: f64) -> f64 {
    edge(u - lo, d_m) * edge(hi - u, d_m)
}

/// Returns the width of the smoothing at an occluder's edge behind which a gap of the length `gap`
/// is blocked.
///
/// **Formula.** d_m·m(gap/d_m): the published eq. 24 lacks the factor d_m, without which it is not
/// a length (the authors' code has it). The width shrinks to 0 as the line slides off the occluder
/// at a vertex, so that the factor does not jump there. It is 0 for a d_m that is not positive and
/// finite.
///
/// ```
/// use linelit_mis::smoothing::occluder_width;
/// assert_eq!([0.0, 1.0, f64::INFINITY].map(|gap| occluder_width(gap, 2.0)), [0.0, 1.5, 2.0]);
/// ```
#[inline]
#[must_use]
pub fn occluder_width(gap: f64, d_m: f64) -> f64 {
    if d_m > 0.0 && d_m.is_finite() {
        d_m * ease(gap / d_m)
    } else {
        0.0
    }
}

/// Returns the smoothing factor for the ends of the visible interval \[lo, hi\] that contains the
/// point.
///
/// **Formula.** m((u − lo)/w_lo) m((hi − u)/w_hi) with w = [`occluder_width`] of the blocked gap
/// beyond each end: Salesin & Jarosz 2019, eq. 24. **Units**: the units of
/// [`border`].
///
/// An end that is the light's own border has the gap 0: its factor is 1 here, and [`border`]
/// smooths it. For smoothing of a fixed width (their Fig. 4, middle) pass infinite gaps at
/// occluders.
///
/// ```
/// use linelit_mis::smoothing::visible_interval;
/// // The left end is the light's border, behind the right one 3 units are blocked: d_m = 1 is used
/// // whole.
/// assert_eq!(visible_interval(3.5, 0.0, 4.0, 0.0, 3.0, 1.0), 0.75);
/// ```
#[inline]
#[must_use]
pub fn visible_interval(u: f64, lo: f64, hi: f64, gap_lo: f64, gap_hi: f64, d_m: f64) -> f64 {
    edge(u - lo, occluder_width(gap_lo, d_m)) * edge(hi - u, occluder_width(gap_hi, d_m))
}

/// Returns the weight of the balance heuristic with smoothed densities.
///
/// **Formula.** wᵢ = Nᵢp'ᵢ/Σⱼ Nⱼp'ⱼ, p'ⱼ = `factors[j]`·pⱼ (Salesin & Jarosz 2019, eq. 22). The
/// factor of a technique that needs no smoothing (a line) is 1; the factor of a point technique is
/// the product of [`border`] and [`visible_interval`] factors in all line directions.
///
/// The estimator still *divides* by the true density pᵢ, and has no 1/S in front (the 1/S of their
/// eq. 20 is an erratum): Σₛ (1/Nₛ) Σₖ wₛ f/pₛ. It is unbiased wherever some p'ⱼ > 0, so never
/// smooth the only technique that covers a point.
///
/// **Domain and error bound** are those of [`balance`](crate::balance).
///
/// # Panics
/// If `i` is not an index of all slices.
///
/// ```
/// use linelit_mis::smoothing::smoothed_balance;
/// assert_eq!(smoothed_balance(&[1.0, 1.0], &[2.0, 4.0], &[1.0, 0.5], 0), 0.5);
/// assert_eq!(smoothed_balance(&[1.0, 1.0], &[2.0, 4.0], &[1.0, 0.0], 0), 1.0);
/// ```
#[inline]
#[must_use]
pub fn smoothed_balance(ns: &[f64], ps: &[f64], factors: &[f64], i: usize) -> f64 {
    let count = ns.len().min(ps.len()).min(factors.len());
    assert!(i < count, "technique {i} of {count}");
    share(count, |j| score(ns[j], score(factors[j], ps[j])), |t| t, i)
}

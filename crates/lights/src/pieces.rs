//! This module holds the two parts that many techniques are built from: a discrete choice among
//! pieces of a light, and samples of a density that is linear over a piece.

use linelit_geometry::ConvexPolygon;
use linelit_geometry::finite::{below_one, fraction};
use linelit_simd::Lanes;

/// The largest number of pieces, which is the largest number of trapezoids between the vertices of
/// a polygon: one less than its capacity for vertices.
const MOST: usize = ConvexPolygon::CAPACITY - 1;

/// A discrete choice among at most 23 pieces of a light in proportion to their weights, stored
/// without allocation. The pieces are triangles of a fan, or trapezoids between vertices. The
/// random number that chooses a piece is rescaled, and then serves to choose a position in it.
///
/// ```
/// use linelit_lights::Pieces;
/// let pieces = Pieces::new([1.0, 3.0].into_iter());
/// let (piece, place) = pieces.pick(0.625);
/// assert_eq!((piece, place), (1, 0.5));
/// assert_eq!(pieces.unpick(piece, place), 0.625);
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Pieces {
    /// Weight of each piece, ≥ 0.
    weight: [f64; MOST],
    count: usize,
    total: f64,
}

impl Pieces {
    /// Makes the choice from the weights of the pieces. Weights that are negative or not numbers
    /// become 0, and pieces beyond 23 are dropped.
    #[must_use]
    pub fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut out = Self::default();
        weights.for_each(|w| out.push(w));
        out
    }

    /// Adds a piece unless there are 23 already. Its weight is 0 if it is negative or not a number.
    #[inline(always)]
    pub(crate) fn push(&mut self, weight: f64) {
        if let Some(slot) = self.weight.get_mut(self.count) {
            *slot = if weight > 0.0 { weight } else { 0.0 };
            self.total += *slot;
            self.count += 1;
        }
    }

    /// Whether a piece can be picked: the sum of the weights is positive and finite.
    #[inline]
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.total > 0.0 && self.total <= f64::MAX
    }

    /// Returns the sum of the weights.
    #[inline]
    #[must_use]
    pub const fn total(&self) -> f64 {
        self.total
    }

    #[inline]
    pub(crate) fn weight(&self, i: usize) -> f64 {
        self.weight[i]
    }

    /// Returns the piece that `u` in [0, 1) falls into, and the position in it, in [0, 1].
    #[inline]
    #[must_use]
    pub fn pick(&self, u: f64) -> (usize, f64) {
        let mut rest = fraction(u) * self.total;
        let mut last = 0;
        for (i, &w) in self.weight[..self.count].iter().enumerate() {
            if w > 0.0 {
                if rest < w {
                    return (i, rest / w);
                }
                last = i;
            }
            rest -= w;
        }
        (last, 1.0)
    }

    /// Picks pieces for one random number or eight at once, without branches; the results are bit
    /// for bit the results of [`Pieces::pick`].
    #[inline(always)]
    pub(crate) fn pick_each<L: Lanes>(&self, l: L, u: L::D) -> (L::D, L::D) {
        let (zero, one) = (l.dsplat(0.0), l.dsplat(1.0));
        let mut rest = fraction_each(l, u) * self.total;
        // The position is rest / weight at the first piece whose weight exceeds the rest. All lanes
        // visit all pieces; a lane that has found its piece keeps it.
        let (mut piece, mut found) = (zero, l.dlt(one, zero));
        let (mut part, mut whole) = (one, one);
        let mut last = zero;
        let mut number = 0.0;
        for &w in &self.weight[..self.count] {
            if w > 0.0 {
                let weight = l.dsplat(w);
                let here = !found & l.dlt(rest, weight);
                last = l.dsplat(number);
                piece = l.select(here, piece, last);
                part = l.select(here, part, rest);
                whole = l.select(here, whole, weight);
                found = found | here;
            }
            rest = rest - w;
            number += 1.0;
        }
        (l.select(found, last, piece), part / whole)
    }

    /// Inverts [`Pieces::pick`]; the result is clamped to [0, 1).
    #[inline]
    #[must_use]
    pub fn unpick(&self, piece: usize, place: f64) -> f64 {
        let before: f64 = self.weight.iter().take(piece).sum();
        let weight = self.weight.get(piece).copied().unwrap_or(0.0);
        below_one((before + place * weight) / self.total)
    }
}

/// Clamps one number or eight to [0, 1], like [`linelit_geometry::finite::fraction`].
#[inline(always)]
pub(crate) fn fraction_each<L: Lanes>(l: L, value: L::D) -> L::D {
    l.dmin(l.dmax(value, l.dsplat(0.0)), l.dsplat(1.0))
}

/// Inverts the CDF of the density on [0, 1] that runs linearly from `p0` to `p1` (at any scale,
/// both ≥ 0): returns the position below which the fraction `xi` of the mass lies.
///
/// ```
/// use linelit_lights::sample_linear;
/// assert_eq!(sample_linear(0.25, 0.0, 7.0), 0.5);
/// ```
#[inline]
#[must_use]
pub fn sample_linear(xi: f64, p0: f64, p1: f64) -> f64 {
    let root = (p0 * p0 * (1.0 - xi) + p1 * p1 * xi).sqrt();
    let denominator = p0 + root;
    if denominator > 0.0 {
        (xi * (p0 + p1) / denominator).min(1.0)
    } else {
        xi
    }
}

//! What techniques are made of: a choice among pieces, and a density linear over one.

use linelit_geometry::ConvexPolygon;
use linelit_geometry::finite::{below_one, fraction};
use linelit_simd::Lanes;

/// The most pieces: trapezoids between the vertices of a polygon.
const MOST: usize = ConvexPolygon::CAPACITY - 1;

/// A choice among at most 23 pieces of a light, in proportion to their weights: triangles of a fan,
/// or trapezoids between vertices; held in place. The random number that chooses a piece is
/// stretched, and goes on to choose a place in it.
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
    /// Pieces of these weights: 0 where one is negative or no number; those beyond 23 are dropped.
    #[must_use]
    pub fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut out = Self::default();
        weights.for_each(|w| out.push(w));
        out
    }

    /// Adds a piece, of the weight 0 where it is negative or no number, while there is room.
    #[inline(always)]
    pub(crate) fn push(&mut self, weight: f64) {
        if let Some(slot) = self.weight.get_mut(self.count) {
            *slot = if weight > 0.0 { weight } else { 0.0 };
            self.total += *slot;
            self.count += 1;
        }
    }

    /// Whether there is anything to pick.
    #[inline]
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.total > 0.0 && self.total <= f64::MAX
    }

    /// The sum of the weights.
    #[inline]
    #[must_use]
    pub const fn total(&self) -> f64 {
        self.total
    }

    #[inline]
    pub(crate) fn weight(&self, i: usize) -> f64 {
        self.weight[i]
    }

    /// The piece that `u` in [0, 1) falls into and the place in it in [0, 1].
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

    /// [`Pieces::pick`] for one number or eight, to the bit; without branches.
    #[inline(always)]
    pub(crate) fn pick_each<L: Lanes>(&self, l: L, u: L::D) -> (L::D, L::D) {
        let (zero, one) = (l.dsplat(0.0), l.dsplat(1.0));
        let mut rest = fraction_each(l, u) * self.total;
        // The place is rest over weight where the rest is below the weight for the first time.
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

    /// The inverse of [`Pieces::pick`], clamped to [0, 1).
    #[inline]
    #[must_use]
    pub fn unpick(&self, piece: usize, place: f64) -> f64 {
        let before: f64 = self.weight.iter().take(piece).sum();
        let weight = self.weight.get(piece).copied().unwrap_or(0.0);
        below_one((before + place * weight) / self.total)
    }
}

/// [`linelit_geometry::finite::fraction`] of one number or eight.
#[inline(always)]
pub(crate) fn fraction_each<L: Lanes>(l: L, value: L::D) -> L::D {
    l.dmin(l.dmax(value, l.dsplat(0.0)), l.dsplat(1.0))
}

/// Inverts the CDF of the density on [0, 1] that runs linearly from `p0` to `p1` (any scale, both ≥
/// 0): the place with the fraction `xi` of the mass below it.
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

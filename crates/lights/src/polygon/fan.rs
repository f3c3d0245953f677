//! The fan of a convex polygon: which triangle, and where on its outer edge.
//!
//! All triangles share the first vertex. The random number that picks a triangle is stretched and
//! goes on to pick the point on that triangle's outer edge, so the map from random numbers to the
//! polygon is continuous over the whole fan.

use linelit_geometry::{ConvexPolygon, DVec3, predicates};

/// The most triangles that a fan can have.
const MAX_TRIANGLES: usize = ConvexPolygon::CAPACITY - 2;

/// The largest f64 below one.
pub(crate) use linelit_geometry::finite::BELOW_ONE as ONE_MINUS;

/// A random number or a parameter of [0, 1]: what is not in it counts as the nearer end, NaN as 0.
#[inline(always)]
pub(crate) fn unit(x: f64) -> f64 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < 1.0 { x } else { 1.0 }
}

/// The smaller of two numbers, of which the second is one.
#[inline(always)]
pub(crate) fn at_most(x: f64, most: f64) -> f64 {
    if x < most { x } else { most }
}

/// [`unit`] below one: for random numbers that an inversion gives back.
#[inline(always)]
pub(crate) fn below_one(x: f64) -> f64 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < ONE_MINUS { x } else { ONE_MINUS }
}

/// A piecewise constant distribution over at most 23 pieces: triangles of a fan, or trapezoids
/// between vertices, in place.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pieces {
    /// Weight of each piece, ≥ 0.
    weight: [f64; MAX_TRIANGLES + 1],
    count: usize,
    total: f64,
}

impl Pieces {
    pub(crate) fn new(weights: impl Iterator<Item = f64>) -> Self {
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
    pub(crate) fn is_usable(&self) -> bool {
        self.total > 0.0 && self.total < f64::INFINITY
    }

    pub(crate) const fn total(&self) -> f64 {
        self.total
    }

    pub(crate) fn weight(&self, i: usize) -> f64 {
        self.weight[i]
    }

    /// The piece that `u` in [0, 1) falls into and the place in it in [0, 1].
    pub(crate) fn pick(&self, u: f64) -> (usize, f64) {
        let mut rest = unit(u) * self.total;
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

    /// The inverse of [`Pieces::pick`], clamped to [0, 1).
    pub(crate) fn unpick(&self, piece: usize, place: f64) -> f64 {
        let before: f64 = self.weight[..piece].iter().sum();
        below_one((before + place * self.weight[piece]) / self.total)
    }
}

/// A point of a fan triangle (a, b, c): `q = b + lambda (c − b)` on the outer edge, then `a + kappa
/// (q − a)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FanPoint {
    pub(crate) triangle: usize,
    pub(crate) lambda: f64,
    pub(crate) kappa: f64,
}

/// The three vertices of a triangle of the fan.
pub(crate) fn triangle(vertices: &[DVec3], i: usize) -> [DVec3; 3] {
    [vertices[0], vertices[i + 1], vertices[i + 2]]
}

/// Where a point of the polygon stands in the fan; `None` where it lies outside by more than the
/// rounding of its coordinates (64 ε of the largest coordinate, which moves λ and κ by as much
/// relative to the polygon's size).
pub(crate) fn locate(polygon: &ConvexPolygon, point: DVec3) -> Option<FanPoint> {
    let v = polygon.vertices();
    let p = point - v[0];
    let side = |i: usize| predicates::cross(v[i] - v[0], p).dot(polygon.normal());
    let slack = {
        let extent = polygon.diameter();
        let largest = point.abs().max_element().max(v[0].abs().max_element());
        64.0 * f64::EPSILON * (largest + extent) * extent
    };
    let last = v.len() - 2;
    let mut i = 0;
    // The triangle between the fan's rays i + 1 and i + 2.
    while i + 1 < last && side(i + 2) > 0.0 {
        i += 1;
    }
    let [a, b, c] = triangle(v, i);
    let twice_area = predicates::cross(b - a, c - a).dot(polygon.normal());
    let (wb, wc) = (-side(i + 2), side(i + 1));
    let inside = wb >= -slack && wc >= -slack && wb + wc <= twice_area + slack;
    if !(inside && slack < f64::INFINITY) {
        return None;
    }
    let (wb, wc) = (wb.max(0.0), wc.max(0.0));
    let sum = wb + wc;
    if twice_area <= 0.0 {
        return None;
    }
    Some(FanPoint {
        triangle: i,
        lambda: if sum > 0.0 { wc / sum } else { 0.0 },
        kappa: (sum / twice_area).min(1.0),
    })
}

/// The point of a fan triangle.
pub(crate) fn place([a, b, c]: [DVec3; 3], lambda: f64, kappa: f64) -> DVec3 {
    let q = b + (c - b) * lambda;
    a + (q - a) * kappa
}

//! View factors between two facets, with all other facets as blockers: how the sides of both are
//! paired, and how the visible part of an exchange is integrated.

use crate::cubature::{Corners, Integral, Integrand, integrate};
use crate::facets::{Facets, Sides};
use crate::hull::{Hull, hides_all};
use crate::partners::Side;
use crate::point::Memory;
use crate::rows::coarse;
use crate::sight::{Candidates, PairOutcome, Sight, before_each_other, sees};
use crate::unobstructed;
use crate::view::unseen_below;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_shading::polygon;
use std::f64::consts::FRAC_1_PI;

/// A value with an error estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// The estimate of its absolute error.
    pub error: f64,
}

impl Estimate {
    pub(crate) fn add(&mut self, other: Self) {
        self.value += other.value;
        self.error += other.error;
    }

    /// Divides an exchange by the area of the facet that sends, which gives a view factor.
    pub(crate) fn over(self, area: f64) -> Self {
        // A facet that is wholly covered sends nothing.
        if area <= 0.0 {
            return Self::default();
        }
        Self {
            value: self.value / area,
            error: self.error / area,
        }
    }
}

/// The largest number of quadrangles into which the adaptive rule divides a polygon; the tolerance
/// may be missed then.
pub(crate) const MOST: usize = 20_000;
/// The largest number of quadrangles of the adaptive rule where there is no blocker; if more would
/// be needed, the contour integral is faster.
const FEW: usize = 8;

impl Facets {
    /// Returns the view factor from one facet to another: the fraction of the radiation that leaves
    /// the first, uniformly and diffusely, and reaches the second. The error is at most the
    /// tolerance wherever 20,000 quadrangles of the adaptive rule are enough.
    ///
    /// The view factor in the opposite direction is this one times the area of `from` over the area
    /// of `to`.
    ///
    /// # Panics
    /// If there is no facet of this number.
    pub fn between(&self, from: usize, to: usize, tolerance: f64, memory: &mut Memory) -> Estimate {
        let area = self.sending_area(from);
        let (exchange, _) = self.exchange(from, to, tolerance * area, memory);
        exchange.over(area)
    }

    /// The total area of all sides of a facet that send.
    pub(crate) fn sending_area(&self, facet: usize) -> f64 {
        let sides = match self.sides {
            Sides::One => 1.0,
            Sides::Two => 2.0,
        };
        self.facets[facet].area * sides
    }

    /// Returns the exchange of two facets: the area of one times its view factor to the other,
    /// which is bit-identical in both directions. The tolerance has the unit of an area. Also
    /// returns the costliest of the steps that determined it.
    pub fn exchange(
        &self,
        a: usize,
        b: usize,
        tolerance: f64,
        memory: &mut Memory,
    ) -> (Estimate, PairOutcome) {
        let (mut sum, mut settled) = (Estimate::default(), PairOutcome::Facing);
        if a == b {
            return (sum, settled);
        }
        // Pair the sides of both facets, each clipped to the part before the other's plane.
        let (first, second) = (a.min(b), a.max(b));
        let mut pairs = Vec::new();
        for p in self.sides_of(first) {
            for q in self.sides_of(second) {
                let own = [&p, &q].map(|side: &Side| self.parts[side.part].patch);
                let flatness = self.flatness(own);
                let polygons = before_each_other(&p.polygon, &q.polygon, flatness);
                pairs.extend(polygons.map(|polygons| (polygons, own)));
            }
        }
        // Integrate what the sides of each pair see of each other, with an equal part of the
        // tolerance for each pair.
        let share = tolerance / pairs.len() as f64;
        for (polygons, own) in pairs {
            let sight = self.sight(polygons, own, &Candidates::All, memory);
            settled = settled.max(sight.settled());
            let Sight::Visible(pair) = sight else {
                continue;
            };
            let polygons = &pair.polygons;
            sum.add(match pair.blockers.is_empty() {
                true => open_exchange(polygons, share / coarse(polygons)),
                false => past(polygons, &pair.blockers, share, memory),
            });
        }
        (sum, settled)
    }
}

/// Returns the exchange of two polygons that blockers partly hide from each other.
///
/// The integral over points of one polygon is computed of two functions at once: the view factor to
/// the part of the other polygon that is visible, and to the part that is hidden. The function with
/// the smaller error is refined; if it is the hidden part, the exchange is the unobstructed
/// exchange minus its integral.
pub(crate) fn past(
    polygons: &[ConvexPolygon; 2],
    blockers: &[ConvexPolygon],
    tolerance: f64,
    memory: &mut Memory,
) -> Estimate {
    let [small, large] = by_area(polygons);
    // Integrate over the smaller polygon, unless none of its points sees the other, as through a
    // slit.
    let [p, q] = match sees(small, large, blockers, memory) {
        true => [small, large],
        false => [large, small],
    };
    let mut past = Past {
        p,
        q,
        blockers,
        widths: blockers.iter().map(|b| shadow_width(b, [p, q])).collect(),
        memory,
    };
    let all = Known::Between((0..blockers.len()).collect());
    // If the hidden part is integrated, the rest of the tolerance is left for the unobstructed
    // exchange.
    let most = 0.95 * tolerance;
    let (visible, found) = integrate(p, most, MOST, are_apart(p, q), &mut past, &all);
    if visible == 1 && found.error <= found.value {
        return Estimate {
            value: found.value,
            error: found.error,
        };
    }
    let open = open_exchange(polygons, 0.05 * tolerance / coarse(polygons));
    let (value, error) = match visible {
        1 => (found.value, found.error),
        _ => (open.value - found.value, open.error + found.error),
    };
    Estimate {
        value: value.clamp(0.0, open.value + open.error),
        error: error.min(open.value + open.error),
    }
}

/// Returns the two polygons, first the smaller one, over whose points the exchange is integrated.
pub(crate) fn by_area([p, q]: &[ConvexPolygon; 2]) -> [&ConvexPolygon; 2] {
    if p.area() <= q.area() { [p, q] } else { [q, p] }
}

/// The integrand of an exchange with blockers: the view factors from points of one polygon to the
/// hidden part and to the visible part of the other.
struct Past<'a> {
    p: &'a ConvexPolygon,
    q: &'a ConvexPolygon,
    blockers: &'a [ConvexPolygon],
    /// For each blocker, the least width of the shadow that it casts, as [`shadow_width`] computes
    /// it.
    widths: Vec<f64>,
    memory: &'a mut Memory,
}

/// Which blockers are between a part of one polygon and the other polygon.
enum Known {
    /// A single blocker hides everything.
    Hidden,
    /// The indices of the blockers between them.
    Between(Vec<usize>),
}

impl Integrand for Past<'_> {
    type Known = Known;

    fn narrow(&mut self, corners: &Corners, around: &Known) -> Known {
        let around = match around {
            Known::Hidden => return Known::Hidden,
            Known::Between(numbers) => numbers,
        };
        let hull = Hull::new(corners, self.q.vertices(), 0.0);
        let mut room = [Vec::new(), Vec::new()];
        let mut meets = |k: &usize| hull.meets(&self.blockers[*k], false, &mut room);
        let between: Vec<usize> = around.iter().copied().filter(&mut meets).collect();
        let q = self.q.vertices();
        let hides = |k: &usize| hides_all(&self.blockers[*k], corners, q, 0.0);
        match between.iter().any(hides) {
            true => Known::Hidden,
            false => Known::Between(between),
        }
    }

    fn at(&mut self, x: DVec3, known: &Known) -> [f64; 2] {
        let n = self.p.normal();
        let view = &mut self.memory.view;
        let [open, visible] = match known {
            Known::Hidden => [view.factors(x, n, self.q, std::iter::empty())[0], 0.0],
            Known::Between(numbers) => {
                let polygons = numbers.iter().map(|&k| &self.blockers[k]);
                view.factors(x, n, self.q, polygons)
            }
        };
        // Parts that are smaller than rounding count as zero.
        let least = unseen_below(open);
        let part = |x: f64| if x > least { x } else { 0.0 };
        [part(open - visible), part(visible)]
    }

    fn unseen(&self, corners: &Corners, known: &Known) -> f64 {
        match known {
            Known::Hidden => 0.0,
            Known::Between(all) => {
                let each = all
                    .iter()
                    .map(|&k| unseen(&self.blockers[k], self.widths[k], corners));
                each.sum()
            }
        }
    }
}

/// The integrand of an exchange without blockers: the view factor from points of one polygon to the
/// other, returned for both functions.
struct Open<'a> {
    n: DVec3,
    q: &'a ConvexPolygon,
}

impl Integrand for Open<'_> {
    type Known = ();

    fn narrow(&mut self, _: &Corners, (): &()) {}

    fn at(&mut self, x: DVec3, (): &()) -> [f64; 2] {
        let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        let irradiance = polygon::irradiance(self.q.relative_to(x, &mut relative), self.n);
        [FRAC_1_PI * irradiance; 2]
    }

    fn unseen(&self, _: &Corners, (): &()) -> f64 {
        0.0
    }
}

/// Returns the least width of the shadows that a blocker casts on the first of two polygons, as
/// seen from points of the second.
fn shadow_width(blocker: &ConvexPolygon, [p, q]: [&ConvexPolygon; 2]) -> f64 {
    let heights = |of: &ConvexPolygon| {
        let (n, origin) = (of.normal(), of.vertices()[0]);
        let heights = blocker.vertices().iter().map(move |v| n.dot(*v - origin));
        heights.fold([f64::INFINITY, 0.0], |[low, high], h| {
            [h.min(low), h.max(high)]
        })
    };
    // Between parallel planes, a shadow is as wide as the blocker plus the projection of the other
    // polygon through a point of the blocker; both are smallest where the blocker is nearest.
    let (near, far) = (heights(p)[0].max(0.0), heights(q)[1].max(f64::MIN_POSITIVE));
    width(blocker) + (width(q) * near / far).min(width(p))
}

/// Returns a bound of what a blocker hides from a quadrangle, if the quadrangle is so large that
/// the points of the rule may all miss the shadow; zero otherwise.
fn unseen(blocker: &ConvexPolygon, width: f64, corners: &Corners) -> f64 {
    let [a, b, c, d] = *corners;
    let middle = 0.25 * (a + b + c + d);
    let radius = corners
        .iter()
        .fold(0.0_f64, |r, v| r.max(v.distance(middle)));
    // Points of the rule are at most the radius apart.
    if radius <= width {
        return 0.0;
    }
    let distance = distance(blocker, middle) - radius;
    let factor = match distance > 0.0 {
        true => (FRAC_1_PI * blocker.area() / (distance * distance)).min(1.0),
        false => 1.0,
    };
    // By reciprocity, a blocker hides no more than its own area: what it sends to a plane by both
    // of its sides.
    (0.5 * (c - a).cross(d - b).length() * factor).min(blocker.area())
}

/// Returns the least width of a polygon: the least, over all edges, of the distance from the edge's
/// line to the corner farthest from it.
fn width(polygon: &ConvexPolygon) -> f64 {
    let v = polygon.vertices();
    let next = v.iter().cycle().skip(1);
    let widths = v.iter().zip(next).map(|(&a, &b)| {
        let along = (b - a).normalize_or_zero();
        let height = |c: &DVec3| (*c - a).cross(along).length();
        v.iter().map(height).fold(0.0, f64::max)
    });
    widths.fold(f64::INFINITY, f64::min)
}

/// The distance of a point from a polygon.
fn distance(polygon: &ConvexPolygon, x: DVec3) -> f64 {
    let (n, v) = (polygon.normal(), polygon.vertices());
    let edges = || v.iter().zip(v.iter().cycle().skip(1));
    if edges().all(|(a, b)| n.dot((*b - *a).cross(x - *a)) >= 0.0) {
        return n.dot(x - v[0]).abs();
    }
    let from_edge = |(a, b): (&DVec3, &DVec3)| {
        let along = *b - *a;
        let t = (x - *a).dot(along) / along.length_squared();
        x.distance(*a + along * t.clamp(0.0, 1.0))
    };
    edges().map(from_edge).fold(f64::INFINITY, f64::min)
}

/// Whether one polygon is so far from another, for its size, that the view factor from its points
/// is a smooth function.
fn are_apart(p: &ConvexPolygon, q: &ConvexPolygon) -> bool {
    let middle = p.centroid();
    let radius = p
        .vertices()
        .iter()
        .fold(0.0_f64, |r, v| r.max(v.distance(middle)));
    distance(q, middle) > 1.5 * radius
}

/// Returns the exchange of two polygons without blockers, up to a relative tolerance.
pub(crate) fn open_exchange(polygons: &[ConvexPolygon; 2], tolerance: f64) -> Estimate {
    let [p, q] = by_area(polygons);
    // For polygons far from each other, a few points are enough; otherwise use the contour
    // integral.
    if are_apart(p, q) {
        let goal = 0.5 * tolerance * coarse(polygons);
        let mut open = Open { n: p.normal(), q };
        let (_, Integral { value, error }) = integrate(p, goal, FEW, true, &mut open, &());
        if error <= tolerance * value {
            return Estimate { value, error };
        }
    }
    let (value, error) = unobstructed::exchange(p, q);
    Estimate { value, error }
}

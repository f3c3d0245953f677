//! View factors between two facets.

use crate::cubature::{Integral, integrate};
use crate::facets::{Facets, Piece, Sides};
use crate::point::Memory;
use crate::unobstructed;
use linelit_estimators::Measure;
use linelit_geometry::{ConvexPolygon, DVec3, Margins};
use linelit_shading::polygon;
use linelit_visibility::{Between, ShaftQuery};
use std::f64::consts::FRAC_1_PI;

/// A value, and a bound of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// The told error, absolute.
    pub error: f64,
}

/// The step that settled what two facets exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Settled {
    /// Neither has a part before the other that faces it.
    #[default]
    Facing,
    /// A facet between them hides each from the other.
    Hidden,
    /// Nothing is between them.
    Clear,
    /// A part is hidden, which an adaptive rule integrated.
    Partly,
}

/// The most triangles of the adaptive rule.
const MOST: usize = 20_000;
/// The distance by which points are lifted off their facet, relative to the largest coordinate.
const LIFT: f64 = 1.0 / (1_u64 << 44) as f64;

/// An occluder between two polygons, as the adaptive rule knows it.
struct Blocker {
    polygon: ConvexPolygon,
    /// Its least extent.
    width: f64,
}

impl Facets {
    /// The view factor from one facet to another: the share of what leaves the first, evenly and
    /// diffusely, that reaches the second, with an error that is at most the tolerance wherever
    /// 20,000 triangles of the adaptive rule are enough.
    ///
    /// The other way round it is this times the quotient of the areas.
    ///
    /// # Panics
    /// If there is no facet of this number.
    pub fn between(&self, from: usize, to: usize, tolerance: f64, memory: &mut Memory) -> Estimate {
        let area = self.facets[from].area * self.side_count();
        let (exchange, _) = self.exchange(from, to, tolerance * area, memory);
        Estimate {
            value: exchange.value / area,
            error: exchange.error / area,
        }
    }

    /// The number of sides that send.
    pub(crate) const fn side_count(&self) -> f64 {
        match self.sides {
            Sides::One => 1.0,
            Sides::Two => 2.0,
        }
    }

    /// What two facets exchange, the area of one times its view factor to the other: to the bit the
    /// same both ways. The tolerance has the unit of an area.
    pub fn exchange(
        &self,
        a: usize,
        b: usize,
        tolerance: f64,
        memory: &mut Memory,
    ) -> (Estimate, Settled) {
        // The smaller one is integrated over; of equal ones that with the lower number.
        let key = |k: usize| (self.facets[k].area, k);
        let (first, second) = if key(a) <= key(b) { (a, b) } else { (b, a) };
        let (mut sum, mut settled) = (Estimate::default(), Settled::Facing);
        let pairs = self.pairs_of_parts(first, second);
        for (polygons, pieces) in &pairs {
            let share = tolerance / pairs.len() as f64;
            let (part, by) = self.parts(polygons, *pieces, share, memory);
            sum.value += part.value;
            sum.error += part.error;
            settled = settled.max(by);
        }
        (sum, settled)
    }

    /// The step that settles a pair, without the integral.
    pub(crate) fn settled(&self, a: usize, b: usize) -> Settled {
        let pairs = self.pairs_of_parts(a, b).into_iter();
        let each = pairs.map(|(polygons, pieces)| self.blockers(&polygons, pieces).0);
        each.max().unwrap_or_default()
    }

    /// The parts of two facets' pieces that lie before each other.
    fn pairs_of_parts(&self, a: usize, b: usize) -> Vec<([ConvexPolygon; 2], [&Piece; 2])> {
        let pieces = |k: usize| &self.pieces[self.facets[k].pieces.clone()];
        let sides: &[bool] = match self.sides {
            Sides::One => &[false],
            Sides::Two => &[false, true],
        };
        let mut pairs = Vec::new();
        if a == b {
            return pairs;
        }
        for from in pieces(a) {
            for to in pieces(b) {
                for &back in sides {
                    for &other_back in sides {
                        let parts = before_each_other(from, back, to, other_back);
                        pairs.extend(parts.map(|parts| (parts, [from, to])));
                    }
                }
            }
        }
        pairs
    }

    /// How much stands between two parts of pieces, and the numbers of the pieces that do.
    fn blockers(&self, [p, q]: &[ConvexPolygon; 2], own: [&Piece; 2]) -> (Settled, Vec<u32>) {
        let space = Between::polygons(p.vertices(), q.vertices());
        let mut between = self.occluders.within(&space);
        between.retain(|t| !own.iter().any(|piece| piece.triangles.contains(t)));
        let mut pieces: Vec<u32> = between.iter().map(|&t| self.piece_of[t as usize]).collect();
        pieces.dedup();
        let hides = |&k: &u32| hides_all(&self.pieces[k as usize].polygon, p, q);
        let settled = match pieces.as_slice() {
            [] => Settled::Clear,
            some if some.iter().any(hides) => Settled::Hidden,
            _ => Settled::Partly,
        };
        (settled, pieces)
    }

    /// What two parts of pieces exchange, of which each lies before the other.
    fn parts(
        &self,
        polygons: &[ConvexPolygon; 2],
        own: [&Piece; 2],
        tolerance: f64,
        memory: &mut Memory,
    ) -> (Estimate, Settled) {
        let [p, q] = polygons;
        let (settled, pieces) = self.blockers(polygons, own);
        let open = match settled {
            Settled::Facing | Settled::Hidden => return (Estimate::default(), settled),
            Settled::Clear | Settled::Partly => open_exchange(p, q, 0.1 * tolerance),
        };
        if settled == Settled::Clear {
            return (open, settled);
        }
        // Half of what is small, give or take half, is near enough.
        if open.value + open.error <= tolerance {
            let half = 0.5 * open.value;
            let estimate = Estimate {
                value: half,
                error: half + open.error,
            };
            return (estimate, Settled::Partly);
        }
        let polygons = pieces.iter().map(|&k| &self.pieces[k as usize].polygon);
        let blockers: Vec<Blocker> = polygons.map(Blocker::new).collect();
        let hidden = self.hidden([p, q], own[1], &blockers, 0.9 * tolerance, memory);
        let estimate = Estimate {
            value: (open.value - hidden.value).max(0.0),
            error: (open.error + hidden.error).min(open.value + open.error),
        };
        (estimate, Settled::Partly)
    }

    /// The part of what two polygons exchange that is hidden.
    fn hidden(
        &self,
        [p, q]: [&ConvexPolygon; 2],
        to: &Piece,
        blockers: &[Blocker],
        tolerance: f64,
        memory: &mut Memory,
    ) -> Integral {
        let n = p.normal();
        let largest = p
            .vertices()
            .iter()
            .fold(0.0_f64, |m, v| m.max(v.abs().max_element()));
        let lift = n * (LIFT * largest);
        let Memory { region, scratch } = memory;
        let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        let hidden = |x: DVec3| {
            let x = x + lift;
            let query = ShaftQuery {
                margins: Margins::NONE,
                ..ShaftQuery::new(x, q).excluding(to.triangles.clone())
            };
            region.find(&self.occluders, query, scratch);
            let visible = region.measure(Measure::Cosine(n));
            let open = polygon::irradiance(q.relative_to(x, &mut relative), n);
            // What is visible or hidden by less than rounding is nothing.
            let part = |x: f64| if x > 1e-12 * open { FRAC_1_PI * x } else { 0.0 };
            [part(open - visible), part(visible)]
        };
        let unseen = |corners: &[DVec3; 3]| blockers.iter().map(|b| b.unseen(corners)).sum::<f64>();
        integrate(p, tolerance, MOST, hidden, unseen)
    }
}

impl Blocker {
    fn new(polygon: &ConvexPolygon) -> Self {
        let v = polygon.vertices();
        let next = v.iter().cycle().skip(1);
        // The least distance between an edge and the farthest corner from it.
        let width = v.iter().zip(next).map(|(&a, &b)| {
            let along = (b - a).normalize_or_zero();
            let height = |c: &DVec3| (*c - a).cross(along).length();
            v.iter().map(height).fold(0.0, f64::max)
        });
        Self {
            polygon: *polygon,
            width: width.fold(f64::INFINITY, f64::min),
        }
    }

    /// A bound of what it hides from a triangle, where that is so coarse that no point may see it.
    fn unseen(&self, [a, b, c]: &[DVec3; 3]) -> f64 {
        let middle = (*a + *b + *c) / 3.0;
        let radius = [a, b, c]
            .map(|v| v.distance(middle))
            .into_iter()
            .fold(0.0, f64::max);
        // Points of the rule are no farther apart than the radius; an image is no smaller than the
        // occluder.
        if radius <= self.width {
            return 0.0;
        }
        let distance = distance(&self.polygon, middle) - radius;
        let factor = match distance > 0.0 {
            true => (FRAC_1_PI * self.polygon.area() / (distance * distance)).min(1.0),
            false => 1.0,
        };
        0.5 * (*b - *a).cross(*c - *a).length() * factor
    }
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

/// The parts of two pieces, as seen from one side of each, that lie before the plane of the other.
fn before_each_other(
    from: &Piece,
    back: bool,
    to: &Piece,
    other_back: bool,
) -> Option<[ConvexPolygon; 2]> {
    let turned = |piece: &Piece, back: bool| match back {
        true => piece.polygon.flipped(),
        false => piece.polygon,
    };
    let (p, q) = (turned(from, back), turned(to, other_back));
    let part = |a: &ConvexPolygon, b: &ConvexPolygon| a.clip(b.vertices()[0], b.normal());
    Some([part(&p, &q)?, part(&q, &p)?])
}

/// What two polygons exchange with nothing in between.
fn open_exchange(p: &ConvexPolygon, q: &ConvexPolygon, tolerance: f64) -> Estimate {
    let n = p.normal();
    let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
    let factor = |x: DVec3| {
        let irradiance = polygon::irradiance(q.relative_to(x, &mut relative), n);
        [FRAC_1_PI * irradiance, 1.0]
    };
    // A few points do where the polygons are far from each other.
    let by_points = integrate(p, tolerance, FEW, factor, |_| 0.0);
    let (value, error) = match by_points.error <= tolerance {
        true => (by_points.value, by_points.error),
        false => unobstructed::exchange(p, q),
    };
    Estimate { value, error }
}

/// The most triangles of the rule where nothing is in between.
const FEW: usize = 12;

/// Whether all segments between two polygons pass a third.
fn hides_all(blocker: &ConvexPolygon, p: &ConvexPolygon, q: &ConvexPolygon) -> bool {
    let (n, v) = (blocker.normal(), blocker.vertices());
    let height = |x: &DVec3| n.dot(*x - v[0]);
    let next = || v.iter().cycle().skip(1);
    let passes = |a: &DVec3, b: &DVec3| {
        let (from, to) = (height(a), height(b));
        let x = *a + (*b - *a) * (from / (from - to));
        let inside = |(c, d): (&DVec3, &DVec3)| n.dot((*d - *c).cross(x - *c)) >= 0.0;
        from * to < 0.0 && v.iter().zip(next()).all(inside)
    };
    let side = p.vertices().first().map_or(0.0, &height).signum();
    // All of one polygon on one side, all of the other on the other.
    let apart = p.vertices().iter().all(|x| height(x) * side > 0.0);
    apart
        && p.vertices()
            .iter()
            .all(|a| q.vertices().iter().all(|b| passes(a, b)))
}

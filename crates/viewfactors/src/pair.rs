//! View factors between two facets.

use crate::cubature::{Corners, Integral, integrate};
use crate::facets::{Facets, Sides};
use crate::partners::{Settled, Side, before_each_other};
use crate::point::Memory;
use crate::rows::coarse;
use crate::unobstructed;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_shading::polygon;
use std::f64::consts::FRAC_1_PI;

/// A value, and a bound of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// The told error, absolute.
    pub error: f64,
}

impl Estimate {
    pub(crate) fn add(&mut self, other: Self) {
        self.value += other.value;
        self.error += other.error;
    }

    pub(crate) fn over(self, area: f64) -> Self {
        Self {
            value: self.value / area,
            error: self.error / area,
        }
    }
}

/// The most quadrangles of the adaptive rule.
const MOST: usize = 20_000;
/// The most quadrangles of the rule where nothing is in between: the contour integral takes longer
/// than a few.
const FEW: usize = 8;
/// The most patches that are taken from a polygon one by one; more are left to the hierarchy.
const ONE_BY_ONE: usize = 200;

/// A patch between two polygons, as the adaptive rule knows it.
struct Blocker {
    polygon: ConvexPolygon,
    /// The least width of its shadows.
    width: f64,
}

impl Facets {
    /// The view factor from one facet to another: the share of what leaves the first, evenly and
    /// diffusely, that reaches the second, with an error that is at most the tolerance wherever
    /// 20,000 quadrangles of the adaptive rule are enough.
    ///
    /// The other way round it is this times the quotient of the areas.
    ///
    /// # Panics
    /// If there is no facet of this number.
    pub fn between(&self, from: usize, to: usize, tolerance: f64, memory: &mut Memory) -> Estimate {
        let area = self.sending_area(from);
        let (exchange, _) = self.exchange(from, to, tolerance * area, memory);
        exchange.over(area)
    }

    /// The area of all sides of a facet that send.
    pub(crate) fn sending_area(&self, facet: usize) -> f64 {
        let sides = match self.sides {
            Sides::One => 1.0,
            Sides::Two => 2.0,
        };
        self.facets[facet].area * sides
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
        let (mut sum, mut settled) = (Estimate::default(), Settled::Facing);
        if a == b {
            return (sum, settled);
        }
        let (first, second) = (a.min(b), a.max(b));
        let mut pairs = Vec::new();
        for p in self.sides_of(first) {
            for q in self.sides_of(second) {
                let polygons = before_each_other(&p.polygon, &q.polygon, self.room);
                pairs.extend(polygons.map(|polygons| (polygons, p, q)));
            }
        }
        for (polygons, p, q) in &pairs {
            let own = [p, q].map(|side: &Side| self.parts[side.part].patch);
            let (by, between) = self.between_polygons(polygons, own, None);
            settled = settled.max(by);
            let share = tolerance / pairs.len() as f64;
            let share = match by {
                Settled::Clear => share / coarse(polygons),
                _ => share,
            };
            sum.add(self.parts(polygons, [first, second], (by, &between), share, memory));
        }
        (sum, settled)
    }

    /// What two parts of facets exchange, of which each lies before the other. The tolerance is
    /// relative where nothing is in between.
    pub(crate) fn parts(
        &self,
        [p, q]: &[ConvexPolygon; 2],
        facets: [usize; 2],
        (settled, between): (Settled, &[usize]),
        tolerance: f64,
        memory: &mut Memory,
    ) -> Estimate {
        // The smaller one is integrated over.
        let ([p, q], to) = if p.area() <= q.area() {
            ([p, q], facets[1])
        } else {
            ([q, p], facets[0])
        };
        match settled {
            Settled::Facing | Settled::Hidden => Estimate::default(),
            Settled::Clear => open_exchange(p, q, tolerance),
            Settled::Partly => {
                let blockers = self.blockers([p, q], between);
                self.partly([p, q], to, &blockers, tolerance, memory)
            }
        }
    }

    /// The parts of patches that lie before two polygons.
    fn blockers(&self, [p, q]: [&ConvexPolygon; 2], between: &[usize]) -> Vec<Blocker> {
        let cut = |&k: &usize| {
            let polygon = before_all(&self.patches[k].polygon, &[p, q], self.room)?;
            Some(Blocker::new(polygon, [p, q]))
        };
        let mut blockers: Vec<Blocker> = between.iter().filter_map(cut).collect();
        // What hides most comes first.
        blockers.sort_by(|a, b| b.polygon.area().total_cmp(&a.polygon.area()));
        blockers
    }

    /// What two polygons exchange past others.
    fn partly(
        &self,
        [p, q]: [&ConvexPolygon; 2],
        to: usize,
        blockers: &[Blocker],
        tolerance: f64,
        memory: &mut Memory,
    ) -> Estimate {
        let open = open_exchange(p, q, 0.05 * tolerance / coarse(&[*p, *q]));
        let n = p.normal();
        let polygons: Vec<ConvexPolygon> = blockers.iter().map(|b| b.polygon).collect();
        let hidden_and_visible = |x: DVec3| {
            let [open, visible] = if polygons.len() <= ONE_BY_ONE {
                memory.view.factors(x, n, q, &polygons)
            } else {
                let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
                let open = polygon::irradiance(q.relative_to(x, &mut relative), n);
                let pieces = &self.pieces[self.facets[to].pieces.clone()];
                let each = pieces.iter().map(|piece| self.piece(x, n, piece, memory));
                [FRAC_1_PI * open, each.sum()]
            };
            // What is visible or hidden by less than rounding is nothing.
            let part = |x: f64| if x > 1e-12 * open { x } else { 0.0 };
            [part(open - visible), part(visible)]
        };
        let unseen = |corners: &Corners| blockers.iter().map(|b| b.unseen(corners)).sum::<f64>();
        let rest = (tolerance - open.error).max(0.5 * tolerance);
        let (visible, found) = integrate(p, rest, MOST, false, hidden_and_visible, unseen);
        let (value, error) = match visible {
            1 => (found.value, found.error),
            _ => (open.value - found.value, open.error + found.error),
        };
        Estimate {
            value: value.clamp(0.0, open.value + open.error),
            error: error.min(open.value + open.error),
        }
    }
}

/// The part of a patch that lies before some polygons.
pub(crate) fn before_all(
    patch: &ConvexPolygon,
    polygons: &[&ConvexPolygon],
    room: f64,
) -> Option<ConvexPolygon> {
    let mut part = *patch;
    for other in polygons {
        let (n, origin) = (other.normal(), other.vertices()[0]);
        let heights = || part.vertices().iter().map(|v| n.dot(*v - origin));
        if heights().all(|h| h <= room) {
            return None;
        }
        if heights().any(|h| h < 0.0) {
            part = part.clip(origin, n)?;
        }
    }
    Some(part)
}

impl Blocker {
    /// A blocker between a polygon that is integrated over and one that is seen.
    fn new(polygon: ConvexPolygon, [p, q]: [&ConvexPolygon; 2]) -> Self {
        let heights = |of: &ConvexPolygon, v: &[DVec3]| {
            let (n, origin) = (of.normal(), of.vertices()[0]);
            let heights = v.iter().map(|v| n.dot(*v - origin));
            heights.fold([f64::INFINITY, 0.0], |[low, high], h| {
                [h.min(low), h.max(high)]
            })
        };
        // Between parallel planes a shadow is as wide as the blocker and the image of what is seen
        // through a point of it, which are smallest where it is nearest.
        let near = heights(p, polygon.vertices())[0].max(0.0);
        let far = heights(q, polygon.vertices())[1].max(f64::MIN_POSITIVE);
        let image = (width(q) * near / far).min(width(p));
        Self {
            width: width(&polygon) + image,
            polygon,
        }
    }

    /// A bound of what it hides from a quadrangle, where that is so coarse that no point may see it.
    fn unseen(&self, corners: &Corners) -> f64 {
        let [a, b, c, d] = *corners;
        let middle = 0.25 * (a + b + c + d);
        let radius = corners
            .iter()
            .fold(0.0_f64, |r, v| r.max(v.distance(middle)));
        // Points of the rule are no farther apart than the radius.
        if radius <= self.width {
            return 0.0;
        }
        let distance = distance(&self.polygon, middle) - radius;
        let factor = match distance > 0.0 {
            true => (FRAC_1_PI * self.polygon.area() / (distance * distance)).min(1.0),
            false => 1.0,
        };
        0.5 * (c - a).cross(d - b).length() * factor
    }
}

/// The least width of a polygon: the least distance between an edge and the corner farthest from it.
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

/// What two polygons exchange with nothing in between, to a relative tolerance.
fn open_exchange(p: &ConvexPolygon, q: &ConvexPolygon, tolerance: f64) -> Estimate {
    let n = p.normal();
    let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
    let factor = |x: DVec3| {
        let irradiance = polygon::irradiance(q.relative_to(x, &mut relative), n);
        [FRAC_1_PI * irradiance; 2]
    };
    // A few points do where the polygons are far from each other.
    let middle = p.centroid();
    let radius = p
        .vertices()
        .iter()
        .fold(0.0_f64, |r, v| r.max(v.distance(middle)));
    if distance(q, middle) > 1.5 * radius {
        let goal = 0.5 * tolerance * coarse(&[*p, *q]);
        let (_, Integral { value, error }) = integrate(p, goal, FEW, true, factor, |_| 0.0);
        if error <= tolerance * value {
            return Estimate { value, error };
        }
    }
    let (value, error) = unobstructed::exchange(p, q);
    Estimate { value, error }
}

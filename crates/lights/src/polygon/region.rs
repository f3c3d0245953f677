//! This module samples a region of a plane uniformly that is given by its boundary: the visible
//! region of a light.
#![allow(clippy::disallowed_types, reason = "kept from one region to the next")]

use crate::density::{Area, Pdf};
use crate::image::{pick, unpick};
use crate::{PointSample, PointTechnique, sample_linear};
use linelit_geometry::DVec3;
use linelit_geometry::finite::{below_one, fraction};

/// A technique that samples points of a region of a plane, uniformly by area: of a light's visible
/// region, say.
///
/// The region is given by straight pieces of its boundary, in any order, with the region on their
/// left; it may have holes and several parts. It is cut into slabs at the ends of the pieces. A
/// point has the coordinates (p, q) in the plane: p is drawn by the length of the region at p,
/// which is linear over a slab, and q uniformly over this length. The density is 1/A in 1/m², and
/// the error of A is ε times the area of the region's bounding box for each piece over a slab. One
/// value can be used for any number of regions, and reuses its memory.
///
/// ```text
///  q │     ╱╲
///    │   ╱│  │╲ │     a slab lies between neighbouring ends of pieces; over it the
///    │ ╱  │  │  ╲     pieces do not begin, end or cross
///    │ ╲──┼──┼──┤
///    └────┴──┴──┴─ p
/// ```
///
/// ```
/// use linelit_lights::geometry::DVec3;
/// use linelit_lights::{PointTechnique, RegionSampler};
///
/// // Two triangles that share a corner.
/// let [a, b, c, d, e] = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [1.0, 1.0], [0.0, 1.0]];
/// let boundary = [[a, b], [b, c], [c, a], [c, d], [d, e], [e, c]];
/// let mut region = RegionSampler::default();
/// region.set([DVec3::ZERO, DVec3::X, DVec3::Y], boundary);
/// assert_eq!(region.area(), 0.5);
/// let sample = region.sample([0.5, 0.75]);
/// assert!(sample.point.distance(DVec3::new(0.5, 0.75, 0.0)) < 1e-15);
/// assert_eq!(sample.pdf.value(), 2.0);
/// assert!(!region.pdf(DVec3::new(0.1, 0.5, 0.0)).is_positive());
/// ```
#[derive(Clone, Debug, Default)]
pub struct RegionSampler {
    /// The point (0, 0) of the plane, and the vectors along p and q.
    plane: [DVec3; 3],
    sides: Vec<Side>,
    slabs: Vec<Slab>,
    /// The indices of the sides over each slab, slab by slab and in each slab ordered by q. The
    /// entries of a slab are at its range `over`.
    over: Vec<usize>,
    /// For each slab, the area of the region at smaller p, and at the end the whole area, in
    /// coordinates (p, q).
    sums: Vec<f64>,
    /// The area in square metres.
    area: f64,
    /// Scratch memory: the values of p at the ends of the sides, and the sides over the current
    /// slab.
    ends: Vec<f64>,
    active: Vec<(f64, usize)>,
}

/// A piece of the boundary, from the end with the smaller p.
#[derive(Clone, Copy, Debug)]
struct Side {
    from: [f64; 2],
    to: f64,
    slope: f64,
    /// Whether the region begins at this side as q grows; otherwise it ends here.
    begins: bool,
}

impl Side {
    /// Makes a side; `None` if p is constant along it, so that it bounds no length.
    fn new([a, b]: [[f64; 2]; 2]) -> Option<Self> {
        let begins = a[0] < b[0];
        let [from, to] = if begins { [a, b] } else { [b, a] };
        (from[0] < to[0]).then(|| Self {
            from,
            to: to[0],
            slope: (to[1] - from[1]) / (to[0] - from[0]),
            begins,
        })
    }

    /// Returns q on the side at p.
    #[inline]
    fn at(&self, p: f64) -> f64 {
        self.from[1] + self.slope * (p - self.from[0])
    }
}

/// A slab between neighbouring ends of sides.
#[derive(Clone, Copy, Debug)]
struct Slab {
    range: [f64; 2],
    /// The length of the region at both ends of the slab.
    lengths: [f64; 2],
    /// The range in `over` of the sides over the slab.
    over: [usize; 2],
}

impl RegionSampler {
    /// Replaces the region. `plane` holds the point (0, 0) of its plane and the vectors along p and
    /// q; `boundary` holds the pieces in these coordinates, with the region on the left of each
    /// piece.
    ///
    /// Where pieces do not meet exactly, for example by rounding, the error of the region is at
    /// most the gap.
    pub fn set(&mut self, plane: [DVec3; 3], boundary: impl IntoIterator<Item = [[f64; 2]; 2]>) {
        self.plane = plane;
        self.sides.clear();
        self.sides
            .extend(boundary.into_iter().filter_map(Side::new));
        let first = |side: &Side| side.from[0];
        (self.sides).sort_unstable_by(|a, b| first(a).total_cmp(&first(b)));
        self.ends.clear();
        let ends = self.sides.iter().flat_map(|side| [side.from[0], side.to]);
        self.ends.extend(ends);
        self.ends.sort_unstable_by(f64::total_cmp);
        self.ends.dedup();
        self.cut();
        let [_, along_p, along_q] = plane;
        let area = self.sums.last().copied().unwrap_or(0.0) * along_p.cross(along_q).length();
        self.area = if area.is_finite() { area } else { 0.0 };
    }

    /// Cuts the region into slabs between the ends of its sides.
    fn cut(&mut self) {
        self.slabs.clear();
        self.over.clear();
        self.sums.clear();
        self.sums.push(0.0);
        self.active.clear();
        let (mut next, mut sum) = (0, 0.0);
        for pair in self.ends.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let sides = &self.sides;
            // Drop the sides that end here, and add the sides that begin here.
            self.active.retain(|(_, side)| sides[*side].to > from);
            while sides.get(next).is_some_and(|side| side.from[0] <= from) {
                self.active.push((0.0, next));
                next += 1;
            }
            // Order the sides by where they cross the middle of the slab.
            let middle = 0.5 * (from + to);
            for (q, side) in &mut self.active {
                *q = sides[*side].at(middle);
            }
            self.active.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let first = self.over.len();
            self.over.extend(self.active.iter().map(|(_, side)| side));
            // Measure the slab as a trapezoid.
            let mut slab = Slab {
                range: [from, to],
                lengths: [0.0; 2],
                over: [first, self.over.len()],
            };
            slab.lengths = slab.range.map(|p| self.parts(&slab, p).map(length).sum());
            sum += 0.5 * (to - from) * (slab.lengths[0] + slab.lengths[1]);
            self.slabs.push(slab);
            self.sums.push(sum);
        }
    }

    /// Returns the region's area in square metres; zero for an empty region.
    #[must_use]
    pub const fn area(&self) -> f64 {
        self.area
    }

    /// Whether a point of the plane is in the region.
    #[must_use]
    pub fn holds(&self, point: DVec3) -> bool {
        let within = |(k, [p, q]): (usize, [f64; 2])| {
            let mut parts = self.parts(&self.slabs[k], p);
            parts.any(|[low, high]| (low..=high).contains(&q))
        };
        self.locate(point).is_some_and(within)
    }

    /// Returns the density, which is the same everywhere in the region; zero for an empty region.
    #[must_use]
    pub fn density(&self) -> Pdf<Area> {
        match self.area > 0.0 {
            true => Pdf::new(1.0 / self.area),
            false => Pdf::ZERO,
        }
    }

    /// Returns the intervals of q that the region covers on the line of constant `p` within a slab,
    /// in ascending order.
    #[inline]
    fn parts(&self, slab: &Slab, p: f64) -> impl Iterator<Item = [f64; 2]> {
        let (mut depth, mut begin) = (0, 0.0);
        let over = self.over[slab.over[0]..slab.over[1]].iter();
        over.filter_map(move |side| {
            let side = &self.sides[*side];
            let q = side.at(p);
            if side.begins {
                depth += 1;
                if depth == 1 {
                    begin = q;
                }
                return None;
            }
            depth -= 1;
            (depth == 0).then(|| [begin, q.max(begin)])
        })
    }

    /// Returns the slab of a point and its coordinates (p, q); `None` outside all slabs.
    fn locate(&self, point: DVec3) -> Option<(usize, [f64; 2])> {
        let [origin, along_p, along_q] = self.plane;
        let d = point - origin;
        let normal = along_p.cross(along_q);
        let square = normal.length_squared();
        let p = d.cross(along_q).dot(normal) / square;
        let q = along_p.cross(d).dot(normal) / square;
        let beyond = self.slabs.partition_point(|slab| slab.range[1] <= p);
        let slab = self.slabs.get(beyond)?;
        (p >= slab.range[0]).then_some((beyond, [p, q]))
    }
}

fn length([low, high]: [f64; 2]) -> f64 {
    high - low
}

impl PointTechnique for RegionSampler {
    type Measure = Area;

    fn sample(&self, [u, v]: [f64; 2]) -> PointSample<Area> {
        let [origin, along_p, along_q] = self.plane;
        if !(self.area > 0.0) {
            return PointSample::none(origin);
        }
        let (k, place) = pick(&self.sums, u);
        let slab = &self.slabs[k];
        let ([from, to], [low, high]) = (slab.range, slab.lengths);
        let p = from + (to - from) * sample_linear(place, low, high);
        let mut rest = fraction(v) * self.parts(slab, p).map(length).sum::<f64>();
        let mut q = None;
        for [low, high] in self.parts(slab, p) {
            q = Some((low + rest).min(high));
            rest -= high - low;
            if rest < 0.0 {
                break;
            }
        }
        match q {
            Some(q) => PointSample::at(origin + along_p * p + along_q * q, self.density()),
            None => PointSample::none(origin),
        }
    }

    fn pdf(&self, point: DVec3) -> Pdf<Area> {
        match self.holds(point) {
            true => self.density(),
            false => Pdf::ZERO,
        }
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        if !self.pdf(point).is_positive() {
            return None;
        }
        let (k, [p, q]) = self.locate(point)?;
        let slab = &self.slabs[k];
        let ([from, to], [low, high]) = (slab.range, slab.lengths);
        let t = (p - from) / (to - from);
        let place = t * (2.0 * low + (high - low) * t) / (low + high);
        let (mut below, mut all) = (0.0, 0.0);
        for part in self.parts(slab, p) {
            all += length(part);
            below += (q.min(part[1]) - part[0]).max(0.0);
        }
        Some([unpick(&self.sums, k, place), below_one(below / all)])
    }
}

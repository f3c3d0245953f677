//! This module samples convex polygons uniformly by area, the classic point technique.

use crate::PointTechnique;
use crate::density::{Area, Pdf};
use crate::pieces::{Pieces, fraction_each};
use crate::polygon::fan::{self, Vector};
use crate::samples::{PointColumns, PointSample};
use linelit_geometry::finite::below_one;
use linelit_geometry::{ConvexPolygon, DVec3, Segment};
use linelit_simd::{Isa, Lanes, One, Simd, dispatch};

/// Samples a convex polygon uniformly by area: density 1/A everywhere (Shirley & Wang 1991, §2).
///
/// A parallelogram is sampled by its two edge vectors. Every other polygon is a fan of triangles,
/// one of which is chosen in proportion to its area; a triangle (a, b, c) is sampled by `q = b +
/// λ(c − b)` with λ = u₀, and then `a + √u₁ (q − a)`.
///
/// **Accuracy**: points lie in the polygon to the rounding of their coordinates.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{AreaSampler, PointTechnique};
/// let light = ConvexPolygon::triangle(DVec3::ZERO, DVec3::X, 2.0 * DVec3::Y).unwrap();
/// let sampler = AreaSampler::new(&light);
/// let sample = sampler.sample([0.25, 0.5]);
/// assert_eq!(sample.pdf.value(), 1.0);
/// let u = sampler.invert(sample.point).unwrap();
/// assert!((u[0] - 0.25).abs() < 1e-15 && (u[1] - 0.5).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AreaSampler<'a> {
    polygon: &'a ConvexPolygon,
    cut: Cut,
    density: Pdf<Area>,
}

/// The way in which a polygon is divided for sampling.
#[derive(Clone, Copy, Debug)]
enum Cut {
    /// A corner and the two edges from it.
    Parallelogram(DVec3, DVec3, DVec3),
    /// The areas of the triangles of the polygon's fan, by which one of the triangles is chosen.
    Fan(Pieces),
}

impl<'a> AreaSampler<'a> {
    /// Sets the technique up for one light.
    #[inline]
    #[must_use]
    pub fn new(polygon: &'a ConvexPolygon) -> Self {
        Self {
            polygon,
            cut: match polygon.as_parallelogram() {
                Some((o, a, b)) => Cut::Parallelogram(o, a, b),
                None => Cut::Fan(weigh(polygon)),
            },
            density: Pdf::new(1.0 / polygon.area()),
        }
    }

    /// Sets the technique up with a fan of triangles even if the polygon is a parallelogram. All
    /// points with the same first random number then lie on one line from the first corner.
    #[must_use]
    pub fn by_fan(polygon: &'a ConvexPolygon) -> Self {
        Self {
            cut: Cut::Fan(weigh(polygon)),
            ..Self::new(polygon)
        }
    }

    /// Returns the line on which the points with the first random number `u` lie, for all second
    /// random numbers.
    ///
    /// With a [fan](Self::by_fan) the lines run from the first corner to the border, with equal
    /// numbers of them over equal areas (Billen & Dutré 2016, §8): a line of length R at the angle
    /// φ has the density R²/(2A) in φ. With dA = r dr dφ, ∫ f dA is the mean over lines of (2A/R²)
    /// ∫ f r dr. A single line therefore represents a thin triangle that is 2A/R wide at the
    /// border.
    ///
    /// ```
    /// use linelit_lights::geometry::{ConvexPolygon, DVec3};
    /// use linelit_lights::AreaSampler;
    /// let square = ConvexPolygon::parallelogram(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap();
    /// let line = AreaSampler::by_fan(&square).line(0.75);
    /// assert_eq!((line.p0, line.p1), (DVec3::ZERO, DVec3::new(0.5, 1.0, 0.0)));
    /// ```
    #[must_use]
    pub fn line(&self, u: f64) -> Segment {
        let at = |v: f64| self.sample([u, v]).point;
        Segment::new(at(0.0), at(1.0))
    }

    /// Returns the points of one pair of random numbers in each lane.
    #[inline(always)]
    fn place<L: Lanes>(&self, l: L, u: [L::D; 2]) -> Vector<L> {
        let pieces = match &self.cut {
            Cut::Parallelogram(o, a, b) => {
                let [x, y] = [fraction_each(l, u[0]), fraction_each(l, u[1])];
                let (o, a, b) = (o.to_array(), a.to_array(), b.to_array());
                return [
                    (x * a[0] + o[0]) + y * b[0],
                    (x * a[1] + o[1]) + y * b[1],
                    (x * a[2] + o[2]) + y * b[2],
                ];
            }
            Cut::Fan(pieces) => pieces,
        };
        // Choose a triangle of the fan in each lane, and collect its corners.
        let (piece, lambda) = pieces.pick_each(l, u[0]);
        let v = self.polygon.vertices();
        let [a, b, c] = fan::triangle(v, 0);
        let (a, mut b, mut c) = (fan::splat(l, a), fan::splat(l, b), fan::splat(l, c));
        let mut number = 0.0;
        for (next, after) in v[1..].iter().zip(&v[2..]).skip(1) {
            number += 1.0;
            let further = l.dle(l.dsplat(number), piece);
            b = fan::select(l, further, b, fan::splat(l, *next));
            c = fan::select(l, further, c, fan::splat(l, *after));
        }
        fan::place::<L>([a, b, c], lambda, l.dsqrt(fraction_each(l, u[1])))
    }
}

/// Returns the areas of the triangles of a polygon's fan, as pieces.
fn weigh(polygon: &ConvexPolygon) -> Pieces {
    let (v, n) = (polygon.vertices(), polygon.normal());
    Pieces::new((0..v.len() - 2).map(|i| {
        let [a, b, c] = fan::triangle(v, i);
        0.5 * linelit_geometry::predicates::cross(b - a, c - a).dot(n)
    }))
}

#[inline(always)]
fn sample_kernel<S: Simd>(
    s: S,
    sampler: &AreaSampler<'_>,
    u: [&[[f64; 8]]; 2],
    out: &mut PointColumns<'_>,
) {
    for row in 0..out.rows(u) {
        let u = [s.dload(&u[0][row]), s.dload(&u[1][row])];
        out.put(s, row, sampler.place(s, u));
        s.dstore(s.dsplat(sampler.density.value()), &mut out.pdf[row]);
    }
}
dispatch! {
    fn sample_into = sample_kernel(
        sampler: &AreaSampler<'_>,
        u: [&[[f64; 8]]; 2],
        out: &mut PointColumns<'_>,
    )
}

impl PointTechnique for AreaSampler<'_> {
    type Measure = Area;

    fn sample(&self, u: [f64; 2]) -> PointSample<Area> {
        PointSample {
            point: self.place(One, u).into(),
            pdf: self.density,
        }
    }

    fn sample_into(&self, u: [&[[f64; 8]]; 2], mut out: PointColumns<'_>) {
        sample_into(Isa::best(), self, u, &mut out);
    }

    fn pdf(&self, _point: DVec3) -> Pdf<Area> {
        self.density
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        let place = fan::locate(self.polygon, point)?;
        let u = match &self.cut {
            Cut::Parallelogram(o, a, b) => {
                let p = point - *o;
                let n = self.polygon.normal();
                let cross = linelit_geometry::predicates::cross;
                let det = cross(*a, *b).dot(n);
                [cross(p, *b).dot(n) / det, cross(*a, p).dot(n) / det]
            }
            Cut::Fan(pieces) => [
                pieces.unpick(place.triangle, place.lambda),
                place.kappa * place.kappa,
            ],
        };
        Some(u.map(below_one))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use linelit_simd::InstructionSet;
    use linelit_testkit::rng::SplitMix64;

    /// Regular polygons of three to twelve corners and parallelograms, seen from anywhere: also
    /// from their planes, from afar, and with coordinates whose squares overflow.
    pub(crate) fn fans() -> Vec<(ConvexPolygon, DVec3)> {
        let mut rng = SplitMix64::new(71);
        let mut out = Vec::new();
        for round in 0..60_u32 {
            let corners = 3 + round % 10;
            let scale = [1.0, 1.0, 1e-3, 1e3, 1e-55, 1e55][(round / 10) as usize];
            let mut v = || scale * DVec3::from([0, 1, 2].map(|_| rng.in_range(-1.0, 1.0)));
            let [o, a, b, x] = [v(), v(), v(), v()];
            let at = |i: u32| {
                let (s, c) = (f64::from(i) * std::f64::consts::TAU / f64::from(corners)).sin_cos();
                o + a * c + b * s
            };
            let vertices: Vec<DVec3> = (0..corners).map(at).collect();
            let polygon = match round % 4 {
                0 => ConvexPolygon::parallelogram(o, a, b),
                _ => ConvexPolygon::new(&vertices),
            };
            let polygon = polygon.expect("a polygon");
            out.extend([x, o, o + 0.3 * a, x * 1e6].map(|x| (polygon, x)));
        }
        out
    }

    /// Columns on every instruction set are the samples one by one.
    pub(crate) fn columns_are_samples(
        technique: &impl PointTechnique,
        fill: impl Fn(Isa, [&[[f64; 8]]; 2], &mut PointColumns<'_>),
    ) {
        let mut rng = SplitMix64::new(3);
        let mut number = |k: usize| match k {
            0 => [
                0.0,
                f64::NAN,
                1.0,
                -1.0,
                0.5,
                1.0 - f64::EPSILON / 2.0,
                2.0,
                1e-300,
            ],
            _ => std::array::from_fn(|_| rng.next_f64()),
        };
        let u = [[0, 1, 2].map(&mut number), [1, 0, 3].map(&mut number)];
        let bits = |x: &[f64; 8]| x.map(f64::to_bits);
        for set in InstructionSet::ALL.into_iter().filter(|s| s.is_available()) {
            let [mut x, mut y, mut z, mut pdf] = [[[0.0; 8]; 3]; 4];
            let mut out = PointColumns {
                point: [&mut x, &mut y, &mut z],
                pdf: &mut pdf,
            };
            fill(Isa::detect(set), [&u[0], &u[1]], &mut out);
            for row in 0..3 {
                let samples: [_; 8] =
                    std::array::from_fn(|i| technique.sample([u[0][row][i], u[1][row][i]]));
                let want = [
                    samples.map(|s| s.point.x),
                    samples.map(|s| s.point.y),
                    samples.map(|s| s.point.z),
                    samples.map(|s| s.pdf.value()),
                ];
                let got = [x[row], y[row], z[row], pdf[row]];
                assert_eq!(got.each_ref().map(bits), want.each_ref().map(bits), "{set}");
            }
        }
    }

    #[test]
    fn lanes_give_the_bits_of_samples() {
        for (polygon, _) in fans() {
            let sampler = AreaSampler::new(&polygon);
            columns_are_samples(&sampler, |isa, u, out| sample_into(isa, &sampler, u, out));
        }
    }
}

//! This module samples any convex polygon uniformly by solid angle.

use crate::PointTechnique;
use crate::density::{Pdf, SolidAngle};
use crate::pieces::{Pieces, fraction_each};
use crate::polygon::fan;
use crate::polygon::quadrilateral::Quadrilateral;
use crate::polygon::spherical_triangle::{Corner, Side, SphericalTriangle};
use crate::samples::{PointColumns, PointSample};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_simd::{Isa, One, Simd, dispatch};
use std::f64::consts::TAU;

/// The number of triangles whose set-up is stored; further triangles are set up again for each
/// sample.
const KEPT: usize = 2;

/// Samples a convex polygon uniformly by the solid angle that it subtends at `x`, with the density
/// 1/Ω.
///
/// The polygon is a fan of spherical triangles, one of which is chosen in proportion to its solid
/// angle. A rectangle consists of two triangles; for a distant rectangle this is more accurate by
/// up to seven digits than the classic sum of the angles of the spherical rectangle.
///
/// **Domain**: any `x`. In the light's plane Ω = 0, and every density is 0. Both sides of the light
/// are sampled alike: [`crate::AreaLight::faces`] says whether the side towards `x` emits. There is
/// no threshold between techniques: one formula is used from Ω = 1e-12 (and far below) to 2π.
///
/// **Accuracy**: Ω to about 10 ε (1 + r/z), where r is the largest distance of a vertex and z the
/// distance of the plane. At grazing incidence the factor r/z is the conditioning of the problem in
/// the coordinates.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{PointTechnique, SolidAngleSampler};
/// // One face of a cube seen from the cube's centre: 4π/6.
/// let corner = DVec3::new(-1.0, -1.0, 1.0);
/// let face = ConvexPolygon::parallelogram(corner, 2.0 * DVec3::X, 2.0 * DVec3::Y).unwrap();
/// let sampler = SolidAngleSampler::new(&face, DVec3::ZERO);
/// assert!((sampler.solid_angle() - 4.0 * std::f64::consts::PI / 6.0).abs() < 1e-14);
/// let sample = sampler.sample([0.3, 0.7]);
/// let u = sampler.invert(sample.point).unwrap();
/// assert!((u[0] - 0.3).abs() < 1e-13 && (u[1] - 0.7).abs() < 1e-13);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SolidAngleSampler {
    polygon: ConvexPolygon,
    x: DVec3,
    kept: [SphericalTriangle; KEPT],
    pieces: Pieces,
    pdf: Pdf<SolidAngle>,
}

/// Sets up one triangle of a polygon's fan, seen from `x`.
#[cold]
fn from_point(polygon: &ConvexPolygon, x: DVec3, i: usize) -> SphericalTriangle {
    let [a, b, c] = fan::triangle(polygon.vertices(), i).map(|v| Corner::new(v, x));
    let mut out = SphericalTriangle::default();
    out.set([&a, &b, &c], &Side::between(&a, &b), &Side::between(&a, &c));
    out
}

impl SolidAngleSampler {
    /// Sets the technique up for one light and the shading point `x`.
    #[inline]
    #[must_use]
    pub fn new(polygon: &ConvexPolygon, x: DVec3) -> Self {
        let mut out = Self {
            polygon: *polygon,
            x,
            kept: [SphericalTriangle::default(); KEPT],
            pieces: Pieces::default(),
            pdf: Pdf::ZERO,
        };
        out.look();
        out
    }

    /// Sets up the triangles of the fan; neighbours share a side.
    fn look(&mut self) {
        if let [a, b, c, d] = *self.polygon.vertices()
            && let Some(seen) = Quadrilateral::new(Isa::best(), &[a, b, c, d], self.x)
        {
            self.look_at_two([a, b, c, d], &seen);
        } else {
            self.look_at_each();
        }
        self.pdf = Pdf::new(1.0 / self.solid_angle());
    }

    /// Sets up the two triangles of a quadrilateral.
    fn look_at_two(&mut self, [a, b, c, d]: [DVec3; 4], seen: &Quadrilateral) {
        let [at_a, at_b, at_c, _] = seen.corners;
        let [la, lb, lc, ld] = seen.lengths;
        let [ab, ac, ad, bc, cd] = &seen.sides;
        let [first, second] = &mut self.kept;
        let edges = [b - a, c - b];
        first.complete([at_a, at_b], edges, [la, lb, lc], [ab, bc, ac], seen.det[0]);
        let edges = [c - a, d - c];
        second.complete([at_a, at_c], edges, [la, lc, ld], [ac, cd, ad], seen.det[1]);
        self.pieces.push(first.solid_angle());
        self.pieces.push(second.solid_angle());
    }

    /// Sets up the triangles of the fan one by one.
    fn look_at_each(&mut self) {
        let [first, second, rest @ ..] = self.polygon.vertices() else {
            return;
        };
        let (a, mut b) = (Corner::new(*first, self.x), Corner::new(*second, self.x));
        let mut ab = Side::between(&a, &b);
        let mut beyond = SphericalTriangle::default();
        for (i, vertex) in rest.iter().enumerate() {
            let c = Corner::new(*vertex, self.x);
            let ac = Side::between(&a, &c);
            let triangle = self.kept.get_mut(i).unwrap_or(&mut beyond);
            triangle.set([&a, &b, &c], &ab, &ac);
            self.pieces.push(triangle.solid_angle());
            (b, ab) = (c, ac);
        }
    }

    /// Applies `ask` to a triangle of the fan.
    fn of_triangle<T>(&self, i: usize, ask: impl Fn(&SphericalTriangle) -> T) -> T {
        match self.kept.get(i) {
            Some(kept) => ask(kept),
            None => ask(&from_point(&self.polygon, self.x, i)),
        }
    }

    /// Computes [`PointTechnique::sample_into`] by a given instruction set.
    fn sample_by(&self, isa: Isa, u: [&[[f64; 8]]; 2], out: &mut PointColumns<'_>) {
        let rows = out.rows(u);
        out.pdf[..rows].fill([self.pdf.value(); 8]);
        let last = self.polygon.vertices().len() - 3;
        // Sample two triangles of the fan at a time.
        for first in (0..=last).step_by(2) {
            let numbers = [first, last.min(first + 1)];
            let pair = numbers.map(|i| self.of_triangle(i, |t| *t));
            sample_pair(isa, self, numbers, &pair, u, out);
        }
    }

    /// Returns the polygon that is sampled.
    #[must_use]
    pub const fn polygon(&self) -> &ConvexPolygon {
        &self.polygon
    }

    /// Returns the solid angle Ω in sr, between 0 and 2π.
    #[must_use]
    pub fn solid_angle(&self) -> f64 {
        // If the shading point is in the light's plane up to rounding, the triangles of the polygon
        // may face either way, and the sum of their solid angles may be larger.
        self.pieces.total().min(TAU)
    }
}

/// Computes the points that fall on two triangles of the fan, and replaces the points there that
/// were computed for earlier triangles.
#[inline(always)]
#[allow(clippy::cast_precision_loss, reason = "numbers of triangles")]
fn pair_kernel<S: Simd>(
    s: S,
    sampler: &SolidAngleSampler,
    numbers: [usize; 2],
    [first, second]: &[SphericalTriangle; 2],
    u: [&[[f64; 8]]; 2],
    out: &mut PointColumns<'_>,
) {
    let v = sampler.polygon.vertices();
    let [[a, b, c], [_, d, e]] = [fan::triangle(v, numbers[0]), fan::triangle(v, numbers[1])];
    let (a, b, c) = (fan::splat(s, a), fan::splat(s, b), fan::splat(s, c));
    let (d, e) = (fan::splat(s, d), fan::splat(s, e));
    let usable = sampler.pdf.is_positive();
    for row in 0..out.rows(u) {
        // Choose the triangle in each lane, and its point.
        let (piece, place) = sampler.pieces.pick_each(s, s.dload(&u[0][row]));
        let later = s.dle(s.dsplat(numbers[1] as f64), piece);
        let u = [place, fraction_each(s, s.dload(&u[1][row]))];
        let (lambda, kappa) = first.each(s, second, later).sample(s, u);
        let corners = [a, fan::select(s, later, b, d), fan::select(s, later, c, e)];
        let mut point = fan::place::<S>(corners, lambda, kappa);
        // Keep the points of earlier triangles in the lanes that do not belong to this pair.
        if !usable {
            point = a;
        } else if numbers[0] > 0 {
            let here = s.dle(s.dsplat(numbers[0] as f64), piece);
            point = fan::select(s, here, out.get(s, row), point);
        }
        out.put(s, row, point);
    }
}
dispatch! {
    fn sample_pair = pair_kernel(
        sampler: &SolidAngleSampler,
        numbers: [usize; 2],
        pair: &[SphericalTriangle; 2],
        u: [&[[f64; 8]]; 2],
        out: &mut PointColumns<'_>,
    )
}

impl PointTechnique for SolidAngleSampler {
    type Measure = SolidAngle;

    fn sample(&self, u: [f64; 2]) -> PointSample<SolidAngle> {
        let vertices = self.polygon.vertices();
        if !self.pdf.is_positive() {
            return PointSample::none(vertices[0]);
        }
        let (i, place) = self.pieces.pick(u[0]);
        let v = fraction(u[1]);
        let (lambda, kappa) =
            self.of_triangle(i, |t| t.each(One, t, false).sample(One, [place, v]));
        let corners = fan::triangle(vertices, i).map(|v| v.to_array());
        PointSample {
            point: fan::place::<One>(corners, lambda, kappa).into(),
            pdf: self.pdf,
        }
    }

    fn sample_into(&self, u: [&[[f64; 8]]; 2], mut out: PointColumns<'_>) {
        self.sample_by(Isa::best(), u, &mut out);
    }

    fn pdf(&self, _point: DVec3) -> Pdf<SolidAngle> {
        self.pdf
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        if !self.pdf.is_positive() {
            return None;
        }
        let at = fan::locate(&self.polygon, point)?;
        let [place, v] = self.of_triangle(at.triangle, |t| t.invert(at.lambda, at.kappa));
        Some([self.pieces.unpick(at.triangle, place), below_one(v)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polygon::area::tests::{columns_are_samples, fans};
    use linelit_simd::InstructionSet;

    #[test]
    fn quadrilaterals_are_seen_as_their_triangles_are() {
        let mut quick = 0;
        for (polygon, x) in fans() {
            let [a, b, c, d] = *polygon.vertices() else {
                continue;
            };
            for scale in [1.0, 1e-3, 1e70, 1e-70, 1e140] {
                let Ok(polygon) = ConvexPolygon::new(&[a, b, c, d].map(|v| v * scale)) else {
                    continue;
                };
                let at_once = SolidAngleSampler::new(&polygon, x * scale);
                let mut each = SolidAngleSampler {
                    kept: [SphericalTriangle::default(); KEPT],
                    pieces: Pieces::default(),
                    ..at_once
                };
                each.look_at_each();
                // All digits of all numbers, and the signs of zeros.
                assert_eq!(format!("{each:?}"), format!("{at_once:?}"), "{scale}");
                let [a, b, c, d] = *polygon.vertices() else {
                    continue;
                };
                let corners = [a, b, c, d];
                let seen = InstructionSet::ALL.map(|set| {
                    let seen = Quadrilateral::new(Isa::detect(set), &corners, x * scale);
                    quick += usize::from(seen.is_some());
                    format!("{seen:?}")
                });
                assert!(seen.iter().all(|s| *s == seen[0]), "{seen:?}");
            }
        }
        assert!(quick > 20, "{quick} in lanes");
    }

    #[test]
    fn lanes_give_the_bits_of_samples() {
        for (polygon, x) in fans() {
            let sampler = SolidAngleSampler::new(&polygon, x);
            columns_are_samples(&sampler, |isa, u, out| sampler.sample_by(isa, u, out));
        }
    }
}

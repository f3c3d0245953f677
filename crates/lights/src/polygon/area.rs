//! Uniform by area: the classic point technique.

use crate::PointTechnique;
use crate::density::{Area, Measure, Pdf};
use crate::pieces::Pieces;
use crate::polygon::fan;
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{ConvexPolygon, DVec3};

/// A point of a light and the density it was drawn with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSample<M: Measure> {
    /// The point, in the coordinates of the light.
    pub point: DVec3,
    /// Its density; zero means that nothing can be sampled, skip it.
    pub pdf: Pdf<M>,
}

impl<M: Measure> PointSample<M> {
    /// A point with its density, which is zero where the point has a coordinate that is not finite.
    #[inline(always)]
    #[must_use]
    pub fn at(point: DVec3, pdf: Pdf<M>) -> Self {
        let pdf = if point.is_finite() { pdf } else { Pdf::ZERO };
        Self { point, pdf }
    }

    /// The answer for degenerate input: the density 0.
    #[must_use]
    pub fn none(point: DVec3) -> Self {
        Self {
            point,
            pdf: Pdf::ZERO,
        }
    }
}

/// Samples a convex polygon uniformly by area: density 1/A everywhere (Shirley & Wang 1991, §2).
///
/// A parallelogram is sampled by its two edge vectors, every other polygon by a fan of triangles
/// whose area CDF picks one; a triangle by `b + λ(c − b)`, λ = u₀, then `a + √u₁ (q − a)`.
///
/// **Accuracy**: points lie in the polygon to the rounding of their coordinates.
///
/// ```
/// use linelit_geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{AreaSampler, PointTechnique};
/// let light = ConvexPolygon::triangle(DVec3::ZERO, DVec3::X, 2.0 * DVec3::Y).unwrap();
/// let sampler = AreaSampler::new(&light);
/// let sample = sampler.sample([0.25, 0.5]);
/// assert_eq!(sample.pdf.value(), 1.0);
/// let u = sampler.invert(sample.point).unwrap();
/// assert!((u[0] - 0.25).abs() < 1e-15 && (u[1] - 0.5).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AreaSampler {
    polygon: ConvexPolygon,
    pieces: Pieces,
    parallelogram: Option<(DVec3, DVec3, DVec3)>,
    density: Pdf<Area>,
}

impl AreaSampler {
    /// The per-light part.
    #[must_use]
    pub fn new(polygon: &ConvexPolygon) -> Self {
        let v = polygon.vertices();
        let areas = (0..v.len() - 2).map(|i| {
            let [a, b, c] = fan::triangle(v, i);
            0.5 * linelit_geometry::predicates::cross(b - a, c - a).dot(polygon.normal())
        });
        Self {
            polygon: *polygon,
            pieces: Pieces::new(areas),
            parallelogram: polygon.as_parallelogram(),
            density: Pdf::new(1.0 / polygon.area()),
        }
    }
}

impl PointTechnique for AreaSampler {
    type Measure = Area;

    fn sample(&self, u: [f64; 2]) -> PointSample<Area> {
        let u = u.map(fraction);
        let point = if let Some((o, a, b)) = self.parallelogram {
            o + a * u[0] + b * u[1]
        } else {
            let (i, lambda) = self.pieces.pick(u[0]);
            let corners = fan::triangle(self.polygon.vertices(), i);
            fan::place(corners, lambda, u[1].sqrt())
        };
        PointSample {
            point,
            pdf: self.density,
        }
    }

    fn pdf(&self, _point: DVec3) -> Pdf<Area> {
        self.density
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        let place = fan::locate(&self.polygon, point)?;
        let u = if let Some((o, a, b)) = self.parallelogram {
            let p = point - o;
            let n = self.polygon.normal();
            let cross = linelit_geometry::predicates::cross;
            let det = cross(a, b).dot(n);
            [cross(p, b).dot(n) / det, cross(a, p).dot(n) / det]
        } else {
            [
                self.pieces.unpick(place.triangle, place.lambda),
                place.kappa * place.kappa,
            ]
        };
        Some(u.map(below_one))
    }
}

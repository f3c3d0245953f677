//! This module samples polygons through Shirley & Wang's imaginary triangles at unit distance, for
//! comparison with exact techniques.

use crate::PointTechnique;
use crate::density::{Pdf, SolidAngle};
use crate::pieces::Pieces;
use crate::polygon::fan::{self, FanPoint};
use crate::samples::PointSample;
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{ConvexPolygon, DVec3, predicates};

/// Samples a polygon through imaginary ("proxy") triangles, whose vertices lie at unit distance
/// from `x` in the directions of the light's vertices. Points are uniform on these triangles, which
/// is close to uniform in solid angle, most of all at grazing incidence.
///
/// **Formula** (Shirley & Wang 1991, §2; they print no density): on a proxy triangle with unit
/// vertices v̂, a point q at the distance r has the density `2r³/|det(v̂₀, v̂₁, v̂₂)|` per solid
/// angle; with a fan it is `r³/(distance of its plane × ΣA)`. The ratio of its extremes is 2.9
/// where plain area sampling has 11. [`crate::SolidAngleSampler`] is exact and not much slower;
/// this technique serves for comparison.
///
/// **Domain**: any `x`; density 0 in the light's plane. Points are returned on the light itself.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{PointTechnique, ProxySampler};
/// let light = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y)?;
/// let sampler = ProxySampler::new(&light, DVec3::ZERO);
/// let sample = sampler.sample([0.3, 0.6]);
/// assert!((sampler.pdf(sample.point).value() / sample.pdf.value() - 1.0).abs() < 1e-12);
/// # Ok::<(), linelit_lights::geometry::PolygonError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ProxySampler {
    polygon: ConvexPolygon,
    x: DVec3,
    /// The areas of the proxy triangles, by which one of them is chosen.
    pieces: Pieces,
}

/// A proxy triangle, given by the triangle of the light.
#[derive(Clone, Copy)]
struct Proxy {
    /// The light's corners relative to x, their distances from x, and the edges from the first
    /// corner.
    corners: [DVec3; 3],
    length: [f64; 3],
    edges: [DVec3; 2],
}

impl Proxy {
    #[inline(always)]
    fn new(polygon: &ConvexPolygon, x: DVec3, i: usize) -> Self {
        let [a, b, c] = fan::triangle(polygon.vertices(), i);
        let corners = [a - x, b - x, c - x];
        let length = predicates::length;
        Self {
            corners,
            length: [length(corners[0]), length(corners[1]), length(corners[2])],
            edges: [b - a, c - a],
        }
    }

    /// Returns the determinant of the unit vectors to the corners: twice the proxy's area times the
    /// distance of its plane from the shading point.
    #[inline(always)]
    fn det(&self) -> f64 {
        let [la, lb, lc] = self.length;
        let [ab, ac] = self.edges;
        predicates::dot(predicates::cross(ab, ac), self.corners[0]).abs() / (la * lb * lc)
    }

    /// Returns the area of the proxy triangle.
    fn area(&self) -> f64 {
        let ([a, b, c], [la, lb, lc]) = (self.corners, self.length);
        // b̂ − â = (b − a)/|b| + a (1/|b| − 1/|a|), where the last difference is computed from the
        // edge.
        let chord = |p: DVec3, edge: DVec3, l: f64| {
            let shorter = -edge.dot(a + p) / (la + l);
            edge / l + a * (shorter / (la * l))
        };
        let [ab, ac] = self.edges;
        0.5 * predicates::length(predicates::cross(chord(b, ab, lb), chord(c, ac, lc)))
    }

    /// Returns r³/(distance of the proxy's plane) at the point with these barycentric coordinates
    /// on the light.
    #[inline(always)]
    fn density(&self, area: f64, weights: [f64; 3], distance: f64) -> f64 {
        let stretch: f64 = weights.iter().zip(self.length).map(|(w, l)| w * l).sum();
        let r = distance / stretch;
        r * r * r * 2.0 * area / self.det()
    }
}

impl ProxySampler {
    /// Sets the technique up for one light and shading point.
    #[must_use]
    pub fn new(polygon: &ConvexPolygon, x: DVec3) -> Self {
        let areas = (0..polygon.vertices().len() - 2).map(|i| {
            let proxy = Proxy::new(polygon, x, i);
            let area = proxy.area();
            let usable = proxy.det() > 0.0 && area.is_finite();
            if usable { area } else { 0.0 }
        });
        Self {
            polygon: *polygon,
            x,
            pieces: Pieces::new(areas),
        }
    }
}

impl PointTechnique for ProxySampler {
    type Measure = SolidAngle;

    fn sample(&self, u: [f64; 2]) -> PointSample<SolidAngle> {
        let vertices = self.polygon.vertices();
        if !self.pieces.is_usable() {
            return PointSample::none(vertices[0]);
        }
        let (triangle, lambda) = self.pieces.pick(u[0]);
        let kappa = fraction(u[1]).sqrt();
        let proxy = Proxy::new(&self.polygon, self.x, triangle);
        let corners = fan::triangle(vertices, triangle);
        // Barycentric coordinates on the proxy, divided by the distances, are coordinates on the
        // light.
        let on_proxy = [1.0 - kappa, kappa * (1.0 - lambda), kappa * lambda];
        let w = normalised([0, 1, 2].map(|i| on_proxy[i] / proxy.length[i]));
        let [a, b, c] = corners;
        let point = a + (b - a) * w[1] + (c - a) * w[2];
        let distance = (point - self.x).length();
        let area = self.pieces.weight(triangle);
        let density = proxy.density(area, w, distance) / self.pieces.total();
        PointSample::at(point, Pdf::new(density))
    }

    fn pdf(&self, point: DVec3) -> Pdf<SolidAngle> {
        fan::locate(&self.polygon, point).map_or(Pdf::ZERO, |at| {
            let proxy = Proxy::new(&self.polygon, self.x, at.triangle);
            let area = self.pieces.weight(at.triangle);
            let density = proxy.density(area, barycentric(&at), (point - self.x).length());
            Pdf::new(density / self.pieces.total())
        })
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        let at = fan::locate(&self.polygon, point).filter(|_| self.pieces.is_usable())?;
        let proxy = Proxy::new(&self.polygon, self.x, at.triangle);
        let w = barycentric(&at);
        let [_, b, c] = normalised([0, 1, 2].map(|i| w[i] * proxy.length[i]));
        let kappa = b + c;
        let lambda = if kappa > 0.0 { c / kappa } else { 0.0 };
        Some([
            self.pieces.unpick(at.triangle, lambda),
            below_one(kappa * kappa),
        ])
    }
}

/// Converts fan coordinates to barycentric coordinates.
fn barycentric(at: &FanPoint) -> [f64; 3] {
    let (kappa, lambda) = (at.kappa, at.lambda);
    [1.0 - kappa, kappa * (1.0 - lambda), kappa * lambda]
}

fn normalised(w: [f64; 3]) -> [f64; 3] {
    let sum = w[0] + w[1] + w[2];
    w.map(|x| x / sum)
}

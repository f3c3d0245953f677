//! Polygons as surfaces of lights.

use super::lines::{LineDensity, LineFamily, LineSetup};
use super::points::{PointDensity as By, PointSource};
use super::{Shape, Viewer, on_plane};
use crate::mixture::Lobes;
use crate::{AngularLines, AreaSampler, LineSampler};
use crate::{PointsOnLines, ProxySampler, SolidAngleSampler};
use linelit_geometry::{ConvexPolygon, DVec2, DVec3, Frame};
use linelit_shading::ltc::TransformedCosines;

impl Shape for ConvexPolygon {
    #[inline]
    fn normal(&self, _: DVec3) -> DVec3 {
        self.normal()
    }

    fn flat(&self) -> Option<DVec3> {
        Some(self.normal())
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        let (vertices, n) = (self.vertices(), self.normal());
        let hit = on_plane(vertices[0], n, x, direction)?;
        let next = vertices.iter().cycle().skip(1);
        let inside = |(a, b): (&DVec3, &DVec3)| n.dot((*b - *a).cross(hit - *a)) >= 0.0;
        vertices.iter().zip(next).all(inside).then_some(hit)
    }

    /// Along and across the first edge.
    fn half_width(&self) -> f64 {
        let frame = self.plane_frame();
        let corners = self.vertices().iter().map(|v| frame.to_plane(*v));
        let (low, high) = corners.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        0.5 * (high - low).min_element()
    }

    fn border(&self, point: DVec3, _: DVec3, edge: impl Fn(f64) -> f64) -> f64 {
        let vertices = self.vertices();
        let next = vertices.iter().cycle().skip(1);
        let factor = |(a, b): (&DVec3, &DVec3)| {
            let inwards = self.normal().cross((*b - *a).normalize_or_zero());
            edge(inwards.dot(point - *a))
        };
        vertices.iter().zip(next).map(factor).product()
    }

    #[inline(always)]
    fn points<'t>(&'t self, by: By, from: &Viewer<'_>) -> PointSource<'t> {
        let (x, n) = (from.position, from.normal);
        match by {
            By::Area | By::VisibleArea | By::Texture => PointSource::Area(AreaSampler::new(self)),
            By::Proxy => PointSource::Proxy(ProxySampler::new(self, x)),
            By::SolidAngle => PointSource::SolidAngle(SolidAngleSampler::new(self, x)),
            By::ProjectedSolidAngle => {
                let lines = AngularLines::by_projected_solid_angle(self, 0.0, x, n);
                PointSource::Projected(PointsOnLines(lines))
            }
            By::Lobes => {
                let nothing = TransformedCosines::new(Frame::from_normal(n), DVec3::ZERO);
                PointSource::Lobes(Lobes::new(self, x, from.cosines.unwrap_or(&nothing)))
            }
        }
    }

    fn lines<'t>(
        &'t self,
        by: LineDensity,
        setup: LineSetup,
        from: &Viewer<'_>,
    ) -> Option<LineFamily<'t>> {
        let (angle, x, n) = (setup.angle, from.position, from.normal);
        let lines = match by {
            LineDensity::Area | LineDensity::Texture => {
                let lines = LineSampler::new(self, angle, setup.offset);
                return Some(LineFamily::Area(lines));
            }
            LineDensity::SolidAngle => AngularLines::by_solid_angle(self, angle, x),
            LineDensity::Warped => AngularLines::by_warped_solid_angle(self, angle, x),
            LineDensity::Projected => AngularLines::by_projected_solid_angle(self, angle, x, n),
        };
        Some(LineFamily::Angular(lines))
    }
}

//! Polygons as surfaces of lights.

use super::lines::{LineDensity, LineFamily, LineSetup};
use super::points::{PointDensity, PointSource};
use super::{Shape, Viewer, on_plane};
use crate::mixture::Lobes;
use crate::{
    AngularLines, AreaSampler, LineSampler, PointsOnLines, ProxySampler, SolidAngleSampler,
};
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

    fn points<'t>(&'t self, by: PointDensity, from: &Viewer<'_>) -> PointSource<'t> {
        let (x, n) = (from.position, from.normal);
        match by {
            PointDensity::Area | PointDensity::VisibleArea | PointDensity::Texture => {
                PointSource::Area(AreaSampler::new(self))
            }
            PointDensity::Proxy => PointSource::Proxy(ProxySampler::new(self, x)),
            PointDensity::SolidAngle => PointSource::SolidAngle(SolidAngleSampler::new(self, x)),
            PointDensity::ProjectedSolidAngle => {
                let lines = AngularLines::by_projected_solid_angle(self, 0.0, x, n);
                PointSource::Projected(PointsOnLines(lines))
            }
            PointDensity::Lobes => PointSource::Lobes(match from.cosines {
                Some(cosines) => Lobes::new(self, x, cosines),
                None => {
                    let nothing = TransformedCosines::new(Frame::from_normal(n), DVec3::ZERO);
                    Lobes::new(self, x, &nothing)
                }
            }),
        }
    }

    fn lines<'t>(
        &'t self,
        by: LineDensity,
        setup: LineSetup,
        from: &Viewer<'_>,
    ) -> Option<LineFamily<'t>> {
        let (angle, x) = (setup.angle, from.position);
        Some(LineFamily::Angular(match by {
            LineDensity::Area | LineDensity::Texture => {
                return Some(LineFamily::Area(LineSampler::new(
                    self,
                    angle,
                    setup.offset,
                )));
            }
            LineDensity::SolidAngle => AngularLines::by_solid_angle(self, angle, x),
            LineDensity::Warped => AngularLines::by_warped_solid_angle(self, angle, x),
            LineDensity::Projected => {
                AngularLines::by_projected_solid_angle(self, angle, x, from.normal)
            }
        }))
    }
}

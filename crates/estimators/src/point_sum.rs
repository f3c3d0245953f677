//! Point samples: the mean of L f_r V cos θ/p_ω, whatever draws the points and whoever knows V.

use crate::{Buffers, EmissionTexture, PointBy, Query, ShadingPoint};
use linelit_bsdf::Reflection;
use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AngularLines, AreaLight, AreaSampler, Pdf, SolidAngle, SolidAngleSampler};
use linelit_visibility::Shaft;

/// A point of a light, drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawnPoint {
    /// The point.
    pub point: DVec3,
    /// The unit direction to it.
    pub direction: DVec3,
    /// The density of that direction.
    pub pdf: Pdf<SolidAngle>,
}

/// The mean of L f_r V cos θ/p_ω over `query.samples` points (Billen & Dutré 2016, eqs. 1–2, per
/// solid angle).
///
/// `draw` makes a point of two random numbers, `unshadowed` says what arrives from it if nothing
/// stands between, `visible` whether nothing does.
pub(crate) fn mean<R, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    draw: impl Fn([f64; 2]) -> Option<DrawnPoint>,
    unshadowed: impl Fn(&DrawnPoint) -> DVec3,
    mut visible: impl FnMut(DVec3) -> bool,
) -> DVec3 {
    let numbers = query.numbers();
    let mut sum = DVec3::ZERO;
    for i in 0..query.samples {
        let Some(sample) = draw(numbers.get_2d(i)) else {
            continue;
        };
        let (value, pdf) = (unshadowed(&sample), sample.pdf.value());
        if pdf > 0.0 && value != DVec3::ZERO && visible(sample.point) {
            sum += value * (1.0 / pdf);
        }
    }
    sum / f64::from(query.samples)
}

/// Points of an area light, a shadow ray for each.
pub(crate) fn by_rays<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    buffers: &mut Buffers,
) -> DVec3 {
    on_area(query, area, by, |on_light| query.sees(on_light, buffers))
}

/// Points of an area light that share a shaft in place of rays.
pub(crate) fn in_shaft<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    shaft: &mut Shaft<'_>,
) -> DVec3 {
    on_area(query, area, by, |on_light| shaft.point_visible(on_light))
}

/// Points of an area light.
fn on_area<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    visible: impl FnMut(DVec3) -> bool,
) -> DVec3 {
    let (point, polygon) = (query.point, &area.polygon);
    let x = point.position;
    let unshadowed = |at: &DrawnPoint| {
        point.reflected(
            query.light.emitted(area, at.point, at.direction),
            at.direction,
        )
    };
    match by {
        PointBy::Area | PointBy::VisibleArea | PointBy::Texture => {
            let sampler = AreaSampler::new(polygon);
            let draw = |u| {
                let sample = sampler.sample(u);
                let to_light = sample.point - x;
                let square = to_light.length_squared();
                let direction = to_light / square.sqrt();
                let pdf = sample
                    .pdf
                    .to_solid_angle(square, polygon.normal().dot(direction));
                Some(DrawnPoint {
                    point: sample.point,
                    direction,
                    pdf,
                })
            };
            mean(query, draw, unshadowed, visible)
        }
        PointBy::SolidAngle | PointBy::Linear(_) => {
            let sampler = SolidAngleSampler::new(polygon, x);
            let draw = |u| {
                let sample = sampler.sample(u);
                Some(DrawnPoint {
                    point: sample.point,
                    direction: (sample.point - x).normalize_or_zero(),
                    pdf: sample.pdf,
                })
            };
            mean(query, draw, unshadowed, visible)
        }
        PointBy::ProjectedSolidAngle => {
            let sampler = AngularLines::by_projected_solid_angle(polygon, 0.0, x, point.normal);
            let draw = |[u, v]: [f64; 2]| {
                let sample = sampler.point(&sampler.sample(u), &[Interval::UNIT], v);
                Some(DrawnPoint {
                    point: sample.point,
                    direction: (sample.point - x).normalize_or_zero(),
                    pdf: sample.pdf,
                })
            };
            mean(query, draw, unshadowed, visible)
        }
        PointBy::Bsdf => {
            let draw = |u| by_bsdf(point, u, |w| meets(polygon, x, w));
            mean(query, draw, unshadowed, visible)
        }
    }
}

/// A direction drawn from the BSDF, if `meets` finds a point of the light in it.
pub(crate) fn by_bsdf<R: Reflection>(
    point: &ShadingPoint<R>,
    u: [f64; 2],
    meets: impl Fn(DVec3) -> Option<DVec3>,
) -> Option<DrawnPoint> {
    let direction = point.bsdf.sample(u, point.outgoing, point.normal)?;
    Some(DrawnPoint {
        point: meets(direction)?,
        direction,
        pdf: Pdf::new(point.bsdf.pdf(direction, point.outgoing, point.normal)),
    })
}

/// Where a ray meets a convex polygon.
pub(crate) fn meets(polygon: &ConvexPolygon, x: DVec3, w: DVec3) -> Option<DVec3> {
    let vertices = polygon.vertices();
    let n = polygon.normal();
    let t = n.dot(vertices[0] - x) / n.dot(w);
    if !(t > 0.0 && t.is_finite()) {
        return None;
    }
    let hit = x + w * t;
    let next = vertices.iter().cycle().skip(1);
    let inside = |(a, b): (&DVec3, &DVec3)| n.dot((*b - *a).cross(hit - *a)) >= 0.0;
    vertices.iter().zip(next).all(inside).then_some(hit)
}

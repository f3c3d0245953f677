//! Point samples: one shadow ray each.

use crate::{PlannedLight, ShadingPoint, Workspace};
use linelit_geometry::{ConvexPolygon, DVec3, LIGHT_MARGIN};
use linelit_lights::{AreaLight, AreaSampler, LinearLight, SolidAngleSampler};
use linelit_samplers::SampleSet;
use linelit_visibility::{Occluders, Ray};

/// What one light sends to a point, by points uniform on its area.
///
/// Billen & Dutré 2016, eqs. 1–2: the mean of L f_r V cos θ cos θ'/(r² p_A).
pub(crate) fn area(
    occluders: &Occluders,
    light: &PlannedLight,
    area: &AreaLight,
    point: &ShadingPoint,
    samples: (&SampleSet, u32),
    workspace: &mut Workspace,
) -> DVec3 {
    let sampler = AreaSampler::new(&area.polygon);
    let (set, count) = samples;
    let mut sum = DVec3::ZERO;
    for i in 0..count {
        let sample = sampler.sample(set.get_2d(i));
        let to_light = sample.point - point.position;
        let square = to_light.length_squared();
        let w = to_light / square.sqrt();
        let cos_light = area.polygon.normal().dot(w);
        let pdf = sample.pdf.to_solid_angle(square, cos_light);
        if pdf.is_positive() {
            let weight = 1.0 / pdf.value();
            sum +=
                contribution(occluders, light, area, point, (w, sample.point), workspace) * weight;
        }
    }
    sum / f64::from(count)
}

/// What one light sends to a point, by points uniform in its solid angle: the mean of
/// L f_r V cos θ/p_ω.
pub(crate) fn solid_angle(
    occluders: &Occluders,
    light: &PlannedLight,
    area: &AreaLight,
    point: &ShadingPoint,
    samples: (&SampleSet, u32),
    workspace: &mut Workspace,
) -> DVec3 {
    let sampler = SolidAngleSampler::new(&area.polygon, point.position);
    let (set, count) = samples;
    let mut sum = DVec3::ZERO;
    for i in 0..count {
        let sample = sampler.sample(set.get_2d(i));
        if sample.pdf.is_positive() {
            let w = (sample.point - point.position).normalize_or_zero();
            let weight = 1.0 / sample.pdf.value();
            sum +=
                contribution(occluders, light, area, point, (w, sample.point), workspace) * weight;
        }
    }
    sum / f64::from(count)
}

/// What one light sends to a point, by directions drawn from the BSDF: the mean of
/// L f_r V cos θ/p_ω over those that meet the light.
pub(crate) fn bsdf(
    occluders: &Occluders,
    light: &PlannedLight,
    area: &AreaLight,
    point: &ShadingPoint,
    samples: (&SampleSet, u32),
    workspace: &mut Workspace,
) -> DVec3 {
    let (set, count) = samples;
    let mut sum = DVec3::ZERO;
    for i in 0..count {
        let Some(w) = point
            .bsdf
            .sample(set.get_2d(i), point.outgoing, point.normal)
        else {
            break;
        };
        let Some(on_light) = meets(&area.polygon, point.position, w) else {
            continue;
        };
        let pdf = point.bsdf.pdf(w, point.outgoing, point.normal);
        if pdf > 0.0 {
            let value = contribution(occluders, light, area, point, (w, on_light), workspace);
            sum += value / pdf;
        }
    }
    sum / f64::from(count)
}

/// Where a ray meets a convex polygon.
fn meets(polygon: &ConvexPolygon, x: DVec3, w: DVec3) -> Option<DVec3> {
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

/// L f_r V cos θ at one point of the light, in direction `w`.
pub(crate) fn contribution(
    occluders: &Occluders,
    light: &PlannedLight,
    area: &AreaLight,
    point: &ShadingPoint,
    (w, on_light): (DVec3, DVec3),
    workspace: &mut Workspace,
) -> DVec3 {
    let value = unshadowed(area, point, w);
    if value == DVec3::ZERO || !sees(occluders, light, point, on_light, workspace) {
        return DVec3::ZERO;
    }
    value
}

/// L f_r cos θ towards `w`, whatever stands between.
pub(crate) fn unshadowed(area: &AreaLight, point: &ShadingPoint, w: DVec3) -> DVec3 {
    let cosine = point.cosine(w);
    if cosine <= 0.0 {
        return DVec3::ZERO;
    }
    let emitted = area.emission.towards(-area.polygon.normal().dot(w));
    emitted * point.bsdf.eval(w, point.outgoing, point.normal) * cosine
}

/// Whether nothing stands between the shading point and a point of the light.
pub(crate) fn sees(
    occluders: &Occluders,
    light: &PlannedLight,
    point: &ShadingPoint,
    on_light: DVec3,
    workspace: &mut Workspace,
) -> bool {
    let ray = Ray {
        origin: point.position,
        direction: on_light - point.position,
        t_min: 0.0,
        t_max: 1.0 - LIGHT_MARGIN,
    };
    !occluders.any_hit(&ray, &light.triangles, &mut workspace.scratch)
}

/// What a linear light sends to a point, by points uniform on its length.
///
/// The limit of a thin cylinder: dω per length and radius is 2 sin γ/r², for the angle γ between
/// the light and the direction (Peters 2021, eqs. 1–3).
pub(crate) fn linear(
    occluders: &Occluders,
    light: &PlannedLight,
    linear: &LinearLight,
    point: &ShadingPoint,
    samples: (&SampleSet, u32),
    workspace: &mut Workspace,
) -> DVec3 {
    let (set, count) = samples;
    let direction = linear.segment.direction();
    let length = linear.segment.length();
    let mut sum = DVec3::ZERO;
    for i in 0..count {
        let on_light = linear.segment.at(set.get_1d(i));
        let to_light = on_light - point.position;
        let square = to_light.length_squared();
        let w = to_light / square.sqrt();
        let cosine = point.cosine(w);
        if cosine > 0.0 && sees(occluders, light, point, on_light, workspace) {
            let width = 2.0 * direction.cross(w).length() / square;
            sum += point.bsdf.eval(w, point.outgoing, point.normal) * (cosine * width * length);
        }
    }
    sum * linear.radiance_radius / f64::from(count)
}

//! Light in closed form: along the visible parts of a line, and over a whole light.

use crate::ShadingPoint;
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{AreaLight, LinearLight};
use linelit_shading::bsdf::Bsdf;
use linelit_shading::{cylinder, horizon, polygon, ribbon};

/// Whether the material's light has a closed form along a line and over a polygon.
pub(crate) fn has_closed_form(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Lambert(_))
}

/// ∫ L f_r cos θ cos θ'/r² along the visible parts of a line on an area light.
pub(crate) fn line(
    light: &AreaLight,
    point: &ShadingPoint,
    line: &Segment,
    parts: &[Interval],
) -> DVec3 {
    // The height over the light's plane, −m·q: the same all along the line.
    let height = light.polygon.normal().dot(point.position - line.p0);
    let emitted = light.emission.towards(height);
    if emitted == DVec3::ZERO {
        return DVec3::ZERO;
    }
    let mut sum = 0.0;
    for piece in parts
        .iter()
        .filter_map(|part| above_surface(point, line, *part))
    {
        sum += ribbon::irradiance(piece.p0, piece.p1, point.normal);
    }
    emitted * diffuse(&point.bsdf) * (sum * height.abs())
}

/// Light of the whole area light with nothing in between; `None` where there is no closed form.
pub(crate) fn whole_light(light: &AreaLight, point: &ShadingPoint) -> Option<DVec3> {
    if !has_closed_form(&point.bsdf) {
        return None;
    }
    let height = light
        .polygon
        .normal()
        .dot(point.position - light.polygon.vertices()[0]);
    let emitted = light.emission.towards(height);
    let clipped = if point.normal == point.geometric_normal {
        Some(light.polygon)
    } else {
        light.polygon.clip(point.position, point.geometric_normal)
    };
    let Some(polygon) = clipped else {
        return Some(DVec3::ZERO);
    };
    let mut relative = [DVec3::ZERO; 24];
    let vertices = polygon.vertices();
    for (to, from) in relative.iter_mut().zip(vertices) {
        *to = *from - point.position;
    }
    let irradiance = polygon::irradiance(&relative[..vertices.len()], point.normal);
    Some(emitted * diffuse(&point.bsdf) * irradiance)
}

/// Light of the visible parts of a linear light.
pub(crate) fn linear(light: &LinearLight, point: &ShadingPoint, parts: &[Interval]) -> DVec3 {
    let mut sum = 0.0;
    for piece in parts
        .iter()
        .filter_map(|part| above_surface(point, &light.segment, *part))
    {
        sum += cylinder::irradiance(piece.p0, piece.p1, point.normal);
    }
    light.radiance_radius * diffuse(&point.bsdf) * sum
}

/// A visible part, relative to the shading point; with an interpolated normal, clipped to the
/// geometric horizon (the closed forms clip to the normal's own).
fn above_surface(point: &ShadingPoint, line: &Segment, part: Interval) -> Option<Segment> {
    let piece = line.piece(part.lo, part.hi).relative_to(point.position);
    if point.geometric_normal == point.normal {
        return Some(piece);
    }
    horizon::clip_segment(piece.p0, piece.p1, point.geometric_normal)
        .map(|clipped| Segment::new(clipped.p0, clipped.p1))
}

fn diffuse(bsdf: &Bsdf) -> DVec3 {
    match bsdf {
        Bsdf::Lambert(lambert) => lambert.value(),
        _ => DVec3::ZERO,
    }
}

//! Light in closed form: along the visible parts of a line, and over a whole light.

use crate::light::even_emission;
use crate::line_sum::Along;
use crate::{EmissionTexture, PlanCounters, Query, ShadingPoint};
use linelit_bsdf::{ClosedForm, Phong, Reflection};
use linelit_geometry::{ConvexPolygon, DVec3, Segment, intervals::Interval};
use linelit_lights::{AreaLight, LinearLight};
use linelit_shading::{batch, cylinder, horizon, phong, phong_polygon, polygon};
use linelit_visibility::ShaftClass;

/// The relative accuracy of closed forms where nobody asks for another: an image of `f32` shows no
/// more.
pub(crate) const TOLERANCE: f64 = 1e-8;

/// Visible pieces of the lines on an area light, relative to the shading point, to be integrated
/// together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pieces {
    pieces: Vec<Segment>,
    /// What their integrals are multiplied with.
    weights: Vec<f64>,
    values: Vec<f64>,
}

impl Pieces {
    pub(crate) fn clear(&mut self) {
        self.pieces.clear();
        self.weights.clear();
    }

    /// Adds the visible parts of a line.
    pub(crate) fn add<R>(
        &mut self,
        point: &ShadingPoint<R>,
        line: &Segment,
        parts: &[Interval],
        weight: f64,
    ) {
        for part in parts {
            if let Some(piece) = above_surface(point, line, *part) {
                self.pieces.push(piece);
                self.weights.push(weight);
            }
        }
    }

    /// Σ weight × ∫ L f_r cos θ cos θ'/r² along the pieces.
    pub(crate) fn light<R>(
        &mut self,
        light: &AreaLight,
        point: &ShadingPoint<R>,
        reflection: &ClosedForm,
    ) -> DVec3 {
        let (emitted, height) = even_emission(light, point.position);
        if emitted == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let n = point.normal;
        self.values.resize(self.pieces.len(), 0.0);
        batch::ribbons(&self.pieces, n, &mut self.values);
        let weighted = self.values.iter().zip(&self.weights).map(|(v, w)| v * w);
        let (flat, mut glossy) = (weighted.sum(), 0.0);
        if let Some((axis, k)) = lobe(point, reflection) {
            for (piece, weight) in self.pieces.iter().zip(&self.weights) {
                glossy += phong::ribbon(piece.p0, piece.p1, n, axis, k) * weight;
            }
        }
        emitted * reflected(reflection, flat, glossy) * height.abs()
    }
}

/// Light of the whole area light with nothing in between, to a tolerance as for [`convex`].
pub(crate) fn whole_light<R>(
    light: &AreaLight,
    point: &ShadingPoint<R>,
    reflection: &ClosedForm,
    tolerance: f64,
) -> DVec3 {
    let (emitted, _) = even_emission(light, point.position);
    let clipped = if point.normal == point.geometric_normal {
        Some(light.polygon)
    } else {
        light.polygon.clip(point.position, point.geometric_normal)
    };
    let Some(polygon) = clipped else {
        return DVec3::ZERO;
    };
    let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
    let vertices = polygon.vertices();
    for (to, from) in relative.iter_mut().zip(vertices) {
        *to = *from - point.position;
    }
    let relative = &relative[..vertices.len()];
    emitted * convex(relative, point, reflection, tolerance)
}

/// ∫ f_r cos θ dω over a convex polygon relative to the shading point, to a tolerance relative to
/// what a diffuse surface of the lobe's albedo would reflect.
pub(crate) fn convex<R>(
    vertices: &[DVec3],
    point: &ShadingPoint<R>,
    reflection: &ClosedForm,
    tolerance: f64,
) -> DVec3 {
    let flat = polygon::irradiance(vertices, point.normal);
    let glossy = lobe(point, reflection).map_or(0.0, |(axis, k)| {
        // The lobe's factor grows with k; its integral is small beside the irradiance then.
        phong_polygon::irradiance_to(vertices, point.normal, axis, k, tolerance / (k + 2.0))
    });
    reflected(reflection, flat, glossy)
}

/// The light where the shaft's class says it all: nothing, or the whole light in closed form if
/// there is one.
pub(crate) fn without_samples<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    class: ShaftClass,
    along: Along,
    plan: &mut PlanCounters,
) -> Option<DVec3> {
    match class {
        ShaftClass::Blocked => {
            plan.hidden += 1;
            Some(DVec3::ZERO)
        }
        ShaftClass::Empty => {
            plan.unoccluded += 1;
            let Along::Analytic(reflection) = along else {
                return None;
            };
            plan.closed_form += 1;
            Some(whole_light(area, query.point, &reflection, query.tolerance))
        }
        ShaftClass::Partial => None,
    }
}

/// Light of the visible parts of a linear light.
pub(crate) fn linear<R>(
    light: &LinearLight,
    point: &ShadingPoint<R>,
    reflection: &ClosedForm,
    parts: &[Interval],
) -> DVec3 {
    let (mut flat, mut glossy) = (0.0, 0.0);
    let lobe = lobe(point, reflection);
    for piece in parts
        .iter()
        .filter_map(|part| above_surface(point, &light.segment, *part))
    {
        flat += cylinder::irradiance(piece.p0, piece.p1, point.normal);
        if let Some((axis, k)) = lobe {
            glossy += phong::cylinder(piece.p0, piece.p1, point.normal, axis, k);
        }
    }
    light.radiance_radius * reflected(reflection, flat, glossy)
}

/// A visible part, relative to the shading point; with an interpolated normal, clipped to the
/// geometric horizon (the closed forms clip to the normal's own).
fn above_surface<R>(point: &ShadingPoint<R>, line: &Segment, part: Interval) -> Option<Segment> {
    let piece = line.piece(part.lo, part.hi).relative_to(point.position);
    if point.geometric_normal == point.normal {
        return Some(piece);
    }
    horizon::clip_segment(piece.p0, piece.p1, point.geometric_normal)
        .map(|clipped| Segment::new(clipped.p0, clipped.p1))
}

/// Axis and exponent of the reflection's lobe, if it has one.
fn lobe<R>(point: &ShadingPoint<R>, reflection: &ClosedForm) -> Option<(DVec3, f64)> {
    let phong = reflection.lobe?;
    Some((Phong::axis(point.outgoing, point.normal), phong.exponent))
}

/// What the reflection makes of the diffuse and the lobe's integral.
fn reflected(reflection: &ClosedForm, flat: f64, glossy: f64) -> DVec3 {
    let diffuse = reflection.diffuse.value() * flat;
    match reflection.lobe {
        None => diffuse,
        Some(phong) => diffuse + phong.scale() * glossy,
    }
}

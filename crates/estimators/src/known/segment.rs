//! The light along the visible parts of linear lights, and of lines on cylinders, is integrated
//! here, in closed form or by quadrature.

use super::lines::above_surface;
use crate::ShadingPoint;
use crate::view::LightView;
use linelit_bsdf::{ClosedForm, ClosedLobe, Reflection};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::CylinderView;
use linelit_shading::quadrature::{self, Model};
use linelit_shading::{cylinder, phong, spherical_gaussian};

/// The relative error that quadrature aims at, on each part between peaks and kinks. It estimates
/// its error from a rule with half of the nodes, and once in a while both rules agree by accident:
/// the worst of 12,000 integrals on ten reflections has an error of 1.8e-8. With a goal ten times
/// as large, the worst of 300,000 has 1.4e-6; if kinks are not knots either, 5e-4.
const QUADRATURE: f64 = 1e-7;

/// The most evaluations of a reflection for each part between peaks and kinks.
const EVALUATIONS: u32 = 20_000;

/// The light of the visible parts of a linear light, for a radiance times radius of one.
pub(crate) fn closed(
    view: &LightView<'_>,
    line: &Segment,
    reflection: &ClosedForm<'_>,
    parts: &[Interval],
) -> DVec3 {
    let n = view.at.normal;
    let flat = over_parts(view, line, parts, |p0, p1| cylinder::irradiance(p0, p1, n));
    let mut sum = reflection.diffuse.value() * flat;
    for lobe in reflection.lobes(view.at.outgoing, n) {
        let whole = over_parts(view, line, parts, |p0, p1| match lobe {
            ClosedLobe::Power { axis, exponent, .. } => phong::cylinder(p0, p1, n, axis, exponent),
            ClosedLobe::Gaussian {
                axis, sharpness, ..
            } => spherical_gaussian::cylinder(p0, p1, n, axis, sharpness),
        });
        sum += lobe.scale() * whole;
    }
    sum
}

/// The sum of an integral over the visible parts of a linear light.
fn over_parts(
    view: &LightView<'_>,
    line: &Segment,
    parts: &[Interval],
    integral: impl Fn(DVec3, DVec3) -> f64,
) -> f64 {
    parts
        .iter()
        .filter_map(|part| above_surface(&view.at, line, *part))
        .fold(0.0, |sum, piece| sum + integral(piece.p0, piece.p1))
}

/// The integral ∫ f_r cos θ along the visible parts of a line by quadrature, to 1e-6, for a
/// reflection without a closed form whose peaks and kinks are known. `model` says whether the line
/// is a thin cylinder or a strip of a surface.
pub(crate) fn by_quadrature<R: Reflection>(
    line: &Segment,
    point: &ShadingPoint<R>,
    parts: &[Interval],
    model: Model,
) -> DVec3 {
    let (n, wo) = (point.normal, point.outgoing);
    let value = |w| point.bsdf.eval(w, wo, n);
    let mut sum = DVec3::ZERO;
    for piece in parts
        .iter()
        .filter_map(|part| above_surface(&point.receiver(), line, *part))
    {
        let peaks = point.bsdf.peaks(&piece, wo, n).unwrap_or_default();
        let mut from = piece.p0;
        for to in peaks.knots().map(|t| piece.at(t)) {
            let part = quadrature::line(from, to, n, model, value, QUADRATURE, EVALUATIONS);
            sum += part.value;
            from = to;
        }
    }
    sum
}

/// The irradiance that a cylinder of radiance one causes at the shading point, if nothing hides it
/// and all of its visible side is above the horizon.
pub(crate) fn whole_cylinder(view: &LightView<'_>, cylinder: &CylinderView) -> f64 {
    view.at.normal.dot(cylinder.vector_irradiance()).max(0.0)
}

//! Light in closed form: along the visible parts of a line, and over a whole light.

use crate::light::even_emission;
use crate::line_sum::Along;
use crate::round::RoundView;
use crate::seen_disk::SeenDisk;
use crate::{EmissionTexture, PlanCounters, Query, SampleBuffers, ShadingPoint};
use linelit_bsdf::{ClosedForm, ClosedLobe, Reflection};
use linelit_geometry::{ConvexPolygon, DVec3, Segment, intervals::Interval};
use linelit_lights::{AreaLight, CylinderView, Disk, DiskCone, LinearLight, SphereProjected};
use linelit_shading::{batch, cylinder, horizon, phong, polygon, quadrature};
use linelit_shading::{ribbon, spherical_gaussian};
use linelit_visibility::{Shaft, ShaftClass};

/// What quadrature asks of its estimated error, relative, on each part between peaks and kinks. The
/// estimate is that of a rule with half of the nodes, and once in a while both agree by accident:
/// the worst of 12,000 integrals on ten reflections errs by 1.8e-8. Where ten times as much is
/// asked, the worst of 300,000 errs by 1.4e-6, and where kinks are no knots besides, by 5e-4.
const QUADRATURE: f64 = 1e-7;

/// The most evaluations of a reflection for each part between peaks and kinks.
const EVALUATIONS: u32 = 20_000;

/// Visible pieces of the lines on an area light, relative to the shading point, to be integrated
/// together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pieces {
    pieces: Vec<Segment>,
    /// What their integrals are multiplied with.
    weights: Vec<f64>,
    /// Widths at both ends of each; none where all are of width one.
    widths: Vec<[f64; 2]>,
    values: Vec<f64>,
}

impl Pieces {
    pub(crate) fn clear(&mut self) {
        self.pieces.clear();
        self.weights.clear();
        self.widths.clear();
    }

    /// Number of pieces.
    pub(crate) fn len(&self) -> usize {
        self.pieces.len()
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

    /// Gives what was added of a line since `first` the widths of one that grows from nothing where
    /// it begins to one at its end: all lines that are integrated together do.
    pub(crate) fn taper<R>(&mut self, first: usize, point: &ShadingPoint<R>, line: &Segment) {
        let (begin, length) = (line.p0 - point.position, line.length());
        let widths = |piece: &Segment| [piece.p0, piece.p1].map(|p| p.distance(begin) / length);
        self.widths.extend(self.pieces[first..].iter().map(widths));
    }

    /// Σ weight × ∫ L f_r cos θ cos θ'/r² along the pieces, of what a flat light sends to the
    /// shading point and the height of that over its plane.
    pub(crate) fn light<R>(
        &mut self,
        emitted: DVec3,
        height: f64,
        point: &ShadingPoint<R>,
        reflection: &ClosedForm<'_>,
    ) -> DVec3 {
        if emitted == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let n = point.normal;
        self.values.resize(self.pieces.len(), 0.0);
        if self.widths.is_empty() {
            batch::ribbons(&self.pieces, n, &mut self.values);
        }
        for (i, widths) in self.widths.iter().enumerate() {
            self.values[i] = ribbon::tapered(self.pieces[i].p0, self.pieces[i].p1, n, *widths);
        }
        let weighted = self.values.iter().zip(&self.weights).map(|(v, w)| v * w);
        let mut reflected = reflection.diffuse.value() * weighted.sum::<f64>();
        for lobe in reflection.lobes(point.outgoing, n) {
            let mut sum = 0.0;
            for (i, (piece, weight)) in self.pieces.iter().zip(&self.weights).enumerate() {
                let Segment { p0, p1 } = *piece;
                let widths = self.widths.get(i).copied();
                sum += weight
                    * match (lobe, widths) {
                        (ClosedLobe::Power { axis, exponent, .. }, None) => {
                            phong::ribbon(p0, p1, n, axis, exponent)
                        }
                        (ClosedLobe::Power { axis, exponent, .. }, Some(widths)) => {
                            phong::tapered(p0, p1, n, axis, exponent, widths)
                        }
                        (
                            ClosedLobe::Gaussian {
                                axis, sharpness, ..
                            },
                            _,
                        ) => {
                            let widths = widths.unwrap_or([1.0; 2]);
                            spherical_gaussian::tapered(p0, p1, n, axis, sharpness, widths)
                        }
                    };
            }
            reflected += lobe.scale() * sum;
        }
        emitted * reflected * height.abs()
    }
}

/// Light of the whole area light with nothing in between, on a diffuse surface.
pub(crate) fn whole_light<R>(
    light: &AreaLight,
    point: &ShadingPoint<R>,
    reflection: &ClosedForm<'_>,
) -> DVec3 {
    let (emitted, _) = even_emission(light, point.position);
    let (x, n) = (point.position, point.normal);
    let irradiance = if n != point.geometric_normal {
        let Some(polygon) = light.polygon.clip(x, point.geometric_normal) else {
            return DVec3::ZERO;
        };
        let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        polygon::irradiance(polygon.relative_to(x, &mut relative), n)
    } else if let [a, b, c, d] = light.polygon.vertices() {
        // Of a quadrilateral, as most lights are, without room for more corners to clear.
        polygon::irradiance(&[*a - x, *b - x, *c - x, *d - x], n)
    } else {
        let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        polygon::irradiance(light.polygon.relative_to(x, &mut relative), n)
    };
    emitted * (reflection.diffuse.value() * irradiance)
}

/// Light of a whole round light with nothing in between, of what it sends to the shading point: a
/// sphere, cut by the shading horizon or not, or a disk above it, on a diffuse surface; `None` for
/// anything else.
pub(crate) fn whole_round<R>(
    view: &RoundView,
    emitted: DVec3,
    point: &ShadingPoint<R>,
    reflection: &ClosedForm<'_>,
) -> Option<DVec3> {
    let (x, n) = (point.position, point.normal);
    let above = |normal: DVec3| {
        let Disk { center, radius, .. } = view.disk;
        let rise = radius * normal.cross(view.disk.normal).length();
        normal.dot(center - x) >= rise
    };
    if !reflection.is_diffuse() || (n != point.geometric_normal && !above(point.geometric_normal)) {
        return None;
    }
    let projected = match &view.sphere {
        Some(sphere) => {
            SphereProjected::new(sphere, x, n).map_or(0.0, |s| s.projected_solid_angle())
        }
        None if above(n) => n
            .dot(DiskCone::new(&view.disk, x).vector_irradiance())
            .max(0.0),
        None => return None,
    };
    Some(emitted * reflection.diffuse.value() * projected)
}

/// Light of a whole cylinder with nothing in between, of constant radiance: above both horizons, on
/// a diffuse surface; `None` for anything else.
pub(crate) fn whole_cylinder<R>(
    view: &CylinderView,
    radiance: DVec3,
    point: &ShadingPoint<R>,
    reflection: &ClosedForm<'_>,
) -> Option<DVec3> {
    let above = |n: &DVec3| view.heights(*n)[0] >= 0.0;
    let is_known = reflection.is_diffuse() && point.horizons().iter().all(above);
    is_known.then(|| {
        let projected = point.normal.dot(view.vector_irradiance()).max(0.0);
        radiance * reflection.diffuse.value() * projected
    })
}

/// Light of what is visible of a round light, of what it sends to the shading point, on a diffuse
/// surface: Lambert's sum over the boundary. `None` where that does not tell.
pub(crate) fn visible_round<R>(
    view: &RoundView,
    emitted: DVec3,
    point: &ShadingPoint<R>,
    reflection: &ClosedForm<'_>,
    shaft: &mut Shaft<'_>,
    buffers: &mut SampleBuffers,
) -> Option<DVec3> {
    let SampleBuffers {
        penumbra, on_disk, ..
    } = buffers;
    let seen = SeenDisk::new(view, point, shaft, penumbra, on_disk)?;
    let flat = seen.irradiance(|p| p, point.normal)?;
    Some(emitted * reflection.diffuse.value() * flat)
}

/// The light where the shaft's class says it all: nothing, or the whole light in closed form on
/// a diffuse surface.
pub(crate) fn without_samples<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    class: ShaftClass,
    along: Along<'_>,
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
            if !reflection.is_diffuse() {
                return None;
            }
            plan.closed_form += 1;
            Some(whole_light(area, query.point, &reflection))
        }
        ShaftClass::Partial => None,
    }
}

/// Light of the visible parts of a linear light.
pub(crate) fn linear<R>(
    light: &LinearLight,
    point: &ShadingPoint<R>,
    reflection: &ClosedForm<'_>,
    parts: &[Interval],
) -> DVec3 {
    let n = point.normal;
    let flat = over_parts(light, point, parts, |p0, p1| {
        cylinder::irradiance(p0, p1, n)
    });
    let mut sum = reflection.diffuse.value() * flat;
    for lobe in reflection.lobes(point.outgoing, n) {
        let whole = over_parts(light, point, parts, |p0, p1| match lobe {
            ClosedLobe::Power { axis, exponent, .. } => phong::cylinder(p0, p1, n, axis, exponent),
            ClosedLobe::Gaussian {
                axis, sharpness, ..
            } => spherical_gaussian::cylinder(p0, p1, n, axis, sharpness),
        });
        sum += lobe.scale() * whole;
    }
    light.radiance_radius * sum
}

/// The sum of an integral over the visible parts of a linear light.
fn over_parts<R>(
    light: &LinearLight,
    point: &ShadingPoint<R>,
    parts: &[Interval],
    integral: impl Fn(DVec3, DVec3) -> f64,
) -> f64 {
    parts
        .iter()
        .filter_map(|part| above_surface(point, &light.segment, *part))
        .fold(0.0, |sum, piece| sum + integral(piece.p0, piece.p1))
}

/// ∫ f_r cos θ along the visible parts of a line by quadrature, to 1e-6, for a reflection without a
/// closed form whose peaks and kinks are known; `model` says what the line stands for.
pub(crate) fn by_quadrature<R: Reflection>(
    line: &Segment,
    point: &ShadingPoint<R>,
    parts: &[Interval],
    model: quadrature::Model,
) -> DVec3 {
    let (n, wo) = (point.normal, point.outgoing);
    let value = |w| point.bsdf.eval(w, wo, n);
    let mut sum = DVec3::ZERO;
    for piece in parts
        .iter()
        .filter_map(|part| above_surface(point, line, *part))
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

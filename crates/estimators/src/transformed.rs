//! Light of reflections without a closed form: that of the transformed cosines which they look
//! like, in closed form, and points for what these leave out.

use crate::light::even_emission;
use crate::techniques::integrals::exact::{CORNERS, Seen};
use crate::techniques::points::DrawPoints;
use crate::techniques::points::ltc::Lobes;
use crate::{EmissionTexture, Query, SampleBuffers};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::AreaLight;
use linelit_shading::ltc::Ltc;
use linelit_shading::polygon;
use linelit_visibility::{Shaft, ShaftClass};
use std::f64::consts::FRAC_1_PI;

/// Lambert's sum over the boundary is good to 1e-8 for lights whose area is larger than this times
/// the square of their distance.
const SMALL: f64 = 1e-8;

/// The transformed cosines g of a reflection, ready for integrals.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fit {
    /// Each with its albedo.
    lobes: Vec<(Ltc, DVec3)>,
    /// Whether the light is too small for sums over its edges.
    is_small: bool,
}

impl Fit {
    fn set(&mut self, cosines: &TransformedCosines, light: &ConvexPolygon, x: DVec3) {
        self.is_small = light.area() < SMALL * light.vertices()[0].distance_squared(x);
        self.lobes.clear();
        let lobes = cosines.lobes().iter();
        self.lobes
            .extend(lobes.map(|lobe| (Ltc::new(lobe.map, 1.0), lobe.albedo)));
    }

    /// ∫ g dω over what is seen of a light.
    fn over(&self, seen: &Seen<'_>, cosines: &TransformedCosines) -> DVec3 {
        let n = cosines.frame.z;
        let image = |ltc: &Ltc, p| ltc.to_cosine() * cosines.frame.to_local(p);
        let whole = || {
            let mut sum = cosines.diffuse * seen.irradiance(|p| p, n, SMALL)?;
            for (ltc, albedo) in &self.lobes {
                sum += *albedo * seen.irradiance(|p| image(ltc, p), DVec3::Z, SMALL)?;
            }
            Some(sum * FRAC_1_PI)
        };
        let by_triangles = || seen.triangles(|triangle| Some(self.over_convex(triangle, cosines)));
        whole().or_else(by_triangles).unwrap_or(DVec3::ZERO)
    }

    /// The same over all of a convex polygon relative to the shading point.
    fn over_convex(&self, vertices: &[DVec3], cosines: &TransformedCosines) -> DVec3 {
        let frame = &cosines.frame;
        let flat = if self.is_small {
            polygon::irradiance(vertices, frame.z)
        } else {
            polygon::irradiance_by_edges(vertices, frame.z)
        };
        let lobes = self.lobes.iter();
        lobes.fold(
            cosines.diffuse * (FRAC_1_PI * flat),
            |sum, (ltc, albedo)| {
                sum + *albedo
                    * if self.is_small {
                        ltc.polygon(frame, vertices)
                    } else {
                        ltc.polygon_by_edges(frame, vertices)
                    }
            },
        )
    }

    /// g(ω).
    fn at(&self, w: DVec3, cosine: f64, cosines: &TransformedCosines) -> DVec3 {
        let local = cosines.frame.to_local(w);
        let flat = cosines.diffuse * (cosine * FRAC_1_PI);
        let lobes = self.lobes.iter();
        lobes.fold(flat, |sum, (ltc, albedo)| {
            sum + *albedo * ltc.density(local)
        })
    }
}

/// The light that a reflection f cos which looks like g sends of what is visible of an area light
/// of one radiance, through a shaft that keeps what stands between: ∫ V g dω in closed form, and
/// of the samples the mean of V (f cos − g)/p.
///
/// Unbiased however far g is from f cos; the noise is that of the difference, in penumbrae as
/// elsewhere. May be negative. `None` if nothing is known of
/// the reflection, or the shaft keeps too little to know what is visible.
pub(crate) fn visible_light<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    shaft: &mut Shaft<'_>,
    buffers: &mut SampleBuffers,
) -> Option<DVec3> {
    let point = query.point;
    let (emitted, _) = even_emission(area, point.position);
    let cosines = point
        .bsdf
        .transformed_cosines(point.outgoing, point.normal)?;
    let SampleBuffers { fit, penumbra, .. } = buffers;
    fit.set(&cosines, &area.polygon, point.position);
    let mut sum = DVec3::ZERO;
    if shaft.class() == ShaftClass::Empty {
        if let Some(above) = area.polygon.clip(point.position, point.geometric_normal) {
            let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
            let vertices = above.relative_to(point.position, &mut relative);
            sum = fit.over_convex(vertices, &cosines);
        }
    } else {
        let mut corners = [[0.0; 2]; CORNERS];
        if let Some(seen) = Seen::new(point, &shaft.images()?, penumbra, &mut corners) {
            sum = fit.over(&seen, &cosines);
        }
    }
    let lobes = Lobes::new(&area.polygon, point.position, &cosines);
    let (numbers, share) = (query.numbers(), 1.0 / f64::from(query.samples));
    for i in 0..query.samples {
        let drawn = lobes.draw(numbers.get_2d(i), &area.polygon, point);
        let Some((at, density)) = drawn.filter(|(_, density)| *density > 0.0) else {
            continue;
        };
        let cosine = point.cosine(at.direction);
        if cosine > 0.0 && shaft.point_visible(at.point) {
            let f = point.bsdf.eval(at.direction, point.outgoing, point.normal);
            let g = fit.at(at.direction, cosine, &cosines);
            sum += (f * cosine - g) * (share / density);
        }
    }
    Some(emitted * sum)
}

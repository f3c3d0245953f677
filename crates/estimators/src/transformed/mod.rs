//! Light of reflections without a closed form: that of the transformed cosines which they look
//! like, in closed form, and points for what these leave out.

mod lines;
mod pieces;
mod rays;
mod round;

use crate::light::{Shape, even_emission};
use crate::techniques::integrals::exact::{CORNERS, Seen};
use crate::techniques::points::DrawPoints;
use crate::techniques::points::ltc::Lobes;
use crate::{EmissionTexture, LineDirection, Lines, Query, SampleBuffers};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use linelit_lights::AreaLight;
use linelit_shading::ltc::Ltc;
use linelit_shading::polygon;
use linelit_visibility::{Shaft, ShaftClass};
use lines::CosineLines;
pub(crate) use pieces::CosinePieces;
pub(crate) use rays::by_rays;
pub(crate) use round::{known_of_round, visible_round_light};
use std::f64::consts::{FRAC_1_PI, PI};

/// Lambert's sum over the boundary is good to 1e-8 for lights whose area is larger than this times
/// the square of their distance.
const SMALL: f64 = 1e-8;

/// The transformed cosines g of a reflection, ready for integrals.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// The surface's frame.
    frame: Frame,
    /// The albedo of the cosine itself.
    diffuse: DVec3,
    /// The others, each with its albedo.
    lobes: Vec<(Ltc, DVec3)>,
    /// Whether the light is too small for sums over its edges.
    is_small: bool,
}

impl Default for Fit {
    /// Of what is black.
    fn default() -> Self {
        Self {
            frame: Frame::from_normal(DVec3::Z),
            diffuse: DVec3::ZERO,
            lobes: Vec::new(),
            is_small: false,
        }
    }
}

impl Fit {
    fn set(&mut self, cosines: &TransformedCosines, is_small: bool) {
        self.is_small = is_small;
        (self.frame, self.diffuse) = (cosines.frame, cosines.diffuse);
        self.lobes.clear();
        let lobes = cosines.lobes().iter();
        self.lobes
            .extend(lobes.map(|lobe| (Ltc::new(lobe.map, 1.0), lobe.albedo)));
    }

    /// The map from the world to the surface's frame.
    fn to_local(&self) -> DMat3 {
        let Frame { x, y, z } = self.frame;
        DMat3::from_cols(x, y, z).transpose()
    }

    /// The albedos of the cosine itself and of each lobe.
    fn albedos(&self) -> impl Iterator<Item = DVec3> {
        let lobes = self.lobes.iter().map(|(_, albedo)| *albedo);
        std::iter::once(self.diffuse).chain(lobes)
    }

    /// The maps from the world to the space of each one's cosine.
    fn maps(&self) -> impl Iterator<Item = DMat3> {
        let to_local = self.to_local();
        let lobes = self.lobes.iter();
        std::iter::once(to_local).chain(lobes.map(move |(ltc, _)| ltc.to_cosine() * to_local))
    }

    /// ∫ g dω over what is seen of a light.
    fn over(&self, seen: &Seen<'_>) -> DVec3 {
        let image = |ltc: &Ltc, p| ltc.to_cosine() * self.frame.to_local(p);
        let whole = || {
            let mut sum = self.diffuse * seen.irradiance(|p| p, self.frame.z, SMALL)?;
            for (ltc, albedo) in &self.lobes {
                sum += *albedo * seen.irradiance(|p| image(ltc, p), DVec3::Z, SMALL)?;
            }
            Some(sum * FRAC_1_PI)
        };
        let by_triangles = || seen.triangles(|triangle| Some(self.over_convex(triangle)));
        whole().or_else(by_triangles).unwrap_or(DVec3::ZERO)
    }

    /// The same over all of a convex polygon relative to the shading point.
    fn over_convex(&self, vertices: &[DVec3]) -> DVec3 {
        let frame = &self.frame;
        let flat = if self.is_small {
            polygon::irradiance(vertices, frame.z)
        } else {
            polygon::irradiance_by_edges(vertices, frame.z)
        };
        let lobes = self.lobes.iter();
        lobes.fold(self.diffuse * (FRAC_1_PI * flat), |sum, (ltc, albedo)| {
            sum + *albedo
                * if self.is_small {
                    ltc.polygon(frame, vertices)
                } else {
                    ltc.polygon_by_edges(frame, vertices)
                }
        })
    }

    /// g(ω).
    pub(crate) fn at(&self, w: DVec3, cosine: f64) -> DVec3 {
        let local = self.frame.to_local(w);
        let lobes = self.lobes.iter();
        lobes.fold(self.diffuse * (cosine * FRAC_1_PI), |sum, (ltc, albedo)| {
            sum + *albedo * ltc.density(local)
        })
    }
}

/// Whether a light is too small for sums over its edges.
fn is_small(light: &ConvexPolygon, x: DVec3) -> bool {
    light.area() < SMALL * light.vertices()[0].distance_squared(x)
}

/// What is known of the light in closed form: the radiance that a light of one radiance sends, and
/// ∫ V g dω over it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub emitted: DVec3,
    pub integral: DVec3,
}

/// ∫ V g dω over a light of one radiance, through a shaft that keeps what stands between; sets
/// `buffers.fit` to g. `None` if the shaft keeps too little to know what is visible.
pub(crate) fn known<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    light: &ConvexPolygon,
    cosines: &TransformedCosines,
    shaft: &mut Shaft<'_>,
    buffers: &mut SampleBuffers,
) -> Option<Known> {
    let point = query.point;
    let (emitted, _) = even_emission(area, point.position);
    let SampleBuffers { fit, penumbra, .. } = buffers;
    fit.set(cosines, is_small(light, point.position));
    let mut integral = DVec3::ZERO;
    if shaft.class() == ShaftClass::Empty {
        if let Some(above) = light.clip(point.position, point.geometric_normal) {
            let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
            let vertices = above.relative_to(point.position, &mut relative);
            integral = fit.over_convex(vertices);
        }
    } else {
        let mut corners = [[0.0; 2]; CORNERS];
        integral = fit.over(&Seen::new(point, shaft, penumbra, &mut corners)?);
    }
    Some(Known { emitted, integral })
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
    let (point, light) = (query.point, &area.polygon);
    let cosines = point
        .bsdf
        .transformed_cosines(point.outgoing, point.normal)?;
    let Known { emitted, integral } = known(query, area, light, &cosines, shaft, buffers)?;
    let lobes = Lobes::new(light, point.position, &cosines);
    let rest = differences(query, light, &lobes, &buffers.fit, shaft);
    Some(emitted * (integral + rest))
}

/// The mean of V (f cos − g)/p over the samples of a query.
fn differences<R: Reflection, T: EmissionTexture, S: Shape>(
    query: &Query<'_, R, T>,
    light: &S,
    lobes: &impl DrawPoints<S>,
    fit: &Fit,
    shaft: &mut Shaft<'_>,
) -> DVec3 {
    let point = query.point;
    let (numbers, share) = (query.numbers(), 1.0 / f64::from(query.samples));
    let mut sum = DVec3::ZERO;
    for i in 0..query.samples {
        let drawn = lobes.draw(numbers.get_2d(i), light, point);
        let Some((at, density)) = drawn.filter(|(_, density)| *density > 0.0) else {
            continue;
        };
        let cosine = point.cosine(at.direction);
        if cosine > 0.0 && shaft.point_visible(at.point) {
            let f = point.bsdf.eval(at.direction, point.outgoing, point.normal);
            let g = fit.at(at.direction, cosine);
            sum += (f * cosine - g) * (share / density);
        }
    }
    sum
}

/// The same light by lines, where the shaft keeps too much for the boundary of what is visible, or
/// that would take too long: lines drawn by g, ∫ g cos'/r² along what is visible of each in closed
/// form, and points of it for f cos − g.
///
/// `None` if nothing is known of the reflection, its lobes do not reach the light, or each line is
/// to have a direction of its own.
pub(crate) fn along_lines<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    options: &Lines,
    shaft: &mut Shaft<'_>,
    buffers: &mut SampleBuffers,
) -> Option<DVec3> {
    let (point, polygon, x) = (query.point, &area.polygon, query.point.position);
    let cosines = point
        .bsdf
        .transformed_cosines(point.outgoing, point.normal)?;
    let SampleBuffers {
        fit,
        draws,
        pieces,
        visible,
        ..
    } = &mut *buffers;
    fit.set(&cosines, is_small(polygon, x));
    if options.direction == LineDirection::UniformPerLine {
        return None;
    }
    let fraction = options.only_fraction(query);
    let family = CosineLines::new(fit, polygon, x, fraction * PI)?;
    draws.draw_by(query, |_, u| family.sample(u));
    shaft.visible(&draws.lines, visible);
    pieces.clear();
    for (i, line) in draws.lines.iter().enumerate() {
        pieces.add(point, line, visible.line(i));
    }
    let (emitted, height) = even_emission(area, x);
    pieces.integrate(fit, height);
    let lines = draws.numbers().enumerate();
    let sum = lines.fold(DVec3::ZERO, |sum, (i, (density, v))| {
        sum + pieces.line(i, fit, point, v) / density
    });
    buffers.count_lines();
    Some(emitted * sum / f64::from(query.samples))
}

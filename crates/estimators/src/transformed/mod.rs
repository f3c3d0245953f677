//! Light of reflections without a closed form: that of the transformed cosines which they look
//! like, in closed form, and points for what these leave out.

mod round;

use crate::light::{Shape, even_emission};
use crate::point_sum::cheapest;
use crate::techniques::integrals::exact::{CORNERS, Seen};
use crate::techniques::points::DrawPoints;
use crate::techniques::points::ltc::{Lobes, Mixture};
use crate::{EmissionTexture, PointBy, Query, SampleBuffers, Stream};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::{ConvexPolygon, DVec3, Frame};
use linelit_lights::AreaLight;
use linelit_shading::ltc::Ltc;
use linelit_shading::polygon;
use linelit_visibility::{Shaft, ShaftClass};
pub(crate) use round::{known_of_round, visible_round_light};
use std::f64::consts::FRAC_1_PI;

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
    /// What the cosine itself and each lobe reflect of what is seen, as sums over the channels.
    seen: Vec<f64>,
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
            seen: Vec::new(),
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

    /// ∫ g dω over what is seen of a light.
    fn over(&mut self, seen: &Seen<'_>) -> DVec3 {
        let whole = seen.irradiance(|p| p, self.frame.z, SMALL);
        let by_triangles = || seen.triangles(|triangle| self.flat_over(triangle));
        let flat = whole.map_or_else(by_triangles, |sum| FRAC_1_PI * sum);
        let mut sum = self.diffuse * flat;
        self.seen.clear();
        self.seen.push(sum.element_sum());
        // The horizon of a lobe's own cosine need not be the surface's, which cuts it as well.
        let is_above = seen.is_above(self.frame.z);
        for (ltc, albedo) in &self.lobes {
            let image = |p| ltc.to_cosine() * self.frame.to_local(p);
            let whole = seen.irradiance(image, DVec3::Z, SMALL).filter(|_| is_above);
            let by_triangles = || seen.triangles(|triangle| self.lobe_over(ltc, triangle));
            let part = whole.map_or_else(by_triangles, |sum| FRAC_1_PI * sum);
            let part = *albedo * part;
            self.seen.push(part.element_sum());
            sum += part;
        }
        sum
    }

    /// The same over all of a convex polygon relative to the shading point.
    fn over_convex(&self, vertices: &[DVec3]) -> DVec3 {
        let flat = self.diffuse * self.flat_over(vertices);
        let lobes = self.lobes.iter();
        lobes.fold(flat, |sum, (ltc, albedo)| {
            sum + *albedo * self.lobe_over(ltc, vertices)
        })
    }

    /// The share of the cosine itself.
    fn flat_over(&self, vertices: &[DVec3]) -> f64 {
        FRAC_1_PI
            * match self.is_small {
                true => polygon::irradiance(vertices, self.frame.z),
                false => polygon::irradiance_by_edges(vertices, self.frame.z),
            }
    }

    /// That of a lobe.
    fn lobe_over(&self, ltc: &Ltc, vertices: &[DVec3]) -> f64 {
        match self.is_small {
            true => ltc.polygon(&self.frame, vertices),
            false => ltc.polygon_by_edges(&self.frame, vertices),
        }
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
    /// The light's plane, in which `penumbra` has the boundary of what is visible; `None` if
    /// nothing stands in between.
    pub plane: Option<[DVec3; 3]>,
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
    let (mut integral, mut plane) = (DVec3::ZERO, None);
    if shaft.class() == ShaftClass::Empty {
        if let Some(above) = light.clip(point.position, point.geometric_normal) {
            let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
            let vertices = above.relative_to(point.position, &mut relative);
            integral = fit.over_convex(vertices);
        }
    } else {
        let mut corners = [[0.0; 2]; CORNERS];
        let seen = Seen::new(point, shaft, penumbra, &mut corners)?;
        integral = fit.over(&seen);
        plane = Some(seen.plane());
    }
    Some(Known {
        emitted,
        integral,
        plane,
    })
}

/// The light that a reflection f cos which looks like g sends of what is visible of an area light
/// of one radiance, through a shaft that keeps what stands between: ∫ V g dω in closed form, and
/// of the samples the mean of V (f cos − g)/p. Past something, where points of the area are
/// cheapest, p is that of what is visible.
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
    let cosines = point.cosines()?;
    let known = known(query, area, light, &cosines, shaft, buffers)?;
    let plane = (known.plane).filter(|_| cheapest(query, area) == PointBy::Area);
    let visible = plane.and_then(|plane| {
        on_what_is_visible(query, light, &cosines, (known.integral, plane), buffers)
    });
    let sum = visible.unwrap_or_else(|| {
        let lobes = Lobes::new(light, point.position, &cosines);
        known.integral + differences(query, light, &lobes, &buffers.fit, shaft)
    });
    Some(known.emitted * sum)
}

/// Of so many samples one goes ahead, at least and at most so many.
const SAMPLES_FOR_ONE_AHEAD: u32 = 4;
const LEAST_AHEAD: u32 = 8;
const MOST_AHEAD: u32 = 2 * LEAST_AHEAD;

/// The same by points of what is visible alone, of which nothing has to be asked: β ∫ V g dω and
/// the mean of (f cos − β g)/p.
///
/// In the tail of a lobe g may be many times f cos. So β is what fits a few samples best that go
/// ahead; as it does not depend on the others, the estimate stays unbiased. `None` if something is
/// visible whose area is rounded to nothing.
fn on_what_is_visible<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    light: &ConvexPolygon,
    cosines: &TransformedCosines,
    (integral, [origin, along_p, along_q]): (DVec3, [DVec3; 3]),
    buffers: &mut SampleBuffers,
) -> Option<DVec3> {
    let SampleBuffers {
        fit,
        penumbra,
        region,
        ..
    } = buffers;
    let (point, x) = (query.point, query.point.position);
    if penumbra.latest().is_empty() {
        return Some(integral);
    }
    let pieces = penumbra.latest().iter().map(|edge| [edge.from, edge.to]);
    region.set([origin + x, along_p, along_q], pieces);
    if region.area() <= 0.0 {
        return None;
    }
    let mixture = Mixture::within(region, light, x, cosines, &fit.seen);
    // f cos/p and g/p.
    let draw = |u: [f64; 2]| {
        let (at, density) = mixture.draw_visible(u, light, x)?;
        let cosine = point.cosine(at.direction);
        (cosine > 0.0 && density > 0.0).then(|| {
            let f = point.bsdf.eval(at.direction, point.outgoing, point.normal);
            [f * cosine, fit.at(at.direction, cosine)].map(|v| v / density)
        })
    };
    let count = (query.samples / SAMPLES_FOR_ONE_AHEAD).min(MOST_AHEAD);
    let beta = if count < LEAST_AHEAD {
        1.0
    } else {
        let ahead = query.numbers.points(Stream::Ahead, count);
        let drawn = (0..count).map(|i| draw(ahead.get_2d(i)).unwrap_or_default());
        slope(drawn.map(|pair| pair.map(DVec3::element_sum)))
    };
    let numbers = query.numbers();
    let sum: DVec3 = (0..query.samples)
        .filter_map(|i| draw(numbers.get_2d(i)))
        .map(|[f, g]| f - g * beta)
        .sum();
    Some(integral * beta + sum / f64::from(query.samples))
}

/// The slope of the line that fits some pairs of f and g best, if that is from 0 to 1 and leaves no
/// more than a half of the variance of f − g; else one.
fn slope(pairs: impl Iterator<Item = [f64; 2]>) -> f64 {
    let (mut n, mut sums, mut squares) = (0.0, [0.0; 2], [0.0; 3]);
    for [f, g] in pairs {
        n += 1.0;
        sums = [sums[0] + f, sums[1] + g];
        squares = [squares[0] + f * f, squares[1] + f * g, squares[2] + g * g];
    }
    let [f, g] = sums;
    let [ff, fg, gg] = [
        squares[0] - f * f / n,
        squares[1] - f * g / n,
        squares[2] - g * g / n,
    ];
    let left = |beta: f64| ff - 2.0 * beta * fg + beta * beta * gg;
    let beta = (fg / gg).clamp(0.0, 1.0);
    if left(beta) < 0.5 * left(1.0) {
        beta
    } else {
        1.0
    }
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

#[cfg(test)]
mod tests {
    use super::slope;

    /// A slope is believed that leaves little of what one leaves, and is within bounds.
    #[test]
    fn slopes_that_fit_are_taken() {
        let of = |pairs: &[[f64; 2]]| slope(pairs.iter().copied());
        // A dozen roundings of numbers below ten, over squares of two.
        let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-14, "{got} for {want}");
        // The tail of a lobe; a line beside zero; f that falls as g grows; more than g.
        close(of(&[[0.15, 1.0], [0.45, 3.0], [0.3, 2.0]]), 0.15);
        close(of(&[[1.25, 1.0], [1.75, 3.0], [1.5, 2.0]]), 0.25);
        close(of(&[[3.0, 1.0], [1.0, 3.0], [2.0, 2.0]]), 0.0);
        close(of(&[[2.0, 1.0], [6.0, 3.0], [4.0, 2.0]]), 1.0);
        // What .9 leaves is no less than half of what one leaves.
        close(of(&[[1.0, 1.0], [2.4, 3.0], [2.5, 2.0], [0.0, 0.0]]), 1.0);
        // Nothing is known.
        close(of(&[]), 1.0);
        close(of(&[[1.0, 2.0]; 8]), 1.0);
        close(of(&[[0.0, 0.0]; 8]), 1.0);
    }
}

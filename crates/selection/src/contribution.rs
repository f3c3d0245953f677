//! This module estimates the light that a surface point receives from a light without occluders,
//! from one random point.

use linelit_geometry::{DVec3, predicates};
use linelit_lights::{Light, PointTechnique, Sky, SkyBy, SkyPoints, SkyView};

/// A surface point for which lights are chosen.
#[derive(Clone, Copy, Debug)]
pub struct Receiver<F> {
    /// The position of the point.
    pub position: DVec3,
    /// The unit normal, on the side from which light comes.
    pub normal: DVec3,
    /// Returns the light that the surface reflects from a direction, by channel: f cos θ for a unit
    /// vector. A shorter vector represents the directions whose mean it is; for it the function
    /// returns approximately the mean of f cos θ over them. Only [`LightTree`](crate::LightTree)
    /// passes shorter vectors.
    ///
    /// The unit is up to the caller, except for the tree: there the integral over the hemisphere
    /// should be about π, as it is for the cosine.
    pub reflected: F,
}

/// Makes the receiver of a diffuse surface, which reflects cos θ, so that its light is the
/// irradiance. For directions with the mean w it is (c + √(c² + (1 − |w|²)/4))/2 with c = n·w. This
/// is exact if all directions are equal (it is max(0, c)), and for directions that are uniform over
/// the sphere (¼).
pub fn diffuse(position: DVec3, normal: DVec3) -> Receiver<impl Fn(DVec3) -> DVec3 + Copy> {
    Receiver {
        position,
        normal,
        reflected: move |w: DVec3| DVec3::splat(positive_part(normal.dot(w), spread(w))),
    }
}

/// Returns 1 − |w|² for a mean w of unit vectors: the mean square of their distances from it.
#[must_use]
pub fn spread(mean: DVec3) -> f64 {
    (1.0 - mean.length_squared()).max(0.0)
}

/// Returns approximately the mean of max(0, c) over directions with the mean cosine `c` and a
/// [`spread`]: (c + √(c² + spread/4))/2.
#[must_use]
pub fn positive_part(c: f64, spread: f64) -> f64 {
    0.5 * (c + (c * c + 0.25 * spread).sqrt())
}

/// Whether any point of the light can light the surface point `x` with the unit normal `n`: a part
/// of the light is above the tangent plane, and x is on a side that emits. Only if this is false
/// may the probability α of choosing the light be 0.
#[must_use]
pub fn can_contribute(light: &Light, x: DVec3, n: DVec3) -> bool {
    light.can_light(x, n)
}

/// Returns a one-sample estimate of the light that a surface reflects, from a random point of the
/// light, averaged over the channels, as if that point were visible (Shirley & Wang 1991, eq. 3).
/// It is unbiased and not negative.
#[must_use]
pub fn unshadowed(light: &Light, at: &Receiver<impl Fn(DVec3) -> DVec3>, u: [f64; 2]) -> f64 {
    match light {
        Light::Linear(l) => from_point(light, at, l.segment.at(u[0])) * l.segment.length(),
        Light::Point(_) | Light::Distant(_) => from_beam(light, at),
        Light::Sky(l) => from_sky(l, at, u),
        surface => surface.sample_area(at.position, u).map_or(0.0, |sample| {
            from_point(light, at, sample.point) / sample.pdf.value()
        }),
    }
}

/// Returns an estimate of the light that a surface reflects, from the light's centre in place of a
/// random point. It is deterministic, and wrong where the centre is below the horizon while other
/// parts are not: with a probability α = 0 there, an image gets the bands of Shirley & Wang's Fig.
/// 10. Use it for that comparison only.
#[must_use]
pub fn unshadowed_at_center(light: &Light, at: &Receiver<impl Fn(DVec3) -> DVec3>) -> f64 {
    match light {
        Light::Linear(l) => from_point(light, at, l.segment.at(0.5)) * l.segment.length(),
        Light::Point(_) | Light::Distant(_) => from_beam(light, at),
        // Take the centre of the sampled directions of a sky.
        Light::Sky(l) => from_sky(l, at, [0.5, 0.5]),
        surface => surface.middle(at.position).map_or(0.0, |(middle, across)| {
            from_point(light, at, middle) * across * surface.area()
        }),
    }
}

/// Returns the reflected light of a delta light without occluders, averaged over the channels.
fn from_beam(light: &Light, at: &Receiver<impl Fn(DVec3) -> DVec3>) -> f64 {
    match light.beam(at.position) {
        Some(beam) if at.normal.dot(beam.direction) > 0.0 => {
            (beam.irradiance * (at.reflected)(beam.direction)).element_sum() / 3.0
        }
        _ => 0.0,
    }
}

/// Returns a one-sample estimate of the reflected light of a sky, from a random direction.
fn from_sky(sky: &Sky, at: &Receiver<impl Fn(DVec3) -> DVec3>, u: [f64; 2]) -> f64 {
    let view = SkyView::new(sky, at.position);
    let sample = SkyPoints::new(view, SkyBy::Projected(at.normal)).sample(u);
    let w = (sample.point - at.position).normalize_or_zero();
    if !sample.pdf.is_positive() || at.normal.dot(w) <= 0.0 {
        return 0.0;
    }
    let light = sky.radiance(at.position, w) * (at.reflected)(w);
    light.element_sum() / 3.0 / sample.pdf.value()
}

/// Returns the reflected light per area (per length for a linear light) of the light at `point`.
fn from_point(light: &Light, at: &Receiver<impl Fn(DVec3) -> DVec3>, point: DVec3) -> f64 {
    let d = point - at.position;
    let r2 = d.length_squared();
    if r2 <= 0.0 || at.normal.dot(d) <= 0.0 {
        return 0.0;
    }
    let r = r2.sqrt();
    // Compute the radiance, and r³ times the solid angle of a unit of the light.
    let emission = light.emission();
    let side = match (light, light.normal(point)) {
        // For linear lights dω/R is 2h/r³ dt.
        (Light::Linear(l), _) => 2.0 * predicates::cross(d, l.segment.direction()).length(),
        (_, Some(normal)) => {
            let side = -normal.dot(d);
            let two_sided = emission.two_sided;
            if two_sided { side.abs() } else { side.max(0.0) }
        }
        // Delta lights and light from infinity have no area.
        (_, None) => return 0.0,
    };
    if side <= 0.0 {
        return 0.0;
    }
    let reflected = emission.radiance * (at.reflected)(d / r);
    reflected.element_sum() / 3.0 * (side / (r2 * r))
}

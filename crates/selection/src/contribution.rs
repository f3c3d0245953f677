//! What a light may contribute to a surface point, without shadows.

use linelit_geometry::{DVec3, predicates};
use linelit_lights::{Light, PointTechnique, Sky, SkyBy, SkyPoints, SkyView};

/// A surface point for which lights are chosen.
#[derive(Clone, Copy, Debug)]
pub struct Receiver<F> {
    /// The position of the point.
    pub position: DVec3,
    /// The unit normal, on the side from which light comes.
    pub normal: DVec3,
    /// The light that the surface reflects from a direction, by channel: f cos θ for a unit vector.
    /// For a shorter vector, which stands for directions of which it is the mean, about the mean of
    /// f cos θ over them; only [`LightTree`](crate::LightTree) passes these.
    ///
    /// Its unit is the caller's, but for the tree: there its integral over the hemisphere should be
    /// about π, as the cosine's is.
    pub reflected: F,
}

/// A diffuse surface, which reflects cos θ: its light is the irradiance. Of directions with the
/// mean w it is (c + √(c² + (1 − |w|²)/4))/2 with c = n·w: exact where all are the same (then it is
/// max(0, c)) and for all directions alike (¼).
pub fn diffuse(position: DVec3, normal: DVec3) -> Receiver<impl Fn(DVec3) -> DVec3 + Copy> {
    Receiver {
        position,
        normal,
        reflected: move |w: DVec3| DVec3::splat(positive_part(normal.dot(w), spread(w))),
    }
}

/// Returns how far a mean of unit vectors is from length one: 1 − |w|², the mean square of their
/// distances from it.
#[must_use]
pub fn spread(mean: DVec3) -> f64 {
    (1.0 - mean.length_squared()).max(0.0)
}

/// About the mean of max(0, c) for cosines about `c` of directions of a [`spread`]:
/// (c + √(c² + spread/4))/2.
#[must_use]
pub fn positive_part(c: f64, spread: f64) -> f64 {
    0.5 * (c + (c * c + 0.25 * spread).sqrt())
}

/// Whether any point of the light can light the surface point `x` with the unit normal `n`: some of
/// it is above the tangent plane, and x is on an emitting side. This is the test that allows α = 0.
#[must_use]
pub fn can_contribute(light: &Light, x: DVec3, n: DVec3) -> bool {
    light.can_light(x, n)
}

/// One-sample estimate of the light that a surface reflects, from a random point of the light,
/// averaged over the channels, the geometry term set to visible (Shirley & Wang 1991, eq. 3).
/// Unbiased; not negative.
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

/// The estimate from the light's centre: deterministic, and wrong where the centre is below the
/// horizon while other parts are not. It makes the bands of Shirley & Wang's Fig. 10 if α = 0
/// follows from it; for that comparison only.
#[must_use]
pub fn unshadowed_at_center(light: &Light, at: &Receiver<impl Fn(DVec3) -> DVec3>) -> f64 {
    match light {
        Light::Linear(l) => from_point(light, at, l.segment.at(0.5)) * l.segment.length(),
        Light::Point(_) | Light::Distant(_) => from_beam(light, at),
        // The centre of what a sky draws from.
        Light::Sky(l) => from_sky(l, at, [0.5, 0.5]),
        surface => surface.middle(at.position).map_or(0.0, |(middle, across)| {
            from_point(light, at, middle) * across * surface.area()
        }),
    }
}

/// The light of a source without size.
fn from_beam(light: &Light, at: &Receiver<impl Fn(DVec3) -> DVec3>) -> f64 {
    match light.beam(at.position) {
        Some(beam) if at.normal.dot(beam.direction) > 0.0 => {
            (beam.irradiance * (at.reflected)(beam.direction)).element_sum() / 3.0
        }
        _ => 0.0,
    }
}

/// The estimate from a random direction of a sky.
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

/// Reflected light per area (per length for a line) of the light around `point`.
fn from_point(light: &Light, at: &Receiver<impl Fn(DVec3) -> DVec3>, point: DVec3) -> f64 {
    let d = point - at.position;
    let r2 = d.length_squared();
    if r2 <= 0.0 || at.normal.dot(d) <= 0.0 {
        return 0.0;
    }
    let r = r2.sqrt();
    // Radiance, and the solid angle of a unit of the light times r³.
    let emission = light.emission();
    let side = match (light, light.normal(point)) {
        // dω/R = 2h/r³ dt.
        (Light::Linear(l), _) => 2.0 * predicates::cross(d, l.segment.direction()).length(),
        (_, Some(normal)) => {
            let side = -normal.dot(d);
            let two_sided = emission.two_sided;
            if two_sided { side.abs() } else { side.max(0.0) }
        }
        // Lights without size and light from infinity have no area.
        (_, None) => return 0.0,
    };
    if side <= 0.0 {
        return 0.0;
    }
    let reflected = emission.radiance * (at.reflected)(d / r);
    reflected.element_sum() / 3.0 * (side / (r2 * r))
}

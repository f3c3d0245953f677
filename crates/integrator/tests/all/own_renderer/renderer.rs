//! This is a renderer of direct light in 60 lines that does not use linelit's scenes.

use linelit_estimators::bsdf::Reflection;
use linelit_estimators::geometry::{ConvexPolygon, DVec3, Frame};
use linelit_estimators::lights::{AreaLight, Emission, Light};
use linelit_estimators::{Buffers, LightSource, Query, RandomNumbers, ShadingPoint, estimate};
use linelit_estimators::{samplers::SamplerKind, visibility::Occluders};
use std::f64::consts::{FRAC_1_PI, TAU};

/// A BSDF of one's own: diffuse, with three methods and no closed form.
struct Chalk(DVec3);

impl Reflection for Chalk {
    fn eval(&self, _: DVec3, _: DVec3, _: DVec3) -> DVec3 {
        self.0 * FRAC_1_PI
    }

    fn sample(&self, [u, v]: [f64; 2], _: DVec3, n: DVec3) -> Option<DVec3> {
        let (sine, (y, x)) = (u.sqrt(), (TAU * v).sin_cos());
        let local = DVec3::new(sine * x, sine * y, (1.0 - u).sqrt());
        Some(Frame::from_normal(n).to_world(local))
    }

    fn pdf(&self, wi: DVec3, _: DVec3, n: DVec3) -> f64 {
        n.dot(wi).max(0.0) * FRAC_1_PI
    }
}

/// Triangles of one's own that emit light. All corners are `f32` numbers, like the corners of
/// scenes.
fn lights() -> [Light; 2] {
    [0.0, 2.0].map(|x| {
        let corners = [
            (-0.75, -0.5, 2.0),
            (0.125, 0.875, 1.625),
            (0.75, -0.375, 2.25),
        ];
        let [a, b, c] = corners.map(|p| DVec3::from(p) + DVec3::X * x);
        let polygon = ConvexPolygon::triangle(a, b, c).expect("three corners");
        let emission = Emission::one_sided(DVec3::new(8.0, 6.0, 4.0));
        Light::Area(AreaLight { polygon, emission })
    })
}

/// The radiance from the point `x` of a floor below these triangles and below an occluder, to a
/// viewer overhead.
pub(crate) fn radiance(x: DVec3, estimator: &str, samples: u32, seed: u64) -> DVec3 {
    let corners = [[-0.5, -0.25, 1.0], [0.5, -0.25, 1.0], [0.125, 0.5, 0.75]];
    let occluders = Occluders::build(&corners, &[[0, 1, 2]]);
    let bsdf = Chalk(DVec3::new(0.75, 0.5, 0.25));
    let point = ShadingPoint::new(x, DVec3::Z, DVec3::Z, bsdf);
    let estimator = estimator.parse().expect("an estimator");
    let mut buffers = Buffers::default();
    let mut sum = DVec3::ZERO;
    for (light, pair) in lights().iter().zip(0..) {
        let source = LightSource::new(light);
        let numbers = RandomNumbers::new(SamplerKind::Auto, seed, [0, 0], pair);
        let query = Query::new(&occluders, &source, &point, &estimator, numbers, samples);
        sum += estimate(&query, &mut buffers);
    }
    sum
}

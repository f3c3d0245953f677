//! Direct light in a renderer that knows nothing of linelit's scenes: 60 lines.

use linelit_bsdf::Reflection;
use linelit_estimators::{Buffers, LightSource, Query, RandomNumbers, ShadingPoint, estimate};
use linelit_geometry::{ConvexPolygon, DVec3, Frame};
use linelit_lights::{AreaLight, Emission, Light};
use linelit_samplers::SamplerKind;
use linelit_visibility::Occluders;

/// A BSDF of one's own: diffuse, with three methods and no closed form.
pub(crate) struct Chalk(pub(crate) DVec3);

impl Reflection for Chalk {
    fn eval(&self, _: DVec3, _: DVec3, _: DVec3) -> DVec3 {
        self.0 * std::f64::consts::FRAC_1_PI
    }

    fn sample(&self, [u, v]: [f64; 2], _: DVec3, n: DVec3) -> Option<DVec3> {
        let (sine, (y, x)) = (u.sqrt(), (std::f64::consts::TAU * v).sin_cos());
        Some(Frame::from_normal(n).to_world(DVec3::new(sine * x, sine * y, (1.0 - u).sqrt())))
    }

    fn pdf(&self, wi: DVec3, _: DVec3, n: DVec3) -> f64 {
        n.dot(wi).max(0.0) * std::f64::consts::FRAC_1_PI
    }
}

/// Lights and triangles of one's own: two triangles of light, and one that is in their way.
pub(crate) struct Room(pub(crate) Vec<Light>, Occluders);

impl Room {
    pub(crate) fn new() -> Self {
        let corners = [
            [-0.8, -0.5, 2.0],
            [0.125, 0.875, 1.625],
            [0.75, -0.375, 2.25],
        ];
        let emit = |offset: DVec3| {
            let [a, b, c] = corners.map(|p| DVec3::from_array(p) + offset);
            let polygon = ConvexPolygon::triangle(a, b, c).expect("three corners");
            let emission = Emission::one_sided(DVec3::new(8.0, 6.0, 4.0));
            Light::Area(AreaLight { polygon, emission })
        };
        let blocker = [
            [-0.625, -0.25, 1.0],
            [0.5, -0.25, 1.125],
            [0.125, 0.625, 0.75],
        ];
        let lights = vec![emit(DVec3::ZERO), emit(DVec3::X * 2.0)];
        Self(lights, Occluders::build(&blocker, &[[0, 1, 2]]))
    }
}

/// Radiance from the point `x` of a floor, seen from above.
pub(crate) fn radiance(room: &Room, x: DVec3, estimator: &str, samples: u32) -> DVec3 {
    let Room(lights, occluders) = room;
    let (normal, bsdf) = (DVec3::Z, Chalk(DVec3::new(0.7, 0.5, 0.3)));
    let (position, geometric_normal, outgoing) = (x, normal, normal);
    let point = ShadingPoint {
        position,
        geometric_normal,
        normal,
        outgoing,
        bsdf,
    };
    let (estimator, mut buffers) = (estimator.parse().expect("an estimator"), Buffers::default());
    let each = (0u32..).zip(lights).map(|(pair, light)| {
        let numbers = RandomNumbers {
            sampler: SamplerKind::Stratified,
            seed: 1,
            pixel: [0, 0],
            pair,
        };
        let source = LightSource::new(light);
        estimate(
            &Query::new(occluders, &source, &point, &estimator, numbers, samples),
            &mut buffers,
        )
    });
    each.sum()
}

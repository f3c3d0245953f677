//! The side on which a light emits, and normals that are not unit vectors.

use linelit_bsdf::{Bsdf, Lambert, Phong};
use linelit_estimators::{Buffers, LightSource, Query, RandomNumbers, ShadingPoint, estimate};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AreaLight, Emission, Light};
use linelit_samplers::SamplerKind;
use linelit_shading::polygon;
use linelit_testkit::assert_close;
use linelit_visibility::Occluders;

const TEXTS: [&str; 6] = [
    "point-area",
    "point-ltc",
    "line-analytic",
    "line-solid-angle+point-bsdf",
    "exact",
    "hybrid",
];

/// A square overhead that emits downwards, or upwards.
fn square(turned: bool) -> ConvexPolygon {
    let (u, v) = (DVec3::X, DVec3::Y);
    let [u, v] = if turned { [u, v] } else { [v, u] };
    ConvexPolygon::parallelogram(DVec3::new(-0.2, -0.5, 1.5), u, v).expect("a square")
}

fn light_by(text: &str, light: &Light, point: &ShadingPoint) -> f64 {
    let estimator = text.parse().expect("an estimator");
    let numbers = RandomNumbers::new(SamplerKind::Stratified, 1, [0, 0], 0);
    let (occluders, source) = (Occluders::build(&[], &[]), LightSource::new(light));
    let query = Query::new(&occluders, &source, point, &estimator, numbers, 16);
    estimate(&query, &mut Buffers::default()).x
}

fn glossy() -> Bsdf {
    let diffuse = Lambert {
        albedo: DVec3::splat(0.4),
    };
    let phong = Phong {
        specular: DVec3::splat(0.5),
        exponent: 20.0,
    };
    Bsdf::Phong(diffuse, phong)
}

#[test]
fn lengths_of_normals_make_no_difference() {
    let light = Light::Area(AreaLight {
        polygon: square(false),
        emission: Emission::one_sided(DVec3::ONE),
    });
    let [n, to] = [DVec3::new(0.1, 0.3, 0.9), DVec3::new(-0.3, 0.1, 1.0)];
    for text in TEXTS {
        let by = |n: DVec3, to| {
            let point = ShadingPoint::new(DVec3::ZERO, n, to, glossy());
            light_by(text, &light, &point)
        };
        let want = by(n.normalize(), to.normalize());
        assert!(want > 0.0, "{text}");
        for scale in [1e-200, 0.5, 2.0, 3.0, 1e200] {
            // The rounding of directions, times the exponent of the lobe.
            let got = by(n * scale, to / scale);
            assert_close!(got, want, rel = 1e-12, "{text} × {scale}");
        }
    }
}

#[test]
#[cfg(debug_assertions)]
#[should_panic(expected = "unit vectors")]
fn normals_that_are_no_unit_vectors_are_told_in_debug_builds() {
    let light = Light::Area(AreaLight {
        polygon: square(false),
        emission: Emission::one_sided(DVec3::ONE),
    });
    let mut point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, DVec3::Z, glossy());
    point.normal *= 2.0;
    light_by("exact", &light, &point);
}

#[test]
fn the_back_of_a_light_is_dark_to_estimators_alone() {
    let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, DVec3::Z, glossy());
    let [front, back] = [false, true].map(square);
    let irradiance = [&front, &back].map(|p| polygon::irradiance(p.vertices(), DVec3::Z));
    assert_close!(irradiance[0], irradiance[1], rel = 1e-12, "both sides");
    for text in TEXTS {
        let by = |polygon, emission| {
            let light = Light::Area(AreaLight { polygon, emission });
            light_by(text, &light, &point)
        };
        let one = Emission::one_sided(DVec3::ONE);
        let two = Emission {
            two_sided: true,
            ..one
        };
        assert!(by(front, one) > 0.0, "{text}");
        assert_eq!(by(back, one).to_bits(), 0, "{text}");
        assert!(by(back, two) > 0.0, "{text}");
    }
}

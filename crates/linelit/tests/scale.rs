//! Tests that a scene far from the origin of its coordinates has the same values as near it, and
//! that all methods agree about occluders that stand on a point.

use linelit::geometry::{DVec3, Segment, vector};
use linelit::lights::LinearLight;
use linelit::{Estimator, Light, Measure, Scene};

const PLACES: [[f64; 3]; 6] = [
    [0.0, 0.0, 0.0],
    [1e3, -1e3, 1e3],
    [5e3, 5e3, 0.0],
    [540_000.0, 0.0, 0.0],
    [500_000.0, 5_400_000.0, 300.0],
    [1e7, -1e7, 1e7],
];

const BLADE: [[f64; 3]; 3] = [[-0.2, -0.1, 1.0], [0.25, -0.05, 1.0], [0.0, 0.2, 1.1]];

fn lamp(at: DVec3) -> Light {
    let corner = at + DVec3::new(-0.5, -0.5, 2.0);
    Light::rectangle(corner, DVec3::Y, DVec3::X, [10.0; 3]).expect("a square")
}

fn tube(at: DVec3) -> Light {
    let ends = [DVec3::new(-0.6, -0.2, 2.0), DVec3::new(0.5, 0.3, 1.8)].map(|p| p + at);
    Light::Linear(LinearLight {
        segment: Segment::new(ends[0], ends[1]),
        radiance_radius: DVec3::ONE,
    })
}

/// Returns the irradiance from a light at a point, and the visible fraction of the light.
fn answers(at: DVec3, vertices: &[[f64; 3]], light: Light, estimator: &str) -> [f64; 2] {
    let estimator: Estimator = estimator.parse().expect("an estimator");
    let scene = Scene::builder_from(vertices, &[[0, 1, 2]]).light(light);
    let scene = scene.method(estimator).samples(1 << 10).build().unwrap();
    assert!(!scene.occluders().rounding().is_coarse(), "{at}");
    let irradiance = scene.irradiance(at, DVec3::Z).unwrap()[0];
    let fraction = scene.visible_fraction(at, 0, Measure::Area).unwrap();
    [irradiance, fraction]
}

/// Points on a slanted floor, computed in double precision, get all of the light although the
/// rounded floor passes in front of some of them.
#[test]
fn rounding_does_not_hide_a_surface_from_its_own_points() {
    let open = Scene::builder(&[], &[]).light(lamp(DVec3::ZERO));
    let open = open.method(Estimator::exact()).build().unwrap();
    for place in PLACES.map(vector) {
        let corners = [[-1.1, -0.9, 0.1], [1.3, -0.7, 0.3], [0.1, 1.7, -0.1]];
        let [a, b, c] = corners.map(|v| vector(v) + place);
        let vertices = [a, b, c].map(|v| v.to_array());
        let floor = Scene::builder_from(&vertices, &[[0, 1, 2]]).light(lamp(place));
        let floor = floor.method(Estimator::exact()).build().unwrap();
        let normal = (b - a).cross(c - a);
        for k in 0..100 {
            let (u, v) = (f64::from(k % 10) + 0.5, f64::from(k / 10) + 0.5);
            let (u, v) = (u / 10.0 * (1.0 - v / 10.0), v / 10.0);
            let point = a + (b - a) * u + (c - a) * v;
            let got = floor.irradiance(point, normal).unwrap()[0];
            let want = open.irradiance(point - place, normal).unwrap()[0];
            // The point is lifted by three roundings of vertices, and by that of its coordinates.
            let lift = 3.0 * 2f64.powi(-24) + f64::EPSILON * 64.0 * place.abs().max_element();
            assert!(
                (got - want).abs() < 3.0 * lift * want,
                "{place} {k}: {got} {want}"
            );
        }
    }
}

/// The answers stay the same when an occluder (the blade) and two lights (the lamp and the tube)
/// are moved together to distant coordinates in double precision.
///
/// The answers may differ by rounding alone. The corners of blade, lamp and tube are rounded to
/// half an ulp of their coordinates, ε/2 times the largest, and the corners of the blade once more
/// to 2⁻²⁴ of its size of 1.1, relative to another origin. A shadow's edge moves by twice the sum
/// of both, as the blade is half of the way up. The light is one unit wide, and the answer changes
/// by less than three times as much per unit by which one of its three edges moves; there are four
/// roundings for each. The point is lifted by 2⁻⁴⁶ of the largest coordinate and twice the
/// rounding, which is less than ten times as much.
#[test]
fn scenes_are_the_same_everywhere_on_the_map() {
    for make in [lamp, tube] {
        let exact = answers(DVec3::ZERO, &BLADE, make(DVec3::ZERO), "exact");
        assert!(exact[1] > 0.5 && exact[1] < 0.95, "{exact:?}");
        for place in PLACES.map(vector) {
            let vertices = BLADE.map(|v| (vector(v) + place).to_array());
            let rounding = f64::EPSILON * place.abs().max_element() + 2f64.powi(-24);
            let bound =
                3.0 * 2.0 * (3.0 * 4.0 + 10.0) * rounding + SURFACE * place.abs().max_element();
            let got = answers(place, &vertices, make(place), "exact");
            for (got, want) in got.into_iter().zip(exact) {
                assert!((got - want).abs() < bound * want, "{place}: {got} {want}");
            }
            let [hybrid, _] = answers(place, &vertices, make(place), "hybrid");
            assert!(
                (hybrid - exact[0]).abs() < bound * exact[0],
                "{place}: {hybrid}"
            );
        }
    }
}

/// A bound of the change by lifting a point, per unit of its largest coordinate: six times the lift
/// of 2⁻⁴⁶. At one unit of distance from an edge or the light, the light changes by less than three
/// times the shift, and both sides of the comparison are lifted.
const SURFACE: f64 = 6.0 / (1_u64 << 46) as f64;

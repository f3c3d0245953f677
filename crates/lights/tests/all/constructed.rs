//! Lights from plain numbers: what constructors make is what the fields say, of ordinary numbers,
//! and no panic of hostile ones.

use linelit_geometry::DVec3;
use linelit_lights::Light;
use linelit_testkit::strategies::{hostile, hostile_vector};
use proptest::prelude::*;
use std::f64::consts::PI;

#[test]
fn lights_emit_what_their_numbers_say() {
    let square = Light::rectangle([0.0; 3], DVec3::X, DVec3::Y, [2.0; 3]).expect("a square");
    let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    assert_eq!(Light::polygon(&corners, [2.0; 3]), Ok(square.clone()));
    let sides = square.clone().two_sided();
    // Powers: radiance times area times π, 4π times the intensity, and those of thin cylinders.
    for (light, power) in [
        (square, 2.0 * PI),
        (sides, 4.0 * PI),
        (
            Light::disk([0.0; 3], [0.0, 0.0, 7.0], 2.0, [1.0; 3]),
            4.0 * PI * PI,
        ),
        (Light::sphere([0.0; 3], 2.0, [1.0; 3]), 16.0 * PI * PI),
        (
            Light::cylinder([0.0; 3], [3.0, 0.0, 0.0], 2.0, [1.0; 3]),
            12.0 * PI * PI,
        ),
        (
            Light::line([0.0; 3], [3.0, 0.0, 0.0], [1.0; 3]),
            6.0 * PI * PI,
        ),
        (Light::point([0.0; 3], [1.0; 3]), 4.0 * PI),
    ] {
        // A product of six factors: six roundings.
        assert!((light.power() / power - 1.0).abs() < 1e-14, "{light:?}");
    }
    // A spot along −z, whole within its inner angle and nothing beyond the outer one.
    let spot = Light::spot([0.0, 0.0, 1.0], [0.0, 0.0, -3.0], [0.2, 0.4], [1.0; 3]);
    let arrives = |x: f64| spot.beam(DVec3::new(x, 0.0, 0.0)).map(|b| b.irradiance);
    assert_eq!(arrives(0.0), Some(DVec3::ONE));
    assert_eq!(arrives(0.5).unwrap_or_default(), DVec3::ZERO);
    let sun = Light::distant([0.0, 0.0, 5.0], [1.5; 3]);
    assert_eq!(sun.beam(DVec3::ZERO).map(|b| b.direction), Some(DVec3::Z));
    let Light::Sky(sky) = Light::sun([0.0, 0.0, 5.0], 0.1, [1.5; 3]) else {
        panic!("a sky");
    };
    assert_eq!(sky.radiance(DVec3::ZERO, DVec3::Z), DVec3::splat(1.5));
    assert_eq!(sky.radiance(DVec3::ZERO, DVec3::X), DVec3::ZERO);
    assert_eq!(Light::sky([1.5; 3]).emission().radiance, DVec3::splat(1.5));
}

proptest! {
    #[test]
    fn lights_of_hostile_numbers_have_a_power(
        [a, b, c, e] in [(); 4].map(|()| hostile_vector()),
        [r, s] in [hostile(), hostile()],
    ) {
        let mut lights = vec![
            Light::disk(a, b, r, e),
            Light::sphere(a, r, e),
            Light::cylinder(a, b, r, e),
            Light::line(a, b, e),
            Light::point(a, e),
            Light::spot(a, b, [r, s], e),
            Light::distant(a, e),
            Light::sky(e),
            Light::sun(a, r, e),
        ];
        lights.extend(Light::polygon(&[a, b, c], e));
        lights.extend(Light::rectangle(a, b, c, e));
        for light in lights {
            let light = light.two_sided();
            for power in [&[light.power()][..], &light.power_by_channel().to_array()].concat() {
                prop_assert!(power >= 0.0 && power.is_finite(), "{light:?} {power}");
            }
        }
    }
}

//! These tests make lights from plain numbers: constructors set the fields that they should for
//! ordinary numbers, and do not panic for hostile ones.

use linelit_geometry::DVec3;
use linelit_lights::{Extent, Light, Normals, PointDensity, SeenSurface, Surface};
use linelit_testkit::strategies::{hostile, hostile_vector};
use proptest::prelude::*;
use std::f64::consts::PI;

#[test]
fn lights_emit_what_their_numbers_say() {
    let square = Light::rectangle([0.0; 3], DVec3::X, DVec3::Y, [2.0; 3]).expect("a square");
    let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    assert_eq!(Light::polygon(&corners, [2.0; 3]), Ok(square.clone()));
    let sides = square.clone().two_sided();
    // Powers: radiance times area times π, 4π times the intensity, and the powers of thin
    // cylinders.
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

/// Lights with a surface, with the number of their densities.
fn surfaces() -> Vec<(Light, usize)> {
    let (from, to) = (DVec3::new(1.0, -2.0, 0.5), DVec3::new(2.5, 0.0, 1.0));
    let square = Light::rectangle(from, DVec3::X * 2.0, DVec3::Y, [2.0; 3]).expect("a rectangle");
    vec![
        (square, 4),
        (Light::disk(from, to, 0.75, [1.0; 3]).two_sided(), 3),
        (Light::sphere(from, 1.5, [1.0; 3]), 4),
        (Light::cylinder(from, to, 0.5, [1.0; 3]), 4),
    ]
}

/// For points that are uniform on the visible area: they are in the box, their mean squared
/// distance from the mean is the variance, their normals are the normals of the surface, and the
/// light can light a receiver if one of them is above its horizon.
#[test]
fn lights_are_where_their_points_are() {
    const N: u32 = 64;
    let x = DVec3::new(3.0, 1.0, 4.0);
    let grid = |i: u32| (f64::from(i) + 0.5) / f64::from(N);
    for (light, densities) in surfaces() {
        assert_eq!(light.densities().len(), densities, "{light:?}");
        assert!(light.densities().contains(&PointDensity::Area));
        let Extent {
            bounds: (lo, hi),
            mean,
            variance,
            normals,
        } = light.extent();
        assert_eq!(light.is_flat(), normals != Normals::Around);
        let seen: SeenSurface<'_> = light.seen_from(x).expect("in view");
        let surface = seen.surface();
        let (middle, part) = light.middle(x).expect("an area");
        assert!(part > 0.0 && part <= 1.0);
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        let places = (0..N * N).map(|k| [grid(k / N), grid(k % N)]);
        for u in places {
            let point = light.sample_area(x, u).expect("an area").point;
            // Eight roundings of coordinates below four.
            let slack = DVec3::splat(8.0 * 4.0 * f64::EPSILON);
            for point in [point, middle] {
                assert!((point + slack).cmpge(lo).all() && (point - slack).cmple(hi).all());
            }
            let normal = light.normal(point).expect("sides");
            assert!(normal.distance(surface.normal(point)) < 1e-14, "{light:?}");
            for n in [
                DVec3::X,
                DVec3::NEG_Y,
                DVec3::NEG_Z,
                DVec3::new(-0.6, 0.0, -0.8),
            ] {
                let is_above = n.dot(point - x) > 0.0;
                let is_seen = normal.dot(x - point) > 0.0 || light.emission().two_sided;
                assert!(
                    !(is_above && is_seen) || light.can_light(x, n),
                    "{light:?} {n}"
                );
                assert!(!is_above || surface.may_rise_above(x, n), "{light:?} {n}");
            }
            let square = point.distance_squared(mean);
            (sum, largest) = (sum + square, largest.max(square));
        }
        // The midpoint rule on N² cells is off by at most the variation, over N.
        let error = (sum / f64::from(N * N) - variance).abs();
        assert!(error <= largest / f64::from(N), "{light:?}: {error}");
    }
}

#[test]
fn lights_know_whether_their_numbers_are_valid_and_lines_have_no_surface() {
    let x = DVec3::new(3.0, 1.0, 4.0);
    for (light, _) in surfaces() {
        assert!(light.is_valid(10.0) && !light.is_valid(0.4), "{light:?}");
    }
    let line = Light::line(DVec3::X, DVec3::Y, [1.0; 3]);
    assert!(line.seen_from(x).is_none() && line.normal(x).is_none() && line.middle(x).is_none());
    assert!(line.sample_area(x, [0.5; 2]).is_none() && line.densities().is_empty());
    assert!(line.can_light(DVec3::ZERO, DVec3::X) && !line.can_light(x, DVec3::X));
    // No size, no direction, no number, or a negative emission.
    for broken in [
        Light::sphere(x, 0.0, [1.0; 3]),
        Light::sphere(x, -1.0, [1.0; 3]),
        Light::sphere(x, 1.0, [1.0, -1.0, 1.0]),
        Light::disk(x, DVec3::ZERO, 1.0, [1.0; 3]),
        Light::disk(x, x, f64::NAN, [1.0; 3]),
        Light::cylinder(x, x, 1.0, [1.0; 3]),
        Light::cylinder(x, DVec3::ZERO, 0.0, [1.0; 3]),
        Light::line(x, x, [1.0; 3]),
        Light::point(DVec3::NAN, [1.0; 3]),
        Light::distant(DVec3::ZERO, [1.0; 3]),
        Light::sky([f64::INFINITY; 3]),
        Light::sun(x, 2.0, [1.0; 3]),
    ] {
        assert!(!broken.is_valid(10.0), "{broken:?}");
    }
    assert!(line.is_valid(1.0) && Light::sun(x, 0.1, [1.0; 3]).is_valid(1.0));
}

/// Lines across others go through their points at right angles to them, on what has lines.
#[test]
fn lines_across_others_are_at_right_angles() {
    let x = DVec3::new(3.0, 1.0, 4.0);
    for (light, _) in surfaces() {
        let seen = light.seen_from(x).expect("in view");
        let (surface, mut lines) = (seen.surface(), Vec::new());
        let point = light.sample_area(x, [0.3, 0.6]).expect("an area").point;
        let direction = match surface {
            Surface::Cylinder(view) => view.cylinder().axis.direction(),
            _ => DVec3::new(0.6, 0.8, 0.0),
        };
        surface.lines_across(direction, [point].into_iter(), &mut lines);
        let has_lines = matches!(surface, Surface::Polygon(_) | Surface::Cylinder(_));
        assert_eq!(lines.len(), usize::from(has_lines), "{light:?}");
        for line in lines {
            // Some roundings of coordinates below four, over lengths above a half.
            assert!(line.direction().dot(direction).abs() < 1e-14, "{light:?}");
            let off = (point - line.p0).cross(line.direction()).length();
            assert!(off < 1e-14 && line.length() > 0.5, "{light:?}: {off}");
        }
    }
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
        let [a, b, c] = [a, b, c].map(DVec3::from);
        for light in lights {
            let light = light.two_sided();
            for power in [&[light.power()][..], &light.power_by_channel().to_array()].concat() {
                prop_assert!(power >= 0.0 && power.is_finite(), "{light:?} {power}");
            }
            prop_assert!(light.area() >= 0.0 && light.area().is_finite(), "{light:?}");
            if let Some(sample) = light.sample_area(c, [r, s]) {
                prop_assert!(sample.pdf.value() >= 0.0 && sample.pdf.value().is_finite());
            }
            let _ = (light.is_valid(r), light.can_light(c, b), light.extent(), light.middle(c), light.normal(c));
            if let Some(seen) = light.seen_from(c) {
                let _ = seen.surface().may_rise_above(c, b);
                seen.surface().lines_across(b, [a, c].into_iter(), &mut Vec::new());
            }
        }
    }
}

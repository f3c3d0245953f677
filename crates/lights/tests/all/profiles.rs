//! These tests check profiles: means, tables, images, and numbers that cannot be a profile.

use linelit_geometry::{DMat3, DVec3, Frame};
use linelit_lights::octahedral::{sphere_to_square, square_to_sphere};
use linelit_lights::{
    Falloff, LightSpace, Profile, ProfileError, ProfileKind, ProfileMap, ProfileTable,
};
use linelit_testkit::quadrature::gauss_legendre;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

pub(crate) fn profiles() -> Vec<(&'static str, ProfileKind)> {
    let cone = |inner: f64, outer: f64, falloff| ProfileKind::Cone {
        cos_inner: inner.cos(),
        cos_outer: outer.cos(),
        falloff,
    };
    vec![
        ("smooth", cone(0.3, 0.7, Falloff::Smooth)),
        ("quartic", cone(0.2, 1.3, Falloff::Quartic)),
        ("quadratic", cone(0.0, 1.9, Falloff::Quadratic)),
        ("wide", cone(1.8, 3.0, Falloff::Smooth)),
        ("step", cone(0.5, 0.5, Falloff::Smooth)),
        ("all", cone(PI, PI, Falloff::Smooth)),
        ("cosine", ProfileKind::CosinePower(1.0)),
        ("even", ProfileKind::CosinePower(0.0)),
        ("narrow", ProfileKind::CosinePower(50.5)),
    ]
}

/// Means in closed form agree with quadrature between the cones.
#[test]
fn means_of_profiles() {
    let frame = Frame::from_normal(DVec3::new(0.6, 0.0, 0.8));
    let nodes = gauss_legendre(64);
    for (name, kind) in profiles() {
        let knots = match kind {
            ProfileKind::Cone {
                cos_inner,
                cos_outer,
                ..
            } => vec![-1.0, cos_outer, 0.0, cos_inner, 1.0],
            _ => vec![-1.0, 0.0, 1.0],
        };
        let mut knots = knots;
        knots.sort_by(f64::total_cmp);
        let profile = Profile::new(kind, frame);
        let integral = |weight: &dyn Fn(f64) -> f64| -> f64 {
            let piece = |pair: &[f64]| {
                nodes.integrate(pair[0], pair[1], |c| {
                    let sine = ((1.0 - c) * (1.0 + c)).max(0.0).sqrt();
                    let w = frame.to_world(DVec3::new(sine, 0.0, c));
                    profile.factor(w).x * weight(c)
                })
            };
            knots.windows(2).map(piece).sum()
        };
        let (mean, lambert) = (integral(&|_| 0.5), integral(&|c| 2.0 * c.max(0.0)));
        // 64 nodes of polynomials, and of cos^50.5: to rounding of the directions next to the pole.
        assert!((profile.mean().x - mean).abs() < 1e-6, "{name}: {mean}");
        assert!(
            (profile.lambertian_mean() - lambert).abs() < 1e-6,
            "{name}: {lambert}"
        );
        let twice = profile.clone().scaled(2.0);
        assert!((twice.mean() - 2.0 * profile.mean()).length() < 1e-15);
        let w = frame.to_world(DVec3::new(0.28, 0.0, 0.96));
        assert_eq!(twice.factor(w), 2.0 * profile.factor(w));
        // About another normal the same cosine has the same factor.
        let on = profile.on_surface(DVec3::Y, DVec3::new(0.28, 0.96, 0.0));
        assert!((on - profile.factor(w)).length() < 1e-12, "{name}");
    }
}

/// On a surface, horizontal angles begin at the profile's x axis, laid into the surface, and go on
/// against the clock about the normal; about the profile's own axis the factor is its own.
#[test]
fn tables_on_surfaces_begin_at_the_x_axis_of_the_profile() {
    let angles = |count: u32| {
        (0..count)
            .map(|k| f64::from(k) * FRAC_PI_2)
            .collect::<Vec<_>>()
    };
    let values = vec![1.0, 2.0, 1.0, 3.0, 1.0, 4.0, 1.0, 5.0];
    let table = ProfileTable::new(angles(2), angles(4), values).unwrap();
    let x = DVec3::new(0.6, 0.0, 0.8);
    let frame = Frame::from_normal_and_tangent(DVec3::new(-0.8, 0.0, 0.6), x);
    let profile = Profile::new(ProfileKind::Table(Arc::new(table)), frame);
    let normals = [frame.z, DVec3::Z, DVec3::Y, DVec3::new(0.48, -0.6, 0.64)];
    for n in normals {
        let tangent = (x - n * n.dot(x)).normalize();
        let around = [tangent, n.cross(tangent), -tangent, -n.cross(tangent)];
        for (w, value) in around.into_iter().zip([2.0, 3.0, 4.0, 5.0]) {
            // Halfway from the axis, where the table is one.
            let got = profile.on_surface(n, (n + w).normalize()).x;
            assert!((got - 0.5 * (1.0 + value)).abs() < 1e-12, "{n} {w}: {got}");
        }
        let (w, own) = ((frame.z + frame.y).normalize(), 2.0);
        assert!((profile.factor(w).x - own).abs() < 1e-12);
    }
}

/// The mean of an image is the mean of its lookups: for interpolated pixels, for the nearest pixel,
/// and for one bright pixel at any index.
#[test]
fn maps_have_the_mean_of_their_lookups() {
    for side in [1, 2, 5, 16] {
        for bright in [0, side / 2, side * side - 1] {
            let values = |count: usize| {
                (0..count)
                    .map(|k| f32::from(u8::from(k == bright)))
                    .collect()
            };
            let map = ProfileMap::octahedral(side, values(side * side)).unwrap();
            // Equal areas; interpolation keeps the sum.
            let want = 1.0 / (side * side) as f64;
            for map in [map.clone(), map.nearest()] {
                let map = ProfileKind::Map(Arc::new(map));
                let got = Profile::new(map, Frame::from_normal(DVec3::Y)).mean().x;
                assert!((got / want - 1.0).abs() < 1e-12, "{side} {bright}: {got}");
            }
            let size = [side, side + 1];
            let map = ProfileMap::equirectangular(size, values(side * (side + 1))).unwrap();
            let row = bright / side;
            let [from, to] = [row, row + 1].map(|k| (k as f64 * PI / (side + 1) as f64).cos());
            let want = 0.5 * (from - to) / side as f64;
            let map = ProfileKind::Map(Arc::new(map.nearest()));
            let got = Profile::new(map, Frame::from_normal(DVec3::Y)).mean().x;
            assert!((got / want - 1.0).abs() < 1e-12, "{side} {bright}: {got}");
        }
    }
}

/// Tables: what stands in them at their angles, between them the mean, zero beyond, on around the
/// axis; images of one value are one.
#[test]
fn tables_and_maps() {
    let degrees = |d: &[f64]| d.iter().map(|d| d.to_radians()).collect::<Vec<_>>();
    let table = ProfileTable::new(
        degrees(&[0.0, 45.0, 90.0]),
        degrees(&[0.0, 90.0, 180.0, 270.0]),
        vec![8.0, 4.0, 0.0, 8.0, 2.0, 0.0, 8.0, 4.0, 0.0, 8.0, 6.0, 0.0],
    );
    let table = ProfileKind::Table(Arc::new(table.unwrap()));
    let world = Frame {
        x: DVec3::X,
        y: DVec3::Y,
        z: DVec3::Z,
    };
    let profile = Profile::new(table, world);
    let at = |theta: f64, phi: f64| {
        let (theta, phi) = (theta.to_radians(), phi.to_radians());
        let (s, c) = theta.sin_cos();
        profile
            .factor(DVec3::new(s * phi.cos(), s * phi.sin(), c))
            .x
    };
    let known = [
        (0.0, 10.0, 8.0),
        (45.0, 0.0, 4.0),
        (45.0, 90.0, 2.0),
        (45.0, 45.0, 3.0),
        (45.0, 315.0, 5.0),
        (22.5, 90.0, 5.0),
        (89.0, 90.0, 2.0 / 45.0),
        (91.0, 0.0, 0.0),
        (180.0, 0.0, 0.0),
    ];
    for (theta, phi, want) in known {
        assert!(
            (at(theta, phi) - want).abs() < 1e-9,
            "{theta} {phi}: {}",
            at(theta, phi)
        );
    }
}

#[test]
fn maps_and_what_is_none() {
    let degrees = |d: &[f64]| d.iter().map(|d| d.to_radians()).collect::<Vec<_>>();
    let world = Frame {
        x: DVec3::X,
        y: DVec3::Y,
        z: DVec3::Z,
    };
    // One value everywhere.
    let map = ProfileMap::octahedral(2, vec![3.0; 4]).unwrap().nearest();
    let map = Profile::new(ProfileKind::Map(Arc::new(map)), world);
    assert!((map.mean() - DVec3::splat(3.0)).length() < 1e-15);
    // By the cosines in the middles of cells.
    assert!((map.lambertian_mean() - 3.0).abs() < 3e-5);
    let map = ProfileMap::equirectangular([4, 2], vec![1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    let map = Profile::new(ProfileKind::Map(Arc::new(map.unwrap())), world);
    let poles = [DVec3::Z, DVec3::NEG_Z].map(|w| map.factor(w));
    assert_eq!(poles, [DVec3::ONE, DVec3::ZERO]);
    // Refused.
    let new =
        |v: &[f64], h: &[f64], n: usize| ProfileTable::new(degrees(v), degrees(h), vec![1.0; n]);
    assert_eq!(
        new(&[0.0, 90.0], &[0.0], 3).unwrap_err(),
        ProfileError::Count
    );
    assert_eq!(new(&[], &[0.0], 0).unwrap_err(), ProfileError::Count);
    assert_eq!(
        new(&[0.0, 90.0, 90.0], &[0.0], 3).unwrap_err(),
        ProfileError::Angle(2)
    );
    assert_eq!(
        new(&[0.0, 190.0], &[0.0], 2).unwrap_err(),
        ProfileError::Angle(1)
    );
    assert_eq!(
        new(&[f64::NAN], &[0.0], 1).unwrap_err(),
        ProfileError::Angle(0)
    );
    let negative = ProfileMap::octahedral(1, vec![-1.0]).unwrap_err();
    assert_eq!(negative, ProfileError::Value(0));
    assert!(ProfileMap::equirectangular([2, 2], vec![1.0]).is_err());
}

/// A profile in the world's own space.
fn in_world(kind: ProfileKind) -> Profile {
    Profile::new(kind, LightSpace::WORLD)
}

fn table(vertical: &[f64], horizontal: &[f64], values: &[f32]) -> ProfileKind {
    let radians = |d: &[f64]| d.iter().map(|d| d.to_radians()).collect();
    let table = ProfileTable::new(radians(vertical), radians(horizontal), values.to_vec());
    ProfileKind::Table(Arc::new(table.unwrap()))
}

/// The mean of a profile over all directions and its Lambertian mean by Gauss' rule between knots
/// of both angles, in degrees: what lies between them is smooth.
fn quadrature(profile: &Profile, vertical: &[f64], horizontal: &[f64]) -> (DVec3, DVec3) {
    let nodes = gauss_legendre(16);
    let mut sums = (DVec3::ZERO, DVec3::ZERO);
    for (k, weigh) in [|_| 1.0, |c: f64| 4.0 * c.max(0.0)].into_iter().enumerate() {
        let channel = |i: usize| -> f64 {
            let around = |theta: f64| -> f64 {
                let at = |phi: f64| {
                    let ((s, c), (sin, cos)) = (theta.sin_cos(), phi.sin_cos());
                    profile.factor(DVec3::new(s * cos, s * sin, c))[i] * weigh(c) * s
                };
                let pairs = horizontal
                    .windows(2)
                    .map(|p| [p[0], p[1]].map(f64::to_radians));
                pairs.map(|[a, b]| nodes.integrate(a, b, at)).sum()
            };
            let pairs = vertical
                .windows(2)
                .map(|p| [p[0], p[1]].map(f64::to_radians));
            let whole: f64 = pairs.map(|[a, b]| nodes.integrate(a, b, around)).sum();
            whole / (4.0 * PI)
        };
        let sum = DVec3::new(channel(0), channel(1), channel(2));
        *[&mut sums.0, &mut sums.1][k] = sum;
    }
    sums
}

/// Tables and images are linear between their angles: their means are closed forms, which
/// quadrature of the lookup itself meets.
#[test]
fn means_of_tables_and_images_are_integrals_of_the_lookup() {
    let values: Vec<f32> = (0..20_u16).map(|k| f32::from(k * 7 % 11)).collect();
    let turns = [0.0, 30.0, 100.0, 270.0];
    let image: Vec<f32> = (0..60_u16).map(|k| f32::from(k * 13 % 17)).collect();
    let map = ProfileMap::equirectangular([5, 4], image).unwrap();
    let rows = [0.0, 22.5, 67.5, 90.0, 112.5, 157.5, 180.0];
    let columns = [0.0, 36.0, 108.0, 180.0, 252.0, 324.0, 360.0];
    for (kind, vertical, horizontal) in [
        (
            table(&[0.0, 20.0, 70.0, 100.0, 180.0], &turns, &values),
            &[0.0, 20.0, 70.0, 90.0, 100.0, 180.0][..],
            &[0.0, 30.0, 100.0, 270.0, 360.0][..],
        ),
        // Dark below its first angle and beyond its last.
        (
            table(&[80.0, 85.0, 95.0, 100.0, 130.0], &turns, &values),
            &[80.0, 85.0, 90.0, 95.0, 100.0, 130.0],
            &[0.0, 30.0, 100.0, 270.0, 360.0],
        ),
        (
            table(&[0.0, 90.0], &[0.0], &[3.0, 1.0]),
            &[0.0, 90.0],
            &[0.0, 360.0],
        ),
        (ProfileKind::Map(Arc::new(map)), &rows, &columns),
    ] {
        // The Lambertian mean of an image is by the cosines in the middles of cells.
        let is_image = matches!(kind, ProfileKind::Map(_));
        let profile = in_world(kind);
        let (mean, lambert) = quadrature(&profile, vertical, horizontal);
        // 16 nodes of lines times sines and cosines, by 10 for the roundings of the sums.
        let tolerance = 100.0 * f64::EPSILON * mean.max_element();
        let off = (profile.mean() - mean).abs().max_element();
        assert!(off < tolerance, "{mean}: {off:e}");
        let off = profile.lambertian_mean() - lambert.element_sum() / 3.0;
        let by_cells = if is_image {
            1e-5 * mean.max_element()
        } else {
            0.0
        };
        assert!(off.abs() < tolerance + by_cells, "{lambert}: {off:e}");
    }
}

/// A beam that is even up to an angle b and falls linearly to zero at 1.2 b has, over 4π, the
/// volume of a truncated cone, (1 + 1.2 + 1.2²) b²/12, but for terms of b⁴.
#[test]
fn the_narrowest_beams_have_their_means() {
    for b in [1.0, 1e-1, 1e-3, 1e-5, 1e-7_f64] {
        let beam = table(&[0.0, b, 1.2 * b, 90.0], &[0.0], &[1.0, 1.0, 0.0, 0.0]);
        let (beam, radians) = (in_world(beam), b.to_radians());
        let want = 3.64 * radians * radians / 12.0;
        let relative = beam.mean().x / want - 1.0;
        // sin θ is θ but for θ²/6, and roundings.
        let tolerance = radians * radians + 1e-12;
        assert!(relative.abs() < tolerance, "{b}: {relative:e}");
        let lambert = beam.lambertian_mean() / (4.0 * want) - 1.0;
        assert!(lambert.abs() < 4.0 * tolerance, "{b}: {lambert:e}");
        // Half way down the flank.
        let theta = 1.1 * radians;
        let half = beam.factor(DVec3::new(theta.sin(), 0.0, theta.cos())).x;
        assert!((half - 0.5).abs() < 1e-8, "{b}: {half}");
    }
}

/// An equal-area image has the mean of its pixels over all directions. Its Lambertian mean is
/// computed from midpoints of 64 × 64 parts of each pixel, whose error is of the order of the
/// square of their size.
#[test]
fn means_of_equal_area_images_are_those_of_their_pixels() {
    for side in [1, 2, 3, 5_usize] {
        let values: Vec<f32> = (0..3 * side * side).map(|k| (k * 13 % 7) as f32).collect();
        let map = ProfileMap::octahedral(side, values.clone()).unwrap();
        let map = in_world(ProfileKind::Map(Arc::new(map.nearest())));
        let pixel = |i: usize, j: usize| {
            let k = 3 * (j * side + i);
            DVec3::from([0, 1, 2].map(|c| f64::from(values[k + c])))
        };
        let (mut mean, mut lambert) = (DVec3::ZERO, 0.0);
        let fine = 64 * side;
        for (a, b) in (0..fine).flat_map(|a| (0..fine).map(move |b| (a, b))) {
            let place = [a, b].map(|k| (k as f64 + 0.5) / fine as f64);
            let (w, value) = (square_to_sphere(place), pixel(a / 64, b / 64));
            assert_eq!(map.factor(w), value, "{:?}", sphere_to_square(w));
            mean += value / (fine * fine) as f64;
            lambert += 4.0 * w.z.max(0.0) * value.element_sum() / (3 * fine * fine) as f64;
        }
        assert!(map.mean().distance(mean) < 1e-12 * mean.length());
        // The cosine's second derivatives are at most 2, in parts of 2/fine; and as above.
        let tolerance = 4.0 * 6.0 * (2.0 / fine as f64).powi(2) / 6.0 + 1e-5 * mean.max_element();
        let off = (map.lambertian_mean() - lambert).abs();
        assert!(off < tolerance, "{side}: {off:e}");
    }
}

/// What lies in a light's space is where its transform takes it, and densities change by the
/// stretch: the solid angles of small triangles say so.
#[test]
fn light_spaces_are_linear_maps_of_directions() {
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let scale = |x: f64, y: f64, z: f64| DMat3::from_diagonal(DVec3::new(x, y, z));
    for (matrix, is_rigid) in [
        (turn, true),
        (turn * scale(-1e-150, 1e-150, 1e-150), true),
        (scale(3e150, 3e150, 3e150) * turn, true),
        (turn * scale(1.0, 2.0, 1.0), false),
        (scale(0.5, -3.0, 1.0) * turn, false),
    ] {
        let space = LightSpace::new(matrix).unwrap();
        assert_eq!(space.is_rigid(), is_rigid);
        for w in [DVec3::X, DVec3::new(0.36, -0.48, 0.8)] {
            let along = (matrix * w).normalize();
            assert!(space.to_world(w).distance(along) < 1e-14);
            assert!(space.to_light(along).distance(w) < 1e-14);
            let (d, frame) = (1e-5, Frame::from_normal(along));
            let at = |u: f64, v: f64| {
                let w = along + frame.x * (d * u) + frame.y * (d * v);
                space.to_light(w.normalize())
            };
            let (u, v) = (at(1.0, 0.0) - at(-1.0, 0.0), at(0.0, 1.0) - at(0.0, -1.0));
            let stretch = u.cross(v).length() / (4.0 * d * d);
            assert!((space.stretch(along) / stretch - 1.0).abs() < 1e-8);
        }
    }
    // One in another: the inner one is applied first on the way to the world.
    let (inner, outer) = (LightSpace::new(turn).unwrap(), scale(1.0, 2.0, -1.0));
    let both = inner.within(&LightSpace::new(outer).unwrap());
    let w = DVec3::new(0.36, -0.48, 0.8);
    assert!(both.to_world(w).distance((outer * turn * w).normalize()) < 1e-14);
    for flat in [scale(1.0, 0.0, 1.0), DMat3::ZERO, scale(1.0, f64::NAN, 1.0)] {
        assert_eq!(LightSpace::new(flat), None);
    }
}

/// The part of a table that a surface cannot send is below its horizon.
#[test]
fn the_part_behind_is_below_the_horizon() {
    for (kind, want) in [
        (table(&[0.0, 180.0], &[0.0], &[1.0, 1.0]), 0.5),
        (table(&[0.0, 90.0], &[0.0], &[1.0, 1.0]), 0.0),
        (table(&[90.0, 180.0], &[0.0], &[0.0, 1.0]), 1.0),
        // ∫ (1 − θ/π) sin θ dθ is 1 over all angles, and 1/π of it is below.
        (table(&[0.0, 180.0], &[0.0], &[1.0, 0.0]), 1.0 / PI),
        (ProfileKind::CosinePower(2.0), 0.0),
    ] {
        let part = in_world(kind).part_behind();
        assert!((part - want).abs() < 1e-14, "{part} {want}");
    }
}

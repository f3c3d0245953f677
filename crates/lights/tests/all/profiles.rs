//! Profiles: means, tables, images, and what is none.

use linelit_geometry::{DVec3, Frame};
use linelit_lights::{Falloff, Profile, ProfileError, ProfileKind, ProfileMap, ProfileTable};
use linelit_testkit::quadrature::gauss_legendre;
use std::f64::consts::PI;
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

/// Means in closed form are those of quadrature between the cones.
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
                    profile.factor(w) * weight(c)
                })
            };
            knots.windows(2).map(piece).sum()
        };
        let (mean, lambert) = (integral(&|_| 0.5), integral(&|c| 2.0 * c.max(0.0)));
        // 64 nodes of polynomials, and of cos^50.5: to rounding of the directions next to the pole.
        assert!((profile.mean() - mean).abs() < 1e-6, "{name}: {mean}");
        assert!(
            (profile.lambertian_mean() - lambert).abs() < 1e-6,
            "{name}: {lambert}"
        );
        let twice = profile.clone().scaled(2.0);
        assert!((twice.mean() - 2.0 * profile.mean()).abs() < 1e-15);
        let w = frame.to_world(DVec3::new(0.28, 0.0, 0.96));
        assert_eq!(
            twice.factor(w).to_bits(),
            (2.0 * profile.factor(w)).to_bits()
        );
        // About another normal the same cosine has the same factor.
        let on = profile.on_surface(DVec3::Y, DVec3::new(0.28, 0.96, 0.0));
        assert!((on - profile.factor(w)).abs() < 1e-12, "{name}");
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
        profile.factor(DVec3::new(s * phi.cos(), s * phi.sin(), c))
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
    let map = ProfileMap::octahedral(2, vec![3.0; 4]).unwrap();
    let map = Profile::new(ProfileKind::Map(Arc::new(map)), world);
    // The midpoint rule of 450 rows errs by (π/450)²/24 of the integral.
    assert!((map.mean() - 3.0).abs() < 1e-5, "{}", map.mean());
    assert!(
        (map.lambertian_mean() - 3.0).abs() < 1e-4,
        "{}",
        map.lambertian_mean()
    );
    let map = ProfileMap::equirectangular([4, 2], vec![1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    let map = Profile::new(ProfileKind::Map(Arc::new(map.unwrap())), world);
    assert_eq!((map.factor(DVec3::Z), map.factor(DVec3::NEG_Z)), (1.0, 0.0));
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

//! These tests compare profiles with known values in single directions, to rounding.

use crate::profiles::profiles;
use linelit_geometry::{DVec3, Frame};
use linelit_lights::{Falloff, Profile, ProfileKind, ProfileMap, ProfileTable};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

const WORLD: Frame = Frame {
    x: DVec3::X,
    y: DVec3::Y,
    z: DVec3::Z,
};

/// The direction at an angle from the axis and one around it.
fn direction(theta: f64, phi: f64) -> DVec3 {
    let ((st, ct), (sp, cp)) = (theta.sin_cos(), phi.sin_cos());
    DVec3::new(st * cp, st * sp, ct)
}

/// Falloffs half and a quarter of the way between the cosines of both cones, and what they
/// integrate to: over the sphere, and by the cosine on a surface.
#[test]
fn cones_are_their_polynomials() {
    let [inner, outer] = [0.75, 0.25];
    let falloffs = [
        // t² (3 − 2t), t⁴ and t² at ½ and ¼, and ∫ of each over t, and of each times t.
        (Falloff::Smooth, [0.5, 0.15625], [0.5, 0.35]),
        (Falloff::Quartic, [0.0625, 0.00390625], [0.2, 1.0 / 6.0]),
        (Falloff::Quadratic, [0.25, 0.0625], [1.0 / 3.0, 0.25]),
    ];
    for (falloff, values, [sum, moment]) in falloffs {
        let [cos_inner, cos_outer] = [inner, outer];
        let kind = ProfileKind::Cone {
            cos_inner,
            cos_outer,
            falloff,
        };
        let profile = Profile::new(kind, WORLD);
        let at = |c: f64| profile.factor(DVec3::new((1.0 - c * c).sqrt(), 0.0, c)).x;
        for (t, want) in [(0.5, values[0]), (0.25, values[1]), (1.1, 1.0), (-0.1, 0.0)] {
            let got = at(outer + (inner - outer) * t);
            assert!(
                (got - want).abs() < 1e-15,
                "{falloff:?} {t}: {got} for {want}"
            );
        }
        // ½ ∫ f dc, and ∫ 2 c f dc, with c = outer + height t.
        let height = inner - outer;
        let mean = 0.5 * ((1.0 - inner) + height * sum);
        let lambert = (1.0 - inner * inner) + 2.0 * height * (outer * sum + height * moment);
        assert!(
            (profile.mean().x - mean).abs() < 1e-15,
            "{falloff:?}: {mean}"
        );
        assert!(
            (profile.lambertian_mean() - lambert).abs() < 1e-15,
            "{falloff:?}: {lambert}"
        );
        // A cone half beyond the surface: of c = −½ + t, what is above zero begins at t = ½.
        let kind = ProfileKind::Cone {
            cos_inner: 0.5,
            cos_outer: -0.5,
            falloff,
        };
        let half = match falloff {
            // ∫ 2 (t − ½) f dt from ½ to 1.
            Falloff::Smooth => {
                2.0 * ((0.75 - 0.4 - 0.5 * (1.0 - 0.5))
                    - (3.0 / 64.0 - 1.0 / 80.0 - 0.5 * (1.0 / 8.0 - 1.0 / 32.0)))
            }
            Falloff::Quartic => 2.0 * ((1.0 - 1.0 / 64.0) / 6.0 - 0.1 * (1.0 - 1.0 / 32.0)),
            Falloff::Quadratic => 2.0 * ((1.0 - 1.0 / 16.0) / 4.0 - (1.0 - 1.0 / 8.0) / 6.0),
        };
        let lambert = 0.75 + half;
        let got = Profile::new(kind, WORLD).lambertian_mean();
        assert!(
            (got - lambert).abs() < 1e-14,
            "{falloff:?}: {got} for {lambert}"
        );
    }
}

/// cᵖ, with mean 1/(2(p + 1)) over the sphere and 2/(p + 2) on a surface.
#[test]
fn powers_of_the_cosine_are_powers() {
    for power in [0.0, 1.0, 2.5, 50.0] {
        let profile = Profile::new(ProfileKind::CosinePower(power), WORLD);
        let got = profile.factor(DVec3::new(0.6, 0.0, 0.8)).x;
        assert!(
            (got / 0.8_f64.powf(power) - 1.0).abs() < 1e-13,
            "{power}: {got}"
        );
        assert!((profile.mean().x * (2.0 * power + 2.0) - 1.0).abs() < 1e-14);
        assert!((profile.lambertian_mean() * (power + 2.0) / 2.0 - 1.0).abs() < 1e-14);
    }
}

/// Tables between rows, columns, the last column and the first, of uneven angles; and on a surface,
/// where horizontal angles begin in the direction of the profile's x.
#[test]
fn tables_are_linear_between_their_angles() {
    let vertical = vec![0.0, 0.5, 1.5];
    let horizontal = vec![0.25, 1.0, 4.0];
    let values = vec![8.0, 4.0, 1.0, 8.0, 2.0, 3.0, 8.0, 6.0, 5.0];
    let table = Arc::new(ProfileTable::new(vertical, horizontal, values).expect("a table"));
    let profile = Profile::new(ProfileKind::Table(table), WORLD);
    // From the last angle on to the first, 4 to 2π + ¼.
    let gap = TAU + 0.25 - 4.0;
    for (theta, phi, want) in [
        (0.5, 0.25, 4.0),
        (0.125, 1.0, 8.0 - 0.25 * 6.0),
        (0.75, 1.0, 2.0 + 0.25),
        (0.5, 0.4375, 4.0 - 0.25 * 2.0),
        (0.5, 1.75, 2.0 + 0.25 * 4.0),
        (1.0, 1.75, 2.5 + 0.25 * 3.0),
        (0.5, 4.0 + 0.25 * gap, 6.0 - 0.25 * 2.0),
        (0.5, 0.25 - 0.25 * gap, 4.0 + 0.25 * 2.0),
        (1.6, 1.0, 0.0),
    ] {
        let w = direction(theta, phi);
        let got = profile.factor(w).x;
        // ε over the smallest gap of angles, times the largest step.
        assert!(
            (got - want).abs() < 1e-14,
            "{theta} {phi}: {got} for {want}"
        );
        // About y, with x as it is, z is where −y was.
        let on = profile.on_surface(DVec3::Y, DVec3::new(w.x, w.z, -w.y)).x;
        assert!((on - want).abs() < 1e-14, "{theta} {phi}: {on} for {want}");
    }
}

/// Tables are linear over 720 steps, so that a cosine's integral is right to (π/720)²/12 of the
/// integral of its second derivative, and values are `f32`.
#[test]
fn means_of_tables_of_cosines_are_those_of_cosines() {
    let rows: Vec<f64> = (0..=720).map(|k| PI * f64::from(k) / 720.0).collect();
    #[allow(clippy::cast_possible_truncation, reason = "a table is f32")]
    let values = rows.iter().map(|t| (1.0 + t.cos()) as f32).collect();
    let table = ProfileTable::new(rows, vec![0.0], values).expect("a table");
    let profile = Profile::new(ProfileKind::Table(Arc::new(table)), WORLD);
    // ½ ∫ (1 + c) dc = 1, ∫ 2 c (1 + c) dc = 5/3.
    assert!(
        (profile.mean().x - 1.0).abs() < 5e-6,
        "{}",
        profile.mean().x
    );
    let lambert = profile.lambertian_mean();
    assert!((lambert * 0.6 - 1.0).abs() < 1e-5, "{lambert}");
}

/// Middles of pixels, and halves and quarters of the way between.
#[test]
fn maps_are_linear_between_the_middles_of_pixels() {
    let values = vec![1.0, 2.0, 4.0, 8.0, 3.0, 5.0, 9.0, 7.0];
    let map = ProfileMap::equirectangular([4, 2], values).expect("a map");
    let profile = Profile::new(ProfileKind::Map(Arc::new(map)), WORLD);
    let (turn, row) = (FRAC_PI_2, FRAC_PI_2);
    for (i, j, want) in [
        (0.0, 0.0, 1.0),
        (2.0, 1.0, 9.0),
        (0.25, 0.0, 1.25),
        (1.5, 0.0, 3.0),
        (1.0, 0.25, 2.75),
        (2.5, 0.75, 0.25 * 6.0 + 0.75 * 8.0),
        (3.25, 0.0, 0.75 * 8.0 + 0.25),
        (-0.25, 1.0, 0.75 * 3.0 + 0.25 * 7.0),
        (1.0, -0.3, 2.0),
    ] {
        let got = profile
            .factor(direction((j + 0.5) * row, (i + 0.5) * turn))
            .x;
        assert!((got - want).abs() < 1e-13, "{i} {j}: {got} for {want}");
    }
}

/// What a surface takes is what stands at the same angle about its normal, scaled.
#[test]
fn scales_and_normals_change_nothing_else() {
    for (name, kind) in profiles() {
        let (n, tilted) = (DVec3::new(0.0, 0.6, 0.8), Frame::from_normal(DVec3::X));
        let profile = Profile::new(kind, tilted).scaled(3.0);
        for c in [-0.9_f64, -0.1, 0.2, 0.55, 0.9] {
            let side = DVec3::new((1.0 - c * c).sqrt(), 0.0, 0.0);
            let [about, on] = [DVec3::X * c + DVec3::Y * side.x, n * c + side];
            let (want, got) = (profile.factor(about), profile.on_surface(n, on));
            assert!(
                (got - want).abs().max_element() < 1e-12 * (1.0 + want.max_element()),
                "{name} {c}: {got} for {want}"
            );
        }
    }
}

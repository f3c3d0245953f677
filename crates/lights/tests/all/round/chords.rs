//! These tests check points of disks by projected solid angle, and the vector irradiance of a disk.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "cells of the unit square"
)]

use linelit_geometry::{DVec3, Frame};
use linelit_lights::{Disk, DiskChords, DiskCone, PointTechnique};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::quadrature::gauss_legendre;
use linelit_testkit::rng::SplitMix64;
use proptest::prelude::*;
use std::f64::consts::TAU;

/// Name, disk seen from the origin, and horizons.
fn views() -> [(&'static str, Disk, Vec<DVec3>); 6] {
    let disk = |center: [f64; 3], normal: [f64; 3], radius| Disk {
        center: center.into(),
        normal: DVec3::from(normal).normalize(),
        radius,
    };
    let tilted = DVec3::new(0.6, 0.0, 0.8);
    let ordinary = disk([1.0, -2.0, 1.5], [0.6, 0.0, 0.8], 1.3);
    let upright = disk([2.0, 0.3, 0.2], [-0.9, 0.1, 0.2], 1.1);
    let both = vec![DVec3::Z, DVec3::new(-0.3, 0.9, 0.5).normalize()];
    [
        ("above", ordinary, vec![DVec3::Z]),
        (
            "on the axis",
            disk([0.0, 0.0, 2.0], [0.0, 0.0, 1.0], 1.0),
            vec![tilted],
        ),
        (
            "tiny",
            disk([1.0, 2.0, 1.5], [0.3, 0.4, 1.0], 1e-6),
            vec![DVec3::Z],
        ),
        (
            "huge",
            disk([30.0, 10.0, 5.0], [0.0, 0.1, 1.0], 50.0),
            vec![DVec3::Z],
        ),
        ("cut", upright, vec![DVec3::Z]),
        ("cut twice", upright, both),
    ]
}

/// Samples follow their density, on the square around the disk.
#[test]
fn chords_obey_the_laws() {
    let tests = views().len() * 2;
    for (name, disk, horizons) in views() {
        for angle in [0.3, 2.1] {
            let chords = DiskChords::new(&disk, angle, DVec3::ZERO, &horizons);
            let frame = Frame::from_normal(disk.normal);
            let place = |p: DVec3| {
                let out = (p - disk.center) / disk.radius;
                [frame.x.dot(out), frame.y.dot(out)].map(|x| 0.5 + 0.5 * x)
            };
            let point = |[a, b]: [f64; 2]| {
                let [x, y] = [a, b].map(|x| 2.0 * x - 1.0);
                disk.center + (frame.x * x + frame.y * y) * disk.radius
            };
            // Densities per solid angle over the square of side 2 r.
            let density = |uv: [f64; 2]| {
                let p = point(uv);
                let r = p.length();
                let area = disk.normal.dot(p).abs() / (r * r * r);
                chords.pdf(p).value() * area * 4.0 * disk.radius * disk.radius
            };
            assert_histogram(
                &format!("{name} {angle}"),
                sidak(1e-4, tests),
                |u| place(chords.sample(u).point),
                density,
            );
        }
    }
}

/// χ² of samples in 12 × 12 cells of the square against the integrals of the density, which is one
/// in all: cells at the rim by a fine rule of midpoints.
fn assert_histogram(
    name: &str,
    alpha: f64,
    sample: impl Fn([f64; 2]) -> [f64; 2],
    density: impl Fn([f64; 2]) -> f64,
) {
    const CELLS: usize = 12;
    const FINE: usize = 96;
    const COUNT: usize = 100_000;
    let mut rng = SplitMix64::new(17);
    let mut counts = vec![0_u64; CELLS * CELLS];
    for _ in 0..COUNT {
        let at = sample([rng.next_f64(), rng.next_f64()]);
        let [i, j] = at.map(|x| ((x * CELLS as f64) as usize).min(CELLS - 1));
        counts[CELLS * j + i] += 1;
    }
    let mut expected = vec![0.0; CELLS * CELLS];
    let side = CELLS * FINE;
    for (j, i) in (0..side).flat_map(|j| (0..side).map(move |i| (j, i))) {
        let at = [i, j].map(|k| (k as f64 + 0.5) / side as f64);
        expected[CELLS * (j / FINE) + i / FINE] += density(at) / (side * side) as f64;
    }
    let mass: f64 = expected.iter().sum();
    // The rule's error: the rim, where the density of offsets has the singularity of its cosine,
    // and horizons cross some 4 × 1,152 of its 1,152² squares.
    assert!((mass - 1.0).abs() < 5e-3, "{name}: {mass}");
    let expected: Vec<f64> = expected.iter().map(|e| e / mass * COUNT as f64).collect();
    let test = chi2_test(&counts, &expected, 20.0);
    assert!(test.p_value > alpha, "{name}: {test:?}");
}

/// The mean of f/p is the integral over the part above the horizons, and samples come back.
#[test]
fn chords_cover_the_part_above_the_horizons() {
    let mut rng = SplitMix64::new(5);
    for (name, disk, horizons) in views() {
        let n = horizons[0];
        let above = |p: DVec3| horizons.iter().all(|n| n.dot(p) > 0.0);
        let frame = Frame::from_normal(disk.normal);
        let rule = gauss_legendre(400);
        let integral = rule.integrate_2d([0.0, 1.0], [0.0, TAU], |r, turn| {
            let (s, c) = turn.sin_cos();
            let p = disk.center + (frame.x * c + frame.y * s) * (disk.radius * r);
            let d = p.length();
            let value = f64::from(u8::from(above(p))) * n.dot(p) / d;
            value * r * disk.radius.powi(2) * disk.normal.dot(p).abs() / d.powi(3)
        });
        let size = (disk.center.length() + disk.radius) / disk.radius;
        {
            let chords = DiskChords::new(&disk, 1.1, DVec3::ZERO, &horizons);
            let (count, mut sum, mut squares) = (40_000, 0.0, 0.0);
            for _ in 0..count {
                let u = [rng.next_f64(), rng.next_f64()];
                let s = chords.sample(u);
                let value = n.dot(s.point) / s.point.length() / s.pdf.value();
                assert!(s.pdf.is_positive() && value > -1e-12, "{name} {u:?}");
                assert!(s.point.distance(disk.center) <= disk.radius * (1.0 + 1e-14 * size));
                sum += value;
                squares += value * value;
                // Next to the ends of a chord and of the range, places are the roots of numbers.
                let Some(back) = chords.invert(s.point) else {
                    assert!(u.iter().any(|u| (u - 0.5).abs() > 0.499), "{name} {u:?}");
                    continue;
                };
                let again = chords.sample(back).point;
                let error = again.distance(s.point) / disk.radius;
                assert!(error < 1e-7, "{name} {u:?} {back:?} {error:e}");
            }
            let mean = sum / f64::from(count);
            let sigma =
                ((squares / f64::from(count) - mean * mean).max(0.0) / f64::from(count)).sqrt();
            // Five σ, and 3e-3 of quadrature over the edge of the horizon.
            let slack = 5.0 * sigma
                + integral.abs()
                    * if horizons.len() > 1 || name == "cut" {
                        3e-3
                    } else {
                        1e-7
                    };
            assert!(
                (mean - integral).abs() < slack,
                "{name}: {mean} {integral} {sigma}"
            );
        }
    }
}

/// Nothing above the horizon, or in the disk's plane.
#[test]
fn chords_of_nothing_have_no_density() {
    let disk = Disk {
        center: DVec3::new(3.0, 1.0, 0.0),
        normal: DVec3::X,
        radius: 1.0,
    };
    let (below, inside) = (DVec3::Z * 2.0, disk.center + DVec3::Y);
    for x in [below, inside] {
        let chords = DiskChords::new(&disk, 0.3, x, &[DVec3::Z]);
        assert!(!chords.sample([0.4, 0.3]).pdf.is_positive());
        assert!(!chords.pdf(disk.center).is_positive());
        assert!(chords.invert(disk.center).is_none());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: linelit_testkit::cases::cases(200), ..ProptestConfig::default() })]

    /// The closed form against the integral over the disk.
    #[test]
    fn the_vector_irradiance_is_the_integral(
        center in prop::array::uniform3(-2.0..2.0f64), n in prop::array::uniform3(-1.0..1.0f64), radius in 0.05..2.0f64,
    ) {
        let Some(normal) = DVec3::from(n).try_normalize() else { return Ok(()) };
        let disk = Disk { center: center.into(), normal, radius };
        let height = normal.dot(disk.center).abs();
        // Nearer the plane the quadrature does not follow.
        prop_assume!(height > 0.3 * radius && height > 0.1);
        let frame = Frame::from_normal(normal);
        let rule = gauss_legendre(160);
        let integral = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
            rule.integrate_2d([0.0, 1.0], [0.0, TAU], |r, turn| {
                let (s, c) = turn.sin_cos();
                let p = disk.center + (frame.x * c + frame.y * s) * (radius * r);
                let d = p.length();
                axis.dot(p) / d * r * radius * radius * normal.dot(p).abs() / d.powi(3)
            })
        });
        let closed = DiskCone::new(&disk, DVec3::ZERO).vector_irradiance();
        let error = (DVec3::from(integral) - closed).length() / closed.length();
        prop_assert!(error < 1e-9, "{disk:?}: {integral:?} {closed} {error:e}");
    }
}

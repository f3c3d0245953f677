//! The laws of chords across disks, and the vector irradiance of a disk.

use linelit_geometry::{DVec3, Frame, intervals::Interval};
use linelit_lights::{Disk, PointTechnique};
use linelit_spheres::{ChordMeasure, DiskChords, DiskCone};
use linelit_testkit::chi2::sidak;
use linelit_testkit::laws::Technique;
use linelit_testkit::quadrature::gauss_legendre;
use linelit_testkit::rng::SplitMix64;
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

const MEASURES: [ChordMeasure; 4] = [
    ChordMeasure::Uniform,
    ChordMeasure::Length,
    ChordMeasure::SolidAngle,
    ChordMeasure::Projected,
];

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

/// Offsets, and places along a chord with a part hidden, follow their densities.
#[test]
fn chords_obey_the_laws() {
    let tests = views().len() * MEASURES.len() * 4;
    for (name, disk, horizons) in views() {
        for (measure, angle) in MEASURES.iter().flat_map(|m| [0.3, 2.1].map(|a| (*m, a))) {
            let chords = DiskChords::new(&disk, angle, DVec3::ZERO, &horizons, measure);
            let [first, last] = [0.0, 1.0 - 1e-16].map(|u| chords.sample(u).offset);
            let size = (disk.center.length() + disk.radius) / disk.radius;
            let range = last - first;
            let sixteenth = |k: u32| first + 0.5 * range * (1.0 - (PI * f64::from(k) / 16.0).cos());
            let kinks: Vec<f64> = (1..16).map(sixteenth).collect();
            let laws = Technique::new(format!("{name} {measure:?} {angle}"))
                .alpha(sidak(1e-4, tests))
                // Coordinates are rounded, over the size of the disk.
                .round_trip(256.0 * f64::EPSILON * size)
                // Nor are differences of such coordinates sure in a tiny scene.
                .sure(if name == "tiny" { 0.0 } else { 0.2 })
                .density(if name == "tiny" { f64::INFINITY } else { 3e-7 })
                .mass(1e-7);
            laws.clone().kinks(&kinks).check_1d(
                [first - 1e-12 * range, last + 1e-12 * range],
                |u| chords.sample(u.clamp(1e-12, 1.0 - 1e-12)).offset,
                |offset| chords.offset_pdf(offset).value(),
                |offset| chords.invert_offset(offset),
            );
            let chord = chords.sample(0.4);
            let (p0, along) = (chord.segment.p0, chord.segment.direction());
            let length = chord.segment.length();
            let visible = [Interval::new(0.1, 0.3), Interval::new(0.6, 0.9)];
            let t_of = |p: DVec3| (p - p0).dot(along) / length;
            let density = |t: f64| {
                let p = chord.segment.at(t);
                let r = p.length();
                let cosine = disk.normal.dot(p).abs() / r;
                let joint = chords.joint_pdf(p, &visible).value();
                joint * cosine / (r * r) / chord.pdf.value() * length
            };
            laws.kinks(&[0.1, 0.3, 0.6, 0.9]).round_trip(1.0).check_1d(
                [0.0, 1.0],
                |u| t_of(chords.point(&chord, &visible, u).point),
                density,
                |_| Some(0.5),
            );
        }
    }
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
        for measure in MEASURES {
            let chords = DiskChords::new(&disk, 1.1, DVec3::ZERO, &horizons, measure);
            let (count, mut sum, mut squares) = (40_000, 0.0, 0.0);
            for _ in 0..count {
                let u = [rng.next_f64(), rng.next_f64()];
                let s = PointTechnique::sample(&chords, u);
                let value = n.dot(s.point) / s.point.length() / s.pdf.value();
                assert!(
                    s.pdf.is_positive() && value > -1e-12,
                    "{name} {measure:?} {u:?}"
                );
                assert!(s.point.distance(disk.center) <= disk.radius * (1.0 + 1e-14 * size));
                sum += value;
                squares += value * value;
                // Next to the ends of a chord and of the range, places are the roots of numbers.
                let Some(back) = chords.invert(s.point) else {
                    assert!(u.iter().any(|u| (u - 0.5).abs() > 0.499), "{name} {u:?}");
                    continue;
                };
                let again = PointTechnique::sample(&chords, back).point;
                let error = again.distance(s.point) / disk.radius;
                assert!(error < 1e-7, "{name} {measure:?} {u:?} {back:?} {error:e}");
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
                "{name} {measure:?}: {mean} {integral} {sigma}"
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
    for (x, measure) in MEASURES
        .iter()
        .flat_map(|m| [below, inside].map(|x| (x, *m)))
    {
        let chords = DiskChords::new(&disk, 0.3, x, &[DVec3::Z], measure);
        assert!(!chords.sample(0.4).pdf.is_positive());
        assert!(
            !PointTechnique::sample(&chords, [0.4, 0.3])
                .pdf
                .is_positive()
        );
        assert!(
            !chords
                .joint_pdf(disk.center, &[Interval::UNIT])
                .is_positive()
        );
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

//! The laws of what samples spheres and disks: χ² at a million samples, densities integrate to one, round trips; on ordinary,
//! tiny, huge, grazing and far-from-origin lights.

use linelit_geometry::{DVec3, Frame};
use linelit_lights::{Disk, DiskCone, Sphere, SphereCap, SphereCone};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::quadrature::gauss_legendre;
use linelit_testkit::rng::SplitMix64;
use std::f64::consts::TAU;

/// Rings and sectors of equal area.
const RINGS: usize = 12;
const SECTORS: usize = 8;
const SAMPLES: u32 = 1_000_000;
/// Techniques and lights of this file.
const TESTS: usize = 30;

/// Counts samples by two coordinates in [0, 1), which are uniform by area, and compares with the integral of the density per
/// area. Returns p-value and total mass.
fn fit(
    total: f64,
    sample: impl Fn([f64; 2]) -> [f64; 2],
    density: impl Fn([f64; 2]) -> f64,
) -> (f64, f64) {
    let mut rng = SplitMix64::new(11);
    let mut counts = vec![0_u64; RINGS * SECTORS];
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "below n"
    )]
    let bin = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
    for _ in 0..SAMPLES {
        let [a, b] = sample([rng.next_f64(), rng.next_f64()]);
        counts[bin(a, RINGS) * SECTORS + bin(b, SECTORS)] += 1;
    }
    let rule = gauss_legendre(40);
    let mut expected = Vec::with_capacity(counts.len());
    for i in 0..RINGS {
        for j in 0..SECTORS {
            let range = |i: usize, n: usize| [i as f64 / n as f64, (i + 1) as f64 / n as f64];
            // Smooth in the root of the distance to either end, where rims are.
            let [a, b] = range(i, RINGS).map(|x| (1.0 - 2.0 * x).acos());
            let mass = rule.integrate_2d([a, b], range(j, SECTORS), |angle, y| {
                let x = 0.5 * (1.0 - angle.cos());
                density([x, y]) * total * 0.5 * angle.sin()
            });
            expected.push(mass * f64::from(SAMPLES));
        }
    }
    let mass = expected.iter().sum::<f64>() / f64::from(SAMPLES);
    (chi2_test(&counts, &expected, 5.0).p_value, mass)
}

/// Name, place of the shading point, distance of the centre, radius.
fn spheres() -> [(&'static str, DVec3, f64, f64); 6] {
    let far = DVec3::new(1e5, -2e5, 3e5);
    [
        ("ordinary", DVec3::ZERO, 4.0, 1.0),
        ("tiny", DVec3::ZERO, 1.0, 1e-6),
        ("huge and close", DVec3::ZERO, 1.001, 1.0),
        ("from inside", DVec3::ZERO, 0.5, 1.0),
        ("nearly touching", DVec3::ZERO, 3.0, 2.999),
        ("far from the origin", far, 2.0, 0.5),
    ]
}

#[test]
fn spheres_obey_the_laws() {
    let mut rng = SplitMix64::new(13);
    for (name, x, d, radius) in spheres() {
        let center = x + DVec3::new(0.3, 0.4, 0.866).normalize() * d;
        let sphere = Sphere { center, radius };
        let cone = SphereCone::new(&sphere, x);
        let visible = SphereCap::visible(&sphere, x);
        let whole = SphereCap::whole(&sphere);
        // ε of the coordinates, against the radius and against the distance of the nearest point.
        let slack = 64.0
            * f64::EPSILON
            * (1.0 + (d + center.abs().max_element()) / radius + d / (d - radius).abs());
        for _ in 0..100_000 {
            let u = [rng.next_f64(), rng.next_f64()];
            let s = cone.sample(u);
            assert!(s.pdf.is_positive());
            assert!(((s.point - center).length() / radius - 1.0).abs() < slack);
            // At the rim a rounded point may face away.
            if u[0] < 1.0 - slack {
                let back = cone.invert(s.point).expect("visible");
                assert!((back[0] - u[0]).abs() < slack, "{name} {u:?} {back:?}");
            }
            for cap in [&visible, &whole] {
                let p = cap.sample(u).point;
                let Some(back) = cap.invert(p) else {
                    assert!(u[0] > 1.0 - slack, "{name} {u:?}");
                    continue;
                };
                let round = slack / u[0].sqrt().min((1.0 - u[0]).sqrt());
                assert!((back[0] - u[0]).abs() < slack, "{name} {u:?} {back:?}");
                let turn = (back[1] - u[1]).abs();
                assert!(turn.min(1.0 - turn) < round, "{name} {u:?} {back:?}");
            }
        }
        let seen = |p: DVec3| visible.invert(p).unwrap_or([1.0 - 1e-16, 0.0]);
        let at = |u: [f64; 2]| visible.sample(u).point;
        let area = 1.0 / visible.sample([0.5; 2]).pdf.value();
        let (p, mass) = fit(
            area,
            |u| seen(cone.sample(u).point),
            |u| {
                let v = at(u) - x;
                let cosine = sphere.normal(at(u)).dot(v.normalize());
                cone.pdf(at(u)).to_area(v.length_squared(), cosine).value()
            },
        );
        assert!(p > sidak(0.01, TESTS), "cone, {name}: p = {p:e}");
        // The rim is where the cosine's root ends: the rule's error there, over 40 nodes cubed; for grazing cones the
        // coordinates round by ε d/(d − R).
        assert!((mass - 1.0).abs() < 1e-4, "cone, {name}: ∫ = {mass}");
        let (p, mass) = fit(area, |u| seen(at(u)), |u| visible.pdf(at(u)).value());
        assert!(p > sidak(0.01, TESTS), "cap, {name}: p = {p:e}");
        assert!((mass - 1.0).abs() < 1e-9, "cap, {name}: ∫ = {mass}");
        let (p, mass) = fit(
            sphere.area(),
            |u| whole.invert(whole.sample(u).point).unwrap_or([0.0; 2]),
            |u| whole.pdf(whole.sample(u).point).value(),
        );
        assert!(p > sidak(0.01, TESTS), "whole, {name}: p = {p:e}");
        assert!((mass - 1.0).abs() < 1e-9, "whole, {name}: ∫ = {mass}");
    }
}

/// Name, shading point, disk.
fn disks() -> [(&'static str, DVec3, Disk); 6] {
    let disk = |center: [f64; 3], normal: [f64; 3], radius| Disk {
        center: center.into(),
        normal: DVec3::from(normal).normalize(),
        radius,
    };
    let o = DVec3::ZERO;
    let far = DVec3::new(1e5, -2e5, 3e5);
    let mut there = disk([0.5, 1.0, 2.0], [0.2, 0.1, 1.0], 1.0);
    there.center += far;
    [
        ("ordinary", o, disk([1.0, -2.0, 1.5], [0.6, 0.0, 0.8], 1.3)),
        (
            "on the axis",
            o,
            disk([0.0, 0.0, 2.0], [0.0, 0.0, 1.0], 1.0),
        ),
        ("tiny", o, disk([1.0, 2.0, 1.5], [0.3, 0.4, 1.0], 1e-6)),
        ("huge", o, disk([30.0, 10.0, 5.0], [0.0, 0.1, 1.0], 50.0)),
        ("grazing", o, disk([4.0, 0.0, 0.2], [0.0, 0.0, 1.0], 1.0)),
        ("far from the origin", far, there),
    ]
}

/// Coordinates that are uniform by area: the square of the radius and the turn.
fn polar(disk: &Disk, point: DVec3) -> [f64; 2] {
    let frame = Frame::from_normal(disk.normal);
    let v = (point - disk.center) / disk.radius;
    let (x, y) = (v.dot(frame.x), v.dot(frame.y));
    [(x * x + y * y).min(1.0), (y.atan2(x) / TAU).rem_euclid(1.0)]
}

fn from_polar(disk: &Disk, [a, b]: [f64; 2]) -> DVec3 {
    let frame = Frame::from_normal(disk.normal);
    let (s, c) = (b * TAU).sin_cos();
    disk.center + (frame.x * c + frame.y * s) * (disk.radius * a.sqrt())
}

#[test]
fn disks_obey_the_laws() {
    let mut rng = SplitMix64::new(17);
    for (name, x, disk) in disks() {
        let cone = DiskCone::new(&disk, x);
        let to = disk.center - x;
        let h = to.dot(disk.normal).abs();
        // ε of the coordinates, over the radius and over how edge-on the disk is seen.
        let extent = disk.center.abs().max_element() + x.abs().max_element();
        let slack = 64.0 * f64::EPSILON * (1.0 + extent / disk.radius) * (1.0 + to.length() / h);
        let (mut least, mut most, mut mean) = (f64::INFINITY, 0.0_f64, 0.0);
        for _ in 0..100_000 {
            let u = [rng.next_f64(), rng.next_f64()];
            let s = disk.sample(u);
            let back = disk.invert(s.point).expect("on the disk");
            let error = (back[0] - u[0]).abs() + (back[1] - u[1]).abs();
            assert!(error < slack, "{name}: {u:?} {back:?}");
            let s = cone.sample(u);
            assert!(s.pdf.is_positive(), "{name}: {u:?}");
            least = least.min(s.pdf.value());
            most = most.max(s.pdf.value());
            mean += 1.0 / s.pdf.value() / 100_000.0;
            let back = cone.invert(s.point).expect("on the disk");
            let again = cone.sample(back);
            let error = (again.point - s.point).length() / disk.radius;
            assert!(error < 16.0 * slack, "{name}: {u:?} {back:?} {error:e}");
            let p = cone.pdf(s.point).value();
            assert!(
                (p / s.pdf.value() - 1.0).abs() < 16.0 * slack,
                "{name}: {u:?}"
            );
        }
        assert!(most / least < 1.02, "{name}: {least} {most}");
        // The mean of 1/p is the solid angle: against the integral over the disk.
        let rule = gauss_legendre(200);
        let solid_angle = rule.integrate_2d([0.0, 1.0], [0.0, 1.0], |r, b| {
            let v = from_polar(&disk, [r * r, b]) - x;
            2.0 * r * disk.area() * v.dot(disk.normal).abs() / v.length().powi(3)
        });
        assert!(
            (mean / solid_angle - 1.0).abs() < 1e-3,
            "{name}: {mean} {solid_angle}"
        );
        let (p, mass) = fit(
            disk.area(),
            |u| polar(&disk, cone.sample(u).point),
            |u| {
                let point = from_polar(&disk, u);
                let v = point - x;
                let r = v.length();
                cone.pdf(point)
                    .to_area(r * r, v.dot(disk.normal) / r)
                    .value()
            },
        );
        assert!(p > sidak(0.01, TESTS), "cone, {name}: p = {p:e}");
        // The density is linear by pieces in the turn: kinks of 1 %.
        assert!((mass - 1.0).abs() < 1e-4, "cone, {name}: ∫ = {mass}");
        let (p, mass) = fit(
            disk.area(),
            |u| polar(&disk, disk.sample(u).point),
            |u| disk.pdf(from_polar(&disk, u)).value(),
        );
        assert!(p > sidak(0.01, TESTS), "area, {name}: p = {p:e}");
        assert!((mass - 1.0).abs() < 1e-12, "area, {name}: ∫ = {mass}");
    }
}

#[test]
fn degenerate_disks_have_no_density() {
    let disk = Disk {
        center: DVec3::new(3.0, 1.0, 0.0),
        normal: DVec3::Z,
        radius: 1.0,
    };
    for x in [DVec3::ZERO, disk.center, disk.center + DVec3::X] {
        let cone = DiskCone::new(&disk, x);
        let s = cone.sample([0.3, 0.7]);
        assert!(!s.pdf.is_positive() && s.point.is_finite());
        assert!(cone.invert(s.point).is_none());
    }
    let outside = disk.center + 1.1 * DVec3::Y;
    assert!(!DiskCone::new(&disk, DVec3::Z).pdf(outside).is_positive());
}

/// Hostile positions: tiny solid angles, points within 1e-9 of the disk, of its plane and of its rim.
#[test]
fn hostile_disks_stay_finite() {
    let mut rng = SplitMix64::new(23);
    for _ in 0..20_000 {
        let mut log = |lo: f64, hi: f64| 10_f64.powf(lo + (hi - lo) * rng.next_f64());
        let disk = Disk {
            center: DVec3::new(log(-3.0, 5.0), log(-3.0, 5.0), log(-9.0, 3.0)),
            normal: DVec3::Z,
            radius: log(-6.0, 5.0),
        };
        let cone = DiskCone::new(&disk, DVec3::ZERO);
        for _ in 0..20 {
            let u = [rng.next_f64(), rng.next_f64()];
            let s = cone.sample(u);
            assert!(s.pdf.is_positive() && s.point.is_finite(), "{disk:?} {u:?}");
            assert!(disk.invert(s.point).is_some(), "{disk:?} {u:?}");
            assert!(cone.pdf(s.point).is_positive(), "{disk:?} {u:?}");
        }
    }
}

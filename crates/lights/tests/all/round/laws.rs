//! These tests check the laws of the techniques for spheres and disks: χ² at a million samples,
//! densities that integrate to one, and round trips, on ordinary, tiny, huge, grazing and
//! far-from-origin lights.

use linelit_geometry::{DMat3, DVec3, Frame};
use linelit_lights::{
    Disk, DiskArea, DiskCone, PointTechnique, Sphere, SphereCap, SphereCone, SphereProjected,
    TransformedCone,
};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::quadrature::{gauss_kronrod, gauss_legendre};
use linelit_testkit::rng::SplitMix64;
use std::f64::consts::TAU;

/// Rings and sectors of equal area.
const RINGS: usize = 12;
const SECTORS: usize = 8;
const SAMPLES: u32 = 1_000_000;
/// Techniques and lights of this file.
const TESTS: usize = 42;

/// Counts samples by two coordinates in [0, 1), which are uniform by area, and compares with the
/// integral of the density per area. Returns p-value and total mass.
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
        // The rim is where the cosine's root ends: the rule's error there, over 40 nodes cubed; for
        // grazing cones the coordinates round by ε d/(d − R).
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

/// Name, shading point, disk. Name, the angle of the centre from the normal in degrees, distance,
/// radius, and place of the shading point.
fn projected_spheres() -> [(&'static str, f64, f64, f64, DVec3); 12] {
    let o = DVec3::ZERO;
    [
        ("ordinary", 30.0, 4.0, 1.0, o),
        ("overhead", 0.0, 4.0, 1.0, o),
        ("close", 20.0, 1.2, 1.0, o),
        ("tiny", 60.0, 1.0, 1e-6, o),
        ("huge", 10.0, 1e6, 3e5, o),
        ("grazing", 75.0, 4.0, 1.0, o),
        ("more above the horizon", 80.0, 2.0, 1.0, o),
        ("half", 90.0, 2.0, 1.0, o),
        ("more below it", 105.0, 2.0, 1.0, o),
        ("close and below", 130.0, 1.1, 1.0, o),
        ("tiny on the horizon", 90.0 - 3e-5, 1.0, 1e-6, o),
        ("far", 85.0, 3.0, 1.0, DVec3::new(1e5, -2e5, 3e5)),
    ]
}

/// ∫ n·ω dω over cells of the cone that are equally large in solid angle, above the horizon. At one
/// azimuth the cosine is c cos α + A sin α, so that the horizon is at a known angle.
fn cells_above(cone: &SphereCone, (c, n): (f64, DVec3), x: DVec3) -> Vec<f64> {
    let k = cone.solid_angle() / TAU;
    let angle = |i: usize| 2.0 * (0.5 * k * i as f64 / RINGS as f64).sqrt().asin();
    let rule = gauss_legendre(12);
    // Halfway to the rim, where the direction of a point is exact.
    let middle = 2.0 * (0.25 * k).sqrt().asin();
    let slope = |turn: f64| {
        let toward = n.dot((cone.sample([0.5, turn]).point - x).normalize());
        (toward - c * middle.cos()) / middle.sin()
    };
    let part = |[from, to]: [f64; 2], turn: f64| {
        let a = slope(turn);
        let horizon = (-c / a).atan();
        // Above it on the side of the centre if that is above.
        let (from, to) = if c > 0.0 {
            (from, if a < 0.0 { to.min(horizon) } else { to })
        } else if a > 0.0 {
            (from.max(horizon), to)
        } else {
            (from, from)
        };
        if to <= from {
            return 0.0;
        }
        rule.integrate(from, to, |t| (c * t.cos() + a * t.sin()).max(0.0) * t.sin())
    };
    let mut out = Vec::with_capacity(RINGS * SECTORS);
    for i in 0..RINGS {
        for j in 0..SECTORS {
            let at = |j: usize| j as f64 / SECTORS as f64;
            let ring = [angle(i), angle(i + 1)];
            // In panels, so that the corner of the horizon that just enters a cell is not missed.
            let panel = |p: usize| (at(j) * (24 - p) as f64 + at(j + 1) * p as f64) / 24.0;
            let mass = |p: usize| {
                gauss_kronrod(|turn| TAU * part(ring, turn), panel(p), panel(p + 1), 1e-10).value
            };
            out.push((0..24).map(mass).sum());
        }
    }
    out
}

/// All laws in the chart of the cone, whose measure is solid angle; the horizon is a jump there.
/// And no variance: the cosine over the density is one number.
#[test]
fn spheres_by_projected_solid_angle_obey_the_laws() {
    let n = DVec3::new(0.48, -0.6, 0.64);
    let across = DVec3::new(0.8, 0.0, -0.6);
    let across = (across - n * across.dot(n)).normalize();
    for (name, tilt, d, radius, x) in projected_spheres() {
        let (s, c) = f64::to_radians(tilt).sin_cos();
        let center = x + (n * c + across * s) * d;
        let sphere = Sphere { center, radius };
        let sampler = SphereProjected::new(&sphere, x, n).expect("above the horizon");
        let cone = SphereCone::new(&sphere, x);
        let slack = 64.0 * f64::EPSILON * (1.0 + (d + center.abs().max_element()) / radius);
        let mut rng = SplitMix64::new(41);
        let mut observed = vec![0_u64; RINGS * SECTORS];
        for _ in 0..SAMPLES {
            let s = sampler.sample([rng.next_f64(), rng.next_f64()]);
            let [m, turn] = cone.invert(s.point).unwrap_or([1.0 - f64::EPSILON, 0.0]);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "below n"
            )]
            let bin = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
            observed[bin(m, RINGS) * SECTORS + bin(turn, SECTORS)] += 1;
        }
        let expected = cells_above(&cone, (n.dot((center - x).normalize()), n), x);
        let mass = expected.iter().sum::<f64>() / sampler.projected_solid_angle();
        assert!((mass - 1.0).abs() < 1e-9 + slack, "{name}: ∫ = {mass}");
        let expected: Vec<f64> = expected
            .iter()
            .map(|m| m * f64::from(SAMPLES) / sampler.projected_solid_angle())
            .collect();
        let p = chi2_test(&observed, &expected, 5.0).p_value;
        assert!(p > sidak(0.01, 12), "{name}: p = {p:e}");
        let mut rng = SplitMix64::new(17);
        for _ in 0..20_000 {
            let u = [rng.next_f64(), rng.next_f64()];
            let s = sampler.sample(u);
            assert!(
                ((s.point - center).length() / radius - 1.0).abs() < slack,
                "{name}"
            );
            let cosine = n.dot((s.point - x).normalize());
            let got = cosine / s.pdf.value() / sampler.projected_solid_angle();
            assert!(
                (got - 1.0).abs() < slack * (1.0 + 1.0 / cosine),
                "{name} {u:?}: {got}"
            );
            let Some(back) = sampler.invert(s.point) else {
                // Rounded below the horizon, or away from the point at the rim.
                continue;
            };
            let again = sampler.sample(back).point;
            let off = (again - s.point).length() / radius;
            // Places go by the root of what is left of ξ at the rim and at the ends of slices.
            assert!(off < slack.sqrt(), "{name} {u:?} {back:?}: {off:e}");
        }
    }
}

#[test]
fn spheres_out_of_sight_have_no_projected_solid_angle() {
    let at = |z: f64, radius: f64| Sphere {
        center: DVec3::new(0.3, 0.0, z),
        radius,
    };
    let new = |s: &Sphere| SphereProjected::new(s, DVec3::ZERO, DVec3::Z);
    for sphere in [
        at(-2.0, 1.0),
        at(0.2, 1.0),
        at(2.0, 0.0),
        at(f64::NAN, 1.0),
        at(f64::INFINITY, 1.0),
    ] {
        assert!(new(&sphere).is_none(), "{sphere:?}");
    }
    assert!(new(&at(-0.999, 1.0)).is_some());
}

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
        // And over how edge-on the disk is seen.
        let slack = resolution(&disk, x) * (1.0 + to.length() / h);
        let (mut least, mut most, mut mean) = (f64::INFINITY, 0.0_f64, 0.0);
        for _ in 0..100_000 {
            let u = [rng.next_f64(), rng.next_f64()];
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
    }
}

/// ε of the coordinates, over the radius.
fn resolution(disk: &Disk, x: DVec3) -> f64 {
    let extent = disk.center.abs().max_element() + x.abs().max_element();
    64.0 * f64::EPSILON * (1.0 + extent / disk.radius)
}

#[test]
fn disks_by_area_obey_the_laws() {
    let mut rng = SplitMix64::new(18);
    for (name, x, disk) in disks() {
        let by_area = DiskArea::new(&disk);
        for _ in 0..100_000 {
            let u = [rng.next_f64(), rng.next_f64()];
            let back = by_area
                .invert(by_area.sample(u).point)
                .expect("on the disk");
            let error = (back[0] - u[0]).abs() + (back[1] - u[1]).abs();
            assert!(error < resolution(&disk, x), "{name}: {u:?} {back:?}");
        }
        let (p, mass) = fit(
            disk.area(),
            |u| polar(&disk, by_area.sample(u).point),
            |u| by_area.pdf(from_polar(&disk, u)).value(),
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

/// Hostile positions: tiny solid angles, points within 1e-9 of the disk, of its plane and of its
/// rim.
#[test]
fn hostile_disks_stay_finite() {
    let mut rng = linelit_testkit::cases::rng(23);
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
            assert!(
                DiskArea::new(&disk).invert(s.point).is_some(),
                "{disk:?} {u:?}"
            );
            assert!(cone.pdf(s.point).is_positive(), "{disk:?} {u:?}");
        }
    }
}

/// A direction and back: its density, and its random numbers, to ε of the direction over the width
/// of the smallest disk, 1e-3, and the map's condition.
fn round_trip(name: &str, image: &TransformedCone, u: [f64; 2]) {
    let (w, pdf) = image.sample(u);
    let again = image.pdf(w).value();
    assert!(
        (again / pdf.value() - 1.0).abs() < 1e-10,
        "{name}: {pdf:?} {again}"
    );
    let back = image.invert(w);
    let turn = (back[0] - u[0]).abs();
    let off = (turn.min(1.0 - turn) * u[1].sqrt()).max((back[1] - u[1]).abs());
    assert!(off < 1e-10, "{name}: {u:?} {back:?}");
}

/// Directions towards disks under maps, narrow ones and ones that lean: in the chart of the disk's
/// area.
#[test]
fn disks_under_maps_obey_the_laws() {
    let at = DVec3::new;
    let disk = |center, normal: DVec3, radius| Disk {
        center,
        normal: normal.normalize(),
        radius,
    };
    let far = at(1e3, -2e3, 3e3);
    let disks = [
        (
            "overhead",
            DVec3::ZERO,
            disk(at(0.0, 0.0, 2.0), DVec3::Z, 1.0),
        ),
        (
            "beside",
            far,
            disk(far + at(1.0, -0.7, 0.9), at(0.3, 0.4, -1.0), 0.5),
        ),
        (
            "small",
            DVec3::ZERO,
            disk(at(0.4, 0.2, 1.0), at(0.5, 0.1, -1.0), 1e-3),
        ),
        ("close", DVec3::ZERO, disk(at(0.3, 0.0, 0.2), DVec3::Z, 1.0)),
    ];
    let maps = [
        DMat3::IDENTITY,
        DMat3::from_diagonal(at(0.3, 0.2, 1.0)),
        DMat3::from_cols(at(0.4, 0.0, 0.1), at(0.0, 0.3, 0.0), at(-0.8, 0.2, 1.0)),
    ];
    let mut rng = SplitMix64::new(29);
    for ((name, x, disk), map) in disks.into_iter().flat_map(|d| maps.map(|m| (d, m))) {
        let image = TransformedCone::new(&disk, x, map).expect("an image");
        let by_area = DiskArea::new(&disk);
        let hit = |w: DVec3| {
            let to = disk.center - x;
            x + w * (to.dot(disk.normal) / w.dot(disk.normal))
        };
        (0..10_000).for_each(|_| round_trip(name, &image, [rng.next_f64(), rng.next_f64()]));
        let (p, mass) = fit(
            disk.area(),
            |u| by_area.invert(hit(image.sample(u).0)).unwrap_or([0.0; 2]),
            |u| {
                let v = by_area.sample(u).point - x;
                let cosine = disk.normal.dot(v.normalize()).abs();
                let pdf = image.pdf(v.normalize());
                pdf.to_area(v.length_squared(), cosine).value()
            },
        );
        assert!(p > sidak(0.01, TESTS), "{name}, {map:?}: p = {p:e}");
        // The density has kinks between its pieces.
        assert!((mass - 1.0).abs() < 1e-3, "{name}, {map:?}: {mass}");
    }
}

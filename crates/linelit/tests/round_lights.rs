//! Tests of the visible parts of disks and spheres, and of queries for slices of points.

#![allow(clippy::float_cmp, reason = "nothing, and all")]

use linelit::geometry::DVec3;
use linelit::{Error, Light, Measure, Rings, Scene};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::{PI, TAU};

const UP: Measure = Measure::Cosine(DVec3::Z);

/// Returns a triangle that, seen from the origin, hides the part of the plane z = 2 with
/// x > `from`, except for points that are far away.
fn half_plane(from: f32) -> [[f32; 3]; 3] {
    let x = from / 2.0;
    [[x, -90.0, 1.0], [90.0, 0.0, 1.0], [x, 90.0, 1.0]]
}

fn behind(positions: &[[f32; 3]], light: Light) -> Result<Scene, Error> {
    let corners = (0..).step_by(3).map(|k| [k, k + 1, k + 2]);
    let triangles: Vec<_> = corners.take(positions.len() / 3).collect();
    Scene::builder(positions, &triangles).light(light).build()
}

fn disk(center: [f64; 3], radius: f64) -> Light {
    Light::disk(center, [0.0, 0.0, -1.0], radius, [1.0; 3])
}

#[test]
fn a_half_plane_hides_what_it_does_of_a_disk_and_of_a_sphere() -> Result<(), Error> {
    // An edge through the centre hides a half by every measure, because the light is symmetric
    // about it.
    for (light, radius) in [
        (disk([0.0, 0.3, 2.0], 0.7), 0.7),
        (disk([0.0, 0.0, 2.0], 1e-5), 1e-5),
        (disk([0.0, 0.0, 2.0], 50.0), 50.0),
        (Light::sphere([0.0, 0.3, 2.5], 0.7, [1.0; 3]), 0.7),
        (Light::sphere([0.0, 0.0, 2.5], 1e-5, [1.0; 3]), 1e-5),
    ] {
        let scene = behind(&half_plane(0.0), light)?;
        // The edge is projected to coordinates of up to 180, with an error of ε times that. The
        // closed forms are right to 1e-12, or to the documented 1e-7 where they lose digits.
        let seen = 2.0 * f64::EPSILON * 180.0 / radius;
        let cosine = if radius < 1e-4 { 1e-7 } else { 1e-12 };
        for (measure, error) in [
            (Measure::Area, 1e-14),
            (Measure::SolidAngle, 1e-12),
            (UP, cosine),
        ] {
            let found = scene.visible_fraction([0.0; 3], 0, measure)?;
            assert!(
                (found - 0.5).abs() < error + seen,
                "{radius} {measure:?}: {found}"
            );
        }
    }
    // An edge next to the centre leaves a segment of the circle visible.
    for from in [-0.9_f32, -0.25, 0.5, 0.75] {
        let scene = behind(&half_plane(from), disk([0.0, 0.0, 2.0], 1.0))?;
        let from = f64::from(from);
        let visible = 1.0 - (from.acos() - from * (1.0 - from * from).sqrt()) / PI;
        let found = scene.visible_fraction([0.0; 3], 0, Measure::Area)?;
        assert!((found - visible).abs() < 1e-14, "{from}: {found} {visible}");
        // For the solid angle, integrate over strips. A chord with half the length l, whose middle
        // is at the distance d, has the solid angle h · 2 l / (d² √(d² + l²)) per unit of x, where
        // h = 2 is the height of the disk.
        let strip = |x: f64| {
            let (square, half) = (x * x + 4.0, (1.0 - x * x).max(0.0).sqrt());
            4.0 * half / (square * (square + half * half).sqrt())
        };
        // With x = −cos t the integrand is smooth, also at both ends. Use the midpoint rule in t.
        let to = (-from).acos();
        let integral = |to: f64| {
            let count = 20_000;
            let piece = to / f64::from(count);
            let at = |k: u32| (f64::from(k) + 0.5) * piece;
            (0..count)
                .map(|k| strip(-at(k).cos()) * at(k).sin())
                .sum::<f64>()
                * piece
        };
        let visible = integral(to) / integral(PI);
        let found = scene.visible_fraction([0.0; 3], 0, Measure::SolidAngle)?;
        // The error of the midpoint rule is to²/(24 count²) times derivatives of order one.
        assert!((found - visible).abs() < 1e-8, "{from}: {found} {visible}");
    }
    Ok(())
}

/// Returns the vertices of random triangles, half-way between the origin and a light.
fn soup(random: &mut Pcg64Mcg, count: usize) -> Vec<[f32; 3]> {
    let mut positions = Vec::new();
    for _ in 0..count {
        let at = [0, 1, 2].map(|k| match k {
            2 => random.random_range(0.4..1.2_f32),
            _ => random.random_range(-0.7..0.7_f32),
        });
        positions.extend([0; 3].map(|_| at.map(|x| x + random.random_range(-0.3..0.3_f32))));
    }
    positions
}

/// Whether the segment from x to x + d meets a triangle.
fn hits(x: DVec3, d: DVec3, t: &[[f32; 3]]) -> bool {
    let [a, b, c] = [0, 1, 2].map(|k| DVec3::from(t[k].map(f64::from)));
    let (u, v, from) = (b - a, c - a, x - a);
    let (p, q) = (d.cross(v), from.cross(u));
    let [s, r, t] = [from.dot(p), d.dot(q), v.dot(q)].map(|w| w / u.dot(p));
    s >= 0.0 && r >= 0.0 && s + r <= 1.0 && t > 0.0 && t < 1.0
}

/// Asserts that the rings of the visible part of a disk lie in the disk, have the fraction `want`
/// of its area, and run counter-clockwise as the point x sees them. Their area is a little smaller
/// because they have chords instead of arcs. The disk is given by its centre and by its normal
/// times its radius.
fn rings_have_the_area(rings: &Rings, x: DVec3, [center, normal]: [DVec3; 2], want: f64) {
    let (radius, normal) = (normal.length(), normal.normalize());
    let area = |ring: &Vec<[f64; 3]>| {
        let next = ring.iter().cycle().skip(1);
        let to = |p: &[f64; 3]| DVec3::from(*p) - center;
        let turns = ring
            .iter()
            .zip(next)
            .map(|(a, b)| to(a).cross(to(b)).dot(normal));
        0.5 * turns.sum::<f64>() * normal.dot(x - center).signum()
    };
    let found = rings.iter().map(area).sum::<f64>() / (PI * radius * radius);
    assert!((found - want).abs() < 1.1e-4, "{found} {want}");
    for p in rings.iter().flatten().map(|p| DVec3::from(*p) - center) {
        assert!(p.length() < radius * (1.0 + 1e-9) && normal.dot(p).abs() < 1e-9);
    }
}

#[test]
fn fractions_of_round_lights_are_those_of_rays() -> Result<(), Error> {
    let mut random = Pcg64Mcg::seed_from_u64(8);
    // With 3 · 8 · 3 comparisons, this bound gives one false alarm in 10⁴ runs with other seeds.
    let most = 4.9;
    for case in 0..24 {
        let mut at = |low: f64, high: f64| random.random_range(low..high);
        let center = DVec3::new(at(-0.5, 0.5), at(-0.5, 0.5), at(2.0, 2.4));
        let normal = DVec3::new(at(-1.0, 1.0), at(-1.0, 1.0), at(-1.0, -0.1)).normalize();
        let (radius, x) = (at(0.2, 0.6), DVec3::new(at(-1.0, 1.0), at(-1.0, 1.0), 0.0));
        // Let the horizon of some of the normals cut the light.
        let n = DVec3::new(at(-2.0, 2.0), at(-2.0, 2.0), 0.6).normalize();
        let is_sphere = case % 3 == 0;
        let light = match is_sphere {
            true => Light::sphere(center, radius, [1.0; 3]),
            false => Light::disk(center, normal, radius, [1.0; 3]),
        };
        let (normal, center, radius) = match &light {
            Light::Sphere(l) => {
                let outline = l.sphere.outline(x).expect("outside");
                (outline.normal, outline.center, outline.radius)
            }
            _ => (normal, center, radius),
        };
        let positions = soup(&mut random, 12);
        let scene = behind(&positions, light)?;
        let measures = [Measure::Area, Measure::SolidAngle, Measure::Cosine(n)];
        // Trace rays to random points of the disk, and sum the visible and the whole light by all
        // three measures.
        let (u, v) = normal.any_orthonormal_pair();
        let mut sums = [[0.0_f64; 4]; 3];
        for _ in 0..20_000 {
            let r = radius * random.random_range(0.0..1.0_f64).sqrt();
            let (s, c) = random.random_range(0.0..TAU).sin_cos();
            let d = center + (u * c + v * s) * r - x;
            let seen = f64::from(u8::from(!positions.chunks(3).any(|t| hits(x, d, t))));
            let angle = normal.dot(d).abs() / d.length().powi(3);
            let cosine = angle * n.dot(d).max(0.0) / d.length();
            for (sum, weight) in sums.iter_mut().zip([1.0, angle, cosine]) {
                let (visible, square) = (weight * seen, weight * weight);
                let more = [visible, weight, square, square * seen];
                *sum = [0, 1, 2, 3].map(|k| sum[k] + more[k]);
            }
        }
        for ([seen, all, squares, seen_squares], measure) in sums.into_iter().zip(measures) {
            let exact = scene.visible_fraction(x, 0, measure)?;
            if all == 0.0 {
                assert!(exact.is_nan());
                continue;
            }
            // Compare by the variance of a ratio estimator with the weights w, Σ (w V − f w)².
            let square = (1.0 - 2.0 * exact) * seen_squares + exact * exact * squares;
            let z = (seen / all - exact) / (square.sqrt() / all).max(1e-9);
            assert!(z.abs() < most, "{case} {measure:?}: {exact} z = {z}");
        }
        let want = scene.visible_fraction(x, 0, Measure::Area)?;
        rings_have_the_area(
            &scene.visible_polygons(x, 0)?,
            x,
            [center, normal * radius],
            want,
        );
    }
    Ok(())
}

#[test]
fn small_and_flat_disks_have_the_halves_of_others() -> Result<(), Error> {
    // For a very small disk and for one that is seen almost edge-on, the closed forms lose digits.
    // The edge of the occluder lies in the mirror plane y = 0, and hides the half with y > 0.
    let up = [[-9.0, 0.0, 1.0], [9.0, 0.0, 1.0], [0.0, 9.0, 1.0_f32]];
    let aside = [[1.0, 0.0, -9.0], [1.0, 9.0, 0.0], [1.0, 0.0, 9.0_f32]];
    for (center, radius, wall) in [([0.0, 0.0, 2.0], 1e-5, up), ([3.0, 0.0, 1e-4], 1.0, aside)] {
        let scene = behind(&wall, disk(center, radius))?;
        for (measure, error) in [
            (Measure::Area, 1e-12),
            (Measure::SolidAngle, 1e-9),
            (UP, 1e-7),
        ] {
            let found = scene.visible_fraction([0.0; 3], 0, measure)?;
            // The edge is projected to coordinates of up to 18 with an error of ε times that, which
            // grows if the disk is seen edge-on.
            let flat = DVec3::from(center).length() / center[2];
            let error = error + 2.0 * f64::EPSILON * 18.0 * flat / radius;
            assert!((found - 0.5).abs() < error, "{radius} {measure:?}: {found}");
        }
    }
    Ok(())
}

#[test]
fn of_a_sphere_nothing_is_seen_from_inside_and_triangles_in_it_are_refused() -> Result<(), Error> {
    let sphere = || Light::sphere([0.0, 0.0, 2.0], 0.5, [1.0; 3]);
    let scene = behind(&[], sphere())?;
    for x in [[0.0, 0.0, 2.0], [0.1, 0.2, 1.8], [0.0, 0.0, 1.5]] {
        assert_eq!(scene.irradiance(x, [0.0, 0.0, 1.0])?, [0.0; 3]);
        assert!(scene.visible_fraction(x, 0, Measure::Area)?.is_nan());
        assert!(scene.visible_polygons(x, 0)?.is_empty());
    }
    let triangle = |z: f32| [[-0.1, -0.1, z], [0.1, -0.1, z], [0.0, 0.1, z]];
    let pierced = Error::Pierced { point: 0, light: 0 };
    for (z, want) in [(1.0, None), (1.49, None), (1.6, Some(pierced)), (2.1, None)] {
        let scene = behind(&triangle(z), sphere())?;
        let found = scene.visible_fraction([0.0; 3], 0, Measure::Area);
        assert_eq!(found.err(), want, "{z}");
        assert_eq!(scene.visible_polygons([0.0; 3], 0).err(), want, "{z}");
    }
    // A triangle in the half of the sphere that faces away hides nothing, and one in front that
    // covers the whole sphere hides it.
    let scene = behind(&triangle(2.1), sphere())?;
    assert_eq!(scene.visible_fraction([0.0; 3], 0, Measure::Area)?, 1.0);
    let wide = triangle(1.0).map(|[x, y, z]| [x * 99.0, y * 99.0, z]);
    let scene = behind(&wide, sphere())?;
    assert_eq!(
        scene.visible_fraction([0.0; 3], 0, Measure::SolidAngle)?,
        0.0
    );
    // Thousands of small triangles in front of the sphere hide nearly all of it.
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let dense: Vec<_> = (0..3000).flat_map(|_| soup(&mut random, 1)).collect();
    let scene = behind(&dense, sphere())?;
    let found = scene.visible_fraction([0.0; 3], 0, Measure::Area);
    assert!(found.is_ok_and(|found| found < 0.1), "{found:?}");
    Ok(())
}

#[test]
fn slices_of_points_have_the_polygons_of_each() -> Result<(), Error> {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let positions = soup(&mut random, 12);
    let lamp = Light::rectangle([-1.0, -1.0, 2.0], [0., 2., 0.], [2., 0., 0.], [1.0; 3]);
    let lights = [
        lamp.expect("a square"),
        disk([0.1, 0.2, 2.0], 0.4),
        Light::sphere([0.1, 0.2, 2.5], 0.4, [1.0; 3]),
    ];
    for light in lights {
        let scene = behind(&positions, light)?;
        let at = |k: u32| {
            [
                f64::from(k % 20) * 0.1 - 1.0,
                f64::from(k / 20) * 0.1 - 1.0,
                0.0,
            ]
        };
        let mut points: Vec<_> = (0..400).map(at).collect();
        let found = scene.visible_polygons_each(&points, 0)?;
        for (point, found) in points.iter().zip(&found) {
            assert_eq!(*found, scene.visible_polygons(*point, 0)?);
        }
        assert!(found.iter().any(|rings| rings.len() > 1));
        points[333][1] = f64::NAN;
        points[222][1] = f64::NAN;
        assert_eq!(
            scene.visible_polygons_each(&points, 0),
            Err(Error::Point(222))
        );
        assert_eq!(scene.visible_polygons_each::<[f64; 3]>(&[], 0), Ok(vec![]));
    }
    Ok(())
}

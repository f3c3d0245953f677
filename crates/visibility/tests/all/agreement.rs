//! Lines and rays through the hierarchy, compared with tests of every triangle one by one.

use crate::common::{InSpace, Mesh, NONE, chord, light, soup};
use linelit_geometry::{DVec3, Margins, Segment, intervals::Interval};
use linelit_testkit::cases::rng;
use linelit_visibility::{LightCorners, Occluders, Ray, Scratch, ShaftQuery, VisibleLines, brute};
use std::ops::Range;

/// The length on which two lists of intervals differ.
fn difference(a: &[Interval], b: &[Interval]) -> f64 {
    for set in [a, b] {
        assert!(
            set.iter()
                .all(|i| 0.0 <= i.lo && i.lo < i.hi && i.hi <= 1.0),
            "{set:?}"
        );
        assert!(set.windows(2).all(|w| w[0].hi < w[1].lo), "{set:?}");
    }
    let mut cuts: Vec<f64> = a.iter().chain(b).flat_map(|i| [i.lo, i.hi]).collect();
    cuts.sort_by(f64::total_cmp);
    let inside = |set: &[Interval], t: f64| set.iter().any(|i| i.lo <= t && t <= i.hi);
    cuts.windows(2)
        .filter(|w| inside(a, 0.5 * (w[0] + w[1])) != inside(b, 0.5 * (w[0] + w[1])))
        .map(|w| w[1] - w[0])
        .sum()
}

/// The position and the scale of a scene.
const PLACES: [(DVec3, f64); 4] = [
    (DVec3::ZERO, 1.0),
    (DVec3::splat(1e5), 10.0),
    (DVec3::ZERO, 1e6),
    (DVec3::ZERO, 1e-6),
];

/// By default, none, and a large one before the light.
const MARGINS: [Margins; 3] = [
    Margins::DEFAULT,
    Margins::NONE,
    Margins {
        point: 0.0,
        light: 0.3,
    },
];

/// Compares the visible intervals of lines with brute force, to 1e-9 of the line, with margins that
/// differ from case to case.
fn lines_agree(
    case: usize,
    mesh: &Mesh,
    point: DVec3,
    on_light: (&[DVec3], &[Segment]),
    exclude: &Range<u32>,
    scratch: &mut Scratch,
) {
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    let margins = MARGINS[case % MARGINS.len()];
    let light = LightCorners::new(on_light.0).unwrap();
    let query = ShaftQuery {
        margins,
        ..ShaftQuery::new(point, light).excluding(exclude.clone())
    };
    let mut out = VisibleLines::new();
    let mut shaft = occluders.shaft(query, scratch);
    shaft.visible(on_light.1, &mut out);
    let class = shaft.class();
    for (i, line) in on_light.1.iter().enumerate() {
        let want = brute::visible(
            &mesh.positions,
            &mesh.triangles,
            point,
            line,
            exclude,
            margins,
        );
        let off = difference(out.line(i), &want);
        assert!(
            off <= 1e-9,
            "case {case}, line {i}: off by {off:e}\n{:?}\n{want:?} class {class:?}",
            out.line(i)
        );
    }
}

#[test]
fn lines_agree_with_brute_force() {
    let (mut rng, mut scratch) = (rng(1), Scratch::new());
    for case in 0..400 {
        let (centre, scale) = PLACES[case % 4];
        let size = [0.02, 0.2, 0.8][case % 3];
        let mesh = soup(&mut rng, 120, size, centre, scale);
        let corners = [3, 4, 4, 5, 16, 2][case % 6];
        let light_size = [0.05, 0.3, 1.5][rng.index(3)];
        let at = centre + rng.in_cube(1.5) * scale;
        let light = light(&mut rng, corners, at, light_size * scale);
        let point = centre + rng.in_cube(1.2) * scale;
        let angle = (case % 5 != 0).then(|| rng.in_range(0.0, 3.0));
        let lines: Vec<_> = (0..[1, 4, 16, 33][case % 4])
            .map(|_| chord(&mut rng, &light, angle))
            .collect();
        lines_agree(case, &mesh, point, (&light, &lines), &(0..2), &mut scratch);
    }
}

#[test]
fn rays_agree_with_brute_force() {
    let mut rng = rng(2);
    let mut scratch = Scratch::new();
    for case in 0..200 {
        let (centre, scale) = PLACES[case % 4];
        let mesh = soup(&mut rng, 200, 0.3, centre, scale);
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let alone: Vec<_> = mesh
            .triangles
            .iter()
            .map(|t| Occluders::build(&mesh.positions, std::slice::from_ref(t)))
            .collect();
        for _ in 0..50 {
            let ray = Ray {
                origin: centre + rng.in_cube(1.2) * scale,
                direction: rng.direction(),
                t_min: 0.0,
                t_max: rng.in_range(0.0, 3.0) * scale,
            };
            // The tree of one triangle has only the box around it, so that only the triangle test
            // matters.
            let want = (0_u32..)
                .zip(&alone)
                .filter_map(|(id, o)| Some((o.closest_hit(&ray, &mut scratch)?.t, id)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let got = occluders.closest_hit(&ray, &mut scratch);
            // Trees with different origins differ in the last bits of t.
            match (want, got) {
                (None, None) => {}
                (Some((t, id)), Some(hit)) => {
                    assert!((t - hit.t).abs() <= 1e-9 * scale, "{t} {hit:?}");
                    assert_eq!(id, hit.triangle);
                }
                other => panic!("{other:?}"),
            }
            assert_eq!(occluders.any_hit(&ray, &NONE, &mut scratch), want.is_some());
        }
    }
}

/// Rays from one point through a scratch that remembers the latest hit get the same answers as
/// through a new scratch in a scene without the excluded triangles; two scenes by turns.
#[test]
fn rays_from_one_point_agree_with_rays_alone() {
    let (mut rng, mut scratch) = (rng(8), Scratch::new());
    let mut met = 0;
    for case in 0..60 {
        let (centre, scale) = PLACES[case % 4];
        let scenes = [200, 30].map(|n| {
            let mesh = soup(&mut rng, n, 0.5, centre, scale);
            // Build the scene without the first triangles.
            [0, 10, 20].map(|from| Occluders::build(&mesh.positions, &mesh.triangles[from..]))
        });
        let origin = centre + rng.in_cube(1.2) * scale;
        for k in 0..200 {
            let towards = centre + rng.in_cube(1.0) * scale;
            let ray = Ray {
                origin,
                direction: towards - origin,
                t_min: 0.0,
                t_max: rng.in_range(0.0, 2.0),
            };
            let scene = &scenes[k / 5 % 2];
            let exclude = 0..[0, 10, 20][k % 3];
            let any = scene[0].any_hit(&ray, &exclude, &mut scratch);
            met += u32::from(any);
            let alone = scene[k % 3].any_hit(&ray, &NONE, &mut Scratch::new());
            assert_eq!(any, alone, "case {case}, ray {k}");
        }
    }
    assert!(
        (2_000..10_000).contains(&met),
        "{met} of 12,000 rays meet something"
    );
}

/// Rays that end closer and closer on either side of their hit, at any scale and far from the
/// origin: single precision decides nothing differently than double precision would.
#[test]
fn a_ray_ends_where_it_says() {
    let (mut rng, mut scratch) = (rng(7), Scratch::new());
    let mut met = 0;
    for case in 0..20_000 {
        let power = |x: f64| 10.0_f64.powf(x);
        let scale = power(rng.in_range(-18.0, 18.0));
        let centre = rng.direction() * scale * [0.0, 10.0, 1e4][case % 3];
        let size = power(rng.in_range(-3.0, 0.5));
        let mut mesh = soup(&mut rng, 1, size, centre, scale);
        if case % 2 == 0 {
            // A second triangle far away only makes the hierarchy larger.
            let far = centre + DVec3::splat(power(rng.in_range(0.0, 3.0)) * scale);
            let other = soup(&mut rng, 1, size, far, scale);
            mesh.triangles.push([3, 4, 5]);
            mesh.positions.extend(other.positions);
        }
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let [a, b, c] = mesh.corners(0);
        let (u, v) = (rng.next_f64(), rng.next_f64());
        let aim = match case % 5 {
            0 => a,
            1 => a + (b - a) * u,
            _ => a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v),
        };
        let origin = aim + rng.direction() * scale * power(rng.in_range(-4.0, 0.5));
        let stretch = power(rng.in_range(-6.0, 6.0));
        let mut ray = Ray {
            origin,
            direction: (aim - origin) * stretch,
            t_min: f64::NEG_INFINITY,
            t_max: f64::INFINITY,
        };
        let Some(hit) = occluders.closest_hit(&ray, &mut scratch) else {
            continue;
        };
        // Skip slivers whose corners are so rounded at their distance that t has no correct digits.
        if hit.triangle != 0 || !((hit.t * stretch - 1.0).abs() < 1e-6) {
            continue;
        }
        met += 1;
        for bits in [0, 1, 2, 10, 20, 26, 28, 30, 32, 36, 44, 50, 52] {
            for sign in [-1.0, 1.0] {
                let limit = hit.t * (1.0 + sign * 0.5_f64.powi(bits));
                for (t_min, t_max) in [(0.0, limit), (limit, f64::INFINITY), (limit, 2.0 * hit.t)] {
                    (ray.t_min, ray.t_max) = (t_min, t_max);
                    let want = t_min <= hit.t && hit.t <= t_max;
                    let any = occluders.any_hit(&ray, &(1..2), &mut scratch);
                    assert_eq!(any, want, "case {case}: {ray:?} {hit:?}");
                    let first = occluders.closest_hit(&ray, &mut scratch);
                    let same = first.is_some_and(|h| h.triangle == 0);
                    assert!(
                        same == want || first.is_some(),
                        "case {case}: {ray:?} {hit:?}"
                    );
                }
            }
        }
    }
    assert!(met > 12_000, "{met} rays meet their triangle");
}

/// Shading points on the occluders themselves or a little off them, for which the near margin
/// matters.
#[test]
fn lines_from_surfaces_agree_with_brute_force() {
    let (mut rng, mut scratch) = (rng(3), Scratch::new());
    for case in 0..600 {
        let mesh = soup(&mut rng, 60, [0.2, 1.5][case % 2], DVec3::ZERO, 1.0);
        let corners = [3, 4, 4, 5, 16, 2][case % 6];
        let at = rng.in_cube(1.5);
        let light = light(&mut rng, corners, at, [0.05, 1.0][case % 2]);
        let [a, b, c] = mesh.corners(rng.index(60));
        let normal = (b - a).cross(c - a).normalize();
        let (s, t) = (rng.next_f64() * 0.5, rng.next_f64() * 0.5);
        let off = [1e-3, 2e-6, -2e-6][case % 3];
        let point = a + (b - a) * s + (c - a) * t + normal * off;
        let lines: Vec<_> = (0..8).map(|_| chord(&mut rng, &light, Some(0.0))).collect();
        lines_agree(case, &mesh, point, (&light, &lines), &NONE, &mut scratch);
    }
}

/// Thousands of triangles in the shaft, for the walk that skips what is hidden.
#[test]
fn dense_shafts_agree_with_brute_force() {
    let (mut rng, mut scratch) = (rng(4), Scratch::new());
    for case in 0..24 {
        let (centre, scale) = PLACES[case % 4];
        let mesh = soup(&mut rng, 6000, [0.02, 0.1][case % 2], centre, scale);
        let corners = [3, 4, 2, 6][case % 4];
        let at = centre + DVec3::new(0.2, 0.3, 1.3) * scale;
        let light = light(&mut rng, corners, at, scale);
        let point = centre + DVec3::new(0.1, -0.1, -1.2) * scale;
        let angle = (case % 3 != 0).then_some(0.7);
        let lines: Vec<_> = (0..[1, 16, 21][case % 3])
            .map(|_| chord(&mut rng, &light, angle))
            .collect();
        lines_agree(case, &mesh, point, (&light, &lines), &NONE, &mut scratch);
    }
    assert!(scratch.counters.dense_shafts >= 3, "{:?}", scratch.counters);
}

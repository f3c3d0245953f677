//! Any hits of rays that are traced together, compared with the same rays one by one.

use crate::common::{InSpace, Mesh, NONE, closed, on_all_sets, soup};
use linelit_geometry::DVec3;
use linelit_testkit::cases::{cases, rng};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{Counters, FAN, Fan, Occluders, Ray, Scratch};
use std::ops::Range;

/// A bit for each ray that hits anything, by tracing them one by one.
fn alone(occluders: &Occluders, fan: &Fan<'_>, exclude: &Range<u32>) -> u64 {
    let mut scratch = Scratch::new();
    let meets = |(i, direction): (usize, &DVec3)| {
        let ray = Ray {
            origin: fan.origin,
            direction: *direction,
            t_min: fan.t_min,
            t_max: fan.t_max,
        };
        u64::from(occluders.any_hit(&ray, exclude, &mut scratch)) << i
    };
    let rays = fan.directions.iter().enumerate();
    rays.map(meets).fold(0, |a, b| a | b)
}

/// Compares a fan with its rays alone, on all instruction sets, which do the same work.
fn agree(case: u32, sets: &[Occluders], fan: &Fan<'_>, exclude: &Range<u32>) -> u64 {
    let want = alone(&sets[0], fan, exclude);
    let mut work: Option<Counters> = None;
    for occluders in sets {
        let mut scratch = Scratch::new();
        // Once more through a scratch that remembers what hid the latest rays.
        for time in 0..2 {
            let got = occluders.any_hits(fan, exclude, &mut scratch);
            let set = occluders.instruction_set();
            assert_eq!(got, want, "case {case}, {set}, time {time}: {fan:?}");
        }
        let counters = *work.get_or_insert(scratch.counters);
        assert_eq!(counters.rays, 2 * fan.directions.len() as u64);
        assert_eq!(counters, scratch.counters, "case {case}");
    }
    want
}

/// A point of a triangle: a corner, a point on an edge, or a point inside.
fn on_triangle(rng: &mut SplitMix64, mesh: &Mesh, triangle: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(triangle);
    let (u, v) = (rng.next_f64(), rng.next_f64());
    match rng.index(4) {
        0 => a,
        1 => a + (b - a) * u,
        2 => (a + b) * 0.5,
        _ => a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v),
    }
}

/// Fans of all sizes towards small and large targets and towards corners and edges of triangles,
/// from anywhere, from points on triangles, a little above them and in their planes, at all scales.
#[test]
fn fans_agree_with_rays_alone() {
    let mut rng = rng(21);
    let (mut met, mut all) = (0, 0);
    for case in 0..cases(1500) {
        let scale = [1.0, 1e6, 1e-6, 1e-18, 1e15][rng.index(5)];
        let centre = DVec3::splat([0.0, 0.0, 10.0, 1e4][rng.index(4)] * scale);
        let count = [1, 4, 30, 300, 2000][rng.index(5)];
        let size = [0.02, 0.3, 1.5][rng.index(3)];
        let mesh = match rng.index(3) {
            0 => closed(&mut rng, 7, 6, 0.6, centre, scale),
            _ => soup(&mut rng, count, size, centre, scale),
        };
        let sets = on_all_sets(&mesh);
        let triangle = rng.index(mesh.triangles.len());
        let [a, b, c] = mesh.corners(triangle);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let origin = match rng.index(6) {
            0 => on_triangle(&mut rng, &mesh, triangle),
            1 => on_triangle(&mut rng, &mesh, triangle) + normal * (1e-6 * scale),
            // In the triangle's plane, outside of the triangle.
            2 => a + (b - a) * rng.in_range(-3.0, 3.0) + (c - a) * rng.in_range(-3.0, 3.0),
            // With coordinates of the triangle's corners.
            3 => DVec3::new(a.x, b.y, centre.z + rng.in_range(-1.0, 1.0) * scale),
            _ => centre + rng.in_cube(1.3) * scale,
        };
        let at = centre + rng.in_cube(1.5) * scale;
        let width = [1e-9, 0.01, 0.3, 2.0][rng.index(4)];
        let flat = DVec3::from([(); 3].map(|()| [0.0, 1.0, 1.0][rng.index(3)]));
        let aim = rng.index(4) == 0;
        let directions: Vec<DVec3> = (0..rng.index(FAN + 1))
            .map(|_| {
                let triangle = rng.index(mesh.triangles.len());
                match aim {
                    true => on_triangle(&mut rng, &mesh, triangle) - origin,
                    false => at + rng.in_cube(width * scale) * flat - origin,
                }
            })
            .collect();
        let t_max = [1.0, 1.0 - 1e-4, rng.in_range(0.0, 2.0), 1e4][rng.index(4)];
        let t_min = [0.0, 1e-10, 1e-4, rng.in_range(0.0, 1.0)][rng.index(4)];
        let fan = Fan {
            origin,
            directions: &directions,
            t_min,
            t_max,
        };
        let exclude = [0..0, 0..3, 1..200][rng.index(3)].clone();
        met += agree(case, &sets, &fan, &exclude).count_ones();
        all += directions.len();
    }
    let met = f64::from(met) / all as f64;
    assert!(
        (0.2..0.8).contains(&met),
        "{met} of the rays meet something"
    );
}

/// Rays that end, or begin, closer and closer on either side of their hit: `t_max` and `t_min`
/// decide for a fan as for a ray, to the bit.
#[test]
fn a_fan_begins_and_ends_where_its_rays_do() {
    let mut rng = rng(22);
    let mut met = [0; 2];
    for case in 0..cases(300) {
        let mesh = soup(&mut rng, 3, 0.8, DVec3::ZERO, 1.0);
        let sets = on_all_sets(&mesh);
        let origin = rng.in_cube(1.5);
        let [a, b, c] = mesh.corners(0);
        let (u, v) = (rng.in_range(0.1, 0.4), rng.in_range(0.1, 0.4));
        let towards = a + (b - a) * u + (c - a) * v - origin;
        let ray = Ray {
            origin,
            direction: towards,
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let Some(hit) = sets[0].closest_hit(&ray, &mut Scratch::new()) else {
            continue;
        };
        // All rays meet the plane of the triangle at the same t, up to rounding.
        let directions: Vec<DVec3> = (0..8)
            .map(|k| {
                towards + ((b - a) * f64::from(k) + (c - a)) * (1e-3 * u) * f64::from(k.min(1))
            })
            .collect();
        for bits in [1, 10, 30, 40, 44, 46, 48, 50, 51, 52] {
            for sign in [-1.0, 1.0] {
                let t = hit.t * (1.0 + sign * 0.5_f64.powi(bits));
                for [t_min, t_max] in [[0.0, t], [t, 10.0]] {
                    let fan = Fan {
                        origin,
                        directions: &directions,
                        t_min,
                        t_max,
                    };
                    let hidden = agree(case, &sets, &fan, &NONE);
                    met[usize::from(hidden & 1 != 0)] += 1;
                }
            }
        }
    }
    assert!(
        met.iter().all(|n| *n > 2000),
        "{met:?} end before and behind"
    );
}

/// Rays that cannot be traced, among rays that can.
#[test]
fn hostile_fans_agree_with_rays_alone() {
    let mut rng = rng(23);
    let mesh = soup(&mut rng, 100, 0.5, DVec3::ZERO, 1.0);
    let sets = on_all_sets(&mesh);
    let bad = [
        0.0,
        -0.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1e-300,
        1e300,
        5e-324,
        1e29,
        1e-29,
    ];
    let limits = [
        0.0,
        -0.0,
        -1.0,
        f64::NAN,
        f64::INFINITY,
        1e-300,
        1e300,
        1e29,
        1.0,
    ];
    for case in 0..cases(2000) {
        let mut directions: Vec<DVec3> = (0..rng.index(20)).map(|_| rng.in_cube(1.0)).collect();
        for direction in &mut directions {
            if rng.index(8) == 0 {
                direction[rng.index(3)] = bad[rng.index(bad.len())];
            }
            if rng.index(20) == 0 {
                *direction = DVec3::splat(bad[rng.index(bad.len())]);
            }
        }
        let mut origin = rng.in_cube(1.0);
        if rng.index(3) == 0 {
            origin[rng.index(3)] = bad[rng.index(bad.len())];
        }
        let t_max = limits[rng.index(limits.len())];
        let fan = Fan {
            origin,
            directions: &directions,
            t_min: limits[rng.index(limits.len())],
            t_max,
        };
        agree(case, &sets, &fan, &NONE);
    }
    let nothing = on_all_sets(&Mesh::default());
    let directions = [DVec3::X; FAN];
    let fan = Fan {
        origin: DVec3::ZERO,
        directions: &directions,
        t_min: 0.0,
        t_max: 1.0,
    };
    assert_eq!(agree(0, &nothing, &fan, &NONE), 0);
}

/// Rays that stay together are tested together.
#[test]
fn a_narrow_fan_does_the_work_of_a_ray() {
    let mut rng = rng(24);
    let mesh = soup(&mut rng, 16, 0.3, DVec3::ZERO, 1.0);
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    let origin = DVec3::new(0.0, 0.0, -2.0);
    let directions: Vec<DVec3> = (0..FAN)
        .map(|_| DVec3::Z * 4.0 + rng.in_cube(0.1))
        .collect();
    let (mut together, mut one) = (Scratch::new(), Scratch::new());
    let fan = |directions| Fan {
        origin,
        directions,
        t_min: 0.0,
        t_max: 1.0,
    };
    occluders.any_hits(&fan(&directions), &NONE, &mut together);
    occluders.any_hits(&fan(&directions[..1]), &NONE, &mut one);
    let tests = |s: &Scratch| s.counters.node_tests + s.counters.triangle_tests;
    assert_eq!((together.counters.rays, one.counters.rays), (FAN as u64, 1));
    assert!(tests(&together) <= 2 * tests(&one), "{together:?} {one:?}");
}

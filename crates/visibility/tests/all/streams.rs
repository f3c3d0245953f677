//! Streams of rays against the same rays one by one, and against brute force.

use crate::common::{InSpace, Mesh, closed, nearest, on_all_sets, soup};
use linelit_geometry::DVec3;
use linelit_testkit::cases::{cases, rng};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{Counters, Occluders, Ray, Scratch};
use std::ops::Range;

type Stream = Vec<(Ray, Range<u32>)>;

/// Holds a stream to its rays alone, on all instruction sets, which do the same work: that of a
/// single ray through a scratch that remembers nothing.
fn agree(case: u32, sets: &[Occluders], rays: &Stream) -> Vec<bool> {
    let mut work = Counters::default();
    let alone = rays.iter().map(|(ray, exclude)| {
        let mut scratch = Scratch::new();
        let meets = sets[0].any_hit(ray, exclude, &mut scratch);
        work += scratch.counters;
        meets
    });
    let want: Vec<bool> = alone.collect();
    for occluders in sets {
        let mut scratch = Scratch::new();
        // What was there before does not matter.
        let mut got: Vec<bool> = want.iter().map(|meets| !meets).collect();
        occluders.any_hit_stream(rays, &mut got, &mut scratch);
        let set = occluders.instruction_set();
        for (k, (got, want)) in got.iter().zip(&want).enumerate() {
            assert_eq!(got, want, "case {case}, {set}, ray {k}: {:?}", rays[k]);
        }
        assert_eq!(scratch.counters, work, "case {case}, {set}");
    }
    want
}

/// A point of a triangle: a corner, on an edge, or within.
fn on_triangle(rng: &mut SplitMix64, mesh: &Mesh) -> DVec3 {
    let [a, b, c] = mesh.corners(rng.index(mesh.triangles.len()));
    let (u, v) = (rng.next_f64(), rng.next_f64());
    match rng.index(4) {
        0 => a,
        1 => a + (b - a) * u,
        2 => (a + b) * 0.5,
        _ => a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v),
    }
}

/// Streams of all lengths, from and towards anywhere, corners and edges, at all scales.
#[test]
fn streams_agree_with_rays_alone() {
    let mut rng = rng(31);
    let (mut met, mut all) = (0, 0);
    for case in 0..cases(300) {
        let scale = [1.0, 1e6, 1e-6, 1e-18, 1e15][rng.index(5)];
        let centre = DVec3::splat([0.0, 0.0, 10.0, 1e4][rng.index(4)] * scale);
        let count = [1, 4, 30, 300, 2000][rng.index(5)];
        let size = [0.02, 0.3, 1.5][rng.index(3)];
        let mesh = match rng.index(3) {
            0 => closed(&mut rng, 7, 6, 0.6, centre, scale),
            _ => soup(&mut rng, count, size, centre, scale),
        };
        let sets = on_all_sets(&mesh);
        let place = |rng: &mut SplitMix64| match rng.index(4) {
            0 => on_triangle(rng, &mesh),
            _ => centre + rng.in_cube(1.3) * scale,
        };
        let length = [0, 1, 7, 8, 9, 30, 200][rng.index(7)];
        let mut rays = Stream::new();
        for _ in 0..length {
            let origin = place(&mut rng);
            let direction = match rng.index(8) {
                // Along an axis, where a component is zero.
                0 => [DVec3::X, DVec3::NEG_Y, DVec3::Z][rng.index(3)] * scale,
                _ => place(&mut rng) - origin,
            };
            let t_min = [0.0, 1e-4, -0.5][rng.index(3)];
            let t_max = [1.0, 1.0 - 1e-4, 1e4, f64::INFINITY][rng.index(4)];
            let ray = Ray {
                origin,
                direction,
                t_min,
                t_max,
            };
            rays.push((ray, [0..0, 0..3, 1..200][rng.index(3)].clone()));
        }
        met += agree(case, &sets, &rays).iter().filter(|m| **m).count();
        all += rays.len();
    }
    let met = met as f64 / all as f64;
    assert!(
        (0.2..0.8).contains(&met),
        "{met} of the rays meet something"
    );
}

/// Answers that brute force in `f64` gives, for what it decides.
#[test]
fn streams_agree_with_brute_force() {
    let mut rng = rng(32);
    let mut decided = [0; 2];
    for case in 0..cases(60) {
        let count = [3, 40, 400][rng.index(3)];
        let mesh = soup(&mut rng, count, 0.5, DVec3::ZERO, 1.0);
        let sets = on_all_sets(&mesh);
        let rays: Stream = (0..50)
            .map(|_| {
                let (origin, direction) = (rng.in_cube(1.5), rng.in_cube(2.0));
                (
                    Ray {
                        origin,
                        direction,
                        t_min: 0.0,
                        t_max: 1.0,
                    },
                    0..0,
                )
            })
            .collect();
        for ((ray, _), got) in rays.iter().zip(agree(case, &sets, &rays)) {
            let Some(met) = nearest(&mesh, ray) else {
                continue;
            };
            // Whether it ends before that is only certain beyond the rounding of t.
            if met.is_some_and(|t| (t - 1.0).abs() <= 1e-9) {
                continue;
            }
            let want = met.is_some_and(|t| t < 1.0);
            assert_eq!(got, want, "case {case}: {ray:?}, {met:?}");
            decided[usize::from(want)] += 1;
        }
    }
    assert!(
        decided.iter().all(|n| *n > 300),
        "{decided:?} miss and meet"
    );
}

/// An ordinary ray, within the cube around the origin that soups are in.
fn ordinary(rng: &mut SplitMix64) -> Ray {
    Ray {
        origin: rng.in_cube(1.0),
        direction: rng.in_cube(1.0),
        t_min: 0.0,
        t_max: 1.0,
    }
}

/// What no ray, or hardly one, can be traced with.
const BAD: [f64; 9] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    1e-300,
    1e300,
    5e-324,
    -1.0,
];

/// Hostile rays among ordinary ones.
#[test]
fn hostile_streams_agree_with_rays_alone() {
    let mut rng = rng(33);
    let mesh = soup(&mut rng, 100, 0.5, DVec3::ZERO, 1.0);
    let sets = on_all_sets(&mesh);
    let excluded = [
        0..0,
        Range { start: 3, end: 1 },
        u32::MAX - 1..u32::MAX,
        0..20,
        0..100,
    ];
    let mut met = 0;
    for case in 0..cases(500) {
        let mut rays = Stream::new();
        for _ in 0..rng.index(40) {
            let mut ray = ordinary(&mut rng);
            let bad = BAD[rng.index(BAD.len())];
            match case % 7 {
                0 => ray.origin = DVec3::splat(bad),
                1 => ray.origin.y = bad,
                2 => ray.direction = DVec3::splat(bad),
                3 => ray.direction.x = bad,
                4 => ray.t_min = bad,
                5 => ray.t_max = bad,
                _ => {}
            }
            rays.push((ray, excluded[rng.index(excluded.len())].clone()));
            rays.push((ordinary(&mut rng), 0..0));
        }
        met += agree(case, &sets, &rays).iter().filter(|m| **m).count();
    }
    assert!(met > 1000, "{met} meet something");
    let nothing = on_all_sets(&Mesh::default());
    let rays = vec![(ordinary(&mut rng), 0..0); 20];
    assert_eq!(agree(0, &nothing, &rays), [false; 20]);
}

#[test]
#[should_panic(expected = "an answer for each ray")]
fn answers_for_fewer_rays_are_refused() {
    let occluders = Occluders::build(&[], &[]);
    let rays = [(ordinary(&mut rng(34)), 0..0)];
    occluders.any_hit_stream(&rays, &mut [], &mut Scratch::new());
}

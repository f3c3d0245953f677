//! Closest hits of rays that are traced together, compared with the same rays one by one.

use crate::common::{InSpace, Mesh, closed, on_all_sets, soup};
use linelit_geometry::DVec3;
use linelit_testkit::cases::{cases, rng};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{Counters, Fan, Hit, Occluders, Ray, Scratch};

/// The closest hits of a fan's rays, one by one.
fn alone(occluders: &Occluders, fan: &Fan<'_>) -> Vec<Option<Hit>> {
    let mut scratch = Scratch::new();
    let hit = |direction: &DVec3| {
        let ray = Ray {
            t_min: fan.t_min,
            t_max: fan.t_max,
            ..Ray::new(fan.origin, *direction)
        };
        occluders.closest_hit(&ray, &mut scratch)
    };
    fan.directions.iter().map(hit).collect()
}

/// The bits of a hit.
fn bits(hit: &Option<Hit>) -> Option<(u32, [u64; 3])> {
    let Hit {
        triangle,
        t,
        barycentric: [b, c],
    } = (*hit)?;
    Some((triangle, [t, b, c].map(f64::to_bits)))
}

/// Compares rays traced together with rays traced alone, on all instruction sets, which do the same
/// work; returns how many hit anything.
fn agree(case: u32, sets: &[Occluders], fan: &Fan<'_>) -> usize {
    let want = alone(&sets[0], fan);
    let mut work: Option<Counters> = None;
    let mut got = vec![None; 3];
    for occluders in sets {
        let mut scratch = Scratch::new();
        occluders.closest_hits(fan, &mut got, &mut scratch);
        assert_eq!(got.len(), want.len(), "case {case}");
        for (i, (got, want)) in got.iter().zip(&want).enumerate() {
            let set = occluders.instruction_set();
            assert_eq!(
                bits(got),
                bits(want),
                "case {case}, {set}, ray {i}: {got:?} {want:?} {fan:?}"
            );
        }
        let counters = *work.get_or_insert(scratch.counters);
        assert_eq!(counters.rays, fan.directions.len() as u64);
        assert_eq!(counters, scratch.counters, "case {case}");
    }
    want.iter().flatten().count()
}

/// Neighbouring rays from a point, as through the pixels of a row, or in any directions.
fn some_rays(rng: &mut SplitMix64, origin: DVec3, at: DVec3, width: f64) -> Vec<DVec3> {
    let step = rng.in_cube(width);
    let spread = [0.0, 0.1, 30.0][rng.index(3)] * width;
    let unit = rng.index(2) == 0;
    (0..rng.index(40))
        .map(|i| {
            let d = at + step * i as f64 + rng.in_cube(spread) - origin;
            if unit { d.normalize_or(DVec3::Z) } else { d }
        })
        .collect()
}

#[test]
fn rays_together_meet_what_they_meet_alone() {
    let mut rng = rng(41);
    let (mut met, mut all) = (0, 0);
    for case in 0..cases(2000) {
        let scale = [1.0, 1e6, 1e-6, 1e-18, 1e15][rng.index(5)];
        let centre = DVec3::splat([0.0, 0.0, 10.0, 1e4][rng.index(4)] * scale);
        let count = [1, 4, 30, 300, 2000][rng.index(5)];
        let size = [0.02, 0.3, 1.5][rng.index(3)];
        let mut mesh = match rng.index(3) {
            0 => closed(&mut rng, 7, 6, 0.6, centre, scale),
            _ => soup(&mut rng, count, size, centre, scale),
        };
        // The same triangles a second time: among equally near ones, the first counts.
        if rng.index(4) == 0 {
            let again = mesh.triangles.clone();
            mesh.triangles.extend(again);
        }
        let sets = on_all_sets(&mesh);
        let far = [0.5, 3.0, 20.0][rng.index(3)];
        let origin = centre + rng.in_cube(far) * scale;
        // A point in the scene, or a corner at which several triangles meet.
        let at = match rng.index(3) {
            0 => mesh.corners(rng.index(mesh.triangles.len()))[rng.index(3)],
            _ => centre + rng.in_cube(1.0) * scale,
        };
        let width = [0.0, 1e-6, 0.01, 0.3][rng.index(4)] * scale;
        let directions = some_rays(&mut rng, origin, at, width);
        let t_max = [f64::INFINITY, f64::INFINITY, 1.0, 1e3 * scale][rng.index(4)];
        let fan = Fan {
            origin,
            directions: &directions,
            t_min: [0.0, 0.0, 0.3 * scale][rng.index(3)],
            t_max,
        };
        met += agree(case, &sets, &fan);
        all += directions.len();
    }
    let met = met as f64 / all as f64;
    assert!((0.2..0.8).contains(&met), "{met} of the rays meet anything");
}

/// Rays for which the tests in lanes are not valid: directions along different axes, zero or not
/// finite; and an empty scene.
#[test]
fn rays_of_all_kinds_agree() {
    let mut rng = rng(42);
    let mesh = soup(&mut rng, 100, 0.5, DVec3::ZERO, 1.0);
    let sets = on_all_sets(&mesh);
    let nothing = Mesh {
        positions: vec![],
        triangles: vec![],
    };
    let odd = [
        DVec3::ZERO,
        DVec3::X,
        -DVec3::Z,
        DVec3::ONE,
        DVec3::NAN,
        DVec3::INFINITY,
        DVec3::splat(1e-320),
        DVec3::splat(1e300),
        DVec3::new(1.0, -0.0, 0.0),
    ];
    for case in 0..200 {
        let mut directions = vec![DVec3::Y + rng.in_cube(0.2); 11];
        directions[rng.index(11)] = odd[rng.index(odd.len())];
        let origin = match rng.index(8) {
            0 => DVec3::splat(f64::NAN),
            1 => DVec3::splat(1e200),
            _ => rng.in_cube(1.0),
        };
        for t_max in [f64::INFINITY, 1.0, 0.0, -1.0, f64::NAN] {
            let fan = Fan {
                origin,
                directions: &directions,
                t_min: [0.0, 2.0, -1.0, f64::NAN][case as usize % 4],
                t_max,
            };
            agree(case, &sets, &fan);
            assert_eq!(agree(case, &on_all_sets(&nothing), &fan), 0);
        }
    }
}

/// Rays that stay together are tested together.
#[test]
fn narrow_groups_do_the_work_of_a_ray() {
    let mut rng = rng(43);
    let mesh = soup(&mut rng, 16, 0.3, DVec3::ZERO, 1.0);
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    let directions: Vec<DVec3> = (0..8).map(|_| DVec3::Z + rng.in_cube(0.01)).collect();
    let fan = Fan {
        origin: DVec3::new(0.0, 0.0, -2.0),
        directions: &directions,
        t_min: 0.0,
        t_max: f64::INFINITY,
    };
    let (mut together, mut one) = (Scratch::new(), Scratch::new());
    occluders.closest_hits(&fan, &mut Vec::new(), &mut together);
    let ray = Ray::new(fan.origin, directions[0]);
    occluders.closest_hit(&ray, &mut one);
    let tests = |s: &Scratch| s.counters.node_tests + s.counters.triangle_tests;
    assert!(tests(&together) <= 2 * tests(&one), "{together:?} {one:?}");
}

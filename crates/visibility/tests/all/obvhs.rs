//! Answers do not depend on which builder grew the tree.

use crate::common::{InSpace, Mesh, NONE, ask, chord, closed, light, nearest, past_all, soup};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_testkit::{cases::cases, rng::SplitMix64};
use linelit_visibility::{BuildOptions, Builder, Occluders, Ray, Scratch, ShaftClass};
use proptest::prelude::*;

/// The same triangles under both trees, for rays alone or not.
fn both(mesh: &Mesh, for_rays: bool) -> [Occluders; 2] {
    [Builder::Own, Builder::Obvhs].map(|builder| {
        let options = BuildOptions { for_rays, builder };
        Occluders::build_with(&mesh.positions, &mesh.triangles, options)
    })
}

/// Queries both with rays and lines from and to points within `size` of the origin: the answers are
/// equal, and agree with brute force as far as that is certain. `few` says that there are so few
/// triangles that no shaft depends on the tree.
fn agree(mesh: &Mesh, size: f64, few: bool, rng: &mut SplitMix64) {
    let [own, other] = &both(mesh, !few);
    assert_eq!(own.triangle_count(), other.triangle_count());
    let (mut a, mut b) = (Scratch::new(), Scratch::new());
    for corners in [2, 3, 4, 6] {
        let (point, at) = (rng.in_cube(1.2 * size), rng.in_cube(1.2 * size));
        for _ in 0..16 {
            let ray = Ray::new(point, rng.direction());
            let [hit, expected] = [
                other.closest_hit(&ray, &mut a),
                own.closest_hit(&ray, &mut b),
            ];
            assert_eq!(hit.map(|h| h.t.to_bits()), expected.map(|h| h.t.to_bits()));
            if let Some(nearest) = nearest(mesh, &ray) {
                assert_eq!(hit.is_some(), nearest.is_some());
            }
            assert_eq!(other.any_hit(&ray, &NONE, &mut a), hit.is_some());
        }
        let light = light(rng, corners, at, 0.2 * size);
        let lines: Vec<Segment> = (0..6).map(|_| chord(rng, &light, None)).collect();
        let (class, parts) = ask(other, point, (&light, &lines), &NONE, &mut a);
        let (expected, all) = ask(own, point, (&light, &lines), &NONE, &mut b);
        // A triangle next to the shaft may be rejected by its box in one tree, and only by its
        // image in the other.
        if few && class != expected {
            assert!(![class, expected].contains(&ShaftClass::Blocked));
            assert!((0..lines.len()).all(|i| all.line(i) == [Interval::UNIT]));
        }
        for (i, line) in lines.iter().enumerate() {
            if few {
                assert_eq!(parts.line(i), all.line(i));
            }
            let want = past_all(mesh, point, line, &NONE);
            let want: f64 = want.iter().map(|part| part.hi - part.lo).sum();
            // As in `agreement`: 1e-9 of the line.
            assert!((parts.fraction(i) - want).abs() <= 1e-9);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(48)))]

    #[test]
    fn trees_do_not_matter(seed in any::<u64>(), size in 0u32..120) {
        let mut rng = SplitMix64::new(seed);
        let mesh = match rng.index(2) {
            0 => soup(&mut rng, size as usize, 0.5, DVec3::ZERO, 2.0),
            _ => closed(&mut rng, 3 + size / 20, 3 + size / 20, 0.6, DVec3::ZERO, 1.0),
        };
        agree(&mesh, 2.0, true, &mut rng);
    }
}

/// None, one and two triangles; hundreds without area, in rows, and copies; as large and as small
/// as scene files may be.
#[test]
fn trees_do_not_matter_on_hostile_meshes() {
    let mut rng = SplitMix64::new(3);
    for count in [0, 1, 2, 3] {
        agree(
            &soup(&mut rng, count, 0.9, DVec3::ZERO, 1.0),
            1.0,
            true,
            &mut rng,
        );
    }
    let one = [(-0.4, -0.3), (0.5, -0.2), (0.0, 0.6)].map(|(x, y)| DVec3::new(x, y, 0.0));
    for scale in [1.0, 2.0_f64.powi(60), 2.0_f64.powi(-60)] {
        let [mut copies, mut row, mut flat] = [(); 3].map(|()| Mesh::default());
        for k in 0..200 {
            let x = DVec3::X * (0.01 * f64::from(k - 100));
            let [a, b, c] = one;
            copies.triangle(a * scale, b * scale, c * scale);
            row.triangle((x + a * 0.01) * scale, (x + b) * scale, (x + c) * scale);
            flat.triangle(
                x * scale,
                (x + DVec3::X) * scale,
                (x + DVec3::X * 2.0) * scale,
            );
        }
        for mesh in [copies, row, flat] {
            agree(&mesh, scale, true, &mut rng);
        }
    }
    let far = soup(&mut rng, 200, 1.0, DVec3::ZERO, 2.0_f64.powi(59));
    agree(&far, 2.0_f64.powi(59), true, &mut rng);
}

/// Thousands of copies, for which clustering alone would take quadratic time and make a list.
#[test]
fn thousands_of_copies_are_built() {
    let mut rng = SplitMix64::new(4);
    let mut mesh = soup(&mut rng, 1, 0.9, DVec3::ZERO, 1.0);
    mesh.triangles = vec![mesh.triangles[0]; 50_000];
    agree(&mesh, 1.0, false, &mut rng);
}

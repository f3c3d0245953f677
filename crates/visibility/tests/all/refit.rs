//! Triangles that have moved give the same answers as if the hierarchy had been built with them
//! there.

use crate::common::{InSpace, Mesh, NONE, ask, chord, closed, light, soup};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_testkit::{cases::cases, rng::SplitMix64};
use linelit_visibility::{Occluders, Ray, Scratch, ShaftClass};
use proptest::prelude::*;

/// Queries both with rays and lines; neither is so dense that its shafts depend on the tree.
fn agree(moved: &Occluders, fresh: &Occluders, rng: &mut SplitMix64) -> Result<(), TestCaseError> {
    let (mut a, mut b) = (Scratch::new(), Scratch::new());
    for corners in [2, 3, 4, 6] {
        let (point, at) = (rng.in_cube(3.0), rng.in_cube(3.0));
        let light = light(rng, corners, at, 0.4);
        let lines: Vec<Segment> = (0..6).map(|_| chord(rng, &light, None)).collect();
        let (class, parts) = ask(moved, point, (&light, &lines), &NONE, &mut a);
        let (expected, all) = ask(fresh, point, (&light, &lines), &NONE, &mut b);
        // A triangle next to the shaft may be rejected by its box in one tree, and only by its
        // image in the other.
        if class != expected {
            prop_assert!(![class, expected].contains(&ShaftClass::Blocked));
            prop_assert!((0..lines.len()).all(|i| all.line(i) == [Interval::UNIT]));
        }
        for i in 0..lines.len() {
            prop_assert_eq!(parts.line(i), all.line(i));
        }
        for _ in 0..16 {
            let ray = Ray::new(point, rng.direction());
            let (hit, expected) = (
                moved.closest_hit(&ray, &mut a),
                fresh.closest_hit(&ray, &mut b),
            );
            prop_assert_eq!(hit.map(|h| h.t), expected.map(|h| h.t));
            let any = moved.any_hit(&ray, &NONE, &mut a);
            prop_assert_eq!(any, fresh.any_hit(&ray, &NONE, &mut b));
        }
    }
    prop_assert_eq!(moved.triangle_count(), fresh.triangle_count());
    prop_assert_eq!(moved.left_out(), fresh.left_out());
    Ok(())
}

/// The mesh with each of its corners moved.
fn moved(mesh: &Mesh, rng: &mut SplitMix64, by: f64) -> Mesh {
    let mut mesh = mesh.clone();
    for corner in &mut mesh.positions {
        let v = DVec3::from_array(corner.map(f64::from)) + rng.in_cube(by);
        *corner = v.as_vec3().to_array();
    }
    mesh
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(48)))]

    #[test]
    fn refit_answers_as_built(seed in any::<u64>(), size in 0u32..120, by in 0.0f64..2.0) {
        let mut rng = SplitMix64::new(seed);
        let mut mesh = match rng.index(2) {
            0 => soup(&mut rng, size as usize, 0.5, DVec3::ZERO, 2.0),
            _ => closed(&mut rng, 3 + size / 20, 3 + size / 20, 0.6, DVec3::ZERO, 1.0),
        };
        let mut occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        for _ in 0..3 {
            mesh = moved(&mesh, &mut rng, by);
            occluders.refit(&mesh.positions, &mesh.triangles);
            let fresh = Occluders::build(&mesh.positions, &mesh.triangles);
            agree(&occluders, &fresh, &mut rng)?;
        }
    }

    /// A vertex that is not finite for a while, or equal to another; fewer triangles; none.
    #[test]
    fn what_can_hide_may_change(seed in any::<u64>(), size in 2usize..60) {
        let mut rng = SplitMix64::new(seed);
        let mut mesh = soup(&mut rng, size, 0.5, DVec3::ZERO, 2.0);
        let mut occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let kept = mesh.positions[0];
        for corner in [[f32::NAN; 3], kept, mesh.positions[1], [f32::INFINITY, 0.0, 0.0], kept] {
            mesh.positions[0] = corner;
            occluders.refit(&mesh.positions, &mesh.triangles);
            let fresh = Occluders::build(&mesh.positions, &mesh.triangles);
            agree(&occluders, &fresh, &mut rng)?;
        }
        for fewer in [size / 2, 0, 1] {
            let triangles = &mesh.triangles[..fewer];
            occluders.refit(&mesh.positions, triangles);
            agree(&occluders, &Occluders::build(&mesh.positions, triangles), &mut rng)?;
        }
    }
}

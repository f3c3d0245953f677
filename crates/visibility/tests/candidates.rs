//! The triangles that a shaft names are those that matter: all of them, each once.

mod common;

use common::{Rng, chord, light, soup};
use linelit_geometry::DVec3;
use linelit_visibility::{
    LightCorners, Occluders, Scratch, ShaftClass, ShaftQuery, VisibleLines, brute,
};

#[test]
fn candidates_are_all_that_hides_anything() {
    // The same in a long run, too: 1e-9 below is for these cases. At 1e5 from the origin a side that lies nearly along
    // a line moves an end by more (1.2e-9 in one of 600 cases of another seed).
    let mut rng = Rng(11);
    let mut scratch = Scratch::new();
    let mut out = VisibleLines::new();
    let mut seen = [0; 4];
    for case in 0..600 {
        let centre = [DVec3::ZERO, DVec3::splat(1e5)][case % 2];
        let mesh = soup(&mut rng, [20, 150, 900][case % 3], 0.2, centre, 1.0);
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let at = centre + rng.in_cube(1.5);
        let light = light(&mut rng, [3, 4, 5, 2][case % 4], at, 0.4);
        let point = centre + rng.in_cube(1.2);
        let lines: Vec<_> = (0..12)
            .map(|_| chord(&mut rng, &light, Some(0.4)))
            .collect();
        let exclude = 0..2;
        let query = ShaftQuery {
            point,
            light: LightCorners::new(&light).unwrap(),
            exclude: exclude.clone(),
        };
        let mut shaft = occluders.shaft(query, &mut scratch);
        assert_eq!(shaft.is_dense(), shaft.candidate_triangles().is_none());
        let (Some(ids), Some(corners)) = (shaft.candidate_triangles(), shaft.candidate_corners())
        else {
            seen[0] += 1;
            continue;
        };
        let ids: Vec<u32> = ids.collect();
        let corners: Vec<_> = corners.collect();
        assert_eq!(ids.len(), corners.len());
        for (&id, corners) in ids.iter().zip(&corners) {
            assert!(!exclude.contains(&id));
            // As they were given, far from the origin too: to the bit, in any order of corners.
            let given = mesh.corners(id as usize);
            assert!(
                corners.iter().all(|v| given.contains(v)),
                "{given:?} {corners:?}"
            );
        }
        let mut once = ids.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), ids.len());
        assert!(ids.len() <= shaft.candidates());
        match shaft.class() {
            ShaftClass::Partial => {
                seen[1] += 1;
                assert!(!ids.is_empty());
            }
            ShaftClass::Empty => {
                seen[2] += 1;
                assert!(ids.is_empty());
            }
            ShaftClass::Blocked => {
                seen[3] += 1;
                assert!(ids.is_empty());
                continue;
            }
        }
        // Nothing but the candidates hides any of the lines.
        shaft.visible(&lines, &mut out);
        let few: Vec<[u32; 3]> = ids.iter().map(|&i| mesh.triangles[i as usize]).collect();
        for (i, line) in lines.iter().enumerate() {
            let all = brute::visible(&mesh.positions, &mesh.triangles, point, line, &exclude);
            let some = brute::visible(&mesh.positions, &few, point, line, &(0..0));
            let length = |v: &[linelit_geometry::intervals::Interval]| -> f64 {
                v.iter().map(|i| i.hi - i.lo).sum()
            };
            // Sums of a few intervals, whose ends are good to 1e-12 each.
            assert!((length(&all) - length(&some)).abs() <= 1e-9);
            assert!((length(&some) - out.fraction(i)).abs() <= 1e-9);
        }
    }
    assert!(seen.iter().skip(1).all(|&n| n >= 20), "{seen:?}");
}

/// A shaft with thousands of triangles keeps none of them.
#[test]
fn dense_shafts_name_nothing() {
    let mut rng = Rng(linelit_testkit::cases::seed(12));
    let mesh = soup(&mut rng, 6000, 0.1, DVec3::ZERO, 1.0);
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    let light = light(&mut rng, 4, DVec3::Z * 1.5, 1.0);
    let mut scratch = Scratch::new();
    let query = ShaftQuery {
        point: DVec3::Z * -1.4,
        light: LightCorners::new(&light).unwrap(),
        exclude: 0..0,
    };
    let shaft = occluders.shaft(query, &mut scratch);
    assert!(shaft.is_dense());
    assert!(shaft.candidate_triangles().is_none());
    assert!(shaft.candidate_corners().is_none());
    assert!(shaft.candidates() > 200);
}

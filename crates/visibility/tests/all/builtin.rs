//! The built-in scenes, compared with brute force: a hundred thousand lines each.

use crate::common::{InSpace, NONE, ask, shading_points};
use linelit_geometry::Margins;
use linelit_scenes::{Library, VisibilityScene, stratified_lines};
use linelit_visibility::{Occluders, Scratch, brute};

/// Ends of intervals are `f64` in the light's frame, whose coordinates of a vertex are off by a
/// few ε times its distance over the light's size (at most 1e2 here); a side nearly along the
/// line multiplies that by its slope, which exceeds 1e4 for fewer than one crossing in 1e8. That
/// makes 1e-10, and the requirement is 1e-5.
const TOLERANCE: f64 = 1e-9;

#[test]
fn builtin_scenes_agree_with_brute_force() {
    let mut rng = linelit_testkit::cases::rng(9);
    for name in ["triangle-soup-large", "grid-planes-large"] {
        let scene = VisibilityScene::load(&Library::default(), name).unwrap();
        let occluders = Occluders::build(&scene.positions, &scene.triangles);
        let points = shading_points(&occluders, &scene, [36, 27]);
        let mut scratch = Scratch::new();
        let mut count = 0;
        while count < 100_000 {
            let (_, light) = &scene.lights[rng.index(2)];
            let lines = stratified_lines(light, 48, &mut || rng.next_f64());
            for &point in &points {
                let on_light = (&light[..], &lines[..]);
                let (class, out) = ask(&occluders, point, on_light, &NONE, &mut scratch);
                for (i, line) in lines.iter().enumerate() {
                    let want = brute::visible(
                        &scene.positions,
                        &scene.triangles,
                        point,
                        line,
                        &NONE,
                        Margins::DEFAULT,
                    );
                    let want: f64 = want.iter().map(|i| i.hi - i.lo).sum();
                    let got = out.fraction(i);
                    let right = (got - want).abs() <= TOLERANCE
                        && (got > 0.0) == (want > 0.0)
                        && (got < 1.0) == (want < 1.0);
                    assert!(
                        right,
                        "{} {point} line {i}: {got} {want}, {class:?}",
                        scene.name,
                    );
                }
                count += lines.len();
            }
        }
    }
}

/// A part of the colonnade: forty thousand triangles of columns, arches, plants and curtains, with
/// empty, partial and dense shafts.
#[test]
fn colonnade_agrees_with_brute_force() {
    let whole = VisibilityScene::load(&Library::default(), "colonnade-large").unwrap();
    let inside = |t: &&[u32; 3]| {
        let x = |i: u32| whole.positions[i as usize][0];
        let near = |i: u32| (-4.4..-2.6).contains(&x(i));
        t.iter().any(|&i| near(i)) || t.iter().any(|&i| x(i) > 9.0)
    };
    let triangles: Vec<[u32; 3]> = whole.triangles.iter().filter(inside).copied().collect();
    assert!(triangles.len() > 20_000, "{}", triangles.len());
    let occluders = Occluders::build(&whole.positions, &triangles);
    let points = shading_points(&occluders, &whole, [12, 9]);
    let mut rng = linelit_testkit::cases::rng(10);
    let mut scratch = Scratch::new();
    for (_, light) in &whole.lights {
        for &point in &points {
            let lines = stratified_lines(light, 8, &mut || rng.next_f64());
            let on_light = (&light[..], &lines[..]);
            let (class, out) = ask(&occluders, point, on_light, &NONE, &mut scratch);
            for (i, line) in lines.iter().enumerate() {
                let want = brute::visible(
                    &whole.positions,
                    &triangles,
                    point,
                    line,
                    &NONE,
                    Margins::DEFAULT,
                );
                let want: f64 = want.iter().map(|i| i.hi - i.lo).sum();
                let got = out.fraction(i);
                let right = (got - want).abs() <= TOLERANCE && (got > 0.0) == (want > 0.0);
                assert!(right, "{point} line {i}: {got} {want}, {class:?}");
            }
        }
    }
    let c = scratch.counters;
    assert!(
        c.dense_shafts > 3 && c.partial_shafts - c.dense_shafts > 10,
        "{c:?}"
    );
}

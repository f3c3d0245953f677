//! The built-in scenes against brute force: a hundred thousand lines each.

mod common;

use common::{NONE, Rng};
use linelit_visibility::{Occluders, Scratch, ShaftQuery, VisibleLines, brute, measure};

/// Ends of intervals are `f64` in the light's frame, whose coordinates of a vertex are off by a
/// few ε times its distance over the light's size (at most 1e2 here); a side nearly along the
/// line multiplies that by its slope, which exceeds 1e4 for fewer than one crossing in 1e8. That
/// makes 1e-10, and the requirement is 1e-5.
const TOLERANCE: f64 = 1e-9;

#[test]
fn builtin_scenes_agree_with_brute_force() {
    let mut rng = Rng(9);
    for scene in [measure::soup(), measure::grid()] {
        let occluders = Occluders::build(&scene.positions, &scene.triangles);
        let points = measure::shading_points(&occluders, &scene.view(36, 27), 2e-5);
        let mut scratch = Scratch::new();
        let mut out = VisibleLines::new();
        let mut count = 0;
        while count < 100_000 {
            let (_, light) = &scene.lights[rng.index(2)];
            let lines = measure::stratified_lines(light, 48, &mut || rng.unit());
            for &point in &points {
                let query = ShaftQuery {
                    point,
                    light,
                    exclude: NONE,
                };
                let mut shaft = occluders.shaft(query, &mut scratch);
                shaft.visible(&lines, &mut out);
                for (i, line) in lines.iter().enumerate() {
                    let want =
                        brute::visible(&scene.positions, &scene.triangles, point, line, &NONE);
                    let want: f64 = want.iter().map(|i| i.hi - i.lo).sum();
                    let got = out.fraction(i);
                    let right = (got - want).abs() <= TOLERANCE
                        && (got > 0.0) == (want > 0.0)
                        && (got < 1.0) == (want < 1.0);
                    assert!(
                        right,
                        "{} {point} line {i}: {got} {want}, {:?} with {}",
                        scene.name,
                        shaft.class(),
                        shaft.candidates()
                    );
                }
                count += lines.len();
            }
        }
    }
}

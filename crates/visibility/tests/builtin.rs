//! The built-in scenes against brute force.

mod common;

use common::NONE;
use linelit_visibility::{Occluders, Scratch, ShaftQuery, VisibleLines, brute, measure};

#[test]
fn builtin_scenes_agree_with_brute_force() {
    for scene in [measure::soup(), measure::grid()] {
        let occluders = Occluders::build(&scene.positions, &scene.triangles);
        let points = measure::shading_points(&occluders, &scene.view(12, 9), 2e-5);
        let mut scratch = Scratch::new();
        let mut out = VisibleLines::new();
        for (name, light) in &scene.lights {
            let lines = measure::stratified_lines(light, 16, &mut || 0.3);
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
                    assert!(
                        (got - want).abs() <= 1e-9,
                        "{} {name} {point} line {i}: {got} {want}, {:?} with {} {:?}",
                        scene.name,
                        shaft.class(),
                        shaft.candidates(),
                        out.line(i)
                    );
                }
            }
        }
    }
}

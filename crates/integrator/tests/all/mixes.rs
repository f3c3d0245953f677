//! Every combination of points and lines gives the same light.

use crate::common::{
    CLUTTER, Case, MIXES, ON_THE_FLOOR, PHONG, QUAD_AND_SPHERE, SQUARE, THROUGH_THE_FLOOR,
    TOUCHING, TRIANGLE, agree_on, microfacets, points, room, room_with_floor, settings, trials,
};
use linelit_integrator::{Renderer, Settings, Workspace};

/// Numbers of samples that the techniques divide evenly, and numbers that they do not. Points need
/// more samples: where little is visible, a few of them may all be zero, for which a z test does
/// not work.
fn mixes() -> Vec<Case> {
    let case = |(k, name): (usize, &&'static str)| Case {
        name,
        samples: if name.contains("line") { 12 } else { 240 } + u32::from(k % 3 == 2),
        skip: k % 2 == 0,
    };
    MIXES.iter().enumerate().map(case).collect()
}

/// A traversal for each line and point, or one traversal for all, gives the same light but for the
/// rounding of the ends of intervals.
#[test]
fn sharing_the_shaft_changes_nothing() {
    let scene = room(SQUARE, CLUTTER);
    let renderer = Renderer::new(&scene);
    let mut workspace = Workspace::new();
    for name in MIXES {
        // One point for all pieces may jump to another piece if a bit changes; optimal coefficients
        // amplify rounding; and the largest density may become the density of another technique.
        if ["pieces=one", "optimal", "maximum"]
            .iter()
            .any(|w| name.contains(w))
        {
            continue;
        }
        let shared = settings(name, 12, 3);
        let apart = Settings {
            share: false,
            ..shared
        };
        for (pixel, point) in points(&renderer) {
            let mut direct = |s| renderer.direct(s, &point, pixel, &mut workspace);
            let (a, b) = (direct(&shared), direct(&apart));
            // Ends of intervals are good to 1e-12 of the light in either shaft. A short piece that
            // only one of the two finds has as much light as its length.
            assert!(
                (a - b).abs().max_element() <= 1e-7 * a.max_element().max(1e-3),
                "{name} at {pixel:?}: {a} and {b}"
            );
        }
    }
}

#[test]
fn square_light_behind_clutter() {
    agree_on(&room(SQUARE, CLUTTER), &mixes());
}

#[test]
fn triangular_light_behind_clutter() {
    agree_on(&room(TRIANGLE, CLUTTER), &mixes());
}

#[test]
fn nothing_between() {
    agree_on(&room(SQUARE, ""), &mixes());
}

/// The light crosses the horizon of the floor, and is partly behind occluders.
#[test]
fn light_through_the_floor() {
    agree_on(&room(THROUGH_THE_FLOOR, CLUTTER), &mixes());
}

#[test]
fn light_touches_the_floor() {
    agree_on(&room(ON_THE_FLOOR, CLUTTER), &mixes());
}

#[test]
fn quad_and_sphere_occluders() {
    agree_on(&room(SQUARE, QUAD_AND_SPHERE), &mixes());
}

#[test]
fn glossy_floor_behind_clutter() {
    agree_on(&room_with_floor(PHONG), &mixes());
}

/// Microfacets that range from rough to nearly a mirror.
#[test]
fn microfacet_floors_behind_clutter() {
    for alpha in [0.3, 0.05] {
        agree_on(&room_with_floor(&microfacets(alpha)), &mixes());
    }
}

#[test]
fn occluder_touches_the_light() {
    agree_on(&room(SQUARE, TOUCHING), &mixes());
}

/// Only the ratios of shares matter, no matter how large they are.
#[test]
fn large_shares_are_shares() {
    let scene = room(SQUARE, CLUTTER);
    let renderer = Renderer::new(&scene);
    let point = points(&renderer)[40].clone();
    let light = |name: &str| trials(&renderer, &settings(name, 4, 1), &point, 8);
    let most = u32::MAX;
    let large = light(&format!("line-area:{most}+point-area:{most}"));
    assert_eq!(large, light("line-area+point-area"));
}

/// With many samples, optimal weights have less variance than the weights of the balance heuristic.
#[test]
fn optimal_weights_pay() {
    let scene = room(SQUARE, CLUTTER);
    let renderer = Renderer::new(&scene);
    let all = points(&renderer);
    let variance = |mis: &str| -> f64 {
        let name = format!("line-solid-angle+point-bsdf[mis={mis}]");
        let settings = settings(&name, 128, 77);
        let few = all.iter().step_by(5);
        few.map(|p| trials(&renderer, &settings, p, 32).1.length_squared())
            .sum()
    };
    // Measured: 0.605 and 0.607. The relative error of some 50 variances of 32 trials each is
    // sqrt(2/31/50) = 4 %, and 5 % in a ratio: 0.75 is 4 of its deviations away.
    let balance = variance("balance");
    assert!(variance("optimal") < 0.75 * balance);
    assert!(variance("clamped-optimal") < 0.75 * balance);
}

//! Every estimator gives the same light.

use crate::common::{
    CLUTTER, Case, MATTE, SQUARE, THROUGH_THE_FLOOR, TRIANGLE, agree_on, load, points, room,
    room_text, settings,
};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings};

const ESTIMATORS: [&str; 17] = [
    "point-area",
    "point-bsdf",
    "point-solid-angle",
    "line-area",
    "line-area[orientation=fixed:0.3,offset=uniform]",
    "line-analytic",
    "line-analytic[orientation=uniform]",
    "line-analytic[orientation=fixed:0]",
    "line-analytic[control=none]",
    "exact",
    "hybrid",
    "point-area[visibility=shaft]",
    "point-solid-angle[visibility=shaft]",
    "line-area[orientation=stratified]",
    "line-analytic[orientation=stratified]",
    "line-area[orientation=origin]",
    "line-analytic[orientation=origin]",
];

/// A combination with techniques of all kinds.
const MIX: Case = Case {
    name: "line-solid-angle+point-bsdf",
    samples: 16,
    skip: true,
};

/// The estimators by name and number of samples per trial; every second one takes all samples.
fn estimators() -> Vec<Case> {
    let case = |(k, name): (usize, &&'static str)| Case {
        name,
        samples: if *name == "point-bsdf" { 512 } else { 16 },
        skip: k % 2 == 0,
    };
    ESTIMATORS.iter().enumerate().map(case).collect()
}

fn agree(light: &str, occluders: &str) {
    agree_on(&room(light, occluders), &estimators());
}

#[test]
fn square_light_unoccluded() {
    agree(SQUARE, "");
}

#[test]
fn square_light_behind_clutter() {
    agree(SQUARE, CLUTTER);
}

#[test]
fn triangular_light_behind_clutter() {
    agree(TRIANGLE, CLUTTER);
}

/// The light crosses the horizon of the floor.
#[test]
fn light_through_the_floor() {
    let light = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
        "point P" [ -1.5 -1 -0.5  -1.5 1 -0.5  -1.5 1 1.5  -1.5 -1 1.5 ]"#;
    agree(light, CLUTTER);
}

/// Skips change no bit if the method is the same.
#[test]
fn skips_do_not_change_points() {
    let scene = room(SQUARE, CLUTTER);
    let renderer = Renderer::new(&scene);
    let mut workspace = linelit_integrator::Workspace::new();
    for name in ["point-area", "point-solid-angle", "line-area"] {
        for (pixel, point) in points(&renderer) {
            let on = settings(name, 8, 3);
            let off = Settings { skip: false, ..on };
            let a = renderer.direct(&on, &point, pixel, &mut workspace);
            let b = renderer.direct(&off, &point, pixel, &mut workspace);
            assert_eq!(
                a.to_array().map(f64::to_bits),
                b.to_array().map(f64::to_bits),
                "{name} {pixel:?}"
            );
        }
    }
}

/// If the light is neither hidden nor below the horizon, `exact` is Lambert's formula.
#[test]
fn exact_is_lamberts_formula() {
    let scene = room(SQUARE, "");
    let renderer = Renderer::new(&scene);
    let mut workspace = linelit_integrator::Workspace::new();
    for (pixel, point) in points(&renderer) {
        let got = renderer.direct(&settings("exact", 1, 0), &point, pixel, &mut workspace);
        // An independent evaluation: a fine midpoint rule on the light, with the error O(h^2) for h
        // = 1/256. The second derivatives of the integrand are below 10 of its scale here, so that
        // the relative error is 1/24 h^2 10 2 = 1.3e-5.
        let n = 256;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
                let w = DVec3::new(at(i), at(j), 2.0) - point.position;
                sum += w.z.max(0.0) * w.z / w.length_squared().powi(2);
            }
        }
        let want = DVec3::new(8.0 * 0.7, 6.0 * 0.5, 4.0 * 0.3) / std::f64::consts::PI * sum
            / f64::from(n * n);
        // Positions and radiances of the file are f32: 6e-8.
        assert!(
            (got - want).abs().cmple(want * 1.4e-5).all(),
            "{pixel:?}: {got} {want}"
        );
    }
    let counts = workspace.take_counts();
    assert!(counts.plan.closed_form > 100);
    assert_eq!(counts.segments.lines, 0);
}

/// A glossy floor: closed forms of the lobe, compared with points.
#[test]
fn phong_floor_behind_clutter() {
    let floor = r#"Material "phong" "rgb Kd" [ 0.2 0.1 0.3 ] "rgb Ks" [ 0.5 0.6 0.7 ] "float exponent" [ 40.5 ]"#;
    let scene = load(
        &room_text(SQUARE, CLUTTER).replace(r#"Material "matte" "rgb Kd" [ 0.7 0.5 0.3 ]"#, floor),
    );
    agree_on(&scene, &estimators());
}

/// A lobe with the exponent zero still ends at its own horizon: light from behind it is dark by
/// points, by lines and in closed form.
#[test]
fn phong_floor_of_exponent_zero() {
    let floor = r#"Material "phong" "rgb Kd" [ 0.1 0.1 0.1 ] "rgb Ks" [ 0.5 0.6 0.7 ] "float exponent" [ 0 ]"#;
    let text = room_text(THROUGH_THE_FLOOR, "")
        .replace(MATTE, floor)
        .replace("LookAt 0 -0.5 5", "LookAt -3.5 0 5");
    let all: Vec<Case> = estimators().into_iter().chain([MIX]).collect();
    agree_on(&load(&text), &all);
    // It is the limit of small exponents, since ln of a cosine is above −700.
    let (none, little) = (load(&text), load(&text.replace("[ 0 ]", "[ 1e-9 ]")));
    let renderers = [Renderer::new(&none), Renderer::new(&little)];
    let mut workspace = linelit_integrator::Workspace::new();
    let [zero, small] = renderers.each_ref().map(|renderer| {
        let direct = |(pixel, point): ([u32; 2], _)| {
            renderer.direct(&settings("exact", 1, 0), &point, pixel, &mut workspace)
        };
        points(renderer).into_iter().map(direct).collect::<Vec<_>>()
    });
    assert!(zero.len() > 60 && zero.len() == small.len());
    for (a, b) in zero.iter().zip(&small) {
        assert!((*a - *b).abs().cmple(*a * 1e-6).all(), "{a} {b}");
    }
}

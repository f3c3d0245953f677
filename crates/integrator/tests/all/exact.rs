//! Soft shadows without noise are compared with numbers of 77 digits, with quadrature and with
//! samples.

use crate::common::{
    CLUTTER, Comparison, SQUARE, TRIANGLE, load, oracle, points, room, room_text, settings, trials,
};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, ShadingPoint, Workspace};
use linelit_scene::SceneDescription;
use linelit_testkit::cases::cases;
use linelit_testkit::{precise::Precise, real::Real};
use proptest::prelude::*;
use std::fmt::Write as _;
use std::path::Path;

/// The factor from irradiance to reflected light for the square light's radiance and the floor's
/// albedo, in the first channel.
const RADIANCE: f64 = 8.0 * 0.7 / std::f64::consts::PI;

fn text(triangles: &[[[f64; 3]; 3]]) -> String {
    let mut out = String::new();
    for t in triangles {
        let p = t.as_flattened();
        let _ = write!(
            out,
            "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point P\" ["
        );
        p.iter().for_each(|x| {
            let _ = write!(out, " {x}");
        });
        out.push_str(" ]\n");
    }
    out
}

/// A diffuse point at `x` that looks up.
fn point_at(renderer: &Renderer<'_>, x: [f64; 3]) -> ShadingPoint {
    let (_, mut point) = points(renderer).swap_remove(0);
    point.position = DVec3::from_array(x);
    (point.geometric_normal, point.normal) = (DVec3::Z, DVec3::Z);
    point
}

fn exact(renderer: &Renderer<'_>, estimator: &str, point: &ShadingPoint) -> DVec3 {
    let settings = settings(estimator, 1, 0);
    renderer.direct(&settings, point, [0, 0], &mut Workspace::new())
}

/// Four triangles that intersect each other, the light's sides and a corner. Their coordinates are
/// exact in binary.
const CROSSING: [[[f64; 3]; 3]; 4] = [
    [
        [-0.25, -0.25, 1.0],
        [0.5, -0.125, 1.25],
        [0.0625, 0.5, 0.75],
    ],
    [[-0.5, 0.125, 1.5], [0.375, -0.375, 1.0], [0.25, 0.25, 1.25]],
    [[0.25, 0.125, 1.0], [0.75, 0.25, 1.125], [0.375, 0.75, 1.25]],
    [
        [-0.4375, -0.4375, 1.75],
        [-0.25, -0.4375, 1.75],
        [-0.375, -0.25, 1.75],
    ],
];

#[test]
fn agrees_with_77_digits() {
    let scene = room(SQUARE, &text(&CROSSING));
    let renderer = Renderer::new(&scene);
    for x in [
        [0.125, 0.0625, 0.25],
        [-0.375, 0.5, 0.5],
        [0.25, -0.25, 0.125],
    ] {
        let want = oracle::irradiance::<Precise>(x, 0.5, 2.0, &CROSSING);
        let whole = oracle::irradiance::<Precise>(x, 0.5, 2.0, &[]);
        assert!(want < whole.clone() * Precise::new(0.95), "a penumbra");
        let point = point_at(&renderer, x);
        let got = exact(&renderer, "exact", &point);
        // The colours of the scene are f32, so that the comparison includes them.
        let colour = exact(&Renderer::new(&room(SQUARE, "")), "exact", &point).x;
        let share = got.x / colour;
        let error = (want.clone() / whole.clone() - Precise::new(share)).abs();
        // On a diffuse surface, the only error is the error of the closed form: 1e-13 for each of
        // at most two dozen pieces.
        assert!(error.to_f64() < 3e-12, "{x:?}: off by {}", error.to_f64());
    }
}

fn corner() -> impl Strategy<Value = [f64; 3]> {
    [-64i32..65, -64i32..65, 0i32..52].prop_map(|[x, y, z]| {
        [
            f64::from(x) / 64.0,
            f64::from(y) / 64.0,
            0.75 + f64::from(z) / 64.0,
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(64)))]

    /// A few random triangles are compared with the slabs in f64.
    #[test]
    fn random_triangles(
        triangles in prop::collection::vec([corner(), corner(), corner()], 1..7),
        x in [-64i32..65, -64i32..65].prop_map(|p| p.map(|v| f64::from(v) / 64.0)),
    ) {
        #[allow(clippy::float_cmp, reason = "the very same corner")]
        let distinct = |t: &[[f64; 3]; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let triangles: Vec<_> = triangles.into_iter().filter(distinct).collect();
        let scene = room(SQUARE, &text(&triangles));
        let renderer = Renderer::new(&scene);
        let x = [x[0], x[1], 0.25];
        let got = exact(&renderer, "exact", &point_at(&renderer, x)).x;
        let want = RADIANCE * oracle::irradiance::<f64>(x, 0.5, 2.0, &triangles);
        let whole = RADIANCE * oracle::irradiance::<f64>(x, 0.5, 2.0, &[]);
        // Colours are f32: 1.2e-7 for the product of two. The oracle in f64 loses ε divided by the
        // angle between a trapezoid's sides, which is some 1e-10 for slabs of 1e-6.
        prop_assert!((got - want).abs() <= 1.3e-7 * whole, "{got} {want}");
    }
}

/// Tests `exact` against line samples, at every pixel with a penumbra.
fn agrees_with_lines(scene: &SceneDescription, lines: u32) {
    let renderer = Renderer::new(scene);
    let all = points(&renderer);
    let mut comparison = Comparison::new(3 * all.len() + 1, 24, lines);
    let mut penumbrae = 0;
    let mut workspace = Workspace::new();
    for at in &all {
        let (pixel, point) = at;
        let _ = renderer.direct(&settings("exact", 1, 0), point, *pixel, &mut workspace);
        let plan = workspace.take_counts().plan;
        if plan.exact_penumbrae == 0 || plan.exact_fallbacks > 0 {
            continue;
        }
        penumbrae += 1;
        // There is no noise on diffuse floors; on others there is the noise of as many points.
        let got = trials(&renderer, &settings("exact", lines, 7), at, 24);
        let want = trials(&renderer, &settings("line-analytic", lines, 77), at, 24);
        comparison.add(pixel, got, want);
    }
    comparison.finish("exact");
    assert!(penumbrae > 10, "{penumbrae} penumbrae");
}

#[test]
fn agrees_with_lines_in_clutter() {
    for light in [SQUARE, TRIANGLE] {
        agrees_with_lines(&room(light, CLUTTER), 256);
    }
}

#[test]
fn agrees_with_lines_on_a_glossy_floor() {
    let floor = r#"Material "phong" "rgb Kd" [ 0.2 0.1 0.3 ] "rgb Ks" [ 0.5 0.6 0.7 ] "float exponent" [ 40.5 ]"#;
    let matte = r#"Material "matte" "rgb Kd" [ 0.7 0.5 0.3 ]"#;
    agrees_with_lines(
        &load(&room_text(SQUARE, CLUTTER).replace(matte, floor)),
        256,
    );
}

#[test]
fn agrees_with_lines_in_the_kept_scenes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    for name in [
        "cornell-box-small",
        "cornell-box-large",
        "grid-planes-small",
        "grid-planes-large",
        "triangle-soup-small",
        "triangle-soup-large",
        "logo-small",
        "logo-large",
    ] {
        let path = folder.join(format!("{name}.pbrt"));
        let mut scene = linelit_formats::load(&path, &Default::default())
            .unwrap()
            .scene;
        scene.set_resolution(20, 15);
        agrees_with_lines(&scene, 64);
    }
}

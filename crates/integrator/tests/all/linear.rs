//! Linear lights: every technique gives the light of quadrature, without weights and without losing
//! light.

use crate::common::{CLUTTER, Comparison, load, points, room, room_text, trials};
use linelit_bsdf::Reflection;
use linelit_geometry::{DVec3, Segment};
use linelit_integrator::{Estimator, Renderer, Settings, Workspace};
use linelit_lights::Light;
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;
use linelit_testkit::quadrature::gauss_kronrod;

/// A line above the floor, and one that is partly below it.
const LINES: [&str; 2] = [
    r#"Shape "line" "point3 p0" [ -0.7 -0.3 1.2 ] "point3 p1" [ 0.8 0.4 1.5 ]"#,
    r#"Shape "line" "point3 p0" [ -0.9 0.2 -0.4 ] "point3 p1" [ 0.7 -0.1 1.1 ]"#,
];

const TECHNIQUES: [&str; 11] = [
    "point-linear[technique=area]",
    "point-linear[technique=solid-angle]",
    "point-linear[technique=clipped-solid-angle]",
    "point-linear[technique=linear-cosine]",
    "point-linear[technique=quadratic-cosine]",
    "point-linear[technique=newton-bisection]",
    "point-linear",
    "point-area",
    "point-solid-angle",
    "point-projected-solid-angle",
    "point-bsdf",
];

const WEIGHTED: [&str; 4] = [
    "point-linear[technique=ltc,mis=balance]",
    "point-linear[technique=ltc,mis=weighted-balance]",
    "point-linear[technique=ltc,mis=optimal]",
    "point-linear[technique=ltc]",
];

fn settings(estimator: &str, samples: u32, seed: u64) -> Settings {
    Settings {
        estimator: estimator.parse::<Estimator>().unwrap(),
        sampler: SamplerKind::Independent,
        samples,
        seed,
        ..Settings::default()
    }
}

fn phong(text: &str) -> SceneDescription {
    let floor = r#"Material "phong" "rgb Kd" [ 0.2 0.1 0.3 ] "rgb Ks" [ 0.5 0.6 0.7 ] "float exponent" [ 40.5 ]"#;
    floor_of(text, floor)
}

fn floor_of(text: &str, material: &str) -> SceneDescription {
    load(&text.replace(r#"Material "matte" "rgb Kd" [ 0.7 0.5 0.3 ]"#, material))
}

/// Materials with a lobe for which there is no integral.
const GLOSSY: [&str; 7] = [
    r#"Material "plastic" "rgb Kd" [ 0.2 0.1 0.3 ] "rgb Ks" [ 0.5 0.6 0.7 ] "float roughness" [ 0.2 ] "bool remaproughness" [ "false" ]"#,
    r#"Material "metal" "float roughness" [ 0.2 ] "bool remaproughness" [ "false" ]"#,
    r#"Material "substrate" "rgb Kd" [ 0.2 0.1 0.3 ] "float uroughness" [ 0.2 ] "float vroughness" [ 0.2 ] "bool remaproughness" [ "false" ]"#,
    r#"Material "substrate" "rgb Kd" [ 0 0 0 ] "float uroughness" [ 0.15 ] "float vroughness" [ 0.4 ] "bool remaproughness" [ "false" ]"#,
    r#"Material "uber" "rgb Kd" [ 0.2 0.1 0.3 ] "float roughness" [ 0.3 ] "bool remaproughness" [ "false" ]"#,
    r#"Material "frostbite" "rgb Kd" [ 0.2 0.1 0.3 ] "rgb Ks" [ 0.04 0.5 0.9 ] "float roughness" [ 0.4 ]"#,
    r#"MakeNamedMaterial "a" "string type" "metal" "float roughness" [ 0.3 ]
       MakeNamedMaterial "b" "string type" "plastic" "float roughness" [ 0.1 ]
       Material "mix" "string namedmaterial1" "a" "string namedmaterial2" "b" "rgb amount" [ 0.3 0.5 0.7 ]"#,
];

/// The line, and its radiance × radius.
fn light(scene: &SceneDescription) -> (Segment, DVec3) {
    match &*scene.lights[0].light {
        Light::Linear(line) => (line.segment, line.radiance_radius),
        other => panic!("a linear light, not {other:?}"),
    }
}

/// The integral ∫ f_r cos θ 2h/r³ dt by Gauss–Kronrod quadrature on the line, clipped at the
/// horizon. Of the tested code it only uses the BSDF.
fn quadrature(
    scene: &SceneDescription,
    point: &linelit_integrator::ShadingPoint,
    channel: usize,
) -> f64 {
    let (line, strength) = light(scene);
    let (x, n) = (point.position, point.normal);
    let value = |t: f64| {
        let d = line.at(t) - x;
        let r = d.length();
        let w = d / r;
        let width = 2.0 * line.vector().cross(w).length() / (r * r);
        let f = point.bsdf.eval(w, point.outgoing, n)[channel];
        f * n.dot(w).max(0.0) * width
    };
    let (a, b) = (n.dot(line.p0 - x), n.dot(line.p1 - x));
    let crossing = a / (a - b);
    let cuts = if a * b < 0.0 {
        vec![0.0, crossing, 1.0]
    } else {
        vec![0.0, 1.0]
    };
    let sum: f64 = cuts
        .windows(2)
        .map(|c| gauss_kronrod(value, c[0], c[1], 1e-10).value)
        .sum();
    sum * strength[channel]
}

/// Tests of each estimator against `truth`.
fn hold(scene: &SceneDescription, names: &[&str], truth: impl Fn(&Renderer<'_>, usize) -> DVec3) {
    let renderer = Renderer::new(scene);
    let all = points(&renderer);
    assert!(all.len() > 100);
    let (line, _) = light(scene);
    let count = (all.len() * 3 + 1) * names.len();
    let compared = |_: &&str| Comparison::new(count, 32, 32);
    let mut comparisons: Vec<_> = names.iter().map(compared).collect();
    let mut lit = 0;
    for (index, point) in all.iter().enumerate() {
        // Near the line, a single sample by area may have hundreds of times the mean: the mean of
        // 1024 samples is not yet normally distributed there.
        let to_line = point.1.position - line.p0;
        let along = to_line.dot(line.direction()).clamp(0.0, line.length());
        if (to_line - line.direction() * along).length() < 0.4 {
            continue;
        }
        let want = truth(&renderer, index);
        lit += u32::from(want != DVec3::ZERO);
        for (k, name) in names.iter().enumerate() {
            let base = settings(name, 32, 10_000 * (k as u64 + 1));
            let got = trials(&renderer, &base, point, 32);
            comparisons[k].add((name, point.0), got, (want, DVec3::ZERO));
        }
    }
    assert!(lit > 50, "only {lit} pixels are lit");
    for (comparison, name) in comparisons.into_iter().zip(names) {
        comparison.finish(name);
    }
}

fn by_quadrature(scene: &SceneDescription, names: &[&str]) {
    hold(scene, names, |renderer, index| {
        let (_, point) = &points(renderer)[index];
        DVec3::from_array([0, 1, 2].map(|c| quadrature(scene, point, c)))
    });
}

/// As in a furnace test: an estimator that samples the BSDF never meets the line, and must not lose
/// its light.
#[test]
fn no_energy_is_lost() {
    for line in LINES {
        by_quadrature(&room(line, ""), &TECHNIQUES);
    }
}

#[test]
fn glossy_light_too() {
    for line in LINES {
        let scene = phong(&room_text(line, ""));
        by_quadrature(&scene, &TECHNIQUES[6..]);
        by_quadrature(&scene, &WEIGHTED);
    }
}

/// The lobes of every material are sampled, without bias: none falls back to the diffuse technique.
#[test]
fn every_glossy_material_is_followed() {
    for material in GLOSSY {
        let scene = floor_of(&room_text(LINES[0], ""), material);
        let renderer = Renderer::new(&scene);
        let followed = points(&renderer)
            .iter()
            .filter(|(_, p)| {
                let cosines = p
                    .bsdf
                    .transformed_cosines(p.outgoing, p.normal)
                    .expect("known");
                !cosines.lobes().is_empty()
            })
            .count();
        assert!(followed > 50, "{followed} pixels of {material}");
        by_quadrature(&scene, &WEIGHTED);
    }
}

/// Behind clutter, the closed form over the visible parts is the truth.
#[test]
fn shadows_are_the_same() {
    let exact = |renderer: &Renderer<'_>, index: usize| {
        let (pixel, point) = &points(renderer)[index];
        let mut workspace = Workspace::new();
        renderer.direct(
            &settings("line-analytic", 1, 0),
            point,
            *pixel,
            &mut workspace,
        )
    };
    let flat = room(LINES[0], CLUTTER);
    hold(&flat, &TECHNIQUES, exact);
    let glossy = phong(&room_text(LINES[0], CLUTTER));
    hold(&glossy, &WEIGHTED, exact);
}

/// If nothing is hidden, one sample gives the exact value but for rounding.
#[test]
fn projected_solid_angle_has_no_variance() {
    for line in LINES {
        let scene = room(line, "");
        let renderer = Renderer::new(&scene);
        let mut workspace = Workspace::new();
        for (pixel, point) in points(&renderer) {
            let want = quadrature(&scene, &point, 0);
            for seed in 0..8 {
                let s = settings("point-linear", 1, seed);
                let got = renderer.direct(&s, &point, pixel, &mut workspace).x;
                // The estimate is L f ∫ cos / cos × cos of the sample. Its cosine is recomputed
                // from the direction, which loses ε/cos at grazing angles.
                assert!((got - want).abs() <= 1e-9 * want, "{pixel:?} {got} {want}");
            }
        }
    }
}

/// The weighted balance heuristic is exact if nothing is hidden and the lobe is an LTC. If the LTC
/// only resembles the lobe, it is still much better than either technique alone.
#[test]
fn the_pair_beats_its_members_on_gloss() {
    let scene = phong(&room_text(LINES[0], ""));
    let renderer = Renderer::new(&scene);
    let variance = |name: &str, samples: u32| {
        let spread = |p: &_| {
            trials(&renderer, &settings(name, samples, 5), p, 64)
                .1
                .x
                .powi(2)
        };
        points(&renderer).iter().map(spread).sum::<f64>()
    };
    // Compare two samples of the one technique with one sample of each.
    let flat = variance("point-linear", 2);
    let pair = variance("point-linear[technique=ltc]", 1);
    let clipped = variance("point-linear[technique=clipped-solid-angle]", 2);
    assert!(
        pair < 0.5 * flat && pair < 0.5 * clipped,
        "{pair} {flat} {clipped}"
    );
}

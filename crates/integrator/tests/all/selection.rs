//! One light is chosen at random for each sample; and spheres are exact or consist of facets.

use crate::common::{
    CLUTTER, Comparison, MATTE, SQUARE, TRIANGLE, load, microfacets, points, room, room_text,
    trials,
};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_integrator::{
    Estimator, LightChoice, Renderer, Settings, ShadingPoint, Spheres, Workspace,
};
use linelit_lights::{Light, SphereLight};
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;
use linelit_testkit::{chi2::sidak, ztest::critical_z};
use std::f64::consts::PI;

const SPHERE: &str = r#"AttributeBegin
Translate 0.4 0.2 1.6
Shape "sphere" "float radius" [ 0.3 ]
AttributeEnd"#;

const LINE: &str = r#"Shape "line" "point3 p0" [ -1.2 0.9 1.1 ] "point3 p1" [ -0.4 1.0 1.6 ]"#;

fn settings(estimator: &str) -> Settings {
    Settings {
        estimator: estimator.parse::<Estimator>().unwrap(),
        sampler: SamplerKind::Independent,
        samples: 32,
        ..Settings::default()
    }
}

/// The pixels that show a surface which reflects light; the lights themselves are black.
fn lit_points(renderer: &Renderer<'_>) -> Vec<([u32; 2], ShadingPoint)> {
    let mut all = points(renderer);
    all.retain(|(_, point)| !point.bsdf.is_black());
    all
}

/// Tests of settings against others at every sixth pixel, with this many trials each. Choosing
/// lights makes the distribution of estimates skew, so that their mean needs a few hundred trials
/// to be normally distributed.
fn agree(scene: &SceneDescription, reference: Settings, all: &[(Settings, u32)]) {
    let renderer = Renderer::new(scene);
    let pixels: Vec<_> = lit_points(&renderer).into_iter().step_by(6).collect();
    let comparisons = (pixels.len() * 3 + 1) * all.len();
    let compared = |(s, count): &(Settings, u32)| Comparison::new(comparisons, *count, s.samples);
    let mut comparisons: Vec<_> = all.iter().map(compared).collect();
    let truth = |point: &_| {
        let seed = 1 << 32;
        trials(&renderer, &Settings { seed, ..reference }, point, 64)
    };
    let want: Vec<_> = pixels.iter().map(truth).collect();
    let brightest = want.iter().map(|w| w.0.x).fold(0.0, f64::max);
    let mut lit = 0;
    for (point, want) in pixels.iter().zip(&want) {
        // In the dark, the remaining light is met too seldom for a normally distributed sum.
        if want.0.x < 0.03 * brightest {
            continue;
        }
        lit += 1;
        for (k, (settings, count)) in all.iter().enumerate() {
            let seed = 1000 * (k as u64 + 1);
            let got = trials(&renderer, &Settings { seed, ..*settings }, point, *count);
            comparisons[k].add((settings, point.0), got, *want);
        }
    }
    assert!(lit > 7, "only {lit} pixels are lit");
    for (comparison, (settings, _)) in comparisons.into_iter().zip(all) {
        comparison.finish(settings);
    }
}

/// A square, a triangle, a line and a sphere of facets.
fn many() -> SceneDescription {
    room(&[SQUARE, TRIANGLE, LINE, SPHERE].concat(), CLUTTER)
}

/// All choices of a light, with as many samples as their noise needs.
const CHOICES: [(LightChoice, u32); 5] = [
    (LightChoice::Power, 64),
    (LightChoice::Uniform, 256),
    (LightChoice::Estimate, 16),
    (LightChoice::Tree, 16),
    (LightChoice::Exact, 16),
];

#[test]
fn every_choice_of_lights_gives_the_same_light() {
    let matte = many();
    let lights = [SQUARE, TRIANGLE, LINE, SPHERE].concat();
    let glossy = load(&room_text(&lights, CLUTTER).replace(MATTE, &microfacets(0.3)));
    let cases = [
        (&matte, "point-solid-angle", Spheres::Facets),
        (&matte, "line-analytic", Spheres::Facets),
        (&glossy, "point-solid-angle", Spheres::Exact),
    ];
    for (scene, estimator, spheres) in cases {
        let base = Settings {
            spheres,
            ..settings(estimator)
        };
        let all = CHOICES.map(|(lights, samples)| {
            let settings = Settings {
                lights,
                samples,
                ..base
            };
            (settings, 256)
        });
        // Points of the sphere that clutter almost hides have a skew distribution.
        let samples = match spheres {
            Spheres::Facets => base.samples,
            Spheres::Exact => 256,
        };
        let reference = Settings { samples, ..base };
        agree(scene, reference, &all);
    }
}

/// Thirty small lights are above a glossy floor, of which each point reflects one or two: all
/// choices that consider the reflection have at most half of the variance of a uniform choice.
#[test]
fn choices_know_the_reflection() {
    let light = |i: u32| {
        let (x, y) = (f64::from(i % 6) - 2.5, f64::from(i / 6) - 2.0);
        let [x0, x1, y0, y1] = [x, x + 0.2, y, y + 0.2];
        format!(
            r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ {x0} {y0} 1  {x0} {y1} 1  {x1} {y1} 1  {x1} {y0} 1 ]
"#
        )
    };
    let lights: String = (0..30).map(light).collect();
    let scene = load(&room_text(&lights, "").replace(MATTE, &microfacets(0.08)));
    let renderer = Renderer::new(&scene);
    let points: Vec<_> = lit_points(&renderer).into_iter().step_by(6).collect();
    let variance = |lights| {
        let one = Settings {
            lights,
            samples: 16,
            ..settings("point-solid-angle")
        };
        let errors = points.iter().map(|p| trials(&renderer, &one, p, 64).1.x);
        errors.map(|e| e * e).sum::<f64>()
    };
    let uniform = variance(LightChoice::Uniform);
    for lights in [LightChoice::Estimate, LightChoice::Exact, LightChoice::Tree] {
        let ratio = variance(lights) / uniform;
        assert!(ratio < 0.5, "{lights}: {ratio} of the variance");
    }
}

#[test]
fn spheres_by_every_density() {
    let scene = room(SPHERE, CLUTTER);
    let exact = |estimator: &str| Settings {
        spheres: Spheres::Exact,
        ..settings(estimator)
    };
    let bsdf = Settings {
        samples: 256,
        ..exact("point-bsdf")
    };
    let all = [
        (exact("point-area"), 128),
        (exact("point-visible-area"), 64),
        (exact("point-projected-solid-angle"), 64),
        (exact("line-analytic"), 64),
        (bsdf, 256),
    ];
    agree(&scene, exact("point-solid-angle"), &all);
}

/// Lines and combinations on a sphere, a disk and a cylinder of scene files, compared with points
/// on them.
#[test]
fn round_lights_by_lines() {
    const DISK: &str = "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [8 8 8]
        Translate 0 0 1.9 Rotate 170 1 0 0 Shape \"disk\" \"float radius\" 0.4 AttributeEnd";
    const CYLINDER: &str = "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [8 8 8]
        Translate 0 0 1.6 Rotate 80 1 0 0 Shape \"cylinder\" \"float radius\" 0.15
        \"float zmin\" -0.5 \"float zmax\" 0.5 AttributeEnd";
    for light in [SPHERE, DISK, CYLINDER] {
        let scene = room(light, CLUTTER);
        assert_eq!(scene.round.len(), 1);
        let exact = |estimator: &str| Settings {
            spheres: Spheres::Exact,
            ..settings(estimator)
        };
        let all = [
            (exact("line-analytic"), 64),
            (exact("line-solid-angle"), 64),
            (exact("hybrid+point-bsdf"), 64),
            (exact("line-projected+point-area+point-bsdf"), 64),
        ];
        agree(&scene, exact("point-solid-angle"), &all);
    }
}

/// Above the horizon and unhidden, a sphere gives π L (R/d)² cos θ.
#[test]
fn a_sphere_is_lamberts() {
    let scene = room(SPHERE, "");
    let renderer = Renderer::new(&scene);
    let Light::Sphere(SphereLight { sphere, .. }) = scene.round[0].light else {
        panic!("a sphere");
    };
    let mut workspace = Workspace::new();
    for (pixel, point) in lit_points(&renderer) {
        let to = sphere.center - point.position;
        let want = 8.0 * (0.7 / PI) * PI * sphere.radius.powi(2) * to.z / to.length().powi(3);
        let base = Settings {
            spheres: Spheres::Exact,
            sampler: SamplerKind::Sobol,
            samples: 4096,
            ..settings("point-solid-angle")
        };
        let got = renderer.direct(&base, &point, pixel, &mut workspace).x;
        // The integrand is smooth over a net of 4096 points: (log N)/N is 2e-3 of its variation,
        // which is some 0.3 of the mean here. Kd and L are f32.
        assert!((got - want).abs() < 6e-4 * want, "{pixel:?} {got} {want}");
        // By projected solid angle, one point gives the exact value but for rounding to f32.
        let one = Settings {
            spheres: Spheres::Exact,
            samples: 1,
            ..settings("point-projected-solid-angle")
        };
        let got = renderer.direct(&one, &point, pixel, &mut workspace).x;
        assert!((got - want).abs() < 1e-6 * want, "{pixel:?} {got} {want}");
    }
}

/// Facets have the area of the sphere, so that they are as bright, up to their deviation from it.
#[test]
fn facets_are_nearly_the_sphere() {
    let scene = room(SPHERE, "");
    let renderer = Renderer::new(&scene);
    let mut workspace = Workspace::new();
    let base = Settings {
        sampler: SamplerKind::Sobol,
        samples: 256,
        spheres: Spheres::Facets,
        ..settings("point-solid-angle")
    };
    let exact = Settings {
        spheres: Spheres::Exact,
        ..base
    };
    for (pixel, point) in lit_points(&renderer) {
        let a = renderer.direct(&base, &point, pixel, &mut workspace).x;
        let b = renderer.direct(&exact, &point, pixel, &mut workspace).x;
        // With 24 steps around and 12 along, the middles of facets are 0.9 % of the radius inside
        // and their corners 0.8 % outside. The area of the outline is off by at most twice that.
        assert!((a / b - 1.0).abs() < 0.018, "{pixel:?} {a} {b}");
    }
}

#[test]
fn the_same_bits_each_time() {
    let scene = many();
    let renderer = Renderer::new(&scene);
    let (mut one, mut two) = (Workspace::new(), Workspace::new());
    for lights in [LightChoice::Estimate, LightChoice::Tree, LightChoice::Power] {
        let s = Settings {
            lights,
            ..settings("point-area")
        };
        for (pixel, point) in lit_points(&renderer) {
            let a = renderer.direct(&s, &point, pixel, &mut one);
            let b = Renderer::new(&scene).direct(&s, &point, pixel, &mut two);
            assert_eq!(
                a.to_array().map(f64::to_bits),
                b.to_array().map(f64::to_bits)
            );
            two = Workspace::new();
            if pixel[1] > 2 {
                break;
            }
        }
    }
}

#[test]
fn names_round_trip() {
    for name in [
        "all",
        "one:uniform",
        "one:power",
        "one:estimate",
        "one:exact",
        "one:centre",
        "tree",
    ] {
        assert_eq!(name.parse::<LightChoice>().unwrap().to_string(), name);
    }
    let error = "one".parse::<LightChoice>().unwrap_err();
    assert!(error.contains("one:estimate"), "{error}");
    assert_eq!("exact".parse::<Spheres>().unwrap().to_string(), "exact");
    assert!("round".parse::<Spheres>().unwrap_err().contains("facets"));
}

/// A light with an estimator of its own sends the same light as with that estimator in the
/// settings.
#[test]
fn lights_have_estimators_of_their_own() {
    let two = format!("{SQUARE}\n{TRIANGLE}");
    let scene = room(&two, CLUTTER);
    assert_eq!(scene.lights.len(), 2);
    let mut renderer = Renderer::new(&scene);
    let all = points(&renderer);
    let (lines, rays) = (settings("line-area"), settings("point-area"));
    let mut workspace = Workspace::new();
    let mut light = |renderer: &Renderer<'_>, settings: &Settings| -> Vec<DVec3> {
        let direct = |(pixel, point): &([u32; 2], ShadingPoint)| {
            renderer.direct(settings, point, *pixel, &mut workspace)
        };
        all.iter().map(direct).collect()
    };
    let (by_lines, by_rays) = (light(&renderer, &lines), light(&renderer, &rays));
    assert!(renderer.set_light_estimator(1, Some(rays.estimator)));
    // No light has this number.
    assert!(!renderer.set_light_estimator(2, Some(rays.estimator)));
    assert!(!renderer.set_light_apart(2, true));
    let mixed = light(&renderer, &lines);
    renderer.set_light_estimator(0, Some(rays.estimator));
    renderer.set_light_estimator(1, None);
    let other = light(&renderer, &lines);
    assert!(mixed.iter().zip(&by_lines).any(|(a, b)| a != b));
    for k in 0..mixed.len() {
        // Each light's part occurs once on both sides; sums of two have a rounding error of ε.
        let (one, both) = (mixed[k] + other[k], by_lines[k] + by_rays[k]);
        assert!((one - both).abs().max_element() <= 4.0 * f64::EPSILON * both.max_element());
    }
    renderer.set_light_estimator(0, None);
    assert_eq!(light(&renderer, &lines), by_lines);
}

/// A large light that is wholly behind a plate takes many samples from two lamps, by any choice. If
/// it always gets all samples, it takes none from them, and the light is the same.
#[test]
fn a_hidden_light_apart_does_not_drown_the_others() {
    let sun = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -9 -9 8  -9 9 8  9 9 8  9 -9 8 ]"#;
    let plate = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -30 -30 7  30 -30 7  30 30 7  -30 30 7 ]"#;
    let lamps = format!("{sun}\n{SQUARE}\n{TRIANGLE}");
    let scene = room(&lamps, &format!("{CLUTTER}{plate}"));
    let mut renderer = Renderer::new(&scene);
    let points: Vec<_> = lit_points(&renderer).into_iter().step_by(5).collect();
    let z = critical_z(sidak(0.01, points.len() * CHOICES.len()));
    let all = |renderer: &Renderer<'_>, choice: Settings| -> Vec<(DVec3, DVec3)> {
        let one = |point| trials(renderer, &choice, point, 64);
        points.iter().map(one).collect()
    };
    let seed = 1 << 32;
    let base = settings("point-solid-angle");
    let truth = all(&renderer, Settings { seed, ..base });
    for (lights, _) in CHOICES {
        let choice = Settings { lights, ..base };
        let variance = |got: &[(DVec3, DVec3)]| got.iter().map(|g| g.1.x * g.1.x).sum::<f64>();
        let together = variance(&all(&renderer, choice));
        renderer.set_light_apart(0, true);
        let apart = all(&renderer, choice);
        renderer.set_light_apart(0, false);
        for (got, want) in apart.iter().zip(&truth) {
            let difference = (got.0.x - want.0.x).abs();
            assert!(
                difference <= z * got.1.x.hypot(want.1.x),
                "{lights}: {got:?} {want:?}"
            );
        }
        let gain = together / variance(&apart);
        // At least a third of the samples went to the hidden light, so that the ratio is 1.5 or
        // more, minus the noise of 64 trials over some 50 points, which is a few per cent.
        assert!(gain > 1.3, "{lights}: {gain}");
    }
    // If all lights always get all samples, no light is chosen at random.
    for light in 0..3 {
        assert!(renderer.set_light_apart(light, true));
    }
    let lights = LightChoice::Tree;
    assert_eq!(
        all(&renderer, Settings { lights, ..base }),
        all(&renderer, base)
    );
}

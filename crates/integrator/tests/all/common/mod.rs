//! Small scenes and statistics that the tests share.

pub(crate) mod oracle;

pub(crate) use linelit_testkit::rooms::{
    CLUTTER, MATTE, PHONG, SQUARE, THROUGH_THE_FLOOR, TRIANGLE,
};

use linelit_formats::LoadOptions;
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, Renderer, Settings, ShadingPoint, Workspace};
use linelit_lights::Light;
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{critical_z, t_p_value, z_score};

/// A floor seen from above, a square light above it, and the text of `occluders`.
pub(crate) fn room(light: &str, occluders: &str) -> SceneDescription {
    load(&room_text(light, occluders))
}

/// The text of that scene.
pub(crate) fn room_text(light: &str, occluders: &str) -> String {
    format!(
        r#"
LookAt 0 -0.5 5  0 0 0  0 1 0
Camera "perspective" "float fov" [ 40 ]
Film "image" "integer xresolution" [ 16 ] "integer yresolution" [ 16 ]
WorldBegin
{MATTE}
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -3 -3 0  3 -3 0  3 3 0  -3 3 0 ]
{occluders}
AttributeBegin
Material "matte" "rgb Kd" [ 0 0 0 ]
AreaLightSource "diffuse" "rgb L" [ 8 6 4 ]
{light}
AttributeEnd
WorldEnd
"#
    )
}

/// A scene from pbrt text.
pub(crate) fn load(text: &str) -> SceneDescription {
    linelit_formats::from_pbrt_str(text, "test.pbrt", &LoadOptions::default())
        .expect("the test scene is valid")
        .scene
}

/// An upright light on the floor.
pub(crate) const ON_THE_FLOOR: &str = r#"Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
"point P" [ -1.5 -1 0  -1.5 1 0  -1.5 1 1.5  -1.5 -1 1.5 ]"#;

/// A quad whose edges are parallel to the edges of the square light, and a sphere.
pub(crate) const QUAD_AND_SPHERE: &str = r#"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -0.5 -0.5 1  0.2 -0.5 1  0.2 0.1 1  -0.5 0.1 1 ]
AttributeBegin
Translate 0.5 0.4 0.9
Shape "sphere" "float radius" [ 0.3 ]
AttributeEnd"#;

/// An occluder that touches the square light, along one direction of lines.
pub(crate) const TOUCHING: &str = r#"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -0.5 0 2  0.5 0 2  0.5 0 1.4  -0.5 0 1.4 ]"#;

/// A floor of microfacets with this roughness.
pub(crate) fn microfacets(alpha: f64) -> String {
    format!(
        r#"Material "plastic" "rgb Kd" [ 0.2 0.1 0.3 ] "rgb Ks" [ 0.5 0.6 0.7 ] "float roughness" [ {alpha} ] "bool remaproughness" [ "false" ]"#
    )
}

/// The room with another floor, a square light and clutter.
pub(crate) fn room_with_floor(floor: &str) -> SceneDescription {
    load(&room_text(SQUARE, CLUTTER).replace(MATTE, floor))
}

/// Combinations of all techniques, heuristics and options.
pub(crate) const MIXES: [&str; 32] = [
    "line-warped[orientation=fixed:0]",
    "line-warped+point-bsdf",
    "line-solid-angle",
    "line-solid-angle[pieces=one]",
    "line-solid-angle[orientation=fixed:0]",
    "line-projected",
    "line-projected[orientation=fixed:0.3,pieces=one]",
    "line-area[pieces=each,orientation=fixed:0.5]+line-area[orientation=fixed:0,mis=average]",
    "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5]",
    "line-solid-angle[orientation=fixed:0]:3+line-solid-angle[orientation=fixed:0.5]",
    "line-solid-angle[orientation=spread:4]",
    "line-projected[orientation=spread:3,pieces=one]",
    "line-solid-angle+point-bsdf",
    "line-solid-angle:3+point-bsdf",
    "line-solid-angle+point-bsdf:3[mis=power]",
    "line-solid-angle+point-bsdf[mis=smooth]",
    "line-solid-angle[pieces=one]+point-bsdf[mis=smooth-fixed]",
    "line-solid-angle[orientation=fixed:0]+line-solid-angle[orientation=fixed:0.5]+point-bsdf[mis=smooth]",
    "line-area+point-area[mis=maximum]",
    "line-area+point-solid-angle[mis=average]",
    "point-area+point-bsdf",
    "point-solid-angle+point-bsdf[mis=power]",
    "point-area+point-solid-angle+point-bsdf",
    "line-projected+line-area+point-solid-angle+point-bsdf[mis=smooth]",
    "line-solid-angle+point-bsdf[mis=optimal]",
    "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5,mis=optimal]",
    "point-area+point-solid-angle+point-bsdf[mis=optimal]",
    "line-warped:2+point-area+point-bsdf[mis=clamped-optimal]",
    "line-analytic+point-bsdf",
    "hybrid:2+point-bsdf",
    "line-area[points=4]+point-bsdf:3[mis=power]",
    "line-solid-angle[pieces=one,points=3]+point-area[mis=power]",
];

/// The shading points of all pixels.
pub(crate) fn points(renderer: &Renderer<'_>) -> Vec<([u32; 2], ShadingPoint)> {
    let mut workspace = Workspace::new();
    let film = &renderer.scene().film;
    let pixels = (0..film.height).flat_map(|y| (0..film.width).map(move |x| [x, y]));
    pixels
        .filter_map(|p| renderer.shading_point(p, &mut workspace).map(|s| (p, s)))
        .collect()
}

/// The mean over independent trials and its standard error, by channel.
pub(crate) fn trials(
    renderer: &Renderer<'_>,
    settings: &Settings,
    (pixel, point): &([u32; 2], ShadingPoint),
    count: u32,
) -> (DVec3, DVec3) {
    let mut workspace = Workspace::new();
    let estimate = |trial: u32| {
        let settings = Settings {
            seed: settings.seed + u64::from(trial),
            ..*settings
        };
        renderer.direct(&settings, point, *pixel, &mut workspace)
    };
    let values: Vec<DVec3> = (0..count).map(estimate).collect();
    let n = f64::from(count);
    let mean = values.iter().copied().sum::<DVec3>() / n;
    let square: DVec3 = values.iter().map(|v| (*v - mean) * (*v - mean)).sum();
    (mean, (square / (n * (n - 1.0))).map(f64::sqrt))
}

/// An estimator that is compared with points by solid angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    /// Its text.
    pub name: &'static str,
    /// The number of samples of each trial.
    pub samples: u32,
    /// Whether samples are skipped where they cannot contribute.
    pub skip: bool,
}

/// Settings with independent samples.
pub(crate) fn settings(estimator: &str, samples: u32, seed: u64) -> Settings {
    Settings {
        estimator: estimator.parse::<Estimator>().unwrap(),
        sampler: SamplerKind::Independent,
        samples,
        seed,
        ..Settings::default()
    }
}

const TRIALS: u32 = 32;

/// Tests of each estimator against solid-angle points.
pub(crate) fn agree_on(scene: &SceneDescription, cases: &[Case]) {
    let renderer = Renderer::new(scene);
    let all = clear_of_the_light(&renderer);
    assert!(all.len() > 60, "the camera sees {} pixels", all.len());
    let comparisons = (all.len() * 3 + 1) * cases.len();
    let base = settings("point-solid-angle", 256, 1_000_000);
    let truth: Vec<(DVec3, DVec3)> = all
        .iter()
        .map(|point| trials(&renderer, &base, point, TRIALS))
        .collect();
    let brightest = truth.iter().map(|r| r.0.x).fold(0.0, f64::max);
    let lit = truth.iter().filter(|r| r.0 != DVec3::ZERO).count();
    assert!(lit > 30, "only {lit} pixels are lit");
    for (k, case) in cases.iter().enumerate() {
        let mut comparison = Comparison::new(comparisons, TRIALS, case.samples);
        for (point, reference) in all.iter().zip(&truth) {
            // Directions from the BSDF rarely meet the light. Only where the light is at least a
            // twentieth of the brightest is the sum of 32 x 512 of them normally distributed.
            if case.name == "point-bsdf" && reference.0.x < 0.05 * brightest {
                continue;
            }
            let settings = Settings {
                skip: case.skip,
                ..settings(case.name, case.samples, 10_000 * (k as u64 + 1))
            };
            let got = trials(&renderer, &settings, point, TRIALS);
            comparison.add((case.name, point.0), got, *reference);
        }
        comparison.finish(case.name);
    }
}

/// The shading points of a chequerboard, without those next to the light. There the density of a
/// technique by area is unbounded, and the mean of a few samples is not yet normally distributed.
pub(crate) fn clear_of_the_light(renderer: &Renderer<'_>) -> Vec<([u32; 2], ShadingPoint)> {
    let Light::Area(area) = &*renderer.scene().lights[0].light else {
        panic!("an area light")
    };
    let height = |x: DVec3| area.polygon.normal().dot(x - area.polygon.vertices()[0]);
    let mut all = points(renderer);
    all.retain(|(pixel, point)| {
        let checked = (pixel[0] + pixel[1]) % 2 == 0;
        checked && height(point.position).abs() > 0.5
    });
    all
}

/// A comparison of means of trials with other means, pixel by pixel and for all pixels together.
pub(crate) struct Comparison {
    /// The level of each of the two kinds of tests: α = 0.01 for all comparisons, after Šidák.
    level: f64,
    trials: u32,
    /// The number of samples in each pixel.
    samples: f64,
    difference: f64,
    variance: f64,
    light: f64,
    pixels: f64,
}

impl Comparison {
    /// The comparison for this many comparisons in all, with this many trials of this many samples.
    pub(crate) fn new(comparisons: usize, trials: u32, samples: u32) -> Self {
        Self {
            level: sidak(0.01, comparisons),
            trials,
            samples: f64::from(trials) * f64::from(samples),
            difference: 0.0,
            variance: 0.0,
            light: 0.0,
            pixels: 0.0,
        }
    }

    /// Light that no sample met does not show in the deviation of the samples. If it were more than
    /// a fraction ln(1/level)/n of the points, one of n samples would have met it. It may be as
    /// bright as the rest.
    fn unseen(&self, samples: f64) -> f64 {
        -self.level.ln() / samples
    }

    /// Compares means and their standard errors at a pixel by Student's t, since there are few
    /// trials.
    pub(crate) fn add(
        &mut self,
        what: impl std::fmt::Debug,
        got: (DVec3, DVec3),
        want: (DVec3, DVec3),
    ) {
        for c in 0..3 {
            let (a, b) = (got.0[c], want.0[c]);
            let error = got.1[c].hypot(want.1[c]);
            // This is the error of quadrature and, for constant values, of sums of a few hundred
            // terms.
            let rounding = 1e-9 * b;
            let room = self.unseen(self.samples) * a.max(b) + rounding;
            let beyond = ((a - b).abs() - room).max(0.0);
            let p = t_p_value(z_score(beyond, 0.0, error), f64::from(self.trials - 1));
            assert!(
                p > self.level,
                "{what:?}: {a} +- {}, {b} +- {}",
                got.1[c],
                want.1[c]
            );
        }
        self.difference += got.0.x - want.0.x;
        self.variance += (got.1 * got.1 + want.1 * want.1).x;
        self.light += want.0.x;
        self.pixels += 1.0;
    }

    /// Compares the sums over all pixels, which have many more samples, so that they show a bias
    /// that no single pixel shows.
    pub(crate) fn finish(self, what: impl std::fmt::Debug) {
        let unseen = self.unseen(self.samples * self.pixels);
        let room = (unseen + 1e-9) * self.light;
        let allowed = critical_z(self.level) * self.variance.sqrt() + room;
        let off = self.difference.abs();
        assert!(
            off <= allowed,
            "{what:?}: the sum is off by {off} of {allowed}"
        );
    }
}

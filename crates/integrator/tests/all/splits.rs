//! Camera samples and light samples are parts of one pattern: no matter how a number of samples is
//! split into camera samples with some light samples each, the error of a pixel is the error of as
//! many light samples.

use crate::common::load;
use linelit_integrator::{LightChoice, Renderer, Settings, Workspace};
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;

/// Splits into camera samples, and light samples of each, of 64 samples and of 60 samples.
const SPLITS: [[u32; 2]; 4] = [[1, 64], [64, 1], [16, 4], [8, 8]];
const UNEVEN: [[u32; 2]; 4] = [[1, 60], [60, 1], [10, 6], [12, 5]];

/// The largest root mean square error, relative to the error with light samples alone.
///
/// The strata of blocks have the size of the strata of one set. Their cells are up to four times as
/// long as wide: two times because of the pattern, and two times because of its parts. For light
/// that changes evenly, such cells have a variance of (4 + 1/4)/2 = 2.1 times the variance of
/// squares, which is 1.5 times the error. Nets, and strata of lines, have no such factor.
///
/// If a choice is made once per sample, the groups of samples with the same choice are one more
/// pattern, and both patterns may have half as many samples. For an error that falls as N^−3/2,
/// which is the steepest here, this gives √2 × 2^½ = 2 times the error.
///
/// From the errors of 144 pixels by two seeds, a variance is known to √((kurtosis − 1)/288), which
/// is .13 for a kurtosis of 6, and the ratio of two errors to .09 of itself. For a ratio of 2, five
/// times that is less than the distance to 3.
const MOST: f64 = 3.0;

/// A piece of a floor that is so small that all samples of all pixels see the same light: one
/// square light, or two, which clutter may hide in part.
fn piece(camera: &str, more: &str) -> SceneDescription {
    load(&format!(
        r#"
{camera}
Camera "orthographic" "float screenwindow" [ -0.0005 0.0005 -0.0005 0.0005 ]
Film "image" "integer xresolution" [ 12 ] "integer yresolution" [ 12 ]
WorldBegin
Material "matte" "rgb Kd" [ 1 1 1 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ -3 -3 0  3 -3 0  3 3 0  -3 3 0 ]
{more}
Material "matte" "rgb Kd" [ 0 0 0 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
Shape "trianglemesh" "integer indices" [ 0 2 1 0 3 2 ] "point P" [ -.5 -.5 .6  .5 -.5 .6  .5 .5 .6  -.5 .5 .6 ]
AttributeEnd
WorldEnd
"#
    ))
}

const ABOVE: &str = "LookAt .3 .2 .01  .3 .2 -1  0 1 0";
/// A camera that looks at a mirror, which shows the same piece of the floor.
const ASIDE: &str = "LookAt .9 .2 .3  1.2 .2 .15  0 0 1";
const MIRROR: &str = r#"
AttributeBegin
Material "mirror" "rgb Kr" [ 1 1 1 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point P" [ 1.2 -1 .01  1.2 1 .01  1.2 1 .4  1.2 -1 .4 ]
AttributeEnd"#;
const CLUTTER: &str = r#"
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point P" [ .1 .1 .3  .6 .2 .35  .3 .7 .3 ]"#;
const ANOTHER_LIGHT: &str = r#"
AttributeBegin
Material "matte" "rgb Kd" [ 0 0 0 ]
AreaLightSource "diffuse" "rgb L" [ 3 2 1 ]
Shape "trianglemesh" "integer indices" [ 0 2 1 0 3 2 ] "point P" [ .9 -.5 .8  1.3 -.5 .8  1.3 .5 .6  .9 .5 .6 ]
AttributeEnd"#;

/// The relative mean squared error of the pixels by two seeds, compared with the light without
/// noise.
fn error(renderer: &Renderer<'_>, settings: &Settings, [pixel_samples, samples]: [u32; 2]) -> f64 {
    let mut workspace = Workspace::new();
    let exact = Settings {
        estimator: "exact".parse().expect("a name"),
        bounces: settings.bounces,
        ..Settings::default()
    };
    let (mut sum, mut count) = (0.0, 0.0);
    for i in 0..144 {
        let pixel = [i % 12, i / 12];
        let want = renderer.pixel(&exact, pixel, &mut workspace).x;
        assert!(want > 0.01, "{pixel:?}: {want}");
        for seed in 0..2 {
            let settings = Settings {
                pixel_samples,
                samples,
                seed: settings.seed + seed,
                ..*settings
            };
            let got = renderer.pixel(&settings, pixel, &mut workspace).x;
            sum += (got / want - 1.0).powi(2);
            count += 1.0;
        }
    }
    sum / count
}

/// Asserts that no split of a number of samples has more than [`MOST`] times the error of
/// light samples alone.
fn assert_alike(renderer: &Renderer<'_>, settings: &Settings, splits: &[[u32; 2]]) {
    let alone = error(renderer, settings, splits[0]);
    for split in &splits[1..] {
        let ratio = (error(renderer, settings, *split) / alone).sqrt();
        let Settings {
            estimator,
            sampler,
            lights,
            ..
        } = settings;
        assert!(
            ratio < MOST,
            "{estimator} {sampler} {lights} {split:?}: {ratio}"
        );
    }
}

fn settings(estimator: &str, sampler: SamplerKind) -> Settings {
    Settings {
        estimator: estimator.parse().expect("a name"),
        sampler,
        ..Settings::default()
    }
}

#[test]
fn points_and_lines_have_the_same_error_for_any_split() {
    // Without occluders, lines in closed form have no noise.
    let [points, line_points, lines] = ["point-area", "line-area", "line-analytic[control=none]"];
    for (occluder, estimators) in [
        ("", &[points, line_points][..]),
        (CLUTTER, &[points, line_points, lines]),
    ] {
        let scene = piece(ABOVE, occluder);
        let renderer = Renderer::new(&scene);
        for estimator in estimators {
            for sampler in SamplerKind::ALL {
                let settings = settings(estimator, sampler);
                assert_alike(&renderer, &settings, &SPLITS);
                assert_alike(&renderer, &settings, &UNEVEN);
            }
        }
    }
}

/// With slopes, 64 lines of one shading point have the order −2, but a few lines at each of several
/// shading points do not. Slopes do not increase the error there.
#[test]
fn slopes_do_no_harm_to_lines_of_several_camera_samples() {
    let scene = piece(ABOVE, CLUTTER);
    let renderer = Renderer::new(&scene);
    for sampler in [SamplerKind::Sobol, SamplerKind::Stratified] {
        for split in [[16, 4], [8, 8], [12, 5]] {
            let [slopes, none] = ["line-analytic", "line-analytic[control=none]"]
                .map(|estimator| error(&renderer, &settings(estimator, sampler), split));
            // Two variances are known to .13 each, and their ratio to .18, of which this is three
            // times.
            assert!(slopes < 1.55 * none, "{sampler} {split:?}: {slopes} {none}");
        }
    }
}

#[test]
fn choices_of_lights_are_one_pattern_over_camera_samples() {
    let scene = piece(ABOVE, &format!("{CLUTTER}{ANOTHER_LIGHT}"));
    let renderer = Renderer::new(&scene);
    for lights in [
        LightChoice::All,
        LightChoice::Uniform,
        LightChoice::Power,
        LightChoice::Estimate,
        LightChoice::Exact,
        LightChoice::Tree,
    ] {
        for sampler in [
            SamplerKind::Sobol,
            SamplerKind::MultiJitter,
            SamplerKind::Stratified,
            SamplerKind::Halton,
        ] {
            for estimator in ["point-area", "line-analytic[control=none]"] {
                let settings = Settings {
                    lights,
                    ..settings(estimator, sampler)
                };
                assert_alike(&renderer, &settings, &SPLITS);
                assert_alike(&renderer, &settings, &UNEVEN);
            }
        }
    }
}

#[test]
fn combinations_are_one_pattern_over_camera_samples() {
    let scene = piece(ABOVE, CLUTTER);
    let renderer = Renderer::new(&scene);
    for estimator in [
        "point-area+point-bsdf",
        "line-area+point-bsdf",
        "line-solid-angle:3+point-area",
        "point-solid-angle+point-area+point-bsdf[mis=power]",
    ] {
        for sampler in [
            SamplerKind::Sobol,
            SamplerKind::MultiJitter,
            SamplerKind::Stratified,
        ] {
            let settings = settings(estimator, sampler);
            assert_alike(&renderer, &settings, &SPLITS);
            assert_alike(&renderer, &settings, &UNEVEN);
        }
    }
}

/// The samples of each shading point on a path are one pattern over the camera samples, too.
#[test]
fn what_a_mirror_shows_is_one_pattern_over_camera_samples() {
    let scene = piece(ASIDE, &format!("{MIRROR}{CLUTTER}"));
    let renderer = Renderer::new(&scene);
    for sampler in [SamplerKind::Sobol, SamplerKind::Stratified] {
        let settings = Settings {
            bounces: 1,
            ..settings("point-area", sampler)
        };
        assert_alike(&renderer, &settings, &SPLITS);
    }
}

/// The order over camera samples is the order over light samples: near −3/4 for stratified points
/// of a partly hidden light, −3/2 for lines, and −1/2 for independent samples.
#[test]
fn errors_fall_with_camera_samples_as_with_light_samples() {
    let scene = piece(ABOVE, CLUTTER);
    let renderer = Renderer::new(&scene);
    for (estimator, sampler) in [
        ("point-area", SamplerKind::Stratified),
        ("point-area", SamplerKind::Sobol),
        ("point-area", SamplerKind::Independent),
        ("line-analytic[control=none]", SamplerKind::Stratified),
        ("line-analytic[control=none]", SamplerKind::Sobol),
    ] {
        let settings = settings(estimator, sampler);
        let order = |splits: [[u32; 2]; 2]| {
            let [few, many] = splits.map(|split| error(&renderer, &settings, split));
            0.5 * (many / few).ln() / 64_f64.ln()
        };
        let [camera, light] = [[[4, 1], [256, 1]], [[1, 4], [1, 256]]].map(order);
        // Two variances of 288 errors are known to .13 each, and their ratio to .18. An order over
        // a factor of 64 is known to .02, and a difference of two orders to .03, of which this is
        // three times.
        let name = format!("{estimator} {sampler}: {camera} {light}");
        assert!((camera - light).abs() < 0.09, "{name}");
        let steepest = if sampler == SamplerKind::Independent {
            -0.59
        } else {
            -0.6
        };
        let is_steeper = camera < steepest;
        assert_eq!(is_steeper, sampler != SamplerKind::Independent, "{name}");
    }
}

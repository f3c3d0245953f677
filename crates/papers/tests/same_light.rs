//! All estimators find the same light on every built-in scene, and lines find the same light
//! through the hierarchy as by brute force.

use linelit_estimators::{Query, RandomNumbers, brute_force};
use linelit_formats::LoadOptions;
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, Luminaire, Renderer, Settings, Spheres, Workspace};
use linelit_lights::Light;
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;
use linelit_scenes::Library;
use linelit_study::engine::{Cell, CellRun, run_cell};
use linelit_study::scene_study::{Targets, all_pixels};
use linelit_study::stats::student::quantile;

/// The number of independent trials of each estimator.
const TRIALS: u32 = 16;
/// The significance level of the whole test of one scene.
const ALPHA: f64 = 0.01;
/// The fraction of pixels that must pass: it allows for trials that are not normally distributed.
const PASS_SHARE: f64 = 0.9975;

/// Warnings about the built-in scenes are errors.
fn strict() -> Library {
    Library {
        options: LoadOptions {
            strict: true,
            ..LoadOptions::default()
        },
        ..Library::default()
    }
}

fn run(targets: &Targets<'_>, estimator: &str, samples: u32, seed: u64) -> CellRun<Settings> {
    let settings = Settings {
        estimator: estimator.parse().unwrap(),
        ..Settings::default()
    };
    let cell = Cell {
        settings,
        samples,
        seed,
        trials: TRIALS,
    };
    run_cell(targets, cell)
}

/// Returns the mean and the squared standard error of the trials.
fn moments(values: &[DVec3]) -> (DVec3, DVec3) {
    let n = f64::from(u32::try_from(values.len()).unwrap());
    let mean = values.iter().copied().sum::<DVec3>() / n;
    let square: DVec3 = values.iter().map(|v| (*v - mean) * (*v - mean)).sum();
    (mean, square / (n * (n - 1.0)))
}

/// A t test at every pixel and channel: lines against solid-angle points.
fn agree(scene_name: &str, side: u32, points: u32, lines: u32) {
    let others = [("line-analytic", lines), ("line-area", lines)];
    agree_with(scene_name, side, ("point-solid-angle", points), &others);
}

/// The same test for any estimators with their numbers of samples; the first is the reference.
fn agree_with(scene_name: &str, side: u32, points: (&str, u32), others: &[(&str, u32)]) {
    let mut scene = strict().load(scene_name).unwrap().scene;
    scene.set_resolution(side, side);
    let renderer = Renderer::new(&scene);
    let targets = Targets::find(&renderer, &all_pixels(side, side));
    assert!(
        targets.points.len() > 100,
        "{scene_name}: {} points",
        targets.points.len()
    );
    let reference = run(&targets, points.0, points.1, 11);
    let tests = f64::from(u32::try_from(targets.points.len() * 3).unwrap());
    // Each side has TRIALS - 1 degrees of freedom; where one side's error dominates that is the
    // whole, so the smaller number is the safe one.
    let t = quantile((1.0 - ALPHA).powf(1.0 / tests), TRIALS - 1);
    for (k, &(estimator, samples)) in others.iter().enumerate() {
        let ours = run(&targets, estimator, samples, 1000 + k as u64);
        let (mut failed, mut unmet) = (0usize, 0usize);
        let (mut mean_ours, mut mean_theirs) = (DVec3::ZERO, DVec3::ZERO);
        let mut variance = DVec3::ZERO;
        for point in 0..targets.points.len() {
            let (a, va) = moments(ours.trials_of(point));
            let (b, vb) = moments(reference.trials_of(point));
            // Where neither has variance (unoccluded pixels in closed form against points of a
            // tiny light), sums of 16 x 64 terms still differ by their rounding: 1024 epsilons,
            // times what a grazing cosine amplifies.
            let floor = b.max(a) * 1e-10;
            let apart = (a - b).abs().cmpgt((va + vb).map(f64::sqrt) * t + floor);
            // Points that never met the small visible part have no variance to judge by; the mean
            // over all pixels is tested instead.
            if b == DVec3::ZERO && vb == DVec3::ZERO {
                unmet += usize::from(apart.any());
            } else {
                failed += usize::from(apart.any());
            }
            mean_ours += a;
            mean_theirs += b;
            variance += va + vb;
        }
        assert!(
            100 * unmet <= targets.points.len(),
            "{scene_name}, {estimator}: points meet nothing in {unmet} pixels where lines do"
        );
        let share = 1.0 - failed as f64 / targets.points.len() as f64;
        assert!(
            share >= PASS_SHARE,
            "{scene_name}, {estimator}: {failed} pixels differ"
        );
        // The means over all pixels: thousands of trials, so nearly normal.
        let z = (mean_ours - mean_theirs).abs() / variance.map(f64::sqrt);
        // Sidak over three channels and two estimators.
        let limit = quantile((1.0 - ALPHA).powf(1.0 / 6.0), 10_000);
        assert!(
            z.max_element() < limit,
            "{scene_name}, {estimator}: z = {z}"
        );
    }
}

/// Computes the light of every pixel that sees a surface, by lines through the hierarchy and
/// without skipping work.
fn by_lines(scene: &SceneDescription, side: u32, lines: u32, seed: u64) -> Vec<DVec3> {
    let renderer = Renderer::new(scene);
    let settings = Settings {
        samples: lines,
        seed,
        skip: false,
        ..Settings::default()
    };
    let mut workspace = Workspace::new();
    let mut light = |pixel| {
        let point = renderer.shading_point(pixel, &mut workspace)?;
        Some(renderer.direct(&settings, &point, pixel, &mut workspace))
    };
    all_pixels(side, side)
        .into_iter()
        .filter_map(&mut light)
        .collect()
}

/// Computes the light by the same lines at the points of `scene`, testing every triangle of
/// `occluders` in f64.
fn by_triangles(
    (scene, occluders): (&SceneDescription, &SceneDescription),
    side: u32,
    lines: u32,
    seed: u64,
) -> Vec<DVec3> {
    let renderer = Renderer::new(scene);
    let oracle = Renderer::new(occluders);
    let lights = oracle.plan().lights_of(Spheres::Facets);
    let estimator = Estimator::analytic();
    let mut workspace = Workspace::new();
    let mut light = |pixel| {
        let point = renderer.shading_point(pixel, &mut workspace)?;
        let of_light = |light: &Luminaire| {
            let Light::Area(area) = &*light.light else {
                return DVec3::ZERO;
            };
            let source = light.source();
            let numbers = RandomNumbers::new(SamplerKind::Auto, seed, pixel, light.index);
            let query = Query::new(
                oracle.occluders(),
                &source,
                &point,
                &estimator,
                numbers,
                lines,
            );
            brute_force(&query, area, &occluders.positions, &occluders.triangles)
        };
        Some(lights.iter().map(of_light).sum())
    };
    all_pixels(side, side)
        .into_iter()
        .filter_map(&mut light)
        .collect()
}

/// Counts the pixels that differ by more than rounding.
///
/// Ends of intervals agree to 1e-9 of a line (see the tests of `linelit-visibility`); the light
/// along a line is at most a hundredfold its mean in these scenes, whose points are no nearer to
/// a light than a hundredth of its size. A pixel may be off by 1e-7 of the brightest, then: a
/// triangle that hides a part of 16e-7 of one of 16 lines in one pixel is found.
fn differing(fast: &[DVec3], slow: &[DVec3]) -> usize {
    assert_eq!(fast.len(), slow.len());
    let brightest = slow.iter().copied().fold(DVec3::ZERO, DVec3::max);
    let differ = |(a, b): &(&DVec3, &DVec3)| !(**a - **b).abs().cmple(brightest * 1e-7).all();
    fast.iter().zip(slow).filter(differ).count()
}

/// The fast queries agree with tests of every triangle in f64, with the same samples.
fn brute(scene_name: &str, side: u32, lines: u32) {
    const SEED: u64 = 5;
    let mut scene = strict().load(scene_name).unwrap().scene;
    scene.set_resolution(side, side);
    let fast = by_lines(&scene, side, lines, SEED);
    let slow = by_triangles((&scene, &scene), side, lines, SEED);
    let lit = slow.iter().filter(|b| **b != DVec3::ZERO).count();
    assert!(lit > 10, "{scene_name}: {lit} pixels are lit");
    let failed = differing(&fast, &slow);
    assert_eq!(failed, 0, "{scene_name}: {failed} pixels of {lit} differ");
}

/// The comparison detects a millionth of the light too much at one pixel, other lines, and a scene
/// that lacks one of its five hundred triangles.
#[test]
fn brute_force_has_power() {
    let (side, lines) = (16, 16);
    let mut scene = strict().load("triangle-soup-large").unwrap().scene;
    scene.set_resolution(side, side);
    let fast = by_lines(&scene, side, lines, 5);
    let mut wrong = fast.clone();
    let brightest = (0..fast.len())
        .max_by(|a, b| fast[*a].x.total_cmp(&fast[*b].x))
        .unwrap();
    wrong[brightest] *= 1.0 + 1e-6;
    assert_eq!(differing(&wrong, &fast), 1);
    let other = by_triangles((&scene, &scene), side, lines, 6);
    let found = differing(&fast, &other);
    assert!(2 * found > fast.len(), "{found} of {} pixels", fast.len());
    let mut found = 0;
    let mut asked = 0;
    for lost in (0..scene.triangles.len()).step_by(scene.triangles.len() / 8) {
        let mut holed = scene.clone();
        holed.triangles[lost] = [0; 3];
        asked += 1;
        let slow = by_triangles((&scene, &holed), side, lines, 5);
        found += usize::from(differing(&fast, &slow) > 0);
    }
    assert!(
        2 * found > asked,
        "{found} of {asked} lost triangles are found"
    );
}

#[test]
fn cornell_box() {
    agree("cornell-box-small", 24, 64, 16);
    agree("cornell-box-large", 24, 64, 16);
    brute("cornell-box-large", 16, 16);
}

#[test]
fn grid_planes() {
    agree("grid-planes-small", 24, 64, 16);
    agree("grid-planes-large", 24, 64, 16);
    brute("grid-planes-large", 16, 16);
}

#[test]
fn triangle_soup() {
    agree("triangle-soup-small", 24, 64, 16);
    agree("triangle-soup-large", 24, 64, 16);
    brute("triangle-soup-large", 16, 16);
}

#[test]
fn logo() {
    // Samples of the light alone seldom meet such a sharp lobe: too seldom for a t test.
    let points = ("point-solid-angle+point-bsdf", 1024);
    let lines = [("line-analytic", 256), ("line-area+point-bsdf", 256)];
    agree_with("logo-small", 24, points, &lines);
    agree_with("logo-large", 24, points, &lines);
    agree_with("logo-large", 24, points, &[("point-bsdf", 1024)]);
    brute("logo-large", 16, 16);
}

#[test]
fn colonnade() {
    agree("colonnade-small", 16, 64, 8);
    agree("colonnade-large", 12, 64, 8);
}

#[test]
#[ignore = "long: a quarter of a million triangles for every line"]
fn colonnade_by_brute_force() {
    brute("colonnade-large", 6, 8);
}

/// Any number of threads gives the same bits.
#[test]
fn threads_change_nothing() {
    let mut scene = strict().load("triangle-soup-large").unwrap().scene;
    scene.set_resolution(16, 16);
    let renderer = Renderer::new(&scene);
    let values = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let targets = Targets::find(&renderer, &all_pixels(16, 16));
            let run = run(&targets, "line-analytic", 8, 3);
            run.values
                .iter()
                .flat_map(|v| v.to_array())
                .map(f64::to_bits)
                .collect::<Vec<_>>()
        })
    };
    let one = values(1);
    assert!(!one.is_empty());
    for threads in [2, 3, 5] {
        assert_eq!(one, values(threads), "{threads} threads");
    }
}

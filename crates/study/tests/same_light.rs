//! The same light, by every estimator, on every built-in scene.

use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_samplers::SamplerKind;
use linelit_study::engine::{Cell, CellRun, Targets, run_cell};
use linelit_study::scenes;
use linelit_study::stats::student::quantile;

/// Independent trials of each estimator.
const TRIALS: u32 = 16;
/// Of the whole test of one scene.
const ALPHA: f64 = 0.01;
/// The share of pixels that must pass: a guard against trials that are not normally distributed.
const PASS_SHARE: f64 = 0.9975;

fn grid(side: u32) -> Vec<[u32; 2]> {
    (0..side)
        .flat_map(|y| (0..side).map(move |x| [x, y]))
        .collect()
}

fn run(
    renderer: &Renderer<'_>,
    targets: &Targets,
    estimator: &str,
    samples: u32,
    seed: u64,
) -> CellRun {
    let settings = Settings {
        estimator: estimator.parse().unwrap(),
        sampler: SamplerKind::Stratified,
        samples,
        seed,
        ..Settings::default()
    };
    run_cell(
        renderer,
        targets,
        Cell {
            settings,
            trials: TRIALS,
        },
    )
}

/// Mean and squared standard error of the trials.
fn moments(values: &[DVec3]) -> (DVec3, DVec3) {
    let n = f64::from(u32::try_from(values.len()).unwrap());
    let mean = values.iter().copied().sum::<DVec3>() / n;
    let square: DVec3 = values.iter().map(|v| (*v - mean) * (*v - mean)).sum();
    (mean, square / (n * (n - 1.0)))
}

/// A t test at every pixel and channel: lines against solid-angle points.
fn agree(scene_name: &str, side: u32, points: u32, lines: u32) {
    let others = [("line-analytic", lines), ("line-area", lines)];
    agree_with(scene_name, side, points, &others);
}

/// The same for any estimators with their numbers of samples.
fn agree_with(scene_name: &str, side: u32, points: u32, others: &[(&str, u32)]) {
    let mut scene = scenes::load(scene_name, true).unwrap().scene;
    scene.set_resolution(side, side);
    let renderer = Renderer::new(&scene);
    let targets = Targets::find(&renderer, &grid(side));
    assert!(
        targets.points.len() > 100,
        "{scene_name}: {} points",
        targets.points.len()
    );
    let reference = run(&renderer, &targets, "point-solid-angle", points, 11);
    let tests = f64::from(u32::try_from(targets.points.len() * 3).unwrap());
    // Each side has TRIALS - 1 degrees of freedom; where one side's error dominates that is the
    // whole, so the smaller number is the safe one.
    let t = quantile((1.0 - ALPHA).powf(1.0 / tests), TRIALS - 1);
    for (k, &(estimator, samples)) in others.iter().enumerate() {
        let ours = run(&renderer, &targets, estimator, samples, 1000 + k as u64);
        let (mut failed, mut mean_ours, mut mean_theirs) = (0usize, DVec3::ZERO, DVec3::ZERO);
        let mut variance = DVec3::ZERO;
        for point in 0..targets.points.len() {
            let (a, va) = moments(ours.trials_of(point));
            let (b, vb) = moments(reference.trials_of(point));
            // Where neither has variance (unoccluded pixels in closed form against points of a
            // tiny light), sums of 16 x 64 terms still differ by their rounding: 1024 epsilons,
            // times what a grazing cosine amplifies.
            let floor = b.max(a) * 1e-10;
            failed += usize::from(
                (a - b)
                    .abs()
                    .cmpgt((va + vb).map(f64::sqrt) * t + floor)
                    .any(),
            );
            mean_ours += a;
            mean_theirs += b;
            variance += va + vb;
        }
        #[allow(clippy::cast_precision_loss, reason = "few points")]
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

/// The fast queries against every triangle in f64, line by line the same samples.
fn brute(scene_name: &str, side: u32, lines: u32) {
    let mut scene = scenes::load(scene_name, true).unwrap().scene;
    scene.set_resolution(side, side);
    let renderer = Renderer::new(&scene);
    let mut workspace = Workspace::new();
    let mut lit = 0;
    for pixel in grid(side) {
        let Some(point) = renderer.shading_point(pixel, &mut workspace) else {
            continue;
        };
        let settings = Settings {
            samples: lines,
            seed: 5,
            skip: false,
            ..Settings::default()
        };
        // Independent draws: agreement within both errors, estimated from four seeds each.
        let fast: Vec<DVec3> = (0..4)
            .map(|seed| {
                renderer.direct(
                    &Settings { seed, ..settings },
                    &point,
                    pixel,
                    0,
                    &mut workspace,
                )
            })
            .collect();
        let slow: Vec<DVec3> = (10..14)
            .map(|seed| renderer.brute_force(&point, pixel, lines, seed))
            .collect();
        let ((a, va), (b, vb)) = (moments(&fast), moments(&slow));
        // Three degrees of freedom: alpha = 0.01 over 3 x side^2 tests.
        let tests = f64::from(3 * side * side);
        let t = quantile((1.0 - ALPHA).powf(1.0 / tests), 3);
        let allowed = (va + vb).map(f64::sqrt) * t + b.max(a) * 1e-10;
        assert!(
            (a - b).abs().cmple(allowed).all(),
            "{scene_name} {pixel:?}: {a} {b}"
        );
        lit += usize::from(b != DVec3::ZERO);
    }
    assert!(lit > 10, "{scene_name}: {lit} pixels are lit");
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
    brute("grid-planes-large", 8, 16);
}

#[test]
fn triangle_soup() {
    agree("triangle-soup-small", 24, 64, 16);
    agree("triangle-soup-large", 24, 64, 16);
    brute("triangle-soup-large", 8, 16);
}

#[test]
fn logo() {
    agree("logo-small", 24, 64, 16);
    agree("logo-large", 24, 64, 16);
    agree_with("logo-large", 24, 64, &[("point-bsdf", 1024)]);
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
    let mut scene = scenes::load("triangle-soup-large", true).unwrap().scene;
    scene.set_resolution(16, 16);
    let renderer = Renderer::new(&scene);
    let values = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let targets = Targets::find(&renderer, &grid(16));
            let run = run(&renderer, &targets, "line-analytic", 8, 3);
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

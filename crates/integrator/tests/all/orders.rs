//! Orders of convergence are the reason for line samples: on a partly hidden light, the standard
//! deviation of lines falls faster with their number than that of points, if the offsets of the
//! lines are stratified.

use crate::common::{CLUTTER, SQUARE, points, room};
use linelit_integrator::{Renderer, Settings, ShadingPoint, Workspace};
use linelit_samplers::SamplerKind;
use linelit_testkit::ztest::{Welford, critical_z, t_p_value, z_score_two};

/// The numbers of samples; for points they are squares, in jittered grids.
const SAMPLES: [u32; 4] = [4, 16, 64, 256];
/// The number of independent estimates of each order, whose spread gives the interval.
const GROUPS: u32 = 12;
/// The number of trials of a group at each shading point.
const TRIALS: u32 = 6;
/// The level of each of the tests below. The seeds are fixed, so that the tests pass always or
/// never.
const ALPHA: f64 = 1e-3;

/// Shading points in penumbra, where the light that lines see varies and is not zero.
fn penumbra(renderer: &Renderer<'_>) -> Vec<([u32; 2], ShadingPoint)> {
    let mut workspace = Workspace::new();
    let mut all = points(renderer);
    all.retain(|(pixel, point)| {
        let light = |seed| {
            let settings = settings("line-analytic", SamplerKind::Independent, 4, seed);
            renderer.direct(&settings, point, *pixel, &mut workspace).x
        };
        let values: Welford = (0..8).map(light).collect();
        values.std_dev() > 0.02 * values.mean()
    });
    all
}

fn settings(estimator: &str, sampler: SamplerKind, samples: u32, seed: u64) -> Settings {
    Settings {
        sampler,
        ..crate::common::settings(estimator, samples, seed)
    }
}

/// The slope of log σ over log N by least squares, one for each group.
///
/// σ² is the sample variance, averaged over the points. The bias of its logarithm is minus half its
/// relative variance, some 1/(points × trials). That is the same for all N, so that it does not
/// change the slope.
fn slopes(
    renderer: &Renderer<'_>,
    points: &[([u32; 2], ShadingPoint)],
    (estimator, sampler): (&str, SamplerKind),
) -> Welford {
    let mut workspace = Workspace::new();
    let mut slope = |group: u32| {
        let logarithms = SAMPLES.map(|samples| {
            let mut variance = 0.0;
            for (pixel, point) in points {
                let light = |trial: u32| {
                    let seed = u64::from(samples) << 32 | u64::from(group * TRIALS + trial);
                    let settings = settings(estimator, sampler, samples, seed);
                    renderer.direct(&settings, point, *pixel, &mut workspace).x
                };
                variance += (0..TRIALS).map(light).collect::<Welford>().variance();
            }
            (f64::from(samples).ln(), 0.5 * variance.ln())
        });
        let count = SAMPLES.len() as f64;
        let x = logarithms.iter().map(|p| p.0).sum::<f64>() / count;
        let y = logarithms.iter().map(|p| p.1).sum::<f64>() / count;
        let covariance: f64 = logarithms.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
        covariance / logarithms.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
    };
    (0..GROUPS).map(&mut slope).collect()
}

/// Returns whether the order is certainly below `limit` (steeper): a one-sided t test on the
/// groups.
fn below(order: &Welford, limit: f64) -> bool {
    let t = order.z_score(limit);
    t < 0.0 && 0.5 * t_p_value(t, f64::from(GROUPS - 1)) < ALPHA
}

fn above(order: &Welford, limit: f64) -> bool {
    let t = order.z_score(limit);
    t > 0.0 && 0.5 * t_p_value(t, f64::from(GROUPS - 1)) < ALPHA
}

/// Theory: independent samples always have the order −1/2. For stratified points, discontinuities
/// of visibility are in N^½ of the N strata, which gives −3/4. Along a line, visibility is
/// integrated, so that a continuous function of the offset remains: −3/2 if it is smooth, and −1 if
/// an edge is parallel to the lines.
#[test]
fn stratified_lines_converge_at_a_higher_order_than_points() {
    let scene = room(SQUARE, CLUTTER);
    let renderer = Renderer::new(&scene);
    let mut points = penumbra(&renderer);
    assert!(points.len() >= 24, "{} points in penumbra", points.len());
    let step = points.len() / 24;
    points = points.into_iter().step_by(step).collect();
    let order = |estimator, sampler| {
        let order = slopes(&renderer, &points, (estimator, sampler));
        // An interval as wide as the difference to be shown would let anything pass.
        let error = order.standard_error();
        assert!(error < 0.02, "{estimator} {sampler}: +- {error}");
        order
    };
    let lines = order("line-analytic", SamplerKind::Stratified);
    assert!(below(&lines, -0.95), "lines: {}", lines.mean());
    let plain = order("line-analytic[control=none]", SamplerKind::Stratified);
    assert!(
        below(&plain, -0.95),
        "plain mean of lines: {}",
        plain.mean()
    );
    let steeper = z_score_two(&lines, &plain);
    assert!(
        steeper < -critical_z(2.0 * ALPHA),
        "{} against {}",
        lines.mean(),
        plain.mean()
    );
    // As a control, the same lines with independent offsets fail that test.
    let independent = order("line-analytic", SamplerKind::Independent);
    assert!(!below(&independent, -0.5) && !above(&independent, -0.5));
    assert!(above(&independent, -0.6), "{}", independent.mean());
    let stratified = order("point-solid-angle", SamplerKind::Stratified);
    assert!(!below(&stratified, -0.75), "points: {}", stratified.mean());
    assert!(below(&stratified, -0.6), "points: {}", stratified.mean());
    let independent = order("point-solid-angle", SamplerKind::Independent);
    assert!(!below(&independent, -0.5) && !above(&independent, -0.5));
}

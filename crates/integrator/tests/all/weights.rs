//! The weights of combinations: their noise, and their documented properties.

use crate::common::{CLUTTER, SQUARE, microfacets, points, room, room_with_floor};
use linelit_integrator::{Renderer, Settings, ShadingPoint, Workspace};
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z};

/// A sphere that directions from the BSDF hardly ever meet.
const TINY_SPHERE: &str = r#"
Translate 0 0 1.3
Shape "sphere" "float radius" [ .01 ]"#;

fn light(
    renderer: &Renderer<'_>,
    (estimator, samples, seed): (&str, u32, u64),
    (pixel, point): &([u32; 2], ShadingPoint),
) -> f64 {
    let settings = Settings {
        estimator: estimator.parse().expect("a name"),
        sampler: SamplerKind::Independent,
        samples,
        seed,
        ..Settings::default()
    };
    let mut workspace = Workspace::new();
    renderer.direct(&settings, point, *pixel, &mut workspace).x
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Estimates at all points that receive some light, by a few seeds, divided by that light.
fn estimates(
    renderer: &Renderer<'_>,
    lit: &[(([u32; 2], ShadingPoint), f64)],
    estimator: &str,
    samples: u32,
) -> Vec<f64> {
    const SEEDS: u64 = 12;
    let one =
        |(point, want): &(_, f64), seed| light(renderer, (estimator, samples, seed), point) / want;
    lit.iter()
        .flat_map(|p| (0..SEEDS).map(move |seed| one(p, seed)))
        .collect()
}

/// For one sample and more, and for any shares, the median error by optimal weights is no larger
/// than by the balance heuristic, and the median estimate is no smaller. This also holds if a round
/// of samples has none of a technique, and if a technique hardly ever meets the light.
#[test]
fn optimal_weights_are_no_worse_than_balance_in_the_median() {
    let scenes: [(&str, SceneDescription); 3] = [
        ("tiny sphere", room(TINY_SPHERE, "")),
        ("square", room(SQUARE, CLUTTER)),
        ("plastic", room_with_floor(&microfacets(0.1))),
    ];
    const SHARES: [u32; 3] = [1, 3, 7];
    const SAMPLES: [u32; 7] = [1, 2, 3, 4, 5, 8, 16];
    let tests = 4 * scenes.len() * SHARES.len() * SAMPLES.len();
    let limit = critical_z(2.0 * sidak(0.01, tests));
    for (name, scene) in &scenes {
        let renderer = Renderer::new(scene);
        let mut lit: Vec<_> = points(&renderer)
            .into_iter()
            .map(|point| {
                let want = light(
                    &renderer,
                    ("line-solid-angle:3+point-bsdf", 2048, 99),
                    &point,
                );
                (point, want)
            })
            .collect();
        lit.retain(|(_, want)| *want > 1e-6);
        for share in SHARES {
            for samples in SAMPLES {
                let by = |mis: &str| {
                    let estimator = format!("line-warped:{share}+point-bsdf[mis={mis}]");
                    estimates(&renderer, &lit, &estimator, samples)
                };
                let mut balance = by("balance");
                let mut errors: Vec<f64> = balance.iter().map(|v| (v - 1.0).abs()).collect();
                let (value, error) = (median(&mut balance), median(&mut errors));
                for mis in ["optimal", "clamped-optimal"] {
                    let values = by(mis);
                    let n = values.len() as f64;
                    let darker = values.iter().filter(|v| **v < value).count() as f64;
                    let worse = values.iter().filter(|v| (**v - 1.0).abs() > error).count() as f64;
                    // The bound is what the medians of as many other numbers may have: each of the
                    // two counts has the variance n/4.
                    let most = 0.5 * n + limit * (0.5 * n).sqrt();
                    let text = format!("{name}, {share}:1, N = {samples}, {mis}");
                    assert!(darker < most, "{text}: {darker} of {n} below {value}");
                    assert!(worse < most, "{text}: {worse} of {n} worse than {error}");
                }
            }
        }
    }
}

/// Of two samples by two techniques, each round has one. Which technique draws it determines which
/// one drew in the other round, whose coefficients weight it. The mean is only right because a
/// round is weighted by the numbers of samples that its techniques in fact drew.
#[test]
fn optimal_weights_are_unbiased_for_the_fewest_samples() {
    let scene = room(SQUARE, "");
    let renderer = Renderer::new(&scene);
    let points = points(&renderer);
    let cases: [(&str, u32); 4] = [
        ("point-area+point-bsdf[mis=optimal]", 2),
        ("point-area+point-bsdf[mis=clamped-optimal]", 2),
        ("point-solid-angle+point-area+point-bsdf[mis=optimal]", 3),
        ("line-area:3+point-bsdf[mis=optimal]", 3),
    ];
    let limit = critical_z(sidak(0.01, cases.len()));
    let exact: Vec<f64> = points
        .iter()
        .map(|point| light(&renderer, ("exact", 1, 0), point))
        .collect();
    for (estimator, samples) in cases {
        let mut ratios = Welford::default();
        for seed in 0..600 {
            for (point, want) in points.iter().zip(&exact).filter(|(_, want)| **want > 0.0) {
                ratios.push(light(&renderer, (estimator, samples, seed), point) / want);
            }
        }
        let z = ratios.z_score(1.0);
        assert!(
            z.abs() < limit,
            "{estimator}, N = {samples}: {}, z = {z}",
            ratios.mean()
        );
    }
}

/// `average` gives equal weights to all techniques that can sample a point, regardless of their
/// shares of the samples. With lines, and directions of the BSDF that miss the light, half of the
/// lines' estimate remains.
#[test]
fn the_average_does_not_know_of_shares() {
    let scene = room(TINY_SPHERE, "");
    let renderer = Renderer::new(&scene);
    for (estimator, samples, lines, part) in [
        ("line-solid-angle:3+point-bsdf[mis=average]", 4, 3, 0.5),
        ("line-solid-angle+point-bsdf:3[mis=average]", 4, 1, 0.5),
        (
            "line-solid-angle:2+point-bsdf+point-bsdf[mis=average]",
            4,
            2,
            1.0 / 3.0,
        ),
    ] {
        let mut halves = 0;
        let points = points(&renderer);
        for (seed, point) in (0..).zip(&points) {
            let got = light(&renderer, (estimator, samples, seed), point);
            let alone = light(
                &renderer,
                ("line-solid-angle[mis=balance]", lines, seed),
                point,
            );
            // The rounding of a weight, a quotient and a sum of up to three.
            let is_part = (got - part * alone).abs() <= 8.0 * f64::EPSILON * alone;
            halves += usize::from(is_part && alone > 0.0);
        }
        // The sphere fills less than 1e-4 of the hemisphere: of 256 times three directions, one
        // meets it with a probability of at most .08, and ten with 1e-11.
        assert!(
            halves + 10 > points.len(),
            "{estimator}: {halves} of {}",
            points.len()
        );
    }
}

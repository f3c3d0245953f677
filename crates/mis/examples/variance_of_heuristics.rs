//! This example has two techniques, a sharp and a broad one, for an integrand that is their sum
//! with a shadow in it. It prints the standard deviation of each heuristic by the fraction of the
//! integrand that is in shadow.
//!
//! `cargo run --release -p linelit-mis --example variance_of_heuristics`
#![expect(clippy::print_stdout, reason = "an example prints")]

use linelit_mis::{Heuristic, clamped_optimal, visibility_optimal_contribution};
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::ztest::Welford;

/// Densities on [0, 1]: uniform, and 8 (x)⁷.
fn densities(x: f64) -> [f64; 2] {
    [1.0, 8.0 * x.powi(7)]
}

/// Unshadowed parts: "diffuse" and "specular" shading.
const PARTS: [f64; 2] = [1.0, 0.5];

/// A sample's contribution from its densities, value and technique.
type Contribution = fn(&[f64; 2], f64, usize) -> f64;

fn main() {
    let ns = [1.0, 1.0];
    let heuristics: [(&str, Contribution); 6] = [
        ("balance", |ps, f, i| {
            Heuristic::Balance.contribution(&[1.0, 1.0], ps, f, i)
        }),
        ("power 2", |ps, f, i| {
            Heuristic::Power(2.0).contribution(&[1.0, 1.0], ps, f, i)
        }),
        ("average", |ps, f, i| {
            Heuristic::Average.contribution(&[1.0, 1.0], ps, f, i)
        }),
        ("optimal, ν = ½", |ps, f, i| {
            visibility_optimal_contribution(&PARTS, &[1.0, 1.0], ps, 0.5, f, i)
        }),
        ("clamped, ν = ½", |ps, f, i| {
            clamped_optimal(&PARTS, &[1.0, 1.0], ps, 0.5, i) * f / ps[i].max(f64::MIN_POSITIVE)
        }),
        ("clamped, ν = 1", |ps, f, i| {
            clamped_optimal(&PARTS, &[1.0, 1.0], ps, 1.0, i) * f / ps[i].max(f64::MIN_POSITIVE)
        }),
    ];
    println!(
        "{:16}{}",
        "shadow",
        [0.0, 0.1, 0.3, 0.6, 0.9]
            .map(|s| format!("{s:>9}"))
            .concat()
    );
    for (name, contribution) in heuristics {
        let deviations = [0.0, 0.1, 0.3, 0.6, 0.9].map(|shadow| {
            let mut rng = SplitMix64::new(1);
            let values: Welford = (0..100_000)
                .map(|_| {
                    let points = [rng.next_f64(), rng.next_f64().powf(0.125)];
                    (0..ns.len())
                        .map(|i| {
                            let ps = densities(points[i]);
                            let f = if points[i] < shadow {
                                0.0
                            } else {
                                PARTS[0] * ps[0] + PARTS[1] * ps[1]
                            };
                            contribution(&ps, f, i)
                        })
                        .sum()
                })
                .collect();
            format!("{:>9.4}", values.std_dev())
        });
        println!("{name:16}{}", deviations.concat());
    }
}

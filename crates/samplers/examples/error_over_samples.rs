//! The root mean square error over N of every pattern, for a smooth integrand and for a jump, in
//! one and two dimensions, and the exponent of the variance from the first to the last N:
//!
//! `cargo run --release -p linelit-samplers --example error_over_samples`
#![expect(clippy::print_stdout, reason = "an example prints")]

use linelit_samplers::hash::{mix, unit_f64};
use linelit_samplers::{SampleSet, Sampler, SamplerKind};

const COUNTS: [u32; 6] = [4, 16, 64, 256, 1024, 4096];
const TRIALS: u64 = 500;

/// The squared error of one trial's estimate.
type Error = fn(&SampleSet, u64) -> f64;

fn squared(set: &SampleSet, sum: f64, integral: f64) -> f64 {
    (sum / f64::from(set.count()) - integral).powi(2)
}

/// A place of the jump that changes from trial to trial.
fn place(trial: u64) -> f64 {
    unit_f64(mix(trial ^ 0xC0FFEE))
}

fn main() {
    let integrands: [(&str, Error); 4] = [
        ("1-D smooth: exp x", |set, _| {
            squared(
                set,
                set.iter_1d().map(f64::exp).sum(),
                std::f64::consts::E - 1.0,
            )
        }),
        ("1-D jump: x < c", |set, trial| {
            let c = place(trial);
            squared(set, set.iter_1d().filter(|&x| x < c).count() as f64, c)
        }),
        ("2-D smooth: exp xy", |set, _| {
            squared(
                set,
                set.iter_2d().map(|[x, y]| (x * y).exp()).sum(),
                1.317_902_151_454_403_9,
            )
        }),
        ("2-D jump: y < c/2 + x/2", |set, trial| {
            let c = place(trial);
            squared(
                set,
                set.iter_2d().filter(|[x, y]| 2.0 * y < c + x).count() as f64,
                0.25 + 0.5 * c,
            )
        }),
    ];
    for (name, error) in integrands {
        println!(
            "\n{name:32}{}  variance",
            COUNTS.map(|n| format!("{n:>10}")).concat()
        );
        for kind in SamplerKind::ALL {
            let variances = COUNTS.map(|n| {
                let set = |trial| Sampler::new(kind, trial).points([0, 0], 0, n);
                (0..TRIALS)
                    .map(|trial| error(&set(trial), trial))
                    .sum::<f64>()
                    / TRIALS as f64
            });
            let exponent =
                (variances[5] / variances[0]).ln() / f64::from(COUNTS[5] / COUNTS[0]).ln();
            println!(
                "  {kind:30}{}  N^{exponent:.2}",
                variances.map(|v| format!("{:>10.2e}", v.sqrt())).concat()
            );
        }
    }
}

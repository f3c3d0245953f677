//! This example integrates x² + y over the unit square by 64 Owen–Sobol' points.
#![expect(clippy::print_stdout, reason = "an example prints")]

use linelit_samplers::{Sampler, SamplerKind};

fn main() {
    let set = Sampler::new(SamplerKind::Sobol, 1).points([0, 0], 0, 64);
    let mean = set.iter_2d().map(|[x, y]| x * x + y).sum::<f64>() / 64.0;
    println!("{mean:.6} (exactly 5/6 = {:.6})", 5.0 / 6.0);
}

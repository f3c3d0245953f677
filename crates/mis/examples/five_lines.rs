//! This example computes the weights of a light sample and a BSDF sample.
#![expect(clippy::print_stdout, reason = "an example prints")]

use linelit_mis::{balance, power};

fn main() {
    let (ns, ps) = ([1.0, 1.0], [2.0, 0.5]);
    println!(
        "balance {} + {}",
        balance(&ns, &ps, 0),
        balance(&ns, &ps, 1)
    );
    println!(
        "power   {:.4} + {:.4}",
        power(&ns, &ps, 2.0, 0),
        power(&ns, &ps, 2.0, 1)
    );
}

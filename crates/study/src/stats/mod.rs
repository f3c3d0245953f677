//! Numbers about errors: metrics of pictures, and orders of convergence with their confidence.

pub mod metrics;
pub mod slopes;
pub mod student;

/// A standard normal deviate (Box & Muller 1958).
#[cfg(test)]
pub(crate) fn normal(random: &mut impl rand::RngExt) -> f64 {
    let (a, b): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

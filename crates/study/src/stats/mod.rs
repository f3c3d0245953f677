//! Numbers about errors: metrics of pictures, and orders of convergence with their confidence.

pub mod metrics;
mod random;
pub mod slopes;
pub mod student;

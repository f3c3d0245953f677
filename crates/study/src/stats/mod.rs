//! Numbers about errors: metrics of pictures, and orders of convergence with their confidence.

pub mod metrics;
pub(crate) mod random;
pub mod slopes;
pub mod student;

//! These tests check the properties of the patterns: their values, strata, independence and
//! convergence.

mod blocks;
mod blue_noise;
mod convergence;
mod golden;
mod hostile;
mod independence;
mod long;
mod purity;
mod slopes;
mod strata;
mod uniformity;

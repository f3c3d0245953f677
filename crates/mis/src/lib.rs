//! This crate holds heuristics for multiple importance sampling, as functions of plain numbers.
//!
//! A sample that is drawn by technique i of several has the density pⱼ under each of them. A
//! heuristic turns these densities and the sample counts Nⱼ into a weight wᵢ with Σᵢ wᵢ = 1, for
//! which Σᵢ (1/Nᵢ) Σₖ wᵢ f/pᵢ is unbiased. This crate does not depend on lights, lines or
//! directions. It never allocates, never fails, and returns no NaN for densities that are zero,
//! infinite or NaN.
//!
//! ```
//! use linelit_mis::{balance, power};
//!
//! // One light sample (density 2) and one BSDF sample (density 0.5) in the same measure:
//! let (ns, ps) = ([1.0, 1.0], [2.0, 0.5]);
//! assert_eq!(balance(&ns, &ps, 0), 0.8);
//! assert_eq!(balance(&ns, &ps, 1), 0.2);
//! assert!(power(&ns, &ps, 2.0, 0) > 0.9);
//! ```
//!
//! | heuristic | source |
//! |---|---|
//! | [`balance`], [`power`], [`maximum`], [`cutoff`], [`average`], [`Heuristic`] | Veach & Guibas 1995 |
//! | [`optimal_contribution`], [`OptimalSystem`] | Kondapaneni et al. 2019 |
//! | [`weighted_balance`], [`clamped_optimal`], [`visibility_optimal_contribution`] | Peters 2021 |
//! | [`smoothing`] | Salesin & Jarosz 2019 |

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod clamped;
mod heuristics;
mod optimal;
pub mod smoothing;

pub use clamped::{clamped_optimal, visibility_optimal_contribution, weighted_balance};
pub use heuristics::{Heuristic, average, balance, balance_density, cutoff, maximum, power};
pub use optimal::{OptimalSystem, optimal_contribution};

/// The README's examples are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#![doc = include_str!("../README.md")]
//!
//! ```
//! use linelit_testkit::{assert_close, quadrature::gauss_kronrod};
//! let area = gauss_kronrod(|x| (1.0 - x * x).sqrt(), -1.0, 1.0, 1e-10);
//! assert_close!(area.value, std::f64::consts::FRAC_PI_2, rel = 1e-9, "the tolerance asked for, with a margin of ten");
//! ```

pub mod chi2;
pub mod close;
pub mod dd;
pub mod precise;
pub mod quadrature;
pub mod real;
pub mod rng;
pub mod ztest;

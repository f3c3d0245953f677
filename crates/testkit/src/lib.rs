#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

pub mod cases;
pub mod chi2;
pub mod close;
pub mod dd;
pub mod folder;
pub mod laws;
pub mod peters_as_printed;
pub mod pictures;
pub mod precise;
pub mod program;
pub mod public;
pub mod quadrature;
pub mod real;
pub mod rng;
pub mod rooms;
pub mod strategies;
pub mod vectors;
pub mod ztest;

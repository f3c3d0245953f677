//! This crate makes sample sequences in which every number is a pure function of seed, pixel,
//! dimension and sample.
//!
//! A [`Sampler`] has a [kind](SamplerKind) and a seed. [`Sampler::points`] returns the
//! [`SampleSet`] of one pixel in one dimension. Its numbers are f64 in [0, 1), never 1, in one or
//! two dimensions, for any number of samples. There is no stored or shared state and no order of
//! evaluation, so that images do not depend on threads, tiles or the order of work.
//!
//! ```
//! use linelit_samplers::{Sampler, SamplerKind};
//!
//! // The integral of x² + y over the unit square is 5/6.
//! let set = Sampler::new(SamplerKind::Sobol, 1).points([0, 0], 0, 1024);
//! let mean = set.iter_2d().map(|[x, y]| x * x + y).sum::<f64>() / 1024.0;
//! assert!((mean - 5.0 / 6.0).abs() < 1e-3);
//! ```
//!
//! The numbers of different dimensions are *padded*: they are independent, and each set is
//! stratified by itself. A [`Block`] of a set is for one of several users that share it. [`Slopes`]
//! are control variates between the numbers of a set. [`Sampler::rng`] returns a generator for code
//! that takes one of `rand`'s. The building blocks ([`sobol_02`], [`owen_scramble`],
//! [`blue_noise_rank`], [`hash`]) are public.
//!
//! Streams are frozen: golden values in the tests check them, and a change of one is a breaking
//! change.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod block;
mod blue_noise;
mod burley;
mod cells;
mod halton;
pub mod hash;
mod independent;
mod kind;
mod owen;
mod permute;
mod sampler;
mod slopes;
mod sobol;
mod stratified;
mod zsobol;

pub use block::Block;
pub use blue_noise::blue_noise_rank;
pub use kind::{SamplerKind, UnknownSampler};
pub use owen::owen_scramble;
pub use sampler::{SampleSet, Sampler};
pub use slopes::{Slopes, stratum};
pub use sobol::{sobol_02, van_der_corput};

/// The README's examples are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

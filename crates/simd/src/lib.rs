//! Vectors of eight numbers, whose operations give bit-identical results on every instruction set.
//!
#![doc = include_str!("../README.md")]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod dispatch;
mod isa;
mod scalar;
mod sine;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86;

#[cfg(target_arch = "x86_64")]
pub use isa::{Avx2, Avx512};
pub use isa::{InstructionSet, Isa, ParseInstructionSetError};
pub use scalar::{One, Scalar};
pub use sine::sine;
pub use vector::{Lanes, Numbers, Simd};

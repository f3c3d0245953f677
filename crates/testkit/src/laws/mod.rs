//! Laws to check techniques, closed forms and reflections by, your own too: [`Technique`],
//! [`Integral`] and [`Bsdf`].
//!
//! All take closures over plain numbers and arrays, and know no type of any other crate. A broken
//! law is an error that states which law, where and by how much ([`Broken`]); `check_…` panics
//! with it, `try_…` returns it. With inputs from proptest each check becomes a property:
//!
//! ```
//! use linelit_testkit::laws::Integral;
//! use proptest::prelude::*;
//!
//! proptest!(|(a in 0.1..2.0_f64, b in 2.0..9.0_f64)| {
//!     // ∫ dx/x = ln b − ln a.
//!     Integral::new("1/x").check_1d([a, b], |a, b| (b / a).ln(), |x| 1.0 / x);
//! });
//! ```

mod bsdf;
mod integral;
mod jacobian;
pub mod surface;
mod technique;

pub use bsdf::{Bsdf, Measured};
pub use integral::{Agreement, Integral};
pub use surface::Surface;
pub use technique::{Report, Technique};

use std::fmt;

/// The error of a broken law.
#[derive(Clone, Debug, PartialEq)]
pub struct Broken {
    /// The name of the technique, closed form or reflection, and the law that it broke.
    pub message: String,
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Broken {}

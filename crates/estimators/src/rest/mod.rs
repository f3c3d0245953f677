//! Samples of the part of the light that is not known.

pub(crate) mod alone;
mod optimal;
mod prepared;
pub(crate) mod segment;
mod smooth;
pub(crate) mod visible;
pub(crate) mod weighted;

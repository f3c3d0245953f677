//! Closed-form light integrals along segments and over polygons, and BSDFs.

pub mod bsdf;
pub mod cylinder;
pub mod horizon;
pub mod polygon;
pub mod ribbon;

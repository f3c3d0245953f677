//! Convergence studies for direct illumination: the library behind the `linelit` command.

pub mod procedural;

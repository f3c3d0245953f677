//! Queries compared with brute force, on ordinary, degenerate and extreme meshes.

mod agreement;
mod alpha;
mod between;
mod builtin;
mod candidates;
mod closed_mesh;
mod closest;
mod common;
mod degenerate;
mod fans;
mod holes;
mod laws;
mod leaks;
mod limits;
mod margins;
#[cfg(feature = "obvhs")]
mod obvhs;
mod refit;
mod rounding;
mod silhouettes;
mod together;

//! Queries held to brute force, on ordinary, degenerate and hostile meshes.

mod agreement;
mod alpha;
mod builtin;
mod candidates;
mod closed_mesh;
mod closest;
mod common;
mod degenerate;
mod fans;
mod gathered;
mod instances;
mod laws;
mod leaks;
mod limits;
mod margins;
mod refit;
mod silhouettes;
mod streams;

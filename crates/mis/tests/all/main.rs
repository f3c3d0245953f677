//! These tests check the laws of the heuristics, and their results for hostile numbers.

mod hostile;
mod laws;
mod unbiased;

//! The laws of the heuristics, and what they do with hostile numbers.

mod hostile;
mod laws;
mod unbiased;

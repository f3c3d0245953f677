//! Choosing among lights: frequencies, laws, and hostile input.

mod choices;
mod frozen;
mod laws;

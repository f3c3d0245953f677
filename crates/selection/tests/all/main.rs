//! These tests check the choice among lights: frequencies, laws, and hostile input.

mod choices;
mod frozen;
mod laws;

//! Tests that `cargo xtask` also runs as programs, with arguments.
#![allow(clippy::disallowed_methods, reason = "reads what the test was given")]

/// The arguments of a test: those that `cargo xtask` put into the variable `LINELIT_ARGUMENTS`, a
/// line each, or `usual` where a test runner starts it.
#[must_use]
pub fn arguments(usual: &[&str]) -> Vec<String> {
    match std::env::var("LINELIT_ARGUMENTS") {
        Ok(given) => given.lines().map(str::to_owned).collect(),
        Err(_) => usual.iter().map(|&word| word.to_owned()).collect(),
    }
}

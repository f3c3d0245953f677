//! Arguments of tests that `cargo xtask` also runs as programs.
#![allow(clippy::disallowed_methods, reason = "reads what the test was given")]

/// Returns the arguments of a test: the lines of the environment variable `LINELIT_ARGUMENTS`,
/// which `cargo xtask` sets, or `usual` if a test runner starts it.
#[must_use]
pub fn arguments(usual: &[&str]) -> Vec<String> {
    match std::env::var("LINELIT_ARGUMENTS") {
        Ok(given) => given.lines().map(str::to_owned).collect(),
        Err(_) => usual.iter().map(|&word| word.to_owned()).collect(),
    }
}

//! The example that is a renderer of its own agrees with itself three ways.

#[path = "../examples/engine.rs"]
mod engine;

use std::process::{ExitCode, Termination};

#[test]
fn the_engine_agrees_with_itself() {
    let wanted = format!("{:?}", ExitCode::SUCCESS.report());
    assert_eq!(format!("{:?}", engine::main().report()), wanted);
}

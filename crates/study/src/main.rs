//! The `linelit` command.
fn main() {}

//! The tools of those who work on linelit: `cargo xtask COMMAND` starts them.

#![forbid(unsafe_code)]

mod args;
mod check_references;
mod choice;
mod equal_time;
mod figures;
mod load_all;
mod pictures;
mod speed;
mod visibility;

use args::{Bench, Cli, Command};
use linelit_cli::program;
use std::process::ExitCode;

fn main() -> ExitCode {
    program::start(|cli: &Cli, out| {
        if let Some(set) = cli.isa {
            set.limit();
        }
        match &cli.command {
            Command::CheckReferences(args) => check_references::run(args, out),
            Command::LoadAll(args) => load_all::run(args, out),
            Command::Pictures(args) => pictures::run(args, out),
            Command::Figures(args) => figures::run(args, out),
            Command::Bench(Bench::EqualTime(args)) => equal_time::run(args, out),
            Command::Bench(Bench::Visibility(args)) => visibility::run(args, out),
            Command::Bench(Bench::Speed(args)) => speed::run(args, out),
            Command::Bench(Bench::Choice(args)) => choice::run(args, out),
        }
    })
}

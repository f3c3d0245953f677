//! The `linelit` command.

#![allow(clippy::print_stderr, reason = "a command says what went wrong")]

use clap::Parser;
use linelit_study::cli::{Cli, Command};
use linelit_study::commands;
use std::process::ExitCode;

fn main() -> ExitCode {
    // clap prints usage errors itself and exits with 2.
    let cli = Cli::parse();
    let result = match &cli.command {
        Command::Render(args) => commands::render(args),
        Command::Converge(args) => commands::converge(args),
        Command::Compare(args) => commands::compare(args),
        Command::Info(args) => commands::info(args),
        Command::CheckReferences(args) => commands::check_references(args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

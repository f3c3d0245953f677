//! The `linelit` command.

#![allow(clippy::print_stderr, reason = "a command says what went wrong")]

use clap::Parser;
use linelit_scene::SceneError;
use linelit_study::cli::{Cli, Command};
use linelit_study::commands;
use std::process::ExitCode;

fn main() -> ExitCode {
    // clap prints usage errors itself and exits with 2.
    let cli = Cli::parse();
    if let Some(set) = cli.isa {
        set.limit();
    }
    let result = match &cli.command {
        Command::Render(args) => commands::render(args),
        Command::Converge(args) => commands::converge(args),
        Command::Compare(args) => commands::compare(args),
        Command::Info(args) => commands::info(args),
        Command::Convert(args) => commands::convert(args),
        Command::CheckReferences(args) => commands::check_references(args),
        Command::LoadAll(args) => commands::load_all(args),
        Command::Bench(args) => commands::bench(args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Errors of scene files bring their own heading.
            match error.downcast_ref::<SceneError>() {
                Some(error) => eprintln!("{error}"),
                None => eprintln!("error: {error:#}"),
            }
            ExitCode::FAILURE
        }
    }
}

//! The `linelit` command.

use linelit_cli::args::{Cli, Command};
use linelit_cli::{commands, program};
use std::process::ExitCode;

fn main() -> ExitCode {
    linelit_study::tables::set_commit(env!("LINELIT_COMMIT"));
    program::start(|cli: &Cli, out| {
        if let Some(set) = cli.isa {
            set.limit();
        }
        match &cli.command {
            Command::Render(args) => commands::render(args, out),
            Command::Converge(args) => commands::converge(args, out),
            Command::ViewFactors(args) => commands::viewfactors(args, out),
            Command::Plan(args) => commands::plan(args, out),
            Command::Run(args) => commands::run(args, out),
            Command::Merge(args) => commands::merge(args, out),
            Command::Status(args) => commands::status(args, out),
            Command::Compare(args) => commands::compare(args, out),
            Command::Info(args) => commands::info(args, out),
            Command::List(args) => commands::list(args, out),
            Command::Completions(args) => commands::completions(args.shell, out),
            Command::Man(args) => commands::man(args, out),
        }
    })
}

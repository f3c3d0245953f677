//! The `linelit` command.

use clap::Parser;
use linelit_formats::SceneError;
use linelit_study::cli::{Cli, Command, UsageError};
use linelit_study::commands;
use linelit_study::output::{CLOSED_STATUS, Output, OutputError, note};
use std::process::ExitCode;

/// What clap says with, too.
const USAGE_STATUS: u8 = 2;

fn main() -> ExitCode {
    let mut out = Output::stdout();
    match run(&mut out) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure(&error),
    }
}

fn run(out: &mut Output) -> anyhow::Result<()> {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        // What was asked for: help, or the version.
        Err(text) if !text.use_stderr() => {
            write!(out, "{}", text.render())?;
            return Ok(out.flush()?);
        }
        Err(error) => return Err(error.into()),
    };
    if let Some(set) = cli.isa {
        set.limit();
    }
    match &cli.command {
        Command::Render(args) => commands::render(args, out),
        Command::Converge(args) => commands::converge(args, out),
        Command::Compare(args) => commands::compare(args, out),
        Command::Info(args) => commands::info(args, out),
        Command::Convert(args) => commands::convert(args),
        Command::CheckReferences(args) => commands::check_references(args, out),
        Command::LoadAll(args) => commands::load_all(args, out),
        Command::Bench(args) => commands::bench(args, out),
    }?;
    Ok(out.flush()?)
}

/// Says what went wrong, and the exit status for it.
fn failure(error: &anyhow::Error) -> ExitCode {
    if let Some(OutputError::Closed) = error.downcast_ref() {
        return ExitCode::from(CLOSED_STATUS);
    }
    if let Some(usage) = error.downcast_ref::<clap::Error>() {
        note(format_args!("{}", usage.render().to_string().trim_end()));
        return ExitCode::from(USAGE_STATUS);
    }
    if let Some(UsageError(what)) = error.downcast_ref() {
        note(format_args!(
            "error: {what}\n\nFor more information, try '--help'."
        ));
        return ExitCode::from(USAGE_STATUS);
    }
    // Errors of scene files bring their own heading.
    match error.downcast_ref::<SceneError>() {
        Some(error) => note(format_args!("{error}")),
        None => note(format_args!("error: {error:#}")),
    }
    ExitCode::FAILURE
}

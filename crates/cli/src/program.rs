//! The start and the end of a program of this workspace: it parses the command line, runs, and
//! turns errors into messages and exit statuses.

use crate::args::UsageError;
use crate::output::{Output, OutputError, note};
use anyhow::Result;
use clap::Parser;
use linelit_formats::SceneError;
use linelit_plan::PlanError;
use std::io;
use std::process::ExitCode;

/// The exit status for usage errors, the same as clap's.
const USAGE_STATUS: u8 = 2;

/// The exit status for errors that may not recur (`EX_TEMPFAIL` of sysexits.h): parts are missing,
/// work was stopped, the disk is full.
const TRY_AGAIN_STATUS: u8 = 75;

/// The exit status when the reader of standard output is gone: 128 + 13, as if SIGPIPE (number 13)
/// had ended the program, like other tools in a pipe.
const CLOSED_STATUS: u8 = 141;

/// The error that work is unfinished; the program exits with status 75.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct TryAgain(pub String);

/// Parses the command line, works, and prints errors. Exit statuses are 0 for success, 1 for
/// failure, 2 for usage errors, 75 for "try again", and 141 when the reader of standard output is
/// gone.
pub fn start<C: Parser>(work: impl FnOnce(&C, &mut Output) -> Result<()>) -> ExitCode {
    match run(work) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure(&error),
    }
}

/// Parses the command line and works.
fn run<C: Parser>(work: impl FnOnce(&C, &mut Output) -> Result<()>) -> Result<()> {
    let mut out = Output(io::stdout());
    match C::try_parse() {
        Ok(words) => work(&words, &mut out)?,
        // The help or the version was requested.
        Err(text) if !text.use_stderr() => write!(out, "{}", text.render())?,
        Err(error) => return Err(error.into()),
    }
    Ok(out.flush()?)
}

/// Prints an error, and returns the exit status for it.
fn failure(error: &anyhow::Error) -> ExitCode {
    if error.downcast_ref().is_some_and(OutputError::is_closed) {
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
    // Errors of scene files have a heading of their own.
    match error.downcast_ref::<SceneError>() {
        Some(error) => note(format_args!("{error}")),
        None => note(format_args!("error: {error:#}")),
    }
    let later = error.downcast_ref().is_some_and(PlanError::is_temporary);
    if later || error.downcast_ref::<TryAgain>().is_some() {
        return ExitCode::from(TRY_AGAIN_STATUS);
    }
    ExitCode::FAILURE
}

//! How a program of this workspace starts and ends.

use crate::args::UsageError;
use crate::output::{Output, OutputError, note};
use anyhow::Result;
use clap::Parser;
use linelit_formats::SceneError;
use linelit_plan::PlanError;
use std::io;
use std::process::ExitCode;

/// The exit status for usage errors, which clap has, too.
const USAGE_STATUS: u8 = 2;

/// The exit status for what may go well later (`EX_TEMPFAIL` of sysexits.h): parts are missing,
/// work was stopped, the disk is full.
const TRY_AGAIN_STATUS: u8 = 75;

/// The exit status when the reader of standard output has gone: that of a program that the signal
/// for it (SIGPIPE, number 13) has ended, 128 + 13, as other tools of a pipe have.
const CLOSED_STATUS: u8 = 141;

/// The error that work is unfinished: the program exits with 75.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct TryAgain(pub String);

/// Reads the command line, works, and says what went wrong: 0 done, 1 failed, 2 usage, 75 try
/// again, 141 when nobody reads standard output any more.
pub fn start<C: Parser>(work: impl FnOnce(&C, &mut Output) -> Result<()>) -> ExitCode {
    match run(work) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure(&error),
    }
}

fn run<C: Parser>(work: impl FnOnce(&C, &mut Output) -> Result<()>) -> Result<()> {
    let mut out = Output(io::stdout());
    match C::try_parse() {
        Ok(words) => work(&words, &mut out)?,
        // What was asked for: help, or the version.
        Err(text) if !text.use_stderr() => write!(out, "{}", text.render())?,
        Err(error) => return Err(error.into()),
    }
    Ok(out.flush()?)
}

/// Says what went wrong, and the exit status for it.
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
    // Errors of scene files bring their own heading.
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

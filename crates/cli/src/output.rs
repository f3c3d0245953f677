//! The output of a command: results on standard output, everything else on standard error.
//!
//! All printing goes through this module, so that a closed pipe or a full disk becomes an error and
//! not a panic; clippy's lints `print_stdout` and `print_stderr` ensure this.

use std::fmt;
use std::io::{self, Write};

/// The standard output; `write!` and `writeln!` work on it.
#[derive(Debug)]
pub struct Output(pub(crate) io::Stdout);

/// The reason why results could not be printed.
#[derive(Debug, thiserror::Error)]
#[error("cannot write to standard output: {0}")]
pub struct OutputError(#[from] io::Error);

impl OutputError {
    /// Returns whether the reader of the results has closed the pipe, which is not worth a message.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.0.kind() == io::ErrorKind::BrokenPipe
    }
}

impl Output {
    /// Writes formatted text; `write!` and `writeln!` call this.
    ///
    /// # Errors
    /// [`OutputError`], to be passed on with `?`, so that it ends the program.
    pub fn write_fmt(&mut self, text: fmt::Arguments<'_>) -> Result<(), OutputError> {
        Ok(self.0.write_fmt(text)?)
    }

    /// Writes all buffered text.
    ///
    /// # Errors
    /// As [`Output::write_fmt`].
    pub fn flush(&mut self) -> Result<(), OutputError> {
        Ok(self.0.flush()?)
    }
}

/// Prints a line on standard error. If that is closed or full, the line is lost and the work
/// continues.
pub fn note(text: fmt::Arguments<'_>) {
    let _ = writeln!(io::stderr(), "{text}");
}

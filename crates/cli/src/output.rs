//! What the command says: results on standard output, everything else on standard error.
//!
//! All printing goes through here, so that a reader that goes away, or a disk that is full, is an
//! answer and not a panic; clippy's `print_stdout` and `print_stderr` keep it so.

use std::fmt;
use std::io::{self, Write};

/// Standard output; `write!` and `writeln!` work on it.
#[derive(Debug)]
pub struct Output(pub(crate) io::Stdout);

/// Why results could not be printed.
#[derive(Debug, thiserror::Error)]
#[error("cannot write to standard output: {0}")]
pub struct OutputError(#[from] io::Error);

impl OutputError {
    /// Whether nobody reads the results any more: no reason to complain.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.0.kind() == io::ErrorKind::BrokenPipe
    }
}

impl Output {
    /// Implementation of `write!` and `writeln!`.
    ///
    /// # Errors
    /// [`OutputError`], to be handed on with `?`: the program ends by it.
    pub fn write_fmt(&mut self, text: fmt::Arguments<'_>) -> Result<(), OutputError> {
        Ok(self.0.write_fmt(text)?)
    }

    /// Hands on what is still held back.
    ///
    /// # Errors
    /// As [`Output::write_fmt`].
    pub fn flush(&mut self) -> Result<(), OutputError> {
        Ok(self.0.flush()?)
    }
}

/// Says something beside the results: a line on standard error. Where that is closed or full there
/// is nobody to tell, and the work goes on.
pub fn note(text: fmt::Arguments<'_>) {
    let _ = writeln!(io::stderr(), "{text}");
}

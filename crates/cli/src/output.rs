//! What the command says: results on standard output, everything else on standard error.
//!
//! All printing goes through here, so that a reader that goes away, or a disk that is full, is an
//! answer and not a panic; clippy's `print_stdout` and `print_stderr` keep it so.

use std::fmt;
use std::io::{self, Write};

/// Exit status when the reader of standard output has gone: that of a program that the signal for
/// it (SIGPIPE, number 13) has ended, 128 + 13, as other tools of a pipe have.
pub const CLOSED_STATUS: u8 = 141;

/// Destination of results; `write!` and `writeln!` work on it.
pub struct Output {
    to: Box<dyn Write + Send>,
}

/// Why results could not be printed.
#[derive(Debug)]
pub enum OutputError {
    /// Nobody reads them any more: no reason to complain.
    Closed,
    /// The system refused, as on a full disk.
    Failed(io::Error),
}

impl Output {
    /// Standard output.
    #[must_use]
    pub fn stdout() -> Self {
        Self::new(io::stdout())
    }

    /// Any other place.
    #[must_use]
    pub fn new(to: impl Write + Send + 'static) -> Self {
        Self { to: Box::new(to) }
    }

    /// Implementation of `write!` and `writeln!`.
    ///
    /// # Errors
    /// [`OutputError`], to be handed on with `?`: the program ends by it.
    pub fn write_fmt(&mut self, text: fmt::Arguments<'_>) -> Result<(), OutputError> {
        Ok(self.to.write_fmt(text)?)
    }

    /// Hands on what is still held back.
    ///
    /// # Errors
    /// As [`Output::write_fmt`].
    pub fn flush(&mut self) -> Result<(), OutputError> {
        Ok(self.to.flush()?)
    }
}

impl fmt::Debug for Output {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Output")
    }
}

impl From<io::Error> for OutputError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::Closed,
            _ => Self::Failed(error),
        }
    }
}

impl fmt::Display for OutputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed => f.write_str("nobody reads standard output"),
            Self::Failed(error) => write!(f, "cannot write to standard output: {error}"),
        }
    }
}

impl std::error::Error for OutputError {}

/// Says something beside the results: a line on standard error. Where that is closed or full there
/// is nobody to tell, and the work goes on.
pub fn note(text: fmt::Arguments<'_>) {
    let _ = writeln!(io::stderr(), "{text}");
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes nothing, for a reason.
    struct Broken(io::ErrorKind);

    impl Write for Broken {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_closed_pipe_is_told_from_a_full_disk() {
        let try_with = |kind| writeln!(Output::new(Broken(kind)), "{}", 1).unwrap_err();
        assert!(matches!(
            try_with(io::ErrorKind::BrokenPipe),
            OutputError::Closed
        ));
        let full = try_with(io::ErrorKind::StorageFull);
        assert!(matches!(full, OutputError::Failed(_)));
        assert!(
            full.to_string()
                .starts_with("cannot write to standard output: ")
        );
    }
}

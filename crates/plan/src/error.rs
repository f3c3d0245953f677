//! The errors of plans.

use std::io;
use std::path::{Path, PathBuf};

/// An error of the function that computes units.
pub type BoxError = Box<dyn std::error::Error + Send + Sync>;

/// The reason why a plan could not be made, read, run or merged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The operating system reported an error.
    #[error("cannot {step} {}: {error}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The step that was tried, as a verb.
        step: &'static str,
        /// The system's error.
        error: io::Error,
    },
    /// A file exists but does not have the contents that were written.
    #[error("{} is broken: {reason}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// The reason why the file counts as broken.
        reason: String,
    },
    /// The folder holds another plan.
    #[error(
        "{} holds another plan ({differs}): choose another folder, or remove it",
        path.display()
    )]
    Another {
        /// The folder.
        path: PathBuf,
        /// The differences; the values of the existing plan come first.
        differs: String,
    },
    /// Something differs from what was planned, as the text says.
    #[error("{0}")]
    Refused(String),
    /// A unit could not be computed.
    #[error("unit {number} ({name}): {error}")]
    Work {
        /// The index of the unit in the plan.
        number: u32,
        /// The name of the unit.
        name: String,
        /// The error of the function that computes units.
        error: BoxError,
    },
    /// The work was stopped from outside; finished units are stored.
    #[error("interrupted")]
    Interrupted,
}

impl PlanError {
    /// Returns a function that makes a [`PlanError::Io`] of an error of the operating system.
    pub(crate) fn io(path: &Path, step: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |error| Self::Io { path, step, error }
    }

    /// Returns the error that a file is broken.
    pub(crate) fn broken(path: &Path, reason: impl Into<String>) -> Self {
        Self::Broken {
            path: path.to_owned(),
            reason: reason.into(),
        }
    }

    /// Returns whether the same call may succeed later without a change of plan or program: the
    /// disk is full, the file system does not answer, or the work was stopped. (Programs exit with
    /// status 75 then.)
    #[must_use]
    pub fn is_temporary(&self) -> bool {
        use io::ErrorKind as Kind;
        match self {
            Self::Interrupted => true,
            Self::Io { error, .. } => matches!(
                error.kind(),
                Kind::StorageFull
                    | Kind::QuotaExceeded
                    | Kind::ResourceBusy
                    | Kind::Interrupted
                    | Kind::TimedOut
                    | Kind::WouldBlock
                    | Kind::StaleNetworkFileHandle
                    | Kind::HostUnreachable
                    | Kind::NetworkUnreachable
                    | Kind::NetworkDown
                    | Kind::OutOfMemory
            ),
            Self::Work { error, .. } => {
                error.downcast_ref::<Self>().is_some_and(Self::is_temporary)
            }
            Self::Broken { .. } | Self::Another { .. } | Self::Refused(_) => false,
        }
    }
}

#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod durable;
mod error;
mod folder;
mod part;
mod plan;
mod run;
mod shard;
mod status;

pub use error::{BoxError, PlanError};
pub use folder::{Folder, Missing};
pub use part::hash;
pub use plan::{Input, InputFile, Plan, Unit};
pub use run::{Event, Run, RunCounts, Task, run};
pub use shard::Shard;
pub use status::Status;

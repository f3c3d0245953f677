#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod durable;
mod error;
mod folder;
mod hash;
mod part;
mod plan;
mod run;
mod shard;
mod status;
mod tree;

pub use error::{BoxError, PlanError};
pub use folder::{Folder, Missing};
pub use hash::hash;
pub use plan::{Input, InputFile, Plan, Unit};
pub use run::{Event, Ran, Run, Task, run};
pub use shard::{Named, Shard};
pub use status::Status;
pub use tree::Tree;

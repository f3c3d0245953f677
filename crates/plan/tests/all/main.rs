//! Plans, used as programs use them.

mod common;
mod folders;
mod parts;
mod runs;
mod schedules;

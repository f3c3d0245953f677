#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod args;
pub mod commands;
pub mod folder;
pub mod inputs;
pub mod interrupt;
pub mod output;
pub mod program;
pub mod words;

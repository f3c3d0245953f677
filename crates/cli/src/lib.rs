#![doc = include_str!("../README.md")]

pub mod args;
pub mod commands;
pub mod folder;
pub mod output;
pub mod program;

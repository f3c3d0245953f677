//! The program as a user runs it.

mod alone;
mod command;
mod common;
mod files;
mod folders;
mod guide;
mod isa;
mod killed;
mod outside;
mod studies;
mod words;

//! The program as a user runs it.

mod alone;
mod command;
mod common;
mod compare;
mod described;
mod files;
mod flags;
mod folders;
mod guide;
mod isa;
mod killed;
mod outside;
mod pictures;
mod plans;
mod studies;
mod study_plans;
mod tev;
mod viewfactors;
mod words;

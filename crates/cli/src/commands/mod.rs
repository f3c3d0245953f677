//! The commands of the program, a module each, and the modules that they share.

mod aovs;
mod compare;
mod converge;
mod cut;
mod image;
mod info;
mod list;
mod methods;
mod pages;
mod picture;
mod plan;
mod render;
mod study;
mod tev;
mod threads;
mod units;
mod viewfactors;

pub use compare::run as compare;
pub use converge::run as converge;
pub use info::run as info;
pub use list::run as list;
pub use pages::{completions, man};
pub use plan::{merge, plan, run, status};
pub use render::run as render;
pub use threads::{bar, pool};
pub use viewfactors::run as viewfactors;

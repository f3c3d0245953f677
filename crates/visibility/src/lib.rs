//! Ray and line visibility: BVH, shadow-triangle and shaft queries that return the visible intervals of light segments.

pub mod brute;
mod build;
mod counters;
mod dense;
mod dispatch;
mod frame;
mod lines;
mod merge;
#[doc(hidden)]
pub mod measure;
mod node;
mod occluders;
mod project;
mod ray;
mod scratch;
mod shaft;
mod simd;
mod sweep;
mod traverse;
mod watertight;

pub use counters::Counters;
pub use dispatch::InstructionSet;
pub use lines::VisibleLines;
pub use occluders::Occluders;
pub use ray::{Hit, Ray};
pub use scratch::Scratch;
pub use shaft::{Shaft, ShaftClass, ShaftQuery};

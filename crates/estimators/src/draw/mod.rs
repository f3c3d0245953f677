//! Points and lines that are drawn on a light before their visibility is asked for.

pub(crate) mod block;
pub(crate) mod lines;
pub(crate) mod points;

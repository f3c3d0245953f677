//! What holds for every shape and every number, in one program: linking takes longer than testing.

mod hostile;
mod intervals;
mod measures;
mod shadow;

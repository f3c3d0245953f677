//! Properties that hold for every shape and every number. All are in one program, since linking
//! takes longer than testing.

mod hostile;
mod intervals;
mod measures;
mod shadow;

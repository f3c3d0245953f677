//! Tests of the functions: against 31 digits, in their special cases, and bit for bit.

mod accuracy;
mod hostile;
mod special;

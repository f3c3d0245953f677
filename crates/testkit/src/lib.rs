//! Test tools of linelit: quadrature, high-precision evaluation, statistical tests and float-attacking strategies.

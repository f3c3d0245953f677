//! Convergence studies for direct illumination: the linelit command.

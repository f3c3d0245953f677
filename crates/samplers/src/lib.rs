//! Counter-based sample sequences: every number is a pure function of seed, pixel, dimension and sample.

//! Multiple importance sampling heuristics on plain numbers.

//! Closed-form light integrals along segments and over polygons, and BSDFs.

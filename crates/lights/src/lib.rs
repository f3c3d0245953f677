//! Area and linear lights, with sample, pdf and invert for every sampling technique, and line parametrisations.

//! linelit for Python: functions that take numpy's arrays and return them.
//!
//! Each file is one part of the module `linelit._linelit`, which `python/linelit` wraps. The code
//! here reads arguments, calls the Rust crates, which compute everything, and converts results.

mod arrays;
mod errors;
mod light;
mod lit;
mod pickle;
mod picture;
mod receivers;
mod reflection;
mod sampling;
mod scene;
mod study;
mod threads;
mod viewfactors;

use pyo3::prelude::*;

/// The compiled part of linelit.
#[pymodule]
mod _linelit {
    #[pymodule_export]
    use crate::light::Light;
    #[pymodule_export]
    use crate::picture::render;
    #[pymodule_export]
    use crate::reflection::Reflection;
    #[pymodule_export]
    use crate::sampling::{pdf, sample};
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::study::converge;
    #[pymodule_export]
    use crate::viewfactors::ViewFactors;

    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "Python's name")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}

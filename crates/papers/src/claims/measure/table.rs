//! Billen & Dutré 2016, Table 1: tests of boxes and triangles for lights of two sizes.

use super::super::bench::{Bench, Figures};
use crate::billen_table1;
use crate::measured::Measured;
use anyhow::Result;

/// How much more is tested for a large light than for a small one.
pub(super) fn run(bench: &Bench<'_>) -> Result<Figures> {
    // Of all pixels: which of them see more of the scene is what the figure hangs on.
    let rows = billen_table1::rows(&bench.pictures_of(u32::MAX, 0))?;
    let find = |scene: String| rows.iter().find(|row| row.scene() == scene);
    let mut figures = Figures::new();
    for (name, scene) in [
        ("grid planes", "grid-planes"),
        ("triangle soup", "triangle-soup"),
        ("Sponza", "colonnade"),
        ("logo", "logo"),
    ] {
        let pair = ["small", "large"].map(|size| find(format!("{scene}-{size}")));
        if let [Some(small), Some(large)] = pair {
            for (what, ratio) in [
                ("boxes", large.boxes / small.boxes),
                ("triangles", large.triangles / small.triangles),
            ] {
                let name = format!("{what} for a large light/{name}");
                figures.insert(name, Measured::exact(ratio));
            }
        }
    }
    Ok(figures)
}

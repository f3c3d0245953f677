//! Billen & Dutré 2016, Table 1: tests of boxes and triangles for lights of two sizes.

use super::super::bench::Bench;
use super::super::measured::{Figures, Measured};
use crate::billen_table1;
use anyhow::Result;

/// How much more is tested for a large light than for a small one, and the rates.
pub(super) fn run(bench: &Bench<'_>) -> Result<Figures> {
    let found = billen_table1::run(&bench.pictures_of(12, 0))?;
    let value = |scene: &str, key: &str| {
        let rows = found.rows.as_array().into_iter().flatten();
        let mut own = rows.filter(|row| row["scene"] == scene);
        own.next().and_then(|row| row[key].as_f64())
    };
    let mut figures = Figures::new();
    for (name, scene) in [
        ("grid planes", "grid-planes"),
        ("triangle soup", "triangle-soup"),
        ("Sponza", "colonnade"),
        ("logo", "logo"),
    ] {
        for (what, key) in [("boxes", "box_tests_m"), ("triangles", "triangle_tests_m")] {
            let [small, large] =
                ["small", "large"].map(|size| value(&format!("{scene}-{size}"), key));
            if let (Some(small), Some(large)) = (small, large) {
                let ratio = Measured::exact(large / small);
                figures.insert(format!("{what} for a large light/{name}"), ratio);
            }
        }
    }
    Ok(figures)
}

//! The report pages: from results to pictures, plots and tables.

use crate::engine::SceneResult;
use crate::studies::{Figure, StudySpec};
use crate::tables::StudyRecord;
use anyhow::Result;
use std::path::Path;

/// Writes `report.html` and `plots/*.svg` of a convergence study.
pub(super) fn write_study(
    _out: &Path,
    _record: &StudyRecord,
    _spec: &StudySpec,
    _results: &[SceneResult],
) -> Result<()> {
    Ok(())
}

/// Writes `report.html` of figures.
pub(super) fn write_figures(_out: &Path, _figures: &[Figure]) -> Result<()> {
    Ok(())
}

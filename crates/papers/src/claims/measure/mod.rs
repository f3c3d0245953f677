//! What is measured for the claims, group by group.

mod formulas;
mod orders;
mod peters;
mod salesin;
mod shirley;
mod table;
mod theory;

use super::bench::{Bench, Figures};

use anyhow::Result;

/// Figures that are measured together.
#[derive(Clone, Copy)]
pub(super) struct Group {
    /// Its name, for those who wait.
    pub(super) name: &'static str,
    /// The study that shows more of the same.
    pub(super) study: &'static str,
    /// Measures.
    pub(super) run: fn(&Bench<'_>) -> Result<Figures>,
}

impl Group {
    const fn new(
        name: &'static str,
        study: &'static str,
        run: fn(&Bench<'_>) -> Result<Figures>,
    ) -> Self {
        Self { name, study, run }
    }
}

/// All groups, in the order in which they are measured.
pub(super) const GROUPS: [Group; 15] = [
    Group::new("formulas as printed", "claims", formulas::run),
    Group::new("orders by theory", "claims", theory::run),
    Group::new("directions of lines", "billen-figures", theory::directions),
    Group::new("orders of points and lines", "billen-orders", orders::run),
    Group::new("tests of boxes and triangles", "billen-table1", table::run),
    Group::new("two directions", "salesin-fig5", salesin::directions),
    Group::new("strips", "salesin-fig6", salesin::strips),
    Group::new("smoothed weights", "salesin-fig7", salesin::smoothing),
    Group::new("the Cornell box", "salesin-fig8", salesin::cornell),
    Group::new("scenes for the same time", "salesin-fig1", salesin::scenes),
    Group::new("diffuse linear lights", "peters-fig6", peters::diffuse),
    Group::new("glossy linear lights", "peters-fig1", peters::gloss),
    Group::new("costs of linear lights", "peters-table1", peters::costs),
    Group::new("many luminaires", "shirley", shirley::run),
    Group::new(
        "a triangle and a hidden light",
        "shirley",
        shirley::triangles,
    ),
];

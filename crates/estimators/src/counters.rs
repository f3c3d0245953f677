//! What was skipped, and what was done.

use std::fmt;
use std::ops::AddAssign;

/// How often what was skipped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlanCounters {
    /// Shading points estimated.
    pub points: u64,
    /// Shading points whose material reflects nothing: no light was looked at.
    pub black_materials: u64,
    /// Pairs of shading point and light that were looked at.
    pub point_lights: u64,
    /// Pairs dropped because the light faces away.
    pub facing_away: u64,
    /// Pairs dropped because the light is below the horizon.
    pub below_horizon: u64,
    /// Pairs with nothing between point and light: no visibility was sampled.
    pub unoccluded: u64,
    /// Pairs where the light is wholly hidden: nothing was sampled.
    pub hidden: u64,
    /// Pairs where the light was integrated in closed form without any sample.
    pub closed_form: u64,
    /// Pairs in penumbra whose visible part was integrated in closed form.
    pub exact_penumbrae: u64,
    /// Pairs in penumbra that `exact` handed to line samples.
    pub exact_fallbacks: u64,
    /// Line samples that are wholly hidden.
    pub hidden_lines: u64,
    /// Lines asked for their density at a point of another technique.
    pub density_lines: u64,
}

impl PlanCounters {
    /// Names and values, for reports.
    #[must_use]
    pub fn rows(&self) -> [(&'static str, u64); 12] {
        [
            ("shading points", self.points),
            ("points on black materials, skipped", self.black_materials),
            ("(point, light) pairs", self.point_lights),
            ("pairs skipped: light faces away", self.facing_away),
            ("pairs skipped: light below the horizon", self.below_horizon),
            (
                "pairs without any occluder: no visibility sampled",
                self.unoccluded,
            ),
            (
                "pairs with the light wholly hidden: nothing sampled",
                self.hidden,
            ),
            ("pairs in closed form: no samples", self.closed_form),
            ("penumbra pairs in closed form", self.exact_penumbrae),
            (
                "penumbra pairs handed by exact to lines",
                self.exact_fallbacks,
            ),
            ("line samples wholly hidden", self.hidden_lines),
            (
                "lines through points of other techniques, for their density",
                self.density_lines,
            ),
        ]
    }
}

impl AddAssign for PlanCounters {
    fn add_assign(&mut self, other: Self) {
        self.points += other.points;
        self.black_materials += other.black_materials;
        self.point_lights += other.point_lights;
        self.facing_away += other.facing_away;
        self.below_horizon += other.below_horizon;
        self.unoccluded += other.unoccluded;
        self.hidden += other.hidden;
        self.closed_form += other.closed_form;
        self.exact_penumbrae += other.exact_penumbrae;
        self.exact_fallbacks += other.exact_fallbacks;
        self.hidden_lines += other.hidden_lines;
        self.density_lines += other.density_lines;
    }
}

impl fmt::Display for PlanCounters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, value) in self.rows() {
            writeln!(f, "{value:>14}  {name}")?;
        }
        Ok(())
    }
}

/// How many pieces line samples were cut into (Billen & Dutré 2016, Fig. 5).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SegmentCounters {
    /// Line samples asked.
    pub lines: u64,
    /// Visible pieces found.
    pub pieces: u64,
}

impl AddAssign for SegmentCounters {
    fn add_assign(&mut self, other: Self) {
        self.lines += other.lines;
        self.pieces += other.pieces;
    }
}

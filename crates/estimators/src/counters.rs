//! Counters of skipped and finished work.

use linelit_visibility::VisibleLines;
use std::fmt;
use std::ops::AddAssign;

/// Counters that add up, each with what reports call it.
macro_rules! counters {
    ($(#[$outer:meta])* $name:ident { $($(#[$doc:meta])* $counter:ident: $text:literal,)+ }) => {
        $(#[$outer])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name {
            $($(#[$doc])* pub $counter: u64,)+
        }

        impl $name {
            /// Names and values, for reports.
            pub fn rows(&self) -> impl Iterator<Item = (&'static str, u64)> {
                [$(($text, self.$counter)),+].into_iter()
            }
        }

        impl AddAssign for $name {
            fn add_assign(&mut self, other: Self) {
                $(self.$counter += other.$counter;)+
            }
        }
    };
}

counters! {
    /// Pairs of shading points and lights, by the work that was skipped.
    PlanCounters {
        /// Shading points estimated.
        points: "shading points",
        /// Shading points whose material reflects nothing: no light was looked at.
        black_materials: "points on black materials, skipped",
        /// Pairs of shading point and light that were looked at.
        point_lights: "(point, light) pairs",
        /// Pairs dropped because the light faces away.
        facing_away: "pairs skipped: light faces away",
        /// Pairs dropped because the light is below the horizon.
        below_horizon: "pairs skipped: light below the horizon",
        /// Pairs of a shading point and a light that were skipped without a look at the light: it
        /// is in a group of lights each of which faces away from the point or is below its horizon.
        groups_left_out: "pairs skipped with their group: facing away or below the horizon",
        /// Pairs with nothing between point and light: no visibility was sampled.
        unoccluded: "pairs without any occluder: no visibility sampled",
        /// Pairs where the light is wholly hidden: nothing was sampled.
        hidden: "pairs with the light wholly hidden: nothing sampled",
        /// Pairs where the light was integrated in closed form without any sample.
        closed_form: "pairs in closed form: no samples",
        /// Pairs in penumbra whose visible part was integrated in closed form.
        exact_penumbrae: "penumbra pairs in closed form",
        /// Pairs of which `exact` did not integrate the visible part, though the light was neither
        /// found hidden nor seen as a whole: lines or points in its place.
        exact_fallbacks: "penumbra pairs handed by exact to lines",
        /// Pairs for which a closed form over the light or along lines was requested and there is
        /// none, so that points alone took its place.
        points_in_place: "pairs by points in place of a closed form that there is not",
        /// These points.
        points_drawn_in_place: "points in place of closed forms that there are not",
        /// Pairs of a point and a sphere that triangles reach into, or with too many in between to
        /// tell: points by solid angle in place of lines, a shadow ray for each point.
        spheres_by_rays: "pairs with a sphere that triangles may reach into: rays, no lines",
        /// Pairs of a point and a cylinder that triangles reach into, or with too many in between
        /// to tell: each line and each point is looked for by itself.
        cylinders_by_rays: "pairs with a cylinder that triangles may reach into: a look for each line",
        /// Line samples that are wholly hidden.
        hidden_lines: "line samples wholly hidden",
        /// Lines asked for their density at a point of another technique.
        density_lines: "lines through points of other techniques, for their density",
    }
}

counters! {
    /// Numbers of lines and of the pieces that they were cut into (Billen & Dutré 2016, Fig. 5).
    SegmentCounters {
        /// Line samples asked.
        lines: "lines",
        /// Visible pieces found.
        pieces: "visible pieces of lines",
    }
}

/// The counters of all work that estimates do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkCounters {
    /// Skipped and finished work.
    pub plan: PlanCounters,
    /// Lines and their visible pieces.
    pub segments: SegmentCounters,
}

impl WorkCounters {
    /// Counts so many lines that were asked for, their visible pieces, and those that have none.
    pub(crate) fn count_lines(&mut self, visible: &VisibleLines, lines: usize) {
        for i in 0..lines {
            let parts = visible.line(i);
            self.segments.lines += 1;
            self.segments.pieces += parts.len() as u64;
            self.plan.hidden_lines += u64::from(parts.is_empty());
        }
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

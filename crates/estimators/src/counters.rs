//! These counters say how much work estimates did, and how much of it they skipped.

use linelit_visibility::VisibleLines;
use std::fmt;
use std::ops::AddAssign;

/// Defines a struct of counters that can be added up. Each counter has the text that reports show
/// for it.
macro_rules! counters {
    ($(#[$outer:meta])* $name:ident { $($(#[$doc:meta])* $counter:ident: $text:literal,)+ }) => {
        $(#[$outer])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name {
            $($(#[$doc])* pub $counter: u64,)+
        }

        impl $name {
            /// The counters as pairs of a text for reports and a value.
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
    /// Numbers of pairs of a shading point and a light, by how they were treated and which work was
    /// skipped.
    PlanCounters {
        /// The shading points for which light was estimated.
        points: "shading points",
        /// The shading points whose material is black: no light was considered.
        black_materials: "points on black materials, skipped",
        /// The pairs of a shading point and a light that were considered.
        point_lights: "(point, light) pairs",
        /// The pairs that were skipped because the light faces away from the point.
        facing_away: "pairs skipped: light faces away",
        /// The pairs that were skipped because the light is below the point's horizon.
        below_horizon: "pairs skipped: light below the horizon",
        /// The pairs that were skipped without considering the light by itself: it is in a group of
        /// lights each of which faces away from the point or is below its horizon.
        groups_left_out: "pairs skipped with their group: facing away or below the horizon",
        /// The pairs with no occluder between point and light: no visibility was sampled.
        unoccluded: "pairs without any occluder: no visibility sampled",
        /// The pairs with a wholly hidden light: no samples were taken.
        hidden: "pairs with the light wholly hidden: nothing sampled",
        /// The pairs with a light that was integrated as a whole in closed form, without samples.
        closed_form: "pairs in closed form: no samples",
        /// The pairs with a partly hidden light whose visible part was integrated in closed form.
        exact_penumbrae: "penumbra pairs in closed form",
        /// The pairs for which `exact` used lines or points instead of integrating the visible
        /// part, though the light was neither found hidden nor seen as a whole.
        exact_fallbacks: "penumbra pairs handed by exact to lines",
        /// The pairs for which the estimator is named for a closed form, over the light or along
        /// lines, that does not exist here, so that only points were sampled.
        points_in_place: "pairs by points, since the requested closed form does not exist",
        /// The number of points that were sampled for [`points_in_place`](Self::points_in_place).
        points_drawn_in_place: "points drawn in place of closed forms that do not exist",
        /// The pairs with a sphere that triangles reach into, or with too many triangles in between
        /// to know: points by solid angle were sampled instead of lines, with a shadow ray for
        /// each.
        spheres_by_rays: "pairs with a sphere that triangles may reach into: rays, no lines",
        /// The pairs with a cylinder that triangles reach into, or with too many triangles in
        /// between to know: visibility was queried for each line and each point by itself.
        cylinders_by_rays: "pairs with a cylinder that triangles may reach into: a look for each line",
        /// The line samples that are wholly hidden.
        hidden_lines: "line samples wholly hidden",
        /// The lines whose visible parts were queried for the density of line sampling at a point
        /// that another technique drew.
        density_lines: "lines through points of other techniques, for their density",
    }
}

counters! {
    /// Numbers of lines, and of the visible pieces into which occluders cut them (Billen & Dutré
    /// 2016, Fig. 5).
    SegmentCounters {
        /// The line samples whose visibility was queried.
        lines: "lines",
        /// The visible pieces that were found.
        pieces: "visible pieces of lines",
    }
}

/// The counters of all work that estimates do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkCounters {
    /// Work that was done or skipped, by pairs of a point and a light.
    pub plan: PlanCounters,
    /// Lines and their visible pieces.
    pub segments: SegmentCounters,
}

impl WorkCounters {
    /// Counts this many queried lines, their visible pieces, and the lines that have none.
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

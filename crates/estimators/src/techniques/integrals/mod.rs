//! Integrals over what lines find visible.

pub(crate) mod analytic;
pub(crate) mod exact;
pub(crate) mod hybrid;

use crate::techniques::integrations;
use crate::{Buffers, EmissionTexture, Integration, Lines, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;
use linelit_visibility::Shaft;

/// What a line becomes in a combination on a reflection without a closed form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Instead {
    /// It stays one, of which a point is drawn.
    Line,
    /// So many points of the light.
    Points(u32),
    /// The closed form of the transformed cosines that the reflection looks like, and so many
    /// points for what these leave out, of this technique and of all others.
    Differences(u32),
}

/// What decides that.
pub(crate) struct Between<'q, 's> {
    /// What stands between the shading point and the light.
    pub shaft: &'q Shaft<'s>,
    /// The samples of the combination.
    pub samples: u32,
    /// Whether transformed cosines may look like the light that is reflected.
    pub has_cosines: bool,
}

/// A way to integrate the light of a polygon without a random point of each line: all there is to
/// know about one technique. One with options of its own implements
/// [`OwnOptions`](crate::text::OwnOptions) as well.
pub(crate) trait Integral: Copy + Default {
    /// The name in texts.
    const NAME: &'static str;

    /// Whether its lines stay lines in any combination.
    const KEEPS_LINES: bool = false;

    /// The light of the query, whose samples are lines, as [`estimate`](crate::estimate) gives it:
    /// alone, and in a combination where the reflection has a closed form.
    ///
    /// A shaft is best asked for by [`through_shaft`](crate::strategy::through_shaft), which skips
    /// and counts lights that are hidden or seen as a whole.
    fn light<R: Reflection, T: EmissionTexture>(
        self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        lines: &Lines,
        buffers: &mut Buffers,
    ) -> DVec3;

    /// What becomes of a line in a combination on a reflection without a closed form. Round lights
    /// also ask on others, whether they are integrated over what is visible of them, or along
    /// chords.
    fn instead(self, between: &Between<'_, '_>) -> Instead;
}

impl Integration {
    /// Whether its lines stay lines in any combination.
    pub(crate) fn keeps_lines(self) -> bool {
        integrations! { constant [self, KEEPS_LINES] }
    }

    /// What becomes of a line in a combination.
    pub(crate) fn instead(self, between: &Between<'_, '_>) -> Instead {
        integrations! { dispatch [self, technique => technique.instead(between)] }
    }

    /// The light of the query, whose samples are lines.
    pub(crate) fn light<R: Reflection, T: EmissionTexture>(
        self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        lines: &Lines,
        buffers: &mut Buffers,
    ) -> DVec3 {
        integrations! { dispatch
            [self, technique => technique.light(query, area, lines, buffers)]
        }
    }
}

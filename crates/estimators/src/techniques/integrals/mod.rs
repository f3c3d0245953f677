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

/// A way to integrate the light of a polygon without a random point of each line: all there is to
/// know about one technique. One with options of its own implements
/// [`OwnOptions`](crate::text::OwnOptions) as well.
pub(crate) trait Integral: Copy + Default {
    /// The name in texts.
    const NAME: &'static str;

    /// How many points uniform on the area stand for a line in a combination, where there is no
    /// closed form and a shaft is too dense to keep; lines by area unless said.
    const POINTS_IF_DENSE: Option<u32> = None;

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

    /// Whether a round light of so many samples is integrated over what is visible of it, by what
    /// stands between; else along chords.
    fn is_exact(self, shaft: &Shaft<'_>, samples: u32) -> bool {
        let _ = (shaft, samples);
        false
    }
}

impl Integration {
    pub(crate) fn points_if_dense(self) -> Option<u32> {
        integrations! { constant [self, POINTS_IF_DENSE] }
    }

    /// Whether a round light is integrated over what is visible of it.
    pub(crate) fn is_exact(self, shaft: &Shaft<'_>, samples: u32) -> bool {
        integrations! { dispatch [self, technique => technique.is_exact(shaft, samples)] }
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

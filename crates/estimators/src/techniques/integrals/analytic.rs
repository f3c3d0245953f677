//! `line-analytic`: the closed form along the visible parts of each line.

use super::{Between, Instead, Integral};
use crate::line_sum::{self, Along};
use crate::{Buffers, EmissionTexture, Lines, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Analytic;

impl Integral for Analytic {
    const NAME: &'static str = "line-analytic";
    const KEEPS_LINES: bool = true;

    fn light<R: Reflection, T: EmissionTexture>(
        self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        lines: &Lines,
        buffers: &mut Buffers,
    ) -> DVec3 {
        line_sum::lines(query, area, lines, Along::best(query), buffers)
    }

    fn instead(self, _: &Between<'_, '_>) -> Instead {
        Instead::Line
    }
}

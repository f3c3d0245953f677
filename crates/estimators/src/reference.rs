//! Brute-force visibility in f64, to judge the hierarchy's by.

use crate::line_sum::{self, Along, Draws};
use crate::{EmissionTexture, Lines, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::{DVec3, intervals::Interval};
use linelit_lights::AreaLight;
use linelit_visibility::brute;

/// The light of an area light by lines whose visible parts are found in `f64` by asking every
/// triangle: no hierarchy, no kernels, no skips; where the reflection has a closed form along a
/// line by that, else by a point of each. For tests, and for judging other renderers' images.
///
/// The lines are those of `line-analytic`, so that without skips both give the same light up to
/// the rounding of the intervals' ends.
#[must_use]
pub fn brute_force<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
) -> DVec3 {
    let along = Along::best(query);
    let mut draws = Draws::default();
    draws.draw(query, area, &Lines::AREA, along);
    let (x, own) = (query.point.position, &query.light.triangles);
    let parts: Vec<Vec<Interval>> = draws
        .lines
        .iter()
        .map(|line| brute::visible(positions, triangles, x, line, own, query.margins))
        .collect();
    let sum = line_sum::gather(query, area, along, &mut draws, |i| &parts[i]);
    sum / f64::from(query.samples)
}

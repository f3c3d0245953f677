//! Brute-force visibility in f64, to judge the hierarchy's by.

use crate::draw::lines::{Draws, Use};
use crate::integrand::Integrand;
use crate::known::lines::{self, Pieces};
use crate::rest::alone;
use crate::streams::Samples;
use crate::view::LightView;
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
    let (polygon, occlusion) = (&area.polygon, &query.light.occlusion);
    let (x, own, numbers) = (query.point.position, &query.light.triangles, &query.numbers);
    let Some(view) = LightView::new(query.light, query.point, query.margins, None) else {
        return DVec3::ZERO;
    };
    let form = query.point.known().closed_form();
    let form = form.filter(|_| query.light.texture.is_none());
    let then = match form {
        Some(_) => Use::Integrals,
        None => Use::Points,
    };
    let count = query.samples;
    let mut draws = Draws::default();
    draws.draw(
        polygon,
        &Lines::AREA,
        occlusion,
        Samples { numbers, count },
        then,
    );
    let parts: Vec<Vec<Interval>> = draws
        .segments
        .iter()
        .map(|line| brute::visible(positions, triangles, x, line, own, query.margins))
        .collect();
    let sum = match form {
        Some(form) => {
            let pieces = &mut Pieces::default();
            lines::gather(&view, &form, |_| 1.0, &draws, pieces, |i| &parts[i])
        }
        None => {
            let (light, point) = (query.light, query.point);
            let integrand = Integrand {
                light,
                point,
                known: None,
            };
            alone::gather(&integrand, polygon, &draws, |i| &parts[i])
        }
    };
    sum / f64::from(count)
}

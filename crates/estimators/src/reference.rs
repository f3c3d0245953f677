//! Brute-force visibility in `f64` is the reference for the visibility that the hierarchy finds.

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

/// Estimates the light of an area light by lines whose visible parts are found in `f64` by testing
/// every triangle: without a hierarchy, without kernels and without leaving out samples. Where the
/// reflection has a closed form along lines, that is used; otherwise a point of each line is
/// sampled. This is a reference for tests, and for comparison with images of other renderers.
///
/// The lines are the lines of `line-analytic`. If that takes all samples ([`Query::skip`] is
/// `false`), both give the same light but for the rounding of the ends of visible parts.
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
    // Use the closed form along lines if there is one.
    let form = query.point.known().closed_form();
    let form = form.filter(|_| query.light.texture.is_none());
    let then = match form {
        Some(_) => Use::Integrals,
        None => Use::Points,
    };
    // Draw the lines, and find their visible parts by testing every triangle.
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
    // Integrate along the visible parts, or sample a point of them.
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

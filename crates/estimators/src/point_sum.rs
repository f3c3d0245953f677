//! Point samples: the mean of L f_r V cos θ/p_ω, whatever draws the points and whoever knows V.

use crate::light::Shape;
use crate::techniques::point_techniques;
use crate::techniques::points::{DrawPoints, LightPoint, PointDensity, Polygon};
use crate::{Buffers, EmissionTexture, PointBy, Points, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;
use linelit_visibility::Shaft;

/// The mean of L f_r V cos θ/p_ω over points (Billen & Dutré 2016, eqs. 1–2, per solid angle).
///
/// `draw` gives what point `i` sends to the viewer if nothing stands between, L f_r cos θ, its
/// density per solid angle (of a linear light, times its radius) and what `visible` then needs to
/// know of it.
pub(crate) fn mean<P>(
    count: u32,
    mut draw: impl FnMut(u32) -> Option<(DVec3, f64, P)>,
    mut visible: impl FnMut(&P) -> bool,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (value, density, at) in (0..count).filter_map(&mut draw) {
        if density > 0.0 && value != DVec3::ZERO && visible(&at) {
            sum += value * (1.0 / density);
        }
    }
    sum / f64::from(count)
}

/// The mean over points of the surface of the query's light; by its area without a source.
fn on_surface<R: Reflection, T: EmissionTexture, S: Shape>(
    query: &Query<'_, R, T>,
    surface: &S,
    source: &Option<impl DrawPoints<S>>,
    visible: impl FnMut(&LightPoint) -> bool,
) -> DVec3 {
    match source {
        Some(source) => mean_of(query, surface, source, visible),
        None => mean_of(query, surface, &surface.by_area(), visible),
    }
}

fn mean_of<R: Reflection, T: EmissionTexture, S: Shape>(
    query: &Query<'_, R, T>,
    surface: &S,
    source: &impl DrawPoints<S>,
    visible: impl FnMut(&LightPoint) -> bool,
) -> DVec3 {
    let numbers = query.numbers();
    let draw = |i| {
        let (at, density) = source.draw(numbers.get_2d(i), surface, query.point)?;
        Some((query.unshadowed(&at), density, at))
    };
    mean(query.samples, draw, visible)
}

/// The mean over points of the surface of the query's light, a shadow ray for each.
pub(crate) fn on_surface_by_rays<R: Reflection, T: EmissionTexture, S: Shape>(
    query: &Query<'_, R, T>,
    surface: &S,
    source: &Option<impl DrawPoints<S>>,
    buffers: &mut Buffers,
) -> DVec3 {
    on_surface(query, surface, source, |at| {
        query.is_free(at.to_light, buffers)
    })
}

/// Points of an area light, a shadow ray for each.
pub(crate) fn by_rays<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    buffers: &mut Buffers,
) -> DVec3 {
    on_polygon(query, area, by, |at| query.is_free(at.to_light, buffers))
}

/// Points of an area light that share a shaft in place of rays.
pub(crate) fn in_shaft<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    shaft: &mut Shaft<'_>,
) -> DVec3 {
    on_polygon(query, area, by, |at| shaft.point_visible(at.point))
}

/// Points of an area light.
fn on_polygon<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    visible: impl FnMut(&LightPoint) -> bool,
) -> DVec3 {
    let whole = Polygon {
        polygon: &area.polygon,
        turn: 0.0,
        texture: query.light.texture,
        position: query.point.position,
        normal: query.point.normal,
        cosines: query.cosines_for([&Points::by(by).into()]),
    };
    point_techniques! { dispatch [by, technique => {
        on_surface(query, &area.polygon, &technique.on_polygon(&whole), visible)
    }] }
}

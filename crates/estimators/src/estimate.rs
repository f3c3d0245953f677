//! From an estimator to what it does for each kind of light.

use crate::line_sum::{self, Along};
use crate::strategy::{self, Strategy};
use crate::techniques::point_techniques;
use crate::techniques::points::PointDensity;
use crate::techniques::points::round::{RoundPoints, Viewer};
use crate::{
    Buffers, EmissionTexture, Estimator, Integration, LinearOptions, Lines, PointBy, Points, Query,
    Technique, combination, linear, point_sum,
};
use linelit_bsdf::{Known, Reflection};
use linelit_geometry::DVec3;
use linelit_lights::{AreaLight, CylinderLight, CylinderView, Disk, Light, LinearLight, Sphere};

/// Radiance that the light sends from the shading point to its viewer, W/(m²·sr) by channel.
///
/// Unbiased for every estimator, and a pure function of the query. Where
/// [`LightSource::reaches`](crate::LightSource::reaches) says no, it is zero: so it is behind a
/// one-sided light, whose normal (counter-clockwise corners seen from its tip) points to the side
/// that emits. Closed forms such as `linelit_shading::polygon::irradiance` do not ask for sides.
///
/// In debug builds it panics where a normal or the direction to the viewer is no unit vector, for
/// the result would be out of proportion.
#[must_use]
pub fn estimate<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    buffers: &mut Buffers,
) -> DVec3 {
    debug_assert!(
        query.point.has_unit_vectors(),
        "unit vectors: {:?}",
        [
            query.point.normal,
            query.point.geometric_normal,
            query.point.outgoing,
        ]
    );
    let safer = with_bsdf_samples(query);
    let query = &Query {
        estimator: safer.as_ref().unwrap_or(query.estimator),
        ..*query
    };
    let (x, margin) = (query.point.position, query.margins.light);
    match query.light.light {
        Light::Area(light) if !light.faces(x, margin) => DVec3::ZERO,
        Light::Disk(light) if !light.faces(x, margin) => DVec3::ZERO,
        Light::Area(light) => on_area(query, light, buffers),
        Light::Linear(light) => on_line(query, light, buffers),
        Light::Sphere(light) => match round_by_rays(query) {
            Some(points) => points_of_sphere(query, &light.sphere, points, buffers),
            None => combination::on_round(query, buffers),
        },
        Light::Disk(light) => match round_by_rays(query) {
            Some(points) => points_of_disk(query, &light.disk, points, buffers),
            None => combination::on_round(query, buffers),
        },
        Light::Cylinder(light) => on_cylinder(query, light, buffers),
    }
}

/// The estimator with BSDF samples beside it: for integrals of transformed cosines alone that the
/// reflection is [unlike](Known::is_unlike_cosines).
fn with_bsdf_samples<R: Reflection, T>(query: &Query<'_, R, T>) -> Option<Estimator> {
    let Some(technique @ Technique::Lines(lines)) = query.estimator.alone() else {
        return None;
    };
    if lines.integration.is_none_or(Integration::keeps_lines)
        || technique.must_stand_alone()
        || matches!(query.light.light, Light::Linear(_) | Light::Cylinder(_))
        || query.light.texture.is_some()
    {
        return None;
    }
    let is_unlike = query.point.known().is_unlike_cosines();
    is_unlike.then(|| Estimator::from(*lines).with(Points::bsdf()))
}

/// The technique of points with a shadow ray each, if the estimator is that alone.
fn by_rays<R, T>(query: &Query<'_, R, T>) -> Option<Points> {
    match query.estimator.alone() {
        Some(Technique::Points(points)) if !points.in_shaft => Some(*points),
        Some(Technique::Points(_) | Technique::Lines(_)) | None => None,
    }
}

/// The same of a sphere or a disk, which have no lines: points by solid angle in place of lines,
/// and of closed forms that the reflection has not.
fn round_by_rays<R: Reflection, T>(query: &Query<'_, R, T>) -> Option<Points> {
    let Some(Technique::Lines(lines)) = query.estimator.alone() else {
        return by_rays(query);
    };
    let is_known = || query.point.known() != Known::Nothing;
    let keeps_lines = lines.integration.is_none_or(Integration::keeps_lines);
    (keeps_lines || !is_known()).then(|| Points::by(PointBy::SolidAngle))
}

/// From inside the endless cylinder nothing of it is seen.
fn on_cylinder<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    light: &CylinderLight,
    buffers: &mut Buffers,
) -> DVec3 {
    let Some(view) = CylinderView::new(&light.cylinder, query.point.position) else {
        return DVec3::ZERO;
    };
    match by_rays(query) {
        Some(points) => {
            let source = Some(RoundPoints::on_cylinder(
                points.by,
                &view,
                &query.point.horizons(),
            ));
            point_sum::on_surface_by_rays(query, &view, &source, buffers)
        }
        None => combination::on_cylinder(query, light, &view, buffers),
    }
}

fn points_of_sphere<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    sphere: &Sphere,
    points: Points,
    buffers: &mut Buffers,
) -> DVec3 {
    let cosines = query.cosines_for([&points.into()]);
    let viewer = Viewer::new(query.point, cosines.as_ref());
    point_techniques! { dispatch [points.by, technique => {
        let source = technique.on_sphere(sphere, &viewer);
        point_sum::on_surface_by_rays(query, sphere, &source, buffers)
    }] }
}

fn points_of_disk<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    disk: &Disk,
    points: Points,
    buffers: &mut Buffers,
) -> DVec3 {
    let cosines = query.cosines_for([&points.into()]);
    let viewer = Viewer::new(query.point, cosines.as_ref());
    point_techniques! { dispatch [points.by, technique => {
        let source = technique.on_disk(disk, &viewer);
        point_sum::on_surface_by_rays(query, disk, &source, buffers)
    }] }
}

fn on_area<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    buffers: &mut Buffers,
) -> DVec3 {
    match query.estimator.alone() {
        None => combination::combined(query, area, buffers),
        Some(Technique::Points(points)) if points.in_shaft => {
            let by = Strategy::Points(points.by);
            strategy::through_shaft(query, area, &Lines::AREA, buffers, |_| (by, 1))
        }
        Some(Technique::Points(points)) => point_sum::by_rays(query, area, points.by, buffers),
        Some(Technique::Lines(lines)) => match lines.integration {
            None => line_sum::lines(query, area, lines, Along::Point, buffers),
            Some(integration) => integration.light(query, area, lines, buffers),
        },
    }
}

/// A linear light has no surface that a direction of the BSDF could meet: lines and combinations
/// take the closed form or quadrature along all that is visible of it, but for reflections that say
/// nothing of their peaks.
fn on_line<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    light: &LinearLight,
    buffers: &mut Buffers,
) -> DVec3 {
    let options = match query.estimator.alone() {
        Some(Technique::Points(points)) => points.by.on_linear(),
        Some(Technique::Lines(_)) | None => match linear::whole(query, light, buffers) {
            Some(value) => return value,
            None => LinearOptions::default(),
        },
    };
    linear::points(query, light, options, buffers)
}

//! Point samples: the mean of L f_r V cos θ/p_ω, whatever draws the points and whoever knows V.

use crate::light::Shape;
use crate::point_block::{BLOCK, LEAST, PointBlock, Target};
use crate::techniques::point_techniques;
use crate::techniques::points::{DrawPoints, PointDensity, Polygon};
use crate::{Buffers, EmissionTexture, PointBy, Points, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::{DVec3, Triangle};
use linelit_lights::AreaLight;
use linelit_visibility::Shaft;
use std::ops::Range;

/// Where the solid angle of a piece of the light differs by no more than this from place to
/// place, points uniform on the area are as good as points uniform in the solid angle, and cost
/// two thirds.
const FLAT: f64 = 16.0;

/// The mean of L f_r V cos θ/p_ω over points (Billen & Dutré 2016, eqs. 1–2, per solid angle).
///
/// `draw` puts the points of some numbers into a block: what each sends to the viewer if nothing
/// stands between, L f_r cos θ, its density per solid angle (of a linear light, times its radius)
/// and where it is. `visible` is asked about all points of a block that carry light at once, and
/// sets a bit for each that is visible.
pub(crate) fn mean(
    count: u32,
    block: &mut PointBlock,
    mut draw: impl FnMut(Range<u32>, &mut PointBlock),
    mut visible: impl FnMut(&[DVec3]) -> u64,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut first = 0;
    while first < count {
        let end = count.min(first.saturating_add(BLOCK));
        block.clear();
        draw(first..end, block);
        let seen = visible(block.targets());
        sum = block.add_to(sum, seen);
        first = end;
    }
    sum / f64::from(count)
}

/// How the visibility of points is asked for.
struct Asked<V> {
    /// What tells where a point is.
    target: Target,
    /// As for [`mean`].
    visible: V,
}

/// The mean over points of the surface of the query's light; by its area without a source.
fn on_surface<R: Reflection, T: EmissionTexture, S: Shape>(
    query: &Query<'_, R, T>,
    surface: &S,
    source: &Option<impl DrawPoints<S>>,
    block: &mut PointBlock,
    asked: Asked<impl FnMut(&[DVec3]) -> u64>,
) -> DVec3 {
    match source {
        Some(source) => mean_of(query, surface, source, block, asked),
        None => mean_of(query, surface, &surface.by_area(), block, asked),
    }
}

fn mean_of<R: Reflection, T: EmissionTexture, S: Shape>(
    query: &Query<'_, R, T>,
    surface: &S,
    source: &impl DrawPoints<S>,
    block: &mut PointBlock,
    Asked { target, visible }: Asked<impl FnMut(&[DVec3]) -> u64>,
) -> DVec3 {
    let set = query.numbers();
    let draw = |numbers: Range<u32>, block: &mut PointBlock| {
        if numbers.len() < LEAST
            || !block.draw_in_lanes(query, surface, source, &set, &numbers, target)
        {
            for i in numbers {
                if let Some((at, density)) = source.draw(set.get_2d(i), surface, query.point) {
                    block.push(query.unshadowed(&at), density, target.of(&at));
                }
            }
        }
    };
    mean(query.samples, block, draw, visible)
}

/// The mean over points of the surface of the query's light, a shadow ray for each.
pub(crate) fn on_surface_by_rays<R: Reflection, T: EmissionTexture, S: Shape>(
    query: &Query<'_, R, T>,
    surface: &S,
    source: &Option<impl DrawPoints<S>>,
    Buffers { scratch, samples }: &mut Buffers,
) -> DVec3 {
    let asked = Asked {
        target: Target::ToLight,
        visible: |to_light: &[DVec3]| query.free(to_light, scratch),
    };
    on_surface(query, surface, source, &mut samples.points, asked)
}

/// Points of an area light, a shadow ray for each.
pub(crate) fn by_rays<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    Buffers { scratch, samples }: &mut Buffers,
) -> DVec3 {
    let asked = Asked {
        target: Target::ToLight,
        visible: |to_light: &[DVec3]| query.free(to_light, scratch),
    };
    on_polygon(query, area, by, &mut samples.points, asked)
}

/// Points of an area light that share a shaft in place of rays.
pub(crate) fn in_shaft<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    shaft: &mut Shaft<'_>,
    block: &mut PointBlock,
) -> DVec3 {
    let asked = Asked {
        target: Target::Point,
        visible: |on_light: &[DVec3]| bits(on_light, |at| shaft.point_visible(*at)),
    };
    on_polygon(query, area, by, block, asked)
}

/// A bit for each of up to 64 points that `test` says yes to.
pub(crate) fn bits(points: &[DVec3], mut test: impl FnMut(&DVec3) -> bool) -> u64 {
    let bit = |(i, point)| u64::from(test(point)) << i;
    (0..u64::BITS).zip(points).map(bit).fold(0, |a, b| a | b)
}

/// Points of an area light.
fn on_polygon<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    by: PointBy,
    block: &mut PointBlock,
    asked: Asked<impl FnMut(&[DVec3]) -> u64>,
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
        on_surface(query, &area.polygon, &technique.on_polygon(&whole), block, asked)
    }] }
}

/// The density of points that reaches an error first: uniform on the area, or in the solid angle.
pub(crate) fn cheapest<R, T>(query: &Query<'_, R, T>, area: &AreaLight) -> PointBy {
    let (corners, x) = (area.polygon.vertices(), query.point.position);
    let triangles = corners[1..].windows(2);
    let nearest = triangles.map(|pair| {
        let triangle = Triangle::new(corners[0], pair[0], pair[1]);
        triangle.nearest(x).distance_squared(x)
    });
    let nearest = nearest.fold(f64::INFINITY, f64::min);
    let farthest = corners.iter().map(|corner| corner.distance_squared(x));
    let farthest = farthest.fold(0.0, f64::max);
    // The solid angle of a piece goes as the cube of the distance.
    if farthest.powi(3) <= FLAT * FLAT * nearest.powi(3) {
        PointBy::Area
    } else {
        PointBy::SolidAngle
    }
}

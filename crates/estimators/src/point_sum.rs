//! Point samples: the mean of L f_r V cos θ/p_ω, whatever draws the points and whoever knows V.

use crate::light::Shape;
use crate::techniques::point_techniques;
use crate::techniques::points::{DrawPoints, LightPoint, PointDensity, Polygon};
use crate::{Buffers, EmissionTexture, PointBy, Points, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;
use linelit_visibility::Shaft;

/// The most points that are drawn before their visibility is asked for: a bit of the answer each.
const BLOCK: u32 = u64::BITS;

/// Points of one block, drawn and waiting for their visibility.
#[derive(Debug, Default)]
pub(crate) struct PointBlock {
    /// L f_r cos θ/p_ω.
    contributions: Vec<DVec3>,
    /// What tells where they are.
    targets: Vec<DVec3>,
}

/// The mean of L f_r V cos θ/p_ω over points (Billen & Dutré 2016, eqs. 1–2, per solid angle).
///
/// `draw` gives what point `i` sends to the viewer if nothing stands between, L f_r cos θ, its
/// density per solid angle (of a linear light, times its radius) and where it is. `visible` is
/// asked about all points of a block that carry light at once, and sets a bit for each that is
/// visible.
pub(crate) fn mean(
    count: u32,
    block: &mut PointBlock,
    mut draw: impl FnMut(u32) -> Option<(DVec3, f64, DVec3)>,
    mut visible: impl FnMut(&[DVec3]) -> u64,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut first = 0;
    while first < count {
        let end = count.min(first.saturating_add(BLOCK));
        block.contributions.clear();
        block.targets.clear();
        for (value, density, target) in (first..end).filter_map(&mut draw) {
            if density > 0.0 && value != DVec3::ZERO {
                block.contributions.push(value * (1.0 / density));
                block.targets.push(target);
            }
        }
        let mut seen = visible(&block.targets);
        while seen != 0 {
            sum += block.contributions[seen.trailing_zeros() as usize];
            seen &= seen - 1;
        }
        first = end;
    }
    sum / f64::from(count)
}

/// How the visibility of points is asked for.
struct Asked<V> {
    /// What tells where a point is.
    target: fn(&LightPoint) -> DVec3,
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
    let numbers = query.numbers();
    let draw = |i| {
        let (at, density) = source.draw(numbers.get_2d(i), surface, query.point)?;
        Some((query.unshadowed(&at), density, target(&at)))
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
        target: |at| at.to_light,
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
        target: |at| at.to_light,
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
        target: |at| at.point,
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

//! One technique alone samples the whole light, without weights: the estimate is the mean of value
//! over density.

use crate::draw::Source;
use crate::draw::block::{BLOCK, LEAST, PointBlock};
use crate::draw::lines::{Draw, Draws, Use};
use crate::integrand::Integrand;
use crate::known::lines::LineMemory;
use crate::streams::Samples;
use crate::view::LightView;
use crate::visible::Visible;
use crate::{EmissionTexture, Lines, PointDensity, WorkCounters};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::{ConvexPolygon, DVec3, intervals::Interval, stop};
use linelit_lights::{DiskLtc, LightPoint, PointSource, Surface};
use std::ops::Range;

/// The mean of V × value/p over points (Billen & Dutré 2016, eqs. 1–2, per solid angle).
///
/// `draw` adds the points of some numbers to a block: the value of each point if nothing hides it,
/// its density per solid angle (for a linear light, times its radius), and its position. There is
/// one visibility query for all points of a block that carry light.
pub(crate) fn mean(
    count: u32,
    block: &mut PointBlock,
    visible: &mut Visible<'_>,
    mut draw: impl FnMut(Range<u32>, &mut PointBlock),
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut first = 0;
    while first < count {
        let end = count.min(first.saturating_add(BLOCK));
        stop::check();
        block.clear();
        draw(first..end, block);
        let seen = visible.points(block.targets());
        sum = block.add_to(sum, seen);
        first = end;
    }
    sum / f64::from(count)
}

/// The mean over points that a source draws.
pub(crate) fn points<R: Reflection, T: EmissionTexture>(
    integrand: &Integrand<'_, R, T>,
    surface: &Surface<'_>,
    source: Source<'_, '_>,
    samples: Samples<'_>,
    visible: &mut Visible<'_>,
    block: &mut PointBlock,
) -> DVec3 {
    // A set is large, so that it is created where it is used.
    let set = samples.set();
    let target = visible.target();
    mean(samples.count, block, visible, |numbers, block| {
        if numbers.len() < LEAST
            || !block.draw_in_lanes(integrand, surface, source, &set, &numbers, target)
        {
            for i in numbers {
                if let Some((at, density)) = source.draw(set.get_2d(i), surface, integrand) {
                    block.push(integrand.value(&at), density, target.of(&at));
                }
            }
        }
    })
}

/// The mean over points of a round light in proportion to the lobes of LTCs
/// ([`Rest::PointsByLobes`](crate::Rest)). If the disk that is seen is too small for that, or seen
/// too flatly, the points are uniform in the solid angle.
pub(crate) fn by_lobes<R: Reflection, T: EmissionTexture>(
    integrand: &Integrand<'_, R, T>,
    view: &LightView<'_>,
    cosines: &LtcMixture,
    samples: Samples<'_>,
    visible: &mut Visible<'_>,
    block: &mut PointBlock,
) -> DVec3 {
    let (Some(surface), Some(disk)) = (view.surface(), view.disk()) else {
        return DVec3::ZERO;
    };
    let (texture, viewer) = (integrand.light.texture, view.at.viewer());
    let uniform = || PointSource::new(PointDensity::SolidAngle, surface, texture, &viewer);
    let lobes = DiskLtc::new(&disk, viewer.position, &cosines.lobes_alone());
    let source = lobes.map_or_else(uniform, PointSource::DiskLtc);
    points(
        integrand,
        &surface,
        Source(Some(&source)),
        samples,
        visible,
        block,
    )
}

/// The mean over lines on a polygon, each of which has one point of its visible parts that is
/// uniform in length (Salesin & Jarosz 2019, eqs. 14–15).
pub(crate) fn lines<R: Reflection, T: EmissionTexture>(
    integrand: &Integrand<'_, R, T>,
    polygon: &ConvexPolygon,
    options: &Lines,
    samples: Samples<'_>,
    visible: &mut Visible<'_>,
    memory: &mut LineMemory,
    counts: &mut WorkCounters,
) -> DVec3 {
    let occlusion = &integrand.light.occlusion;
    memory
        .draws
        .draw(polygon, options, occlusion, samples, Use::Points);
    memory.ask(visible, counts);
    let parts = |i| memory.visible.line(i);
    gather(integrand, polygon, &memory.draws, parts) / f64::from(samples.count)
}

/// The sum over the lines that were drawn on a polygon of one point of each. `visible` returns the
/// visible parts of a line.
pub(crate) fn gather<'v, R: Reflection, T: EmissionTexture>(
    integrand: &Integrand<'_, R, T>,
    polygon: &ConvexPolygon,
    draws: &Draws,
    visible: impl Fn(usize) -> &'v [Interval],
) -> DVec3 {
    let (mut sum, x) = (DVec3::ZERO, integrand.point.position);
    for (i, Draw { line, v, .. }) in draws.samples.iter().enumerate() {
        let parts = visible(i);
        if parts.is_empty() {
            continue;
        }
        let (t, length) = draws.width.place(parts, *v);
        let at = LightPoint::new(line.segment.at(t), x, &Surface::Polygon(polygon));
        let integral = at.cos_light.abs() / at.square * length * line.segment.length();
        sum += integrand.value(&at) * integral * (1.0 / line.pdf.value());
    }
    sum
}

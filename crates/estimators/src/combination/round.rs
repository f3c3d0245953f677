//! Combinations, and lines of any kind, on spheres and disks.

use super::domain::RoundPart;
use super::smooth::Smooth;
use super::visibility::Visibility;
use super::{Combination, instead};
use crate::closed_form::{visible_round, whole_round};
use crate::light::Shape;
use crate::round::RoundView;
use crate::techniques::integrals::{Between, Instead};
use crate::transformed::{known_of_round, visible_round_light};
use crate::{Buffers, EmissionTexture, Lines, Queries, Query, SampleBuffers};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::DVec3;
use linelit_visibility::{Shaft, ShaftClass};

/// Any estimator but points with rays, on a sphere or a disk: as [`combined`](super::combined), on
/// the disk that is seen. Integrals over what lines find visible are the closed form along chords.
pub(crate) fn on_round<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    buffers: &mut Buffers,
) -> DVec3 {
    let (occluders, point) = (query.occluders, query.point);
    let Some(view) = RoundView::new(query.light.light, point.position) else {
        return DVec3::ZERO;
    };
    // What it sends to the shading point, and the height of that over the disk's plane.
    let height = view.normal(view.x).dot(view.x - view.disk.center);
    let emission = (view.emission.towards(height), height);
    if emission.0 == DVec3::ZERO {
        return DVec3::ZERO;
    }
    let Buffers { scratch, samples } = buffers;
    let corners = view.corners(&view.disk);
    let mut shaft = occluders.shaft(query.shaft(&corners), scratch);
    let class = shaft.class();
    let mut part = RoundPart {
        view,
        horizons: [point.normal, point.geometric_normal],
        cosines: query.cosines_for(query.estimator.parts().map(|part| &part.technique)),
        by_lines: view.is_told_by(&shaft),
    };
    samples.plan.unoccluded += u64::from(class == ShaftClass::Empty);
    let told = part.by_lines;
    if told
        && class != ShaftClass::Blocked
        && let Some(value) = closed(query, &part, emission, &mut shaft, samples)
    {
        return value;
    }
    let visibility = if told && query.queries == Queries::OneShaft {
        Visibility::OneShaft(shaft)
    } else {
        let hides = |disk| {
            let corners = view.corners(&disk);
            let before = occluders.shaft(query.shaft(&corners), scratch);
            before.class() == ShaftClass::Blocked
        };
        if class == ShaftClass::Blocked && (told || view.before().is_some_and(hides)) {
            samples.plan.hidden += 1;
            return DVec3::ZERO;
        }
        samples.plan.spheres_by_rays += u64::from(!told);
        Visibility::SeparateRays {
            occluders,
            scratch,
            query: query.shaft(&corners),
        }
    };
    weighted(query, &mut part, emission.0, visibility, samples)
}

/// All techniques, weighted.
fn weighted<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    part: &mut RoundPart,
    emitted: DVec3,
    mut visibility: Visibility<'_>,
    samples: &mut SampleBuffers,
) -> DVec3 {
    if visibility.class() == ShaftClass::Blocked {
        samples.plan.hidden += 1;
        return DVec3::ZERO;
    }
    let (view, cosines) = (&part.view, part.cosines.as_mut());
    let (mut instead, known) = instead(
        query,
        &mut visibility,
        cosines,
        samples,
        |c, shaft, samples| known_of_round(query.point, view, emitted, c, shaft, samples),
    );
    if let Instead::Differences(points) = &mut instead {
        // As alone.
        *points = 1;
    }
    let mut own = std::mem::take(&mut samples.round);
    let mut combination = Combination {
        query,
        light: &part.view,
        visibility,
        smoothing: Smooth::new(query.estimator.weights(), &part.view),
        instead,
        known,
        buffers: samples,
    };
    combination.gather(part, &mut own);
    let sum = combination.sum(&own);
    samples.round = own.emptied();
    sum
}

/// The light in closed form, over what is visible or along chords, if the estimator takes it and
/// the reflection has one; alone, also that of the transformed cosines which the reflection looks
/// like, with points for the difference.
fn closed<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    part: &RoundPart,
    emission: (DVec3, f64),
    shaft: &mut Shaft<'_>,
    samples: &mut SampleBuffers,
) -> Option<DVec3> {
    let (lines, integration, count) = query.estimator.closed(query.samples)?;
    let reflection = query.light.closed_form(query.point);
    if query.skip
        && shaft.class() == ShaftClass::Empty
        && let Some(reflection) = &reflection
        && let Some(value) = whole_round(&part.view, emission.0, query.point, reflection)
    {
        samples.plan.closed_form += 1;
        return Some(value);
    }
    let query = query.with_samples(count);
    let partial = u64::from(shaft.class() == ShaftClass::Partial);
    let between = Between {
        shaft,
        occlusion: &query.light.occlusion,
        samples: count,
        has_cosines: true,
    };
    let is_exact = matches!(integration.instead(&between), Instead::Differences(_));
    if is_exact && (reflection.is_some() || query.estimator.alone().is_some()) {
        let (view, sent) = (&part.view, emission.0);
        let value = match &reflection {
            Some(reflection) if reflection.is_diffuse() => {
                visible_round(view, sent, query.point, reflection, shaft, samples)
            }
            _ => visible_round_light(&query, view, sent, shaft, samples),
        };
        if value.is_some() {
            samples.plan.exact_penumbrae += partial;
            return value;
        }
        samples.plan.exact_fallbacks += partial;
    }
    let reflection = reflection?;
    let sum = along_chords(
        &query,
        part,
        &lines,
        (emission, &reflection),
        shaft,
        samples,
    );
    Some(sum)
}

/// The mean over chords, the closed form along what is visible of each.
fn along_chords<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    part: &RoundPart,
    lines: &Lines,
    (emission, reflection): ((DVec3, f64), &ClosedForm<'_>),
    shaft: &mut Shaft<'_>,
    buffers: &mut SampleBuffers,
) -> DVec3 {
    let chords = part.chords(lines, lines.only_fraction(query));
    buffers
        .draws
        .draw_integrated(query, lines.control, |_, u| chords.sample(u));
    shaft.visible(&buffers.draws.lines, &mut buffers.visible);
    buffers.count_lines();
    let SampleBuffers { draws, visible, .. } = buffers;
    let (drawn, pieces) = draws.weighted();
    for (i, (line, weight)) in drawn.enumerate() {
        pieces.add(query.point, &line.segment, visible.line(i), weight);
    }
    let sum = pieces.light(emission, query.point, reflection);
    sum / f64::from(query.samples)
}

//! Combinations on spheres and disks, where lines are points by solid angle, and closed forms.

use super::domain::RoundPart;
use super::smooth::Smooth;
use super::visibility::Visibility;
use super::{Combination, instead};
use crate::closed_form::{visible_round, whole_round};
use crate::light::Shape;
use crate::round::RoundView;
use crate::techniques::integrals::{Between, Instead};
use crate::transformed::{known_of_round, visible_round_light};
use crate::{Buffers, EmissionTexture, Queries, Query, SampleBuffers};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_visibility::{Shaft, ShaftClass};

/// Any estimator but points with rays, on a sphere or a disk: as [`combined`](super::combined), on
/// the disk that is seen.
pub(crate) fn on_round<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    buffers: &mut Buffers,
) -> DVec3 {
    let (occluders, point) = (query.occluders, query.point);
    let Some(view) = RoundView::new(query.light.light, point.position) else {
        return DVec3::ZERO;
    };
    // The height of the shading point over the disk's plane, and what is sent there.
    let height = view.normal(view.x).dot(view.x - view.disk.center);
    let emitted = view.emission.towards(height);
    if emitted == DVec3::ZERO {
        return DVec3::ZERO;
    }
    let Buffers { scratch, samples } = buffers;
    let corners = view.corners(&view.disk);
    let mut shaft = occluders.shaft(query.shaft(&corners), scratch);
    let class = shaft.class();
    let mut part = RoundPart {
        view,
        normal: point.normal,
        cosines: query.cosines_for(query.estimator.parts().map(|part| &part.technique)),
    };
    samples.plan.unoccluded += u64::from(class == ShaftClass::Empty);
    let told = view.is_told_by(&shaft);
    if told
        && class != ShaftClass::Blocked
        && let Some(value) = closed(query, &view, emitted, &mut shaft, samples)
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
    weighted(query, &mut part, emitted, visibility, samples)
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

/// The light in closed form over the whole or the visible part, if the estimator takes that and the
/// reflection has one; alone, also that of the transformed cosines which the reflection looks like,
/// with points for the difference.
fn closed<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    view: &RoundView,
    emitted: DVec3,
    shaft: &mut Shaft<'_>,
    samples: &mut SampleBuffers,
) -> Option<DVec3> {
    let (_, integration, count) = query.estimator.closed(query.samples)?;
    if integration.keeps_lines() {
        return None;
    }
    let reflection = query.light.closed_form(query.point);
    if query.skip
        && shaft.class() == ShaftClass::Empty
        && let Some(reflection) = &reflection
        && let Some(value) = whole_round(view, emitted, query.point, reflection)
    {
        samples.plan.closed_form += 1;
        return Some(value);
    }
    let query = query.with_samples(count);
    let between = Between {
        shaft,
        samples: count,
        has_cosines: true,
    };
    let is_exact = matches!(integration.instead(&between), Instead::Differences(_));
    if !is_exact || reflection.is_none() && query.estimator.alone().is_none() {
        return None;
    }
    let value = match &reflection {
        Some(reflection) if reflection.is_diffuse() => {
            visible_round(view, emitted, query.point, reflection, shaft, samples)
        }
        _ => visible_round_light(&query, view, emitted, shaft, samples),
    };
    let partial = u64::from(shaft.class() == ShaftClass::Partial);
    samples.plan.exact_penumbrae += partial * u64::from(value.is_some());
    samples.plan.exact_fallbacks += partial * u64::from(value.is_none());
    value
}

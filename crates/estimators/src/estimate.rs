//! The trunk: from a query to the light, by a method.

use crate::draw::points::Source;
use crate::integrand::{Integrand, Known};
use crate::known::{self, KnownLight, KnownMemory};
use crate::memory::RestMemory;
use crate::method::{are_wide, closed};
use crate::rest::{alone, segment, visible, weighted};
use crate::streams::Samples;
use crate::view::{Above, Shape, View};
use crate::visible::Visible;
use crate::{
    Ask, Buffers, Closed, EmissionTexture, Facts, KnownKind, KnownOver, LightKind, Method, Of,
    PointBy, Query, Rest, Technique, WorkCounters,
};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::{DVec3, Segment};
use linelit_lights::{CylinderView, DiskLobes, Light, PointSource, Viewer};
use linelit_visibility::ShaftClass;

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
    query.point.assert_unit_vectors();
    let Buffers {
        scratch,
        counts,
        known: memory,
        rest,
    } = buffers;
    // Is the shading point on a side of the light that emits?
    let cylinder = cylinder(query);
    let Some(view) = View::new(query.light, query.point, query.margins, cylinder.as_ref()) else {
        return DVec3::ZERO;
    };
    let estimator = query.estimator;
    let cosines = cosines(query);
    if let Some(method) = estimator.points_by_rays(LightKind::of(query.light), query.samples) {
        let visible = &mut Visible::rays(query.occluders, &view, scratch);
        let sampled = Sampled::new(query, &view, cosines.as_ref(), None);
        return sampled.with_rest(&method, DVec3::ZERO, visible, memory, rest, counts);
    }
    let mut facts = facts(query, &view, cosines.as_ref());
    let drawn_on = view.polygon().filter(|_| estimator.is_weighted(&facts));
    let above = drawn_on.and_then(|polygon| Above::new(polygon, &view.at));
    if drawn_on.is_some() && above.is_none() {
        return DVec3::ZERO;
    }
    let view = view.on(above.as_ref());
    // Ask what stands between, and choose the method.
    let ask = estimator.ask(&facts);
    let mut visible = Visible::new(query.occluders, &view, ask, scratch, &mut counts.plan);
    let mut between = visible.between();
    if between.class == ShaftClass::Partial && estimator.asks_for_density(&facts) {
        facts.points = view.cheapest_points();
    }
    let mut method = estimator.method(&facts, &between);
    if method.ask == Ask::Rays && !matches!(method.known, KnownOver::Region(_)) {
        visible = visible.into_rays();
    }
    // Integrate what is known; where the visible region cannot be found, choose again.
    let asked = cosines.as_ref();
    let mut over =
        |method: &Method<'_>, visible: &mut Visible<'_>, counts: &mut WorkCounters| match method
            .known
        {
            KnownOver::Nothing => Some(KnownLight::NONE),
            _ => known::over(query, &view, &method.known, asked, visible, memory, counts),
        };
    let mut light = over(&method, &mut visible, counts);
    if light.is_none() {
        counts.plan.exact_fallbacks += u64::from(between.class == ShaftClass::Partial);
        between.has_region = false;
        method = estimator.method(&facts, &between);
        light = over(&method, &mut visible, counts);
    }
    let Some(light) = light else {
        return DVec3::ZERO;
    };
    count(&method, between.class, counts);
    // Sample the rest.
    if method.ask == Ask::Rays {
        visible = visible.into_rays();
    }
    let known = (method.known == KnownOver::Region(Of::Cosines)).then_some(light);
    let sampled = Sampled::new(query, &view, cosines.as_ref(), known);
    sampled.with_rest(&method, light.light, &mut visible, memory, rest, counts)
}

/// A cylinder as the shading point sees it, if the light is one.
fn cylinder<R, T>(query: &Query<'_, R, T>) -> Option<CylinderView> {
    match query.light.light {
        Light::Cylinder(light) => CylinderView::new(&light.cylinder, query.point.position),
        Light::Area(_) | Light::Linear(_) | Light::Sphere(_) | Light::Disk(_) => None,
    }
}

/// Counts what the method does.
fn count(method: &Method<'_>, class: ShaftClass, counts: &mut WorkCounters) {
    let plan = &mut counts.plan;
    match (method.known, class) {
        (KnownOver::Region(_), ShaftClass::Partial) => plan.exact_penumbrae += 1,
        (KnownOver::Region(_), ShaftClass::Empty) if method.rest == Rest::Nothing => {
            plan.closed_form += 1;
        }
        (KnownOver::Nothing, ShaftClass::Blocked) if method.rest == Rest::Nothing => {
            plan.hidden += 1;
        }
        _ => {}
    }
}

/// The transformed cosines of the reflection, if they are known and the estimator asks for them.
fn cosines<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
) -> Option<TransformedCosines> {
    let point = query.point;
    // Integrals that stand alone take a diffuse reflection itself.
    let is_diffuse = || point.known().constant().is_some();
    let is_combined = query.estimator.alone().is_none();
    let asks = |technique: &Technique| match technique {
        Technique::Points(_) => technique.asks_for_cosines(),
        Technique::Lines(_) => technique.asks_for_cosines() && (is_combined || !is_diffuse()),
    };
    let mut parts = query.estimator.all().iter();
    if !parts.any(|part| asks(&part.technique)) {
        return None;
    }
    point.bsdf.transformed_cosines(point.outgoing, point.normal)
}

/// The facts by which the method is chosen.
fn facts<'a, R: Reflection, T: EmissionTexture>(
    query: &Query<'a, R, T>,
    view: &View<'_>,
    cosines: Option<&TransformedCosines>,
) -> Facts<'a> {
    let light = LightKind::of(query.light);
    let (point, known) = (query.point, query.point.known());
    let closed = closed(&known);
    let line = match view.shape() {
        Shape::Segment(line) => Some(**line),
        Shape::Cylinder(cylinder) => Some(cylinder.cylinder().axis),
        Shape::Polygon(_) | Shape::Sphere(_) | Shape::Disk(_) => None,
    };
    let has_peaks = |line: Segment| {
        let line = line.relative_to(point.position);
        let peaks = point.bsdf.peaks(&line, point.outgoing, point.normal);
        closed == Closed::Nowhere && peaks.is_some()
    };
    Facts {
        light,
        known: KnownKind {
            closed,
            has_cosines: cosines.is_some(),
            are_unlike: known.is_unlike_cosines(),
            are_wide: cosines.is_some_and(are_wide),
            has_peaks: line.is_some_and(has_peaks),
        },
        occlusion: &query.light.occlusion,
        samples: query.samples,
        skip: query.skip,
        queries: query.queries,
        points: PointBy::SolidAngle,
    }
}

/// A query whose known part has been integrated.
struct Sampled<'a, R, T> {
    query: &'a Query<'a, R, T>,
    view: &'a View<'a>,
    /// The transformed cosines of the reflection, if they are known and asked for.
    cosines: Option<&'a TransformedCosines>,
    /// Their integral, if it is taken.
    known: Option<KnownLight>,
}

impl<'a, R: Reflection, T: EmissionTexture> Sampled<'a, R, T> {
    const fn new(
        query: &'a Query<'a, R, T>,
        view: &'a View<'a>,
        cosines: Option<&'a TransformedCosines>,
        known: Option<KnownLight>,
    ) -> Self {
        Self {
            query,
            view,
            cosines,
            known,
        }
    }

    /// The known light and the mean of the samples for the rest.
    fn with_rest(
        &self,
        method: &Method<'_>,
        light: DVec3,
        visible: &mut Visible<'_>,
        known: &mut KnownMemory,
        memory: &mut RestMemory,
        counts: &mut WorkCounters,
    ) -> DVec3 {
        let Self { query, view, .. } = *self;
        let KnownMemory { lines, region } = known;
        let (point, numbers) = (query.point, &query.numbers);
        let integrand = &Integrand {
            light: query.light,
            point,
            known: self.known.map(|_| Known {
                cosines: &region.cosines,
                emitted: view.emitted().0,
            }),
        };
        let from = |count| Samples { numbers, count };
        let (by, count) = match (method.rest, view.polygon()) {
            (Rest::Nothing, _) => return light,
            (
                Rest::PointsOfLines {
                    lines: options,
                    samples,
                },
                Some(polygon),
            ) => {
                let from = from(samples);
                return light
                    + alone::lines(integrand, polygon, options, from, visible, lines, counts);
            }
            (Rest::PointsOfLines { samples, .. }, None) => (PointBy::SolidAngle, samples),
            (Rest::Weighted(weighted), _) => {
                let cosines = self.drawn();
                let memory = (&mut memory.weighted, &mut memory.points, counts);
                let cosines = cosines.as_ref();
                return light
                    + weighted::sum(
                        integrand, view, &weighted, cosines, numbers, visible, memory,
                    );
            }
            (Rest::Visible { samples }, _) => {
                let plane = self.known.and_then(|known| known.plane);
                if let (Some(cosines), Some(plane)) = (self.cosines, plane) {
                    let (from, sampler) = (from(samples), &mut memory.region);
                    let drawn =
                        visible::points(integrand, view, cosines, plane, from, region, sampler);
                    if let Some((beta, mean)) = drawn {
                        return light * beta + mean;
                    }
                }
                (PointBy::Ltc, samples)
            }
            (Rest::Points { by, samples }, _) => (by, samples),
        };
        light + self.points(integrand, by, from(count), visible, memory)
    }

    /// The mean over points of the whole light.
    fn points(
        &self,
        integrand: &Integrand<'_, R, T>,
        by: PointBy,
        samples: Samples<'_>,
        visible: &mut Visible<'_>,
        memory: &mut RestMemory,
    ) -> DVec3 {
        let (view, point) = (self.view, self.query.point);
        let RestMemory {
            points, segment, ..
        } = memory;
        let Some(surface) = view.surface() else {
            let (Shape::Segment(line), PointBy::Linear(options)) = (view.shape(), by) else {
                return DVec3::ZERO;
            };
            let asked = segment::Asked {
                point,
                line,
                emitted: view.emitted().0,
                samples,
            };
            return segment::points(&asked, options, self.cosines, visible, segment, points);
        };
        let cosines = self.drawn();
        if self.known.is_some()
            && let (Some(disk), Some(cosines)) = (view.disk(), &cosines)
            && let Some(lobes) = DiskLobes::new(&disk, view.at.position, cosines)
        {
            let source = &PointSource::DiskLobes(lobes);
            let source = Source::OnLight(source);
            return alone::points(integrand, &surface, source, samples, visible, points);
        }
        let viewer = Viewer {
            cosines: cosines.as_ref(),
            ..view.at.viewer()
        };
        let Some(density) = by.on_surface() else {
            return alone::points(integrand, &surface, Source::Bsdf, samples, visible, points);
        };
        // A source is large: it is made where it stays.
        let source = PointSource::new(density, surface, self.query.light.texture, &viewer);
        let source = Source::OnLight(&source);
        alone::points(integrand, &surface, source, samples, visible, points)
    }

    /// The transformed cosines that points are drawn by: on round lights, of a reflection with
    /// lobes whose integral is known, the lobes alone, for the difference that the cosine itself
    /// leaves mostly cancels.
    fn drawn(&self) -> Option<TransformedCosines> {
        let mut cosines = *self.cosines?;
        if self.known.is_some() && self.view.disk().is_some() && !cosines.lobes().is_empty() {
            cosines.diffuse = DVec3::ZERO;
        }
        Some(cosines)
    }
}

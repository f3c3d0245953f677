//! This module estimates the light of one query: [`estimate`] is the one function that all
//! estimators go through.
//!
//! The reflected light L = ∫ f V dω is split into a known part and a rest, L = ∫ g V dω + ∫ (f − g)
//! V dω. The steps are always the same:
//!
//! 1. See the light from the shading point ([`LightView`]), and give up if it faces away.
//! 2. Collect the facts about light and reflection, query the occluders in between, and choose the
//!    [`Method`] by both (`choose.rs`).
//! 3. Integrate the known part over what is visible (`known`).
//! 4. Sample the rest, by points or lines, and by weights where there are several techniques
//!    (`rest`).

use crate::choose::Choice;
use crate::draw::Source;
use crate::integrand::{Integrand, Known};
use crate::known::lines::LineMemory;
use crate::known::region::{KnownLight, RegionMemory};
use crate::known::{self, KnownMemory};
use crate::rest::{RestMemory, alone, segment, visible, weighted};
use crate::streams::Samples;
use crate::view::{Above, LightView, Shape};
use crate::visible::Visible;
use crate::{
    EmissionTexture, Integration, KnownIntegrand, KnownOver, LightKind, Method, MethodFacts,
    PlanCounters, PointBy, PointDensity, Query, Rest, VisibilityBy, WorkCounters,
};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::{DVec3, stop};
use linelit_lights::{Light, PointSource, SeenSurface, Viewer};
use linelit_visibility::{Scratch, ShaftClass};

/// Memory that estimates reuse, and counters of their work. Each thread needs its own. No estimate
/// depends on the estimates before it.
#[derive(Debug, Default)]
pub struct Buffers {
    /// The memory of rays and shafts, with their counters.
    pub scratch: Scratch,
    /// The counters of work that was done or skipped.
    pub counts: WorkCounters,
    pub(crate) known: KnownMemory,
    pub(crate) rest: RestMemory,
}

/// Estimates the radiance that a light causes to be reflected at a shading point towards its
/// viewer, W/(m²·sr) by channel.
///
/// The estimate is unbiased for every estimator, and a pure function of the query. It is zero where
/// [`LightSource::reaches`](crate::LightSource::reaches) returns `false`; among other cases, behind
/// a light that emits on one side. The normal points to that side: seen from its tip, the corners
/// of a polygon run counter-clockwise. Closed forms such as `linelit_shading::polygon::irradiance`
/// make no difference between the sides.
///
/// ```
/// use linelit_estimators::bsdf::{Bsdf, Lambert};
/// use linelit_estimators::geometry::DVec3;
/// use linelit_estimators::lights::Light;
/// use linelit_estimators::samplers::SamplerKind;
/// use linelit_estimators::visibility::Occluders;
/// use linelit_estimators::{Buffers, Estimator, LightSource, Query, RandomNumbers};
/// use linelit_estimators::{ShadingPoint, estimate};
///
/// // A lamp over a floor, and a triangle that hides a part of it.
/// let lamp = Light::rectangle([-0.5, -0.5, 2.0], DVec3::Y, DVec3::X, [10.0; 3])?;
/// let blade = [[-0.2, -0.1, 1.0], [0.25, -0.05, 1.0], [0.0, 0.2, 1.1]];
/// let occluders = Occluders::build(&blade, &[[0, 1, 2]]);
/// let gray = Bsdf::Lambert(Lambert { albedo: DVec3::splat(0.5) });
/// let point = ShadingPoint::new([0.0; 3], DVec3::Z, DVec3::Z, gray);
///
/// let (source, mut buffers) = (LightSource::new(&lamp), Buffers::default());
/// let mut by = |estimator: Estimator| {
///     let numbers = RandomNumbers::new(SamplerKind::Auto, 0, [0, 0], 0);
///     let query = Query::new(&occluders, &source, &point, &estimator, numbers, 16);
///     estimate(&query, &mut buffers).x
/// };
/// // Sixteen lines come within a hundredth of the closed form.
/// let (lines, exact) = (by(Estimator::analytic()), by(Estimator::exact()));
/// assert!((lines / exact - 1.0).abs() < 0.01);
/// # Ok::<(), linelit_estimators::geometry::PolygonError>(())
/// ```
///
/// # Panics
/// In debug builds, if a normal or the direction to the viewer is not a unit vector, since the
/// result would then be out of proportion.
#[must_use]
pub fn estimate<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    buffers: &mut Buffers,
) -> DVec3 {
    query.point.assert_unit_vectors();
    stop::check();
    let Buffers {
        scratch,
        counts,
        known: memory,
        rest,
    } = buffers;
    // See the light from the shading point; it may emit on another side.
    let seen = cylinder_from(query.light.light, query.point.position);
    let view = LightView::new(query.light, query.point, query.margins, seen.as_ref());
    let Some(mut view) = view else {
        return DVec3::ZERO;
    };
    // Treat delta lights, and points with a shadow ray each, for which no method has to be chosen.
    if let Some(light) = by_rays(query, &view, (scratch, &memory.region, rest)) {
        return light;
    }
    // Collect the facts about the light and the reflection.
    let cosines = query.cosines();
    let asked = cosines.as_ref();
    let mut choice = Choice::new(query.estimator, MethodFacts::before(query, asked));
    // Clip the light to the horizons where techniques are weighted, since they draw on that part
    // alone.
    let above;
    if choice.is_weighted()
        && let Some(polygon) = view.polygon()
    {
        above = Above::new(polygon, &view.at);
        if above.is_none() {
            return DVec3::ZERO;
        }
        view.above = above.as_ref();
    }
    // Query the occluders in between, and choose the method.
    let (occluders, ask) = (query.occluders, choice.ask());
    let mut visible = Visible::new(occluders, &view, ask, scratch, &mut counts.plan);
    let between = visible.between();
    let may_differ = between.class == ShaftClass::Partial || query.light.texture.is_some();
    if may_differ && choice.asks_for_density() {
        choice.facts.points = query.light.cheapest_points(query.point.position);
    }
    let mut method = choice.method(&between);
    if method.ask == VisibilityBy::Rays {
        visible = visible.into_rays();
    }
    // Integrate what is known, unless the region is too narrow for that.
    let known = known::over(
        query,
        &view,
        &method.known,
        asked,
        &mut visible,
        memory,
        counts,
    );
    // Let another method sample the whole light where the region was too narrow.
    if known.is_none() {
        method = otherwise(&method, LightKind::of(query.light));
    }
    let light = known.map_or(DVec3::ZERO, |known| known.light);
    count(query, &method, between.class, &mut counts.plan);
    // Sample the rest.
    let known = known.filter(|_| method.known == KnownOver::Region(KnownIntegrand::Cosines));
    let sampled = Sampled::new(query, &view, asked, known, &memory.region);
    let memories = (&mut memory.lines, rest, counts);
    sampled.with_rest(&method.rest, light, &mut visible, memories)
}

/// Returns a cylinder as a point sees it, which takes some time to find and is what a view of a
/// cylinder borrows. `None` for all other lights.
fn cylinder_from(light: &Light, x: DVec3) -> Option<SeenSurface<'_>> {
    match light {
        Light::Cylinder(_) => light.seen_from(x),
        _ => None,
    }
}

/// The method that replaces one whose visible region was too narrow to integrate. Only methods for
/// round lights have such a replacement.
fn otherwise<'e>(method: &Method<'e>, light: LightKind) -> Method<'e> {
    debug_assert!(light.is_round(), "regions are known before the choice");
    Method::sampled(method.otherwise, method.ask)
}

/// The light of a query that needs one shadow ray, or one for each point, no matter what is
/// between; `None` for any other query.
#[inline]
fn by_rays<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    view: &LightView<'_>,
    (scratch, region, rest): (&mut Scratch, &RegionMemory, &mut RestMemory),
) -> Option<DVec3> {
    let mut visible = Visible::rays(query.occluders, view, scratch);
    if let Shape::DeltaSample(beam) = &view.shape {
        return Some(known::beam(query.point, beam, &mut visible));
    }
    let by = (query.estimator).points_by_rays(LightKind::of(query.light))?;
    let cosines = query.cosines();
    let sampled = Sampled::new(query, view, cosines.as_ref(), None, region);
    Some(sampled.points(by, query.samples, &mut visible, rest))
}

/// Counts what the method does, for reports.
fn count<R, T>(
    query: &Query<'_, R, T>,
    method: &Method<'_>,
    class: ShaftClass,
    plan: &mut PlanCounters,
) {
    plan.unoccluded += u64::from(query.skip && class == ShaftClass::Empty);
    let mut integrals = query.estimator.integrals();
    let mut has_exact = || integrals.any(|by| matches!(by, Integration::Exact(_)));
    let has_rest = method.rest != Rest::Nothing;
    if let Some(points) = query.estimator.in_place(method) {
        plan.points_in_place += 1;
        plan.points_drawn_in_place += u64::from(points);
    }
    match (method.known, class) {
        (KnownOver::Region(_), ShaftClass::Partial) => plan.exact_penumbrae += 1,
        (KnownOver::Region(_), ShaftClass::Empty) if !has_rest => plan.closed_form += 1,
        (KnownOver::Nothing, ShaftClass::Blocked) if !has_rest => plan.hidden += 1,
        (_, ShaftClass::Partial) if has_exact() => plan.exact_fallbacks += 1,
        _ => {}
    }
}

/// A query whose known part has been integrated, and whose rest is to be sampled.
struct Sampled<'a, R, T> {
    query: &'a Query<'a, R, T>,
    view: &'a LightView<'a>,
    /// The LTCs of the reflection, if they are known and the estimator uses them.
    cosines: Option<&'a LtcMixture>,
    /// The integral of the known part, if there is one.
    known: Option<KnownLight>,
    /// The memory of the visible region over which the known part was integrated.
    region: &'a RegionMemory,
    integrand: Integrand<'a, R, T>,
}

impl<'a, R: Reflection, T: EmissionTexture> Sampled<'a, R, T> {
    #[inline]
    fn new(
        query: &'a Query<'a, R, T>,
        view: &'a LightView<'a>,
        cosines: Option<&'a LtcMixture>,
        known: Option<KnownLight>,
        region: &'a RegionMemory,
    ) -> Self {
        Self {
            query,
            view,
            cosines,
            known,
            region,
            integrand: Integrand {
                light: query.light,
                point: query.point,
                known: known.map(|_| Known {
                    cosines: &region.cosines,
                    emitted: view.emitted().0,
                }),
            },
        }
    }

    /// Returns the known light plus the mean of the samples for the rest.
    fn with_rest(
        &self,
        rest: &Rest<'_>,
        light: DVec3,
        visible: &mut Visible<'_>,
        (lines, memory, counts): (&mut LineMemory, &mut RestMemory, &mut WorkCounters),
    ) -> DVec3 {
        let Self { integrand, .. } = self;
        light
            + match *rest {
                Rest::Nothing => return light,
                Rest::Points { by, samples } => self.points(by, samples, visible, memory),
                Rest::PointsByLobes { samples } => {
                    let Some(cosines) = self.cosines else {
                        return light;
                    };
                    let (from, block) = (self.samples(samples), &mut memory.points);
                    alone::by_lobes(integrand, self.view, cosines, from, visible, block)
                }
                Rest::PointsOfLines {
                    lines: options,
                    samples,
                } => {
                    let Some(polygon) = self.view.polygon() else {
                        return light;
                    };
                    let from = self.samples(samples);
                    alone::lines(integrand, polygon, options, from, visible, lines, counts)
                }
                Rest::Visible { samples } => {
                    let (view, from) = (self.view, self.samples(samples));
                    let (seen, sampler) = (self.region, &mut memory.region);
                    if let Some(cosines) = self.cosines
                        && let Some(plane) = self.known.and_then(|known| known.plane)
                        && let Some((beta, mean)) =
                            visible::points(integrand, view, cosines, plane, from, seen, sampler)
                    {
                        return light * beta + mean;
                    }
                    self.points(PointDensity::Lobes.into(), samples, visible, memory)
                }
                Rest::Weighted(weighted) => {
                    let (view, numbers) = (self.view, &self.query.numbers);
                    let memory = (&mut memory.weighted, &mut memory.points, counts);
                    let cosines = self.cosines;
                    weighted::sum(
                        integrand, view, &weighted, cosines, numbers, visible, memory,
                    )
                }
            }
    }

    const fn samples(&self, count: u32) -> Samples<'_> {
        let numbers = &self.query.numbers;
        Samples { numbers, count }
    }

    /// The mean over points of the whole light, each with its own visibility query.
    fn points(
        &self,
        by: PointBy,
        count: u32,
        visible: &mut Visible<'_>,
        memory: &mut RestMemory,
    ) -> DVec3 {
        let (view, point, integrand) = (self.view, self.query.point, &self.integrand);
        let (samples, block) = (self.samples(count), &mut memory.points);
        // Sample a linear light, which has no surface, by its own techniques.
        let Some(surface) = view.surface() else {
            let (Shape::Segment(line), PointBy::Linear(options)) = (view.shape, by) else {
                return DVec3::ZERO;
            };
            let asked = segment::SegmentQuery {
                point,
                line,
                emitted: view.emitted().0,
                samples,
            };
            let pairs = &mut memory.segment;
            return segment::points(&asked, options, self.cosines, visible, pairs, block);
        };
        let mut mean = |source: Option<&PointSource<'_>>| {
            alone::points(integrand, &surface, Source(source), samples, visible, block)
        };
        // Draw points by a density on the surface, or directions from the BSDF.
        let Some(density) = by.on_surface() else {
            return mean(None);
        };
        let viewer = Viewer {
            cosines: self.cosines,
            ..view.at.viewer()
        };
        // A source is large, so that it is created where it is used.
        let source = PointSource::new(density, surface, self.query.light.texture, &viewer);
        mean(Some(&source))
    }
}

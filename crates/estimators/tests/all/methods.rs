//! The method that an estimator announces is the method that it uses.

use crate::agreement::{Image, Opaque, gaussians, lights, materials, means, occluders};
use linelit_bsdf::{Bsdf, Lambert, Reflection};
use linelit_estimators::{
    Buffers, LightSource, OcclusionStats, PlanCounters, PointDensity, Query, RandomNumbers,
};
use linelit_estimators::{
    Closed, Estimator, KnownKind, KnownOver, LightKind, MethodFacts, ShaftAnswer, VisibilityBy,
};
use linelit_estimators::{Rest, ShadingPoint, Technique, estimate};
use linelit_geometry::DVec3;
use linelit_lights::Light;
use linelit_samplers::SamplerKind;
use linelit_visibility::{Occluders, ShaftClass};
use std::mem;

/// A light without occluders.
fn source((light, texture): &(Light, Option<Image>)) -> LightSource<'_, Image> {
    LightSource {
        profile: None,
        light,
        texture: texture.as_ref(),
        triangles: 0..0,
        occlusion: OcclusionStats::FEW,
    }
}

/// The shaft between the point and the lights of [`occluders`], without and with an occluder that
/// blocks it.
fn between(blocked: bool) -> ShaftAnswer {
    ShaftAnswer {
        class: if blocked {
            ShaftClass::Partial
        } else {
            ShaftClass::Empty
        },
        is_dense: false,
        candidates: usize::from(blocked),
        has_region: true,
    }
}

/// A technique with its estimates of one light, with `[mis=balance]` if it is a combination of one.
struct Cell {
    text: String,
    said: String,
    is_exact: bool,
    mean: f64,
    /// The standard deviation over the mean.
    noise: f64,
}

/// A larger relative deviation is noise, a smaller one is rounding.
const NONE: f64 = 1e-9;

/// The number of samples of each estimate.
const SAMPLES: u32 = 15;

/// Every technique, alone if that is possible, and as a combination of one.
fn estimates<R: Reflection>(
    point: &ShadingPoint<R>,
    light: &(Light, Option<Image>),
    (occluders, blocked): (&Occluders, bool),
) -> Vec<Cell> {
    // Some techniques have directions of their own, unless one is given.
    let texts = Technique::all().flat_map(|technique| {
        let (name, direction) = match technique {
            Technique::Points(_) => (technique.name(), ""),
            Technique::Lines(_) => (technique.name(), "orientation=fixed:0.3,"),
        };
        let alone = format!("{name}[{direction}]");
        [alone, format!("{name}[{direction}mis=balance]")]
    });
    let source = source(light);
    let cell = |text: String| {
        let estimator: Estimator = text.parse().ok()?;
        let numbers = RandomNumbers::new(SamplerKind::Sobol, 0, [0, 0], 0);
        let query = Query::new(occluders, &source, point, &estimator, numbers, SAMPLES);
        let facts = MethodFacts::of(&query);
        let method = estimator.method(&facts, &between(blocked));
        let values = means(light, occluders, point, (&text, false), SAMPLES, 0..16);
        Some(Cell {
            said: method.describe(&facts),
            is_exact: method.is_exact(),
            text,
            mean: values.mean(),
            noise: values.variance().sqrt() / values.mean(),
        })
    };
    texts.filter_map(cell).collect()
}

/// Estimators that announce the same method give the same numbers. A method that announces no noise
/// has none, and other methods have noise unless there are no occluders.
fn hold<R: Reflection>(expected: &str, bsdf: R) {
    let wo = DVec3::new(-0.6, 0.0, 0.8);
    let point = ShadingPoint::new(DVec3::X * 0.25, DVec3::Z, wo, bsdf);
    let known = KnownKind::of(&point);
    let listed = KnownKind::ALL.iter().find(|(name, _)| *name == expected);
    let listed = listed.expect("a name").1;
    // The cost of lobes depends on their exponents.
    let kind = |known: &KnownKind| mem::discriminant(&known.closed);
    assert_eq!(kind(&known), kind(&listed));
    assert_eq!(known.has_cosines, listed.has_cosines);
    // Gaussians have lobes, but no peaks.
    if listed.closed != Closed::AlongLines {
        assert_eq!(known.has_peaks, listed.has_peaks);
    }
    let lights = lights();
    for (light, blocked) in lights.iter().flat_map(|l| [(l, true), (l, false)]) {
        let cells = estimates(&point, light, (&occluders(blocked), blocked));
        let what = format!(
            "on {}, {known:?}, occluded: {blocked}",
            LightKind::of(&source(light))
        );
        for (i, a) in cells.iter().enumerate() {
            let said = format!("{} does {} {what}", a.text, a.said);
            if a.is_exact {
                assert!(a.noise < NONE, "{said}: noise {}", a.noise);
            } else if blocked {
                assert!(a.noise > NONE, "{said}: noise {}", a.noise);
            }
            for b in cells[..i].iter().filter(|b| b.said == a.said) {
                let difference = (a.mean / b.mean - 1.0).abs();
                assert!(
                    difference < NONE,
                    "{said}, as {}: {} {}",
                    b.text,
                    a.mean,
                    b.mean
                );
            }
        }
    }
}

#[test]
fn what_is_said_is_done() {
    let albedo = DVec3::splat(0.5);
    let of = |name: &str| {
        let all = materials();
        all.iter().find(|(n, _)| *n == name).expect("one").1.clone()
    };
    hold("diffuse", Bsdf::Lambert(Lambert { albedo }));
    hold("lobes of Phong", of("two lobes"));
    hold("Gaussians", gaussians());
    for name in [
        "plastic",
        "brushed metal",
        "substrate",
        "glTF",
        "frostbite",
        "mixture",
    ] {
        hold("narrow transformed cosines", of(name));
    }
    hold("wide transformed cosines", of("rough diffuse"));
    hold("nothing known", Opaque(of("plastic")));
}

/// The facts of queries are facts of the light; of the reflection, if the estimator uses it; and
/// the best density of points, which is by area if the light is far away.
#[test]
fn facts_are_those_of_the_query() {
    let bsdf = materials().into_iter().find(|(name, _)| *name == "plastic");
    let bsdf = bsdf.expect("one").1;
    let occluders = occluders(false);
    for light in &lights() {
        let source = source(light);
        for (depth, best) in [
            (0.0, PointDensity::SolidAngle),
            (-100.0, PointDensity::Area),
        ] {
            let position = DVec3::new(0.25, 0.0, depth + 1.25);
            let point = ShadingPoint::new(position, DVec3::Z, DVec3::Z, bsdf.clone());
            for (text, asks) in [("exact", true), ("line-area", false)] {
                let estimator = text.parse().expect("one");
                let numbers = RandomNumbers::new(SamplerKind::Sobol, 0, [0, 0], 0);
                let mut query = Query::new(&occluders, &source, &point, &estimator, numbers, 3);
                query.skip = false;
                let facts = MethodFacts::of(&query);
                let (kind, known) = (LightKind::of(&source), KnownKind::of(&point));
                let has_axis = matches!(kind, LightKind::Linear | LightKind::Cylinder);
                let is_polygon = matches!(kind, LightKind::Polygon | LightKind::Textured);
                let expected = KnownKind {
                    has_cosines: asks,
                    are_wide: asks && known.are_wide,
                    has_peaks: has_axis,
                    ..known
                };
                assert_eq!((facts.light, facts.known), (kind, expected), "{text}");
                assert_eq!((facts.samples, facts.skip), (3, false));
                let best = if is_polygon {
                    best
                } else {
                    PointDensity::SolidAngle
                };
                assert_eq!(facts.points, best, "{kind} {depth}");
            }
        }
    }
}

/// The counters of one estimate.
fn counted<R: Reflection>(
    bsdf: R,
    light: &(Light, Option<Image>),
    (text, skip): (&str, bool),
    occluders: &Occluders,
) -> PlanCounters {
    let point = ShadingPoint::new(DVec3::X * 0.25, DVec3::Z, DVec3::Z, bsdf);
    let (source, estimator) = (source(light), text.parse().expect("one"));
    let numbers = RandomNumbers::new(SamplerKind::Sobol, 0, [0, 0], 0);
    let mut query = Query::new(occluders, &source, &point, &estimator, numbers, SAMPLES);
    query.skip = skip;
    let mut buffers = Buffers::default();
    let _ = estimate(&query, &mut buffers);
    buffers.counts.plan
}

/// `exact` counts the lights past occluders for which it uses lines and points, for any reason. If
/// all samples are taken, no light is counted as one without visibility samples.
#[test]
fn what_is_not_integrated_is_counted() {
    let matte = || {
        let albedo = DVec3::splat(0.5);
        Bsdf::Lambert(Lambert { albedo })
    };
    for light in &lights() {
        let kind = LightKind::of(&source(light));
        let is_whole = !matches!(kind, LightKind::Textured | LightKind::Cylinder);
        let exact = ("exact", true);
        let known = counted(matte(), light, exact, &occluders(true));
        assert_eq!(known.exact_fallbacks, u64::from(!is_whole), "{kind}");
        let unknown = counted(Opaque(matte()), light, exact, &occluders(true));
        assert_eq!(unknown.exact_fallbacks, 1, "{kind}");
        let skipped = [true, false].map(|skip| {
            let lines = ("line-area", skip);
            counted(matte(), light, lines, &occluders(false)).unoccluded
        });
        // Round lights have no lines, and build no shaft.
        let has_shaft = !matches!(kind, LightKind::Sphere | LightKind::Disk);
        assert_eq!(skipped, [u64::from(has_shaft), 0], "{kind}");
    }
}

/// One of 64 combinations of what a method may depend on apart from light and reflection.
fn situation(case: u32, light: LightKind, known: KnownKind) -> (MethodFacts<'static>, ShaftAnswer) {
    let is = |bit: u32| case >> bit & 1 == 1;
    let between = ShaftAnswer {
        is_dense: is(0) && is(1),
        has_region: is(2),
        ..between(is(0))
    };
    let facts = MethodFacts {
        skip: is(3),
        ask: [VisibilityBy::Rays, VisibilityBy::Shaft][usize::from(is(4))],
        points: [PointDensity::Area, PointDensity::SolidAngle][usize::from(is(5))],
        ..MethodFacts::new(light, known, SAMPLES)
    };
    (facts, between)
}

/// For every estimator, light and reflection: a visible region is only integrated with a shaft, and
/// only if it can be found. Methods with the region of a round light, which may be too narrow, have
/// samples of the whole light that replace it.
#[test]
fn what_a_method_integrates_can_be_integrated_or_has_samples_in_its_place() {
    let names = Technique::all().map(|technique| technique.name());
    let endings = ["", "[mis=balance]", "+point-bsdf"];
    let texts = names.flat_map(|name| endings.map(|ending| format!("{name}{ending}")));
    let estimators: Vec<Estimator> = texts.filter_map(|text| text.parse().ok()).collect();
    let knowns = KnownKind::ALL.iter().flat_map(|(_, known)| {
        [false, true].map(|are_unlike| KnownKind {
            are_unlike,
            ..*known
        })
    });
    let (mut regions, mut round) = (0, 0);
    let mut hold = |estimator: &Estimator, (facts, between): (MethodFacts<'_>, ShaftAnswer)| {
        let method = estimator.method(&facts, &between);
        let is_round = matches!(facts.light, LightKind::Sphere | LightKind::Disk);
        let is_region = matches!(method.known, KnownOver::Region(_));
        let has_other = method.otherwise != Rest::Nothing;
        let has_region = between.has_region || facts.light == LightKind::Linear;
        let what = || format!("{estimator} {facts:?} {between:?}: {method:?}");
        assert_eq!(has_other, is_region && is_round, "{}", what());
        let may_be = has_region && method.ask == VisibilityBy::Shaft;
        assert!(may_be || !is_region, "{}", what());
        regions += u32::from(is_region);
        round += u32::from(is_region && is_round);
    };
    for known in knowns {
        for (estimator, (_, light)) in estimators
            .iter()
            .flat_map(|e| LightKind::ALL.map(|l| (e, l)))
        {
            for case in 0..64 {
                hold(estimator, situation(case, light, known));
            }
        }
    }
    assert!(regions > round && round > 0, "{regions} {round}");
}

//! Estimators as text: printed texts parse to the same estimators, and errors say what was
//! expected.

use linelit_estimators::{
    Estimator, ExactOptions, Integration, LineBy, LineDirection, LinearHeuristic, LinearOptions,
    Lines, Optimal, Part, Pieces, PointBy, PointDensity, Points, Smoothing, Technique, Weights,
};
use linelit_lights::OffsetDensity;
use linelit_lights::linear::LinearTechnique;
use linelit_testkit::cases::cases;
use linelit_testkit::public::page;
use proptest::prelude::*;

fn linear() -> impl Strategy<Value = LinearOptions> {
    let nu = || prop_oneof![Just(0.5), 0.0..=1.0f64];
    prop_oneof![
        prop::sample::select(&LinearTechnique::ALL[..]).prop_map(LinearOptions::Technique),
        prop_oneof![
            proptest::sample::select(&LinearTechnique::ALL[..]).prop_map(LinearHeuristic::Balance),
            Just(LinearHeuristic::WeightedBalance),
            nu().prop_map(LinearHeuristic::Optimal),
            nu().prop_map(LinearHeuristic::ClampedOptimal),
        ]
        .prop_map(LinearOptions::Ltc),
    ]
}

/// Any technique of the table, with any options that have an effect.
fn technique() -> BoxedStrategy<Technique> {
    let all: Vec<Technique> = Technique::all().collect();
    let any_options = |technique| match technique {
        Technique::Points(points) => with_options(points).boxed(),
        Technique::Lines(lines) => with_line_options(lines).boxed(),
    };
    prop::sample::select(all).prop_flat_map(any_options).boxed()
}

fn with_options(points: Points) -> impl Strategy<Value = Technique> {
    let has_visibility =
        [PointDensity::Area.into(), PointDensity::SolidAngle.into()].contains(&points.by);
    (linear(), any::<bool>()).prop_map(move |(options, shaft)| {
        let by = match points.by {
            PointBy::Linear(_) => PointBy::Linear(options),
            other => other,
        };
        let in_shaft = shaft && has_visibility;
        Points { by, in_shaft }.into()
    })
}

/// A measure has an effect if lines are not integrated in closed form, and a density of offsets if
/// the measure is area and the lines are parallel.
fn with_line_options(lines: Lines) -> impl Strategy<Value = Technique> {
    let exact = any::<u32>().prop_map(|limit| ExactOptions { limit });
    let exact = prop_oneof![Just(ExactOptions::DEFAULT), exact];
    let direction = prop_oneof![
        Just(LineDirection::Parallel),
        Just(LineDirection::UniformPerLine),
        Just(LineDirection::Stratified),
        Just(LineDirection::Origin),
        (-1e6..1e6f64).prop_map(LineDirection::Fixed),
        (1..=8u8).prop_map(LineDirection::Spread),
    ];
    let pieces = prop::sample::select(vec![Pieces::One, Pieces::Each]);
    let points = prop_oneof![Just(1u8), 1..=64u8];
    (exact, direction, any::<bool>(), pieces, points).prop_map(
        move |(exact, direction, uniform, pieces, points)| {
            let integration = lines.integration.map(|integration| match integration {
                Integration::Exact(_) => Integration::Exact(exact),
                other => other,
            });
            let has_offsets = lines.by == LineBy::Area && direction != LineDirection::Origin;
            let offset = match uniform && has_offsets {
                true => OffsetDensity::Uniform,
                false => OffsetDensity::Length,
            };
            Technique::Lines(Lines {
                integration,
                direction,
                offset,
                pieces,
                points,
                ..lines
            })
        },
    )
}

fn estimator() -> impl Strategy<Value = Estimator> {
    let weights = prop::sample::select(vec![
        Weights::Alone,
        Weights::Balance,
        Weights::Power,
        Weights::Maximum,
        Weights::Average,
        Weights::Smooth(Smoothing::Fixed),
        Weights::Smooth(Smoothing::Variable),
        Weights::Optimal(Optimal::Free),
        Weights::Optimal(Optimal::Clamped),
    ]);
    let share = prop_oneof![Just(1), 1..=u32::MAX];
    let part = (technique(), share).prop_map(|(technique, share)| Part { technique, share });
    let parts = prop_oneof![
        prop::collection::vec(part.clone(), 1),
        prop::collection::vec(part, 1..=8)
    ];
    (parts, weights).prop_filter_map("refused", |(parts, weights)| {
        Estimator::new(&parts, weights)
    })
}

proptest! {
    #![proptest_config(ProptestConfig {
        max_global_rejects: 1_000_000,
        ..ProptestConfig::with_cases(cases(2048))
    })]

    #[test]
    fn any_estimator_prints_and_parses(estimator in estimator()) {
        let text = estimator.to_string();
        prop_assert_eq!(text.parse(), Ok(estimator), "{}", text);
    }
}

/// Each name parses to its row of the table, no two rows have the same name, and the page describes
/// each of them.
#[test]
fn every_technique_has_a_name_and_is_described() {
    let Some(page) = page(env!("CARGO_MANIFEST_DIR"), "docs/estimators.md") else {
        return;
    };
    let mut names = Vec::new();
    for technique in Technique::all() {
        let name = technique.name();
        assert_eq!(name.parse(), Ok(Estimator::from(technique)), "{name}");
        assert!(!names.contains(&name), "{name} twice");
        assert!(page.contains(&format!("| `{name}` |")), "{name}: no row");
        names.push(name);
    }
}

#[test]
#[allow(clippy::too_many_lines, reason = "a list of texts")]
fn texts_round_trip() {
    let texts = [
        "point-area",
        "point-visible-area",
        "point-solid-angle",
        "point-projected-solid-angle",
        "point-bsdf",
        "point-linear",
        "point-linear[technique=area]",
        "point-linear[technique=newton-bisection]",
        "point-linear[technique=ltc]",
        "point-linear[technique=ltc,mis=weighted-balance]",
        "point-linear[technique=ltc,mis=optimal,nu=0.25]",
        "point-linear[technique=ltc,nu=0.75]",
        "line-area",
        "line-analytic",
        "line-area[orientation=fixed:0.25]",
        "line-area[orientation=parallel]",
        "line-area[orientation=uniform,offset=uniform]",
        "line-area[orientation=stratified,offset=uniform]",
        "line-area[orientation=origin]",
        "exact[limit=3,orientation=origin,control=none]",
        "line-analytic[offset=uniform]",
        "line-analytic[control=none]",
        "hybrid[orientation=fixed:0.5,control=none]",
        "exact",
        "hybrid",
        "exact[limit=16]",
        "point-area[visibility=shaft]",
        "point-solid-angle[visibility=shaft]",
        "line-solid-angle",
        "line-solid-angle:3+point-bsdf[mis=smooth]",
        "line-solid-angle[orientation=fixed:0.5]+point-bsdf:3",
        "line-solid-angle:3[orientation=fixed:0.5]+point-bsdf[mis=smooth]",
        "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5,mis=average]",
        "line-projected[orientation=spread:4,pieces=one]+point-solid-angle:2",
        "line-texture[orientation=fixed:0]+point-texture",
        "line-area+point-bsdf[mis=clamped-optimal]",
        "line-analytic+point-bsdf:3",
        "hybrid+point-bsdf",
        "line-area[pieces=one,points=4]+point-bsdf[mis=power]",
        "line-area[pieces=one]",
        "line-area[mis=balance]",
        "line-area[orientation=fixed:0.5,mis=balance]",
        "line-area[points=3]",
        "point-area[mis=balance]",
        // These were once refused, only because of the type in which they were stored.
        "line-area[offset=uniform,points=2]",
        "point-area[visibility=shaft]+point-bsdf",
        "exact+point-bsdf",
        "exact[limit=7]+point-visible-area+point-projected-solid-angle",
    ];
    for text in texts {
        assert_eq!(text.parse::<Estimator>().unwrap().to_string(), text);
    }
    for (spelt, short) in [
        (
            "line-area[ offset=length , orientation=adaptive ]",
            "line-area",
        ),
        (
            "line-area[points=2,offset=uniform]",
            "line-area[offset=uniform,points=2]",
        ),
        (
            "line-area[orientation=fixed:0.5]:3+point-bsdf:1",
            "line-area:3[orientation=fixed:0.5]+point-bsdf",
        ),
        (
            "point-linear[technique=projected-solid-angle]",
            "point-linear",
        ),
        (
            "line-area[mis=power]+point-area[mis=power]",
            "line-area+point-area[mis=power]",
        ),
    ] {
        assert_eq!(spelt.parse::<Estimator>().unwrap().to_string(), short);
    }
}

#[test]
fn constructors_are_the_texts() {
    let pairs = [
        (Estimator::points(PointDensity::Area), "point-area"),
        (Estimator::analytic(), "line-analytic"),
        (Estimator::exact().with(Points::bsdf()), "exact+point-bsdf"),
        (
            Estimator::lines(LineBy::Area)
                .fixed(0.25)
                .weighted(Weights::Balance),
            "line-area[orientation=fixed:0.25,mis=balance]",
        ),
        (
            Estimator::hybrid()
                .with(Points::bsdf())
                .share(3)
                .weighted(Weights::Power),
            "hybrid+point-bsdf:3[mis=power]",
        ),
    ];
    for (built, text) in pairs {
        assert_eq!(text.parse(), Ok(built), "{text}");
        assert_eq!(built.to_string(), text);
    }
}

#[test]
fn errors_say_what_was_expected() {
    let expected = [
        ("line", "expected one of point-area"),
        ("line-area[", "closing"),
        ("line-area[width=2]", "no option `width`"),
        ("line-area[orientation=fixed:nan]", "fixed:FRACTION"),
        ("line-area[orientation=fixed:1e308]", "fixed:FRACTION"),
        ("line-area[orientation=fixed:]", "fixed:FRACTION"),
        ("line-area[orientation=fixed:1x]", "fixed:FRACTION"),
        ("line-area[offset=angle]", "expected uniform or length"),
        ("line-solid-angle[offset=uniform]", "no option `offset`"),
        ("line-area[control=none]", "no option `control`"),
        ("line-analytic[control=x]", "expected slopes or none"),
        ("exact[n=2]", "no option `n`"),
        ("exact[tolerance=1e-4]", "no option `tolerance`"),
        ("point-bsdf[visibility=shaft]", "no option `visibility`"),
        ("point-area[visibility=x]", "rays or shaft"),
        ("line-area:0+point-bsdf", "above 0"),
        ("line-area+point-bsdf[mis=best]", "expected one of balance"),
        ("line-area[pieces=two]", "one or each"),
        ("line-area[points=0]", "from 1 to"),
        ("line-area[orientation=uniform]+point-bsdf", "spread:COUNT"),
        ("line-area[orientation=stratified,points=2]", "alone"),
        ("line-solid-angle[orientation=origin]", "alone"),
        ("line-area+line-area[orientation=origin]", "alone"),
        (
            "line-area[orientation=origin,offset=uniform]",
            "no option `offset`",
        ),
        ("line-area[orientation=spread:9]", "spread:COUNT"),
        ("point-area[pieces=one]", "no option `pieces`"),
        (
            "line-area[orientation=spread:6]+line-solid-angle[orientation=spread:6]",
            "between 1 and 8",
        ),
        ("line-area[mis=smooth]3", ":SHARE"),
        ("line-area:3[mis=smooth]x", "must come before"),
        ("line-area:3[mis=smooth]:4", "must come before"),
        (
            "line-area[mis=power]+point-area[mis=smooth]",
            "`smooth` after `power`",
        ),
        ("point-linear[technique=cosine]", "quadratic-cosine"),
        ("point-linear[technique=ltc,mis=power]", "clamped-optimal"),
        (
            "point-linear[technique=ltc,mis=balance,nu=1]",
            "has no parameter nu",
        ),
        ("point-linear[technique=ltc,nu=2]", "0 to 1"),
        ("point-linear[mis=balance]", "technique=ltc"),
        ("point-linear[technique=ltc,with=area]", "mis=balance"),
        (
            "point-linear[technique=ltc,mis=balance,with=cosine]",
            "quadratic-cosine",
        ),
        ("point-linear[width=2]", "no option `width`"),
    ];
    for (text, part) in expected {
        let error = text.parse::<Estimator>().unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
}

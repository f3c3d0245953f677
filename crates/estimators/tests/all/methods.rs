//! The method that an estimator says is the one that it follows.

use crate::agreement::{Image, Opaque, gaussians, lights, materials, means, occluders};
use linelit_bsdf::{Bsdf, Lambert, Reflection};
use linelit_estimators::{Between, Closed, Estimator, Facts, KnownKind, LightKind, LightSource};
use linelit_estimators::{Method, OcclusionStats, PointBy, Queries, ShadingPoint, Technique};
use linelit_geometry::DVec3;
use linelit_lights::Light;
use linelit_visibility::{Occluders, ShaftClass};

const fn known(closed: Closed, has_cosines: bool, has_peaks: bool) -> KnownKind {
    KnownKind {
        closed,
        has_cosines,
        are_unlike: false,
        are_wide: false,
        has_peaks,
    }
}

fn kind((light, texture): &(Light, Option<Image>)) -> LightKind {
    LightKind::of(&LightSource {
        light,
        texture: texture.as_ref(),
        triangles: 0..0,
        occlusion: OcclusionStats::default(),
    })
}

/// The shaft between the point and the lights of [`occluders`], without and with a blocker.
fn between(blocked: bool) -> Between {
    Between {
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

/// A technique with its estimates of one light; `[mis=balance]` where it is a combination of one.
struct Cell {
    text: String,
    said: String,
    is_exact: bool,
    mean: f64,
    /// The standard deviation over the mean.
    noise: f64,
}

/// More is noise, less rounding.
const NONE: f64 = 1e-9;

/// Samples of each estimate.
const SAMPLES: u32 = 15;

/// Every technique, alone if it can, and as a combination of one.
fn estimates<R: Reflection>(
    known: KnownKind,
    point: &ShadingPoint<R>,
    light: &(Light, Option<Image>),
    (occluders, blocked): (&Occluders, bool),
) -> Vec<Cell> {
    // Some have directions of their own, unless one is asked for.
    let texts = Technique::all().flat_map(|technique| {
        let (name, direction) = match technique {
            Technique::Points(_) => (technique.name(), ""),
            Technique::Lines(_) => (technique.name(), "orientation=fixed:0.3,"),
        };
        let alone = format!("{name}[{direction}]");
        [alone, format!("{name}[{direction}mis=balance]")]
    });
    let cell = |text: String| {
        let estimator: Estimator = text.parse().ok()?;
        let facts = Facts {
            light: kind(light),
            known,
            occlusion: &OcclusionStats::default(),
            samples: SAMPLES,
            skip: true,
            queries: Queries::OneShaft,
            points: PointBy::Area,
        };
        let method: Method<'_> = estimator.method(&facts, &between(blocked));
        let values = means(light, occluders, point, (&text, false), SAMPLES, 0..16);
        Some(Cell {
            said: method.to_string(),
            is_exact: method.is_exact(),
            text,
            mean: values.mean(),
            noise: values.variance().sqrt() / values.mean(),
        })
    };
    texts.filter_map(cell).collect()
}

/// Estimators that say the same method give the same numbers; a method that says that it has no
/// noise has none, and others have some, unless nothing is in between.
fn hold<R: Reflection>(expected: KnownKind, bsdf: R) {
    let wo = DVec3::new(-0.6, 0.0, 0.8);
    let point = ShadingPoint::new(DVec3::X * 0.25, DVec3::Z, wo, bsdf);
    let known = KnownKind::of(&point);
    let (are_unlike, are_wide) = (known.are_unlike, known.are_wide);
    assert_eq!(
        known,
        KnownKind {
            are_unlike,
            are_wide,
            ..expected
        }
    );
    let lights = lights();
    for (light, blocked) in lights.iter().flat_map(|l| [(l, true), (l, false)]) {
        let cells = estimates(known, &point, light, (&occluders(blocked), blocked));
        let what = format!("on {}, {known:?}, occluded: {blocked}", kind(light));
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
    let diffuse = known(Closed::Diffuse, true, true);
    hold(diffuse, Bsdf::Lambert(Lambert { albedo }));
    hold(known(Closed::AlongLines, true, true), of("two lobes"));
    hold(known(Closed::AlongLines, true, false), gaussians());
    let rough = known(Closed::Nowhere, true, true);
    for name in [
        "rough diffuse",
        "plastic",
        "brushed metal",
        "substrate",
        "glTF",
        "frostbite",
    ] {
        hold(rough, of(name));
    }
    hold(rough, of("mixture"));
    hold(known(Closed::Nowhere, false, false), Opaque(of("plastic")));
}

//! What the library says that each technique does is what it does, and what the manual says.

use crate::agreement::{Image, Opaque, gaussians, lights, materials, means, occluders};
use linelit_bsdf::{Bsdf, Lambert, Reflection};
use linelit_estimators::{Closed, Cosines, Estimator, Known, LightKind, LightSource, Method};
use linelit_estimators::{OcclusionStats, ShadingPoint, Technique};
use linelit_geometry::DVec3;
use linelit_lights::Light;
use linelit_testkit::public::page;
use linelit_visibility::Occluders;
use std::fmt::Write as _;

/// What may be known of a reflection, and what the manual calls it.
const KNOWN: [(&str, Known); 6] = [
    ("diffuse", known(Closed::Diffuse, Cosines::Flat, true)),
    (
        "with lobes of Phong",
        known(Closed::AlongLines, Cosines::Lobes, true),
    ),
    (
        "with Gaussians",
        known(Closed::AlongLines, Cosines::Lobes, false),
    ),
    ("rough diffuse", known(Closed::Nowhere, Cosines::Flat, true)),
    ("rough", known(Closed::Nowhere, Cosines::Lobes, true)),
    ("unknown", known(Closed::Nowhere, Cosines::Unknown, false)),
];

const fn known(closed: Closed, cosines: Cosines, peaks: bool) -> Known {
    Known {
        closed,
        cosines,
        peaks,
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

/// What reflections get, those that get the same together.
type Cells = Vec<(Vec<&'static str>, String)>;

fn cells(technique: &Technique, light: LightKind) -> Cells {
    let mut cells = Cells::new();
    for (name, known) in KNOWN {
        let does = technique.method(light, known).to_string();
        match cells.iter_mut().find(|(_, other)| *other == does) {
            Some((names, _)) => names.push(name),
            None => cells.push((vec![name], does)),
        }
    }
    cells
}

/// The rows of the manual: lights with the same cells together, then techniques.
fn table() -> String {
    let mut rows: Vec<(Vec<&str>, Vec<LightKind>, Cells)> = Vec::new();
    for technique in Technique::all() {
        let before = rows.len();
        for light in LightKind::ALL {
            let cells = cells(&technique, light);
            match rows[before..].iter_mut().find(|row| row.2 == cells) {
                Some(row) => row.1.push(light),
                None => rows.push((vec![technique.name()], vec![light], cells)),
            }
        }
        for row in rows.split_off(before) {
            let same =
                |other: &&mut (Vec<_>, Vec<_>, Cells)| (&other.1, &other.2) == (&row.1, &row.2);
            match rows.iter_mut().find(same) {
                Some(other) => other.0.extend(row.0),
                None => rows.push(row),
            }
        }
    }
    let mut out = "| name | light | reflection | what it does |\n|---|---|---|---|\n".to_owned();
    for (names, kinds, cells) in rows {
        let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
        let kinds: Vec<_> = kinds.iter().map(ToString::to_string).collect();
        let (names, kinds) = (names.join(", "), kinds.join(", "));
        for (reflections, does) in &cells {
            let reflections = match reflections.len() {
                6 => "any".to_owned(),
                _ => reflections.join(", "),
            };
            writeln!(out, "| {names} | {kinds} | {reflections} | {does} |").expect("memory");
        }
    }
    out
}

#[test]
fn the_manual_has_the_table() {
    let Some(manual) = page(env!("CARGO_MANIFEST_DIR"), "docs/estimators.md") else {
        return;
    };
    let table = table();
    assert!(manual.contains(&table), "docs/estimators.md lacks\n{table}");
}

/// A technique with its estimates of one light; `[mis=balance]` where it is a combination of one.
struct Cell {
    text: String,
    method: Method,
    alone: bool,
    mean: f64,
    /// The standard deviation over the mean.
    noise: f64,
}

/// More is noise, less rounding.
const NONE: f64 = 1e-9;

/// Every technique, alone if it can, and as a combination of one.
fn estimates<R: Reflection>(
    known: Known,
    point: &ShadingPoint<R>,
    light: &(Light, Option<Image>),
    occluders: &Occluders,
) -> Vec<Cell> {
    // Some have directions of their own, unless one is asked for.
    let texts = Technique::all().flat_map(|technique| {
        let (name, direction) = match technique {
            Technique::Points(_) => (technique.name(), ""),
            Technique::Lines(_) => (technique.name(), "orientation=fixed:0.3,"),
        };
        [name.to_owned(), format!("{name}[{direction}mis=balance]")]
    });
    let cell = |text: String| {
        let estimator: Estimator = text.parse().ok()?;
        let methods: Vec<_> = estimator.methods(kind(light), known).collect();
        let [method] = methods[..] else {
            panic!("{text}: {methods:?}")
        };
        let alone = estimator.alone().is_some();
        let values = means(light, occluders, point, (&text, false), 15, 0..16);
        (alone || text.contains("mis")).then(|| Cell {
            text,
            method,
            alone,
            mean: values.mean(),
            noise: values.variance().sqrt() / values.mean(),
        })
    };
    texts.filter_map(cell).collect()
}

/// Techniques whose method is the same give the same numbers, and no others do, unless both are
/// without noise; what is said to be without noise is.
fn hold<R: Reflection>(known: Known, bsdf: R) {
    let wo = DVec3::new(-0.6, 0.0, 0.8);
    let point = ShadingPoint::new(DVec3::X * 0.25, DVec3::Z, wo, bsdf);
    assert_eq!(Known::of(&point), known);
    let lights = lights();
    for (light, there) in lights.iter().flat_map(|l| [(l, true), (l, false)]) {
        let kind = kind(light);
        let cells = estimates(known, &point, light, &occluders(there));
        // The cheapest does as one of the others does.
        let cheapest = |c: &Cell| matches!(c.method, Method::Cheapest(_));
        let what = format!("on {kind}, {known:?}, occluded: {there}");
        for (i, a) in cells.iter().enumerate() {
            let exact = match there {
                true => a.method.is_exact(),
                false => a.method.is_exact_unoccluded(kind, known),
            };
            let said = format!("{} does {} {what}", a.text, a.method);
            if exact {
                assert!(a.noise < NONE, "{said}: noise {}", a.noise);
            } else if there && !cheapest(a) {
                assert!(a.noise > NONE, "{said}: noise {}", a.noise);
            }
            for b in &cells[..i] {
                let noisy = a.noise > NONE || b.noise > NONE;
                if a.alone != b.alone || cheapest(a) || cheapest(b) || !noisy {
                    continue;
                }
                let same = (a.mean / b.mean - 1.0).abs() < NONE;
                let other = format!("{} does {}: {} and {}", b.text, b.method, a.mean, b.mean);
                // All lines of a cylinder have one direction: with nothing in between, points by
                // solid angle are those of lines.
                let twins = kind == LightKind::Cylinder && !there && same;
                assert!(twins || same == (a.method == b.method), "{said}, {other}");
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
    let [
        diffuse,
        phong,
        with_gaussians,
        rough_diffuse,
        rough,
        unknown,
    ] = KNOWN.map(|(_, k)| k);
    hold(diffuse, Bsdf::Lambert(Lambert { albedo }));
    hold(phong, of("two lobes"));
    hold(with_gaussians, gaussians());
    hold(rough_diffuse, of("rough diffuse"));
    for name in ["plastic", "brushed metal", "substrate", "glTF", "frostbite"] {
        hold(rough, of(name));
    }
    hold(rough, of("mixture"));
    hold(unknown, Opaque(of("plastic")));
}

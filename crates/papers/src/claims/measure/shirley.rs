//! Shirley & Wang 1991: one shadow ray for many luminaires, several times.

use super::super::bench::{Bench, Figures};
use crate::measured::Measured;
use crate::picture_study::{Context, Row};
use crate::{shirley, shirley_advice};
use anyhow::Result;
use linelit_geometry::DVec3;
use linelit_integrator::LightChoice;

/// All but the ten thousand luminaires, which are not the paper's.
pub(super) fn run(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    let rows = |context: &Context<'_>| -> Result<Vec<Row>> { shirley::of_the_paper(context) };
    let runs = bench.repeated(43, rows)?;
    let mut ratio = |name: &str, a: &str, b: &str| {
        figures.insert(name.to_owned(), runs.ratio(a, b, "RMSE"));
    };
    let [two, many] = [
        "Figs. 5 and 6: 2 luminaires",
        "Figs. 7 and 8: 32 luminaires",
    ];
    for (name, scene) in [("2 luminaires", two), ("32 luminaires", many)] {
        for rays in [1, 100] {
            let one = format!("{scene}: {rays} rays, one:estimate");
            let all = format!("{scene}: {rays} rays, all");
            ratio(&format!("{name}, {rays} rays: one over all"), &one, &all);
        }
    }
    ratio(
        "Fig. 9",
        "Fig. 9: one:estimate, 1 ray",
        "Fig. 9: one:uniform, 1 ray",
    );
    for (name, choice) in [("centres", "one:centre"), ("random points", "one:estimate")] {
        let what = format!("Fig. 10: {choice}");
        let lost = runs.mean(&what, "pixels that lost light");
        figures.insert(format!("Fig. 10/{name}"), lost);
        let missing = runs.mean(&what, "light missing in all");
        figures.insert(format!("Fig. 10/{name}, light missing"), missing);
    }
    for (name, one, other) in [
        ("visible over whole sphere", "visible area", "whole area"),
        ("solid angle over visible", "solid angle", "visible area"),
    ] {
        let [one, other] = [one, other].map(|what| format!("Figs. 2-3: {what}, 1 ray"));
        figures.insert(name.to_owned(), runs.ratio(&one, &other, "RMSE"));
    }
    let gap = |name: &str| {
        let gap = figures.get(&format!("{name}: one over all"));
        gap.copied().unwrap_or(Measured::UNKNOWN)
    };
    let [of_two, of_many, often] = [
        "2 luminaires, 1 rays",
        "32 luminaires, 1 rays",
        "32 luminaires, 100 rays",
    ]
    .map(gap);
    figures.insert("2 beside 32 luminaires".to_owned(), of_two.over(of_many));
    figures.insert("100 rays beside 1".to_owned(), often.over(of_many));
    let shadows = |choice: &str| {
        let what = format!("{many}: 100 rays, {choice}");
        runs.values(&what, "shadow rays a pixel").first().copied()
    };
    if let (Some(all), Some(one)) = (shadows("all"), shadows("one:estimate")) {
        figures.insert("shadow rays saved".to_owned(), Measured::exact(all / one));
    }
    for (name, distance) in [("near", 1.2), ("far", 10.0)] {
        let wasted = Measured::exact(unseen(distance));
        figures.insert(format!("wasted on the far side/{name}"), wasted);
    }
    Ok(figures)
}

/// The share of points uniform on a sphere of radius one that face away from a point at this
/// distance from its centre: counted on a spiral of 100,000, of which none is counted twice.
fn unseen(distance: f64) -> f64 {
    const COUNT: u32 = 100_000;
    let viewer = DVec3::Z * distance;
    let faces_away = |k: u32| {
        let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(COUNT);
        let turn = f64::from(k) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let r = (1.0 - z * z).sqrt();
        let p = DVec3::new(r * turn.cos(), r * turn.sin(), z);
        (viewer - p).dot(p) <= 0.0
    };
    f64::from((0..COUNT).map(|k| u32::from(faces_away(k))).sum::<u32>()) / f64::from(COUNT)
}

/// The proxy triangle, overhead and grazing; and a bright light that gives nothing.
pub(super) fn triangles(bench: &Bench<'_>) -> Result<Figures> {
    let batches = bench.pick(2, 16, 64);
    let deviation = |degrees| -> Result<Measured> {
        let gain = shirley_advice::grazing(degrees, batches, bench.context.seed)?.gain;
        Ok(Measured::exact(1.0).over(gain).map(f64::sqrt))
    };
    let (overhead, grazing) = (deviation(60.0)?, deviation(5.0)?);
    let hidden = shirley_advice::hidden(bench.context, LightChoice::Estimate)?;
    Ok(Figures::from(
        [
            ("proxy triangle, overhead", overhead),
            (
                "proxy triangle, grazing over overhead",
                grazing.over(overhead),
            ),
            ("hidden bright light", hidden.harm.map(f64::sqrt)),
        ]
        .map(|(name, found)| (name.to_owned(), found)),
    ))
}

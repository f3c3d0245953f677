//! Shirley & Wang 1991: one shadow ray for many luminaires, several times.

use super::super::bench::{Ask, Bench};
use super::super::measured::{Figures, Measured};
use crate::picture_study::{Context, Row};
use crate::shirley;
use anyhow::Result;
use linelit_geometry::DVec3;
use linelit_integrator::LightChoice;
use linelit_samplers::SamplerKind;
use linelit_scenes::luminaires;

/// All but the ten thousand luminaires, which are not the paper's.
pub(super) fn run(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    let rows = |context: &Context<'_>| -> Result<Vec<Row>> { shirley::of_the_paper(context) };
    let runs = bench.repeated(40, rows)?;
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
    let gap = |name: &str| {
        figures
            .get(&format!("{name} luminaires, 1 rays: one over all"))
            .copied()
    };
    if let (Some(two), Some(many)) = (gap("2"), gap("32")) {
        figures.insert("2 beside 32 luminaires".to_owned(), two.over(many));
    }
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

/// A floor under a triangular light, seen from where it is overhead or at a grazing angle.
fn triangle(lift: f64, away: f64) -> String {
    format!(
        "LookAt 0 {} {away}  0.001 0 {away}  0 0 1
Camera \"perspective\" \"float fov\" [ 30 ]
Film \"rgb\" \"integer xresolution\" [ 8 ] \"integer yresolution\" [ 8 ]
WorldBegin
AttributeBegin
Material \"diffuse\" \"rgb reflectance\" [ 0.7 0.7 0.7 ]
Shape \"trianglemesh\" \"point3 P\" [ -99 0 -99 -99 0 99 99 0 99 99 0 -99 ] \"integer indices\" [ 0 1 2 0 2 3 ]
AttributeEnd
AttributeBegin
Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]
AreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ]
Shape \"trianglemesh\" \"point3 P\" [ -1 {lift} -1 1 {lift} -1 0 {lift} 1 ] \"integer indices\" [ 0 1 2 ]
AttributeEnd
",
        0.8 * lift
    )
}

/// A room's floor with a lamp, and a far brighter one in a closed box.
const HIDDEN: &str = "LookAt 0 3 -5  0 0 0.5  0 1 0
Camera \"perspective\" \"float fov\" [ 40 ]
Film \"rgb\" \"integer xresolution\" [ 8 ] \"integer yresolution\" [ 8 ]
WorldBegin
AttributeBegin
Material \"diffuse\" \"rgb reflectance\" [ 0.7 0.7 0.7 ]
Shape \"trianglemesh\" \"point3 P\" [ -9 0 -9 -9 0 9 9 0 9 9 0 -9 ] \"integer indices\" [ 0 1 2 0 2 3 ]
AttributeEnd
AttributeBegin
Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]
AreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ]
Shape \"trianglemesh\" \"point3 P\" [ -0.5 2 -0.5 0.5 2 -0.5 0 2 0.5 ] \"integer indices\" [ 0 1 2 ]
AttributeEnd
";

/// The sun behind a shade.
const SUN: &str = "AttributeBegin
Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]
Shape \"trianglemesh\" \"point3 P\" [ -19 3.9 -19 -19 3.9 19 19 3.9 19 19 3.9 -19 ] \"integer indices\" [ 0 1 2 0 2 3 ]
AreaLightSource \"diffuse\" \"rgb L\" [ 500 500 500 ]
Shape \"trianglemesh\" \"point3 P\" [ -0.5 4 -0.5 0.5 4 -0.5 0 4 0.5 ] \"integer indices\" [ 0 1 2 ]
AttributeEnd
";

/// The proxy triangle, overhead and grazing; and a bright light that gives nothing.
pub(super) fn triangles(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    for (name, lift, away) in [("overhead", 1.0, 0.0), ("grazing", 0.5, 3.0)] {
        bench.on_grid(bench.text(&triangle(lift, away))?, [8, 8], |targets| {
            let ask = |estimator| Ask {
                estimator,
                sampler: SamplerKind::Independent,
                samples: 4,
                trials: 64,
            };
            let found = bench.ask(targets, &[ask("point-proxy"), ask("point-area")])?;
            let ratio = found[0].variance_ratio(&found[1]).map(f64::sqrt);
            figures.insert(format!("proxy triangle, {name}"), ratio);
            Ok(())
        })?;
    }
    if let (Some(grazing), Some(overhead)) = (
        figures.get("proxy triangle, grazing").copied(),
        figures.get("proxy triangle, overhead").copied(),
    ) {
        let name = "proxy triangle, grazing over overhead";
        figures.insert(name.to_owned(), grazing.over(overhead));
    }
    let ball = bench.text(&luminaires::shining_ball())?;
    bench.on_grid(ball, [24, 24], |targets| {
        let ask = |estimator| Ask {
            estimator,
            sampler: SamplerKind::Independent,
            samples: 1,
            trials: 128,
        };
        let names = ["point-area", "point-visible-area", "point-solid-angle"];
        let found = bench.ask(targets, &names.map(ask))?;
        let visible = found[1].variance_ratio(&found[0]).map(f64::sqrt);
        figures.insert("visible over whole sphere".to_owned(), visible);
        let angle = found[2].variance_ratio(&found[1]).map(f64::sqrt);
        figures.insert("solid angle over visible".to_owned(), angle);
        Ok(())
    })?;
    let deviations = |text: &str| -> Result<Vec<f64>> {
        bench.on_grid(bench.text(text)?, [8, 8], |targets| {
            let runs = 0..bench.pick(2, 6, 12);
            runs.map(|k| shirley::deviation(targets, LightChoice::Estimate, bench.context.seed + k))
                .collect()
        })
    };
    let ratio = Measured::ratio(
        &deviations(&(HIDDEN.to_owned() + SUN))?,
        &deviations(HIDDEN)?,
    );
    figures.insert("hidden bright light".to_owned(), ratio);
    Ok(figures)
}

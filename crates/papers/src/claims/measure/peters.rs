//! Peters 2021: the studies of his figures and tables, several times, and his algorithm's error.

use super::super::bench::{Ask, Bench, Figures};
use crate::measured::Measured;
use crate::picture_study::{Context, PictureStudy, Row};
use crate::{peters_diffuse, peters_gloss, peters_table1};
use anyhow::Result;
use linelit_samplers::SamplerKind;

/// The rows of a study.
fn rows(
    study: fn(&Context<'_>) -> Result<PictureStudy>,
) -> impl Fn(&Context<'_>) -> Result<Vec<Row>> {
    move |context| Ok(study(context)?.rows)
}

/// Figs. 4 and 6: a diffuse room.
pub(super) fn diffuse(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    let runs = bench.repeated(128, rows(peters_diffuse::figure_6))?;
    let mut ratio = |name: &str, a: &str, b: &str, key: &str| {
        figures.insert(format!("Fig. 6/{name}"), runs.ratio(a, b, key));
    };
    const ALL: &str = "RMSE";
    const CLEAR: &str = "RMSE outside penumbrae";
    ratio("solid angle over area", "solid-angle", "area", ALL);
    ratio(
        "clipped over solid angle",
        "clipped-solid-angle",
        "solid-angle",
        ALL,
    );
    ratio(
        "linear over clipped",
        "linear-cosine",
        "clipped-solid-angle",
        ALL,
    );
    ratio(
        "quadratic over clipped",
        "quadratic-cosine",
        "clipped-solid-angle",
        ALL,
    );
    ratio(
        "quadratic over linear",
        "quadratic-cosine",
        "linear-cosine",
        ALL,
    );
    ratio(
        "projected over quadratic",
        "projected-solid-angle",
        "quadratic-cosine",
        ALL,
    );
    ratio(
        "projected over Newton-bisection",
        "projected-solid-angle",
        "newton-bisection",
        ALL,
    );
    ratio(
        "clear, quadratic over clipped",
        "quadratic-cosine",
        "clipped-solid-angle",
        CLEAR,
    );
    let worst = runs.values("projected-solid-angle", "worst relative error outside");
    let worst = worst.into_iter().fold(0.0, f64::max);
    figures.insert(
        "Fig. 6/outside penumbrae".to_owned(),
        Measured::exact(worst),
    );
    within(bench, &mut figures)?;
    rounding(bench, &mut figures)?;
    Ok(figures)
}

/// Fig. 4.
fn rounding(bench: &Bench<'_>, figures: &mut Figures) -> Result<()> {
    let runs = bench.repeated(64, rows(peters_diffuse::figure_4))?;
    for (name, what, key) in [
        ("raw, worst", "as printed", "worst"),
        ("times brightness", "as printed, times brightness", "worst"),
    ] {
        let worst = runs.values(what, key).into_iter().fold(0.0, f64::max);
        figures.insert(format!("Fig. 4/{name}"), Measured::exact(worst));
    }
    Ok(())
}

/// The error by projected solid angle over that by clipped solid angle at points that see a part of
/// the light: by projected solid angle the others have no noise.
fn within(bench: &Bench<'_>, figures: &mut Figures) -> Result<()> {
    bench.on_grid(bench.scene("cornell-box-line")?, [40, 40], |targets| {
        let ask = |estimator| Ask {
            estimator,
            sampler: SamplerKind::Independent,
            samples: 1,
            trials: 32,
        };
        let projected = ask("point-linear");
        let partly = bench.noisy(targets, projected.estimator)?;
        let name = "Fig. 6/within penumbrae".to_owned();
        if partly.points.is_empty() {
            figures.insert(name, Measured::UNKNOWN);
            return Ok(());
        }
        let clipped = ask("point-linear[technique=clipped-solid-angle]");
        let found = bench.ask(&partly, &[projected, clipped])?;
        figures.insert(name, found[0].variance_ratio(&found[1]).map(f64::sqrt));
        Ok(())
    })
}

/// Figs. 1 and 7: gloss.
pub(super) fn gloss(bench: &Bench<'_>) -> Result<Figures> {
    let mut figures = Figures::new();
    let runs = bench.repeated(112, rows(peters_gloss::figure_1))?;
    let mut add = |name: &str, a: &str, b: &str, key: &str| {
        figures.insert(format!("Fig. 1/{name}"), runs.ratio(a, b, key));
    };
    let one = [
        "projected solid angle, 1 sample",
        "clipped solid angle, 1 sample",
    ];
    add("projected over clipped", one[0], one[1], "RMSE");
    add(
        "projected over clipped, diffuse",
        one[0],
        one[1],
        "elsewhere",
    );
    add(
        "projected over clipped, gloss",
        one[0],
        one[1],
        "on puddles",
    );
    let both = "projected + LTC, clamped optimal";
    add(
        "LTC over two projected",
        both,
        "projected solid angle, 2 samples",
        "RMSE",
    );
    add(
        "LTC over two projected, gloss",
        both,
        "projected solid angle, 2 samples",
        "on puddles",
    );
    add(
        "LTC over two clipped",
        both,
        "clipped solid angle, 2 samples",
        "RMSE",
    );
    add(
        "clamped optimal over balance",
        both,
        "projected + LTC, balance",
        "RMSE",
    );
    let runs = bench.repeated(80, rows(peters_gloss::figure_7))?;
    let mut add = |name: &str, a: &str, b: &str, key: &str| {
        figures.insert(format!("Fig. 7 of Peters/{name}"), runs.ratio(a, b, key));
    };
    let [white, blue] = ["(a) independent, white", "(b) independent, blue"];
    let [jittered, both] = ["uniform jittered, white", "(c) uniform jittered, blue"];
    add("jittered over independent", jittered, white, "RMSE");
    add("blue over white", blue, white, "RMSE");
    add("blurred, blue over white", blue, white, "RMSE, blurred");
    add("blurred, both over neither", both, white, "RMSE, blurred");
    Ok(figures)
}

/// Table 1: costs, as ratios.
pub(super) fn costs(bench: &Bench<'_>) -> Result<Figures> {
    let runs = bench.repeated(u32::MAX, rows(peters_table1::table_1))?;
    let mut figures = Figures::new();
    let [light, sample] = ["ns per light", "ns per sample"];
    let mut add = |name: &str, a: &str, b: &str, key: &str| {
        figures.insert(format!("Table 1/{name}"), runs.ratio(a, b, key));
    };
    let [ours, li] = ["projected-solid-angle", "newton-bisection"];
    let equal = "projected-solid-angle, to 1.6e-5";
    add(
        "solid angle under area, sample",
        "area",
        "solid-angle",
        sample,
    );
    add(
        "clipping, sample",
        "clipped-solid-angle",
        "solid-angle",
        sample,
    );
    add("quadratic, light", "quadratic-cosine", ours, light);
    add("linear, light", "linear-cosine", ours, light);
    add("linear, sample", "linear-cosine", ours, sample);
    add(
        "rectangle, light",
        "quad, solid angle",
        "solid-angle",
        light,
    );
    add(
        "rectangle, sample",
        "quad, solid angle",
        "solid-angle",
        sample,
    );
    add("quad, light", "quad, projected solid angle", ours, light);
    add("quad, sample", "quad, projected solid angle", ours, sample);
    // What techniques add to sampling by area, which takes the place of the paper's baseline.
    let mut above = |name: &str, a: &str, b: &str, key: &str| {
        let [a, b, area] = [a, b, "area"].map(|what| runs.values(what, key));
        let ratios: Vec<f64> = (0..a.len())
            .map(|k| (a[k] - area[k]) / (b[k] - area[k]))
            .collect();
        figures.insert(format!("Table 1/{name}"), Measured::geometric_mean(&ratios));
    };
    above(
        "clipping above area, light",
        "clipped-solid-angle",
        "solid-angle",
        light,
    );
    above("Newton-bisection above area, light", li, ours, light);
    above("Newton-bisection above area, sample", li, ours, sample);
    above("Newton-bisection at equal error, light", li, equal, light);
    above("Newton-bisection at equal error, sample", li, equal, sample);
    Ok(figures)
}

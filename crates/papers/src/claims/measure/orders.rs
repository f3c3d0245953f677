//! Billen & Dutré 2016, Figs. 7–9 and 11–13: errors of points and lines over samples and time.

use super::super::bench::{Bench, Effort, Figures};
use crate::billen_orders::{self, COLUMNS, LINES};
use crate::measured::{Measured, largest, smallest};
use anyhow::Result;
use linelit_study::tables::{ResultRow, StudyRecord};

/// All of it, from one run of the study.
pub(super) fn run(bench: &Bench<'_>) -> Result<Figures> {
    let mut spec = billen_orders::spec();
    if bench.effort == Effort::Quick {
        // Of all pixels: orders hang on which shadows' edges the few see.
        (spec.trials, spec.independent_trials) = (8, Some(32));
        spec.reference_rounds = 2;
    }
    let scenes = spec.scenes.clone();
    let record = bench.record(spec)?;
    let mut figures = Figures::new();
    for scene in &scenes {
        add_scene(scene, &record, &mut figures);
    }
    add_all_scenes(&scenes, &mut figures);
    let pieces = |scene: &str| figures.get(&format!("pieces/{scene}")).map(|m| m.value);
    if let (Some(soup), Some(grid)) = (pieces("triangle-soup-large"), pieces("grid-planes-large")) {
        let name = "pieces/triangle soup over grid planes";
        figures.insert(name.to_owned(), Measured::exact(soup / grid));
    }
    let line = |scene: &String| figures.get(&format!("time of a line/{scene}")).copied();
    let times: Vec<Measured> = scenes.iter().filter_map(line).collect();
    if let (Some(least), Some(most)) = (smallest(times.clone()), largest(times)) {
        figures.insert("time of a line, least".to_owned(), least);
        figures.insert("time of a line, most".to_owned(), most);
    }
    Ok(figures)
}

/// Rows of one estimator and pattern on a scene, by samples.
fn rows<'a>(
    record: &'a StudyRecord,
    scene: &'a str,
    estimator: &'a str,
    sampler: &'a str,
) -> Vec<&'a ResultRow> {
    let own = |r: &&ResultRow| {
        (r.scene.as_str(), r.estimator.as_str(), r.sampler.as_str()) == (scene, estimator, sampler)
    };
    record.rows.iter().filter(own).collect()
}

fn add_scene(scene: &str, record: &StudyRecord, figures: &mut Figures) {
    for (column, estimator, sampler) in COLUMNS {
        let sampler = sampler.to_string();
        let found = record.slopes.iter().find(|s| {
            (s.scene.as_str(), s.estimator.as_str()) == (scene, estimator) && s.sampler == sampler
        });
        if let Some(slope) = found {
            figures.insert(format!("order/{scene}/{column}"), Measured::from(slope));
        }
    }
    let order = |column: &str| figures.get(&format!("order/{scene}/{column}")).copied();
    if let (Some(net), Some(jittered)) = (order("low-discrepancy line"), order("stratified line")) {
        figures.insert(format!("rank/{scene}"), net.minus(jittered));
    }
    let of = |estimator, sampler| rows(record, scene, estimator, sampler);
    let pairs = |sampler| {
        of(LINES, sampler)
            .into_iter()
            .zip(of("point-area", sampler))
    };
    let random = pairs("independent").map(|(line, point)| Measured::variance_ratio(line, point));
    if let Some(found) = Measured::pooled(&random.collect::<Vec<_>>()) {
        figures.insert(format!("error at equal samples/{scene}"), found);
    }
    // For the same time: squared error times seconds.
    let cost = |(line, point): (&ResultRow, &ResultRow)| {
        Measured::variance_ratio(line, point).times(Measured::time_ratio(line, point))
    };
    if let Some(last) = pairs("independent").next_back() {
        figures.insert(format!("cost at random/{scene}"), cost(last));
        figures.insert(
            format!("time of a line/{scene}"),
            Measured::time_ratio(last.0, last.1),
        );
        let line = last.0;
        let pieces = line.intervals as f64 / (line.line_queries.max(1)) as f64;
        figures.insert(format!("pieces/{scene}"), Measured::exact(pieces));
    }
    if let Some(first) = pairs("stratified").next() {
        figures.insert(format!("cost of few strata/{scene}"), cost(first));
    }
    if let Some(last) = pairs("stratified").next_back() {
        figures.insert(format!("cost of many strata/{scene}"), cost(last));
    }
}

/// The worst of all scenes of one size of light.
fn add_all_scenes(scenes: &[String], figures: &mut Figures) {
    for size in ["small", "large"] {
        let all = |what: &str| -> Vec<Measured> {
            let own = scenes.iter().filter(|scene| scene.ends_with(size));
            own.filter_map(|scene| figures.get(&format!("{what}/{scene}")).copied())
                .collect()
        };
        let from_half = |m: &Measured| (m.value + 0.5).abs();
        let farthest = |column: &str| {
            let all = scenes.iter().filter(|scene| scene.ends_with(size));
            let all = all.filter_map(|scene| figures.get(&format!("order/{scene}/{column}")));
            all.copied()
                .max_by(|a, b| from_half(a).total_cmp(&from_half(b)))
        };
        let found = [
            (format!("random point, {size}"), farthest("random point")),
            (format!("random line, {size}"), farthest("random line")),
            (
                format!("error at equal samples, {size}"),
                largest(all("error at equal samples")),
            ),
            (
                format!("cost of many strata, {size}"),
                largest(all("cost of many strata")),
            ),
        ];
        let found = found.into_iter().filter_map(|(name, m)| Some((name, m?)));
        figures.extend(found.collect::<Vec<_>>());
    }
}

//! Sentences made from the numbers of a study.

use crate::plots::{seconds, short, signed, unique};
use crate::stats::student::central_probability;
use crate::tables::{ResultRow, SceneRecord, SlopeRow, StudyRecord};

/// Over all rows of a study, unbiased estimators are suspected this rarely.
const ALPHA: f64 = 0.01;

/// Paragraphs on measurements left out, on results, and on how far to trust them.
pub(super) fn paragraphs(record: &StudyRecord) -> Vec<String> {
    let found: Vec<Comparison<'_>> = record
        .scenes
        .iter()
        .filter_map(|scene| comparison(record, &scene.scene))
        .collect();
    let mut results: Vec<String> = overall(&found).into_iter().collect();
    results.extend(orders(&record.slopes));
    let mut trust = vec![bias(record)];
    trust.extend(references(record));
    let left_out = record.left_out_sentences();
    [left_out.join(" "), results.join(" "), trust.join(" ")]
        .into_iter()
        .filter(|text| !text.is_empty())
        .collect()
}

/// The best lines against the best points on one scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Comparison<'a> {
    line: &'a ResultRow,
    point: &'a ResultRow,
    /// Error of points over error of lines at as many samples.
    ratio: f64,
    /// Processor seconds, and the ratio of the errors there.
    equal_time: Option<(f64, f64)>,
}

/// Compares at the largest number of samples of a scene, and at the longest time that both reach.
pub(super) fn comparison<'a>(record: &'a StudyRecord, scene: &str) -> Option<Comparison<'a>> {
    let rows: Vec<&ResultRow> = record.rows.iter().filter(|r| r.scene == scene).collect();
    let measured = |r: &&&ResultRow| r.mse > 0.0;
    let samples = rows.iter().filter(measured).map(|r| r.samples).max()?;
    let best = |kind: &str| {
        rows.iter()
            .filter(measured)
            .filter(|r| r.samples == samples && is_kind(&r.estimator, kind))
            .min_by(|a, b| a.mse.total_cmp(&b.mse))
            .copied()
    };
    let (line, point) = (best("line")?, best("point")?);
    let ratio = (point.mse / line.mse).sqrt();
    Some(Comparison {
        line,
        point,
        ratio,
        equal_time: equal_time(&rows, line, point),
    })
}

impl Comparison<'_> {
    /// The finding for the scene's own part of the page, with a space behind.
    pub(super) fn sentence(&self) -> String {
        let Self {
            line, point, ratio, ..
        } = self;
        let mut text = format!(
            "With {} samples, {} ({}) leaves {} {} ({})",
            line.samples,
            line.estimator,
            line.sampler,
            less_or_more(*ratio),
            point.estimator,
            point.sampler
        );
        if let Some((time, ratio)) = self.equal_time {
            text += &format!(
                "; in the same {}, {} it",
                seconds(time),
                less_or_more(ratio)
            );
        }
        text + ". "
    }
}

fn less_or_more(ratio: f64) -> String {
    if ratio >= 1.0 {
        format!("{} times less error than", short(ratio))
    } else {
        format!("{} times the error of", short(ratio.recip()))
    }
}

/// All scenes in one sentence.
fn overall(found: &[Comparison<'_>]) -> Option<String> {
    let same_samples = span(found.iter().map(|c| c.ratio))?;
    let scenes = if found.len() == 1 {
        "the scene".to_owned()
    } else {
        format!("{} scenes", found.len())
    };
    let mut text = format!(
        "On {scenes}, the best points leave {same_samples} times the error of the best lines with \
         as many samples"
    );
    if let Some(same_time) = span(found.iter().filter_map(|c| c.equal_time).map(|(_, r)| r)) {
        text += &format!(", and {same_time} times in as much processor time");
    }
    Some(text + ".")
}

/// `2.1` or `2.1 to 3.7`.
fn span(values: impl Iterator<Item = f64> + Clone) -> Option<String> {
    let low = values.clone().reduce(f64::min)?;
    let high = values.reduce(f64::max)?;
    let (low, high) = (short(low), short(high));
    Some(if low == high {
        low
    } else {
        format!("{low} to {high}")
    })
}

fn is_kind(estimator: &str, kind: &str) -> bool {
    estimator.starts_with(kind) && !estimator.contains('+')
}

/// The longest time that both series reach, and the ratio of their errors (points over lines)
/// there.
fn equal_time(rows: &[&ResultRow], line: &ResultRow, point: &ResultRow) -> Option<(f64, f64)> {
    let curve = |of: &ResultRow| -> Vec<[f64; 2]> {
        let mut curve: Vec<[f64; 2]> = rows
            .iter()
            .filter(|r| r.estimator == of.estimator && r.sampler == of.sampler)
            .filter(|r| r.mse > 0.0 && r.cpu_seconds > 0.0)
            .map(|r| [r.cpu_seconds, r.mse.sqrt()])
            .collect();
        curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
        curve
    };
    let (lines, points) = (curve(line), curve(point));
    let time = lines.last()?[0].min(points.last()?[0]);
    Some((
        time,
        interpolate(&points, time)? / interpolate(&lines, time)?,
    ))
}

/// The value of a curve at `x`, straight between its points on logarithmic scales; `None` outside.
fn interpolate(curve: &[[f64; 2]], x: f64) -> Option<f64> {
    if let Some(exact) = curve.iter().find(|point| (point[0] - x).abs() <= 0.0) {
        return Some(exact[1]);
    }
    let pair = curve
        .windows(2)
        .find(|pair| pair[0][0] < x && x < pair[1][0])?;
    let t = (x / pair[0][0]).ln() / (pair[1][0] / pair[0][0]).ln();
    Some(pair[0][1] * (pair[1][1] / pair[0][1]).powf(t))
}

/// For each kind and sampler, the range of orders over scenes.
fn orders(slopes: &[SlopeRow]) -> Option<String> {
    let samplers = unique(slopes.iter().map(|row| row.sampler.as_str()));
    let range = |sampler: &str, kind: &str| {
        let values = || {
            slopes
                .iter()
                .filter(|r| r.sampler == sampler && is_kind(&r.estimator, kind))
                .map(|r| r.order)
                .filter(|order| order.is_finite())
        };
        let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        Some(if signed(low, 2) == signed(high, 2) {
            signed(low, 2)
        } else {
            format!("{} to {}", signed(high, 2), signed(low, 2))
        })
    };
    let texts: Vec<String> = samplers
        .iter()
        .filter_map(
            |&sampler| match (range(sampler, "point"), range(sampler, "line")) {
                (Some(points), Some(lines)) => Some(format!(
                    "points {points}, lines {lines} with {sampler} samples"
                )),
                (Some(points), None) => Some(format!("points {points} with {sampler} samples")),
                (None, Some(lines)) => Some(format!("lines {lines} with {sampler} samples")),
                (None, None) => None,
            },
        )
        .collect();
    (!texts.is_empty()).then(|| {
        format!(
            "The standard deviation falls with the order: {}.",
            texts.join("; ")
        )
    })
}

/// One row's bias over its standard error, in which the reference's error is included, and the
/// probability of one as large without bias: Student's, as the error is itself from few trials.
pub(super) fn bias_test(row: &ResultRow, scene: Option<&SceneRecord>) -> Option<(f64, f64)> {
    if row.bias.abs() <= 0.0 {
        return Some((0.0, 1.0));
    }
    let reference = scene.map_or(0.0, |s| s.reference_mse / s.shading_points.max(1) as f64);
    let error = (row.bias_stderr * row.bias_stderr + reference).sqrt();
    let z = row.bias / error;
    let freedom = row.trials.checked_sub(1).filter(|&f| f > 0)?;
    z.is_finite()
        .then(|| (z, 1.0 - central_probability(z.abs(), freedom)))
}

fn bias(record: &StudyRecord) -> String {
    let tests: Vec<(f64, f64, &ResultRow)> = record
        .rows
        .iter()
        .filter_map(|row| {
            let scene = record.scenes.iter().find(|s| s.scene == row.scene);
            bias_test(row, scene).map(|(z, p)| (z, p, row))
        })
        .collect();
    let Some(worst) = tests.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return String::new();
    };
    let count = tests.len();
    let (z, p, row) = worst;
    // Šidák: the smallest of `count` independent p values is below this with probability ALPHA.
    let threshold = 1.0 - (1.0 - ALPHA).powf(1.0 / count as f64);
    let found = format!(
        "{} standard errors, p = {}",
        signed(*z, 1),
        super::scientific(*p)
    );
    let measurement = format!(
        "{} ({}) with {} samples on {}",
        row.estimator, row.sampler, row.samples, row.scene
    );
    if *p >= threshold {
        format!(
            "No estimator shows a bias: the least likely of {count} mean errors is {found} ({measurement}), \
             which chance alone explains (Šidák-corrected α = {ALPHA})."
        )
    } else {
        let many = tests.iter().filter(|test| test.1 < threshold).count();
        format!(
            "{many} of {count} mean errors are larger than chance explains (Šidák-corrected α = \
             {ALPHA}): the least likely is {found} ({measurement})."
        )
    }
}

/// Whether each reference is good enough for the errors that are scored against it.
fn references(record: &StudyRecord) -> Option<String> {
    let shares: Vec<(f64, &str)> = record
        .scenes
        .iter()
        .filter_map(|scene| Some((reference_share(record, scene)?, scene.scene.as_str())))
        .collect();
    let (worst, scene) = shares.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(if worst <= 0.1 {
        format!(
            "The references' own squared error is at most {} % of the smallest that is scored.",
            short((100.0 * worst).max(0.01))
        )
    } else {
        format!(
            "On {scene} the reference's own squared error is {} % of the smallest that is scored, \
             more than the tenth that it should be: the smallest errors there are not to be \
             trusted. The orders need no reference.",
            short(100.0 * worst)
        )
    })
}

/// The reference's squared error over the smallest scored on the scene.
pub(super) fn reference_share(record: &StudyRecord, scene: &SceneRecord) -> Option<f64> {
    let smallest = record
        .rows
        .iter()
        .filter(|row| row.scene == scene.scene && row.mse > 0.0)
        .map(|row| row.mse)
        .reduce(f64::min)?;
    Some(scene.reference_mse / smallest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::LeftOutRow;

    fn row(estimator: &str, samples: u32, mse: f64, cpu_seconds: f64) -> ResultRow {
        ResultRow {
            scene: "room".to_owned(),
            estimator: estimator.to_owned(),
            sampler: "stratified".to_owned(),
            samples,
            trials: 8,
            mse,
            cpu_seconds,
            bias: 1e-4,
            bias_stderr: 1e-4,
            ..ResultRow::default()
        }
    }

    fn record() -> StudyRecord {
        StudyRecord {
            scenes: vec![SceneRecord {
                scene: "room".to_owned(),
                reference_mse: 1e-9,
                shading_points: 100,
                ..SceneRecord::default()
            }],
            rows: vec![
                row("point-area", 4, 4e-4, 1.0),
                row("point-area", 16, 1e-4, 4.0),
                row("line-area", 4, 1e-4, 2.0),
                row("line-area", 16, 1e-6, 8.0),
            ],
            slopes: vec![SlopeRow {
                sampler: "stratified".into(),
                estimator: "line-area".into(),
                order: -1.1,
                ..SlopeRow::default()
            }],
            ..StudyRecord::default()
        }
    }

    #[test]
    fn the_summary_says_what_the_numbers_say() {
        let text = paragraphs(&record());
        // At 4 s points are at 0.01; lines halfway between 0.01 and 0.001 in logarithms: 0.00316.
        assert_eq!(
            text[0],
            "On the scene, the best points leave 10 times the error of the best lines with as many \
             samples, and 3.16 times in as much processor time. The standard deviation falls with \
             the order: lines −1.10 with stratified samples."
        );
        assert_eq!(
            comparison(&record(), "room").unwrap().sentence(),
            "With 16 samples, line-area (stratified) leaves 10 times less error than point-area \
             (stratified); in the same 4 s, 3.16 times less error than it. "
        );
        assert!(
            text[1].starts_with("No estimator shows a bias"),
            "{}",
            text[1]
        );
        assert!(text[1].contains("at most 0.1 %"), "{}", text[1]);
    }

    #[test]
    fn a_bias_and_a_poor_reference_are_not_hidden() {
        let mut record = record();
        record.rows[2].bias = 0.1;
        record.scenes[0].reference_mse = 5e-7;
        let text = paragraphs(&record).join(" ");
        assert!(
            text.contains("1 of 4 mean errors are larger than chance explains"),
            "{text}"
        );
        assert!(text.contains("is 50 % of the smallest"), "{text}");
    }

    #[test]
    fn the_bias_test_uses_few_trials_and_the_references_error() {
        let scene = SceneRecord {
            reference_mse: 3e-6,
            shading_points: 100,
            ..SceneRecord::default()
        };
        let (z, p) = bias_test(&row("x", 1, 1.0, 1.0), Some(&scene)).unwrap();
        // √(1e-8 + 3e-8) = 2e-4.
        assert!((z - 0.5).abs() < 1e-12);
        assert!((p - (1.0 - central_probability(0.5, 7))).abs() < 1e-12);
        assert!(
            bias_test(
                &ResultRow {
                    trials: 1,
                    bias: 1.0,
                    ..ResultRow::default()
                },
                None
            )
            .is_none()
        );
    }

    #[test]
    fn what_was_left_out_comes_first() {
        let mut record = record();
        record.left_out = vec![LeftOutRow {
            scene: "room".to_owned(),
            estimator: "point-area".to_owned(),
            sampler: "stratified".to_owned(),
            samples: 64,
        }];
        assert_eq!(
            paragraphs(&record)[0],
            "The time budget was spent before 1 of 5 measurements on room, which are left out: \
             point-area (stratified) with 64 samples."
        );
    }

    #[test]
    fn nothing_measured_is_nothing_said() {
        assert!(paragraphs(&StudyRecord::default()).is_empty());
    }
}

//! Sentences made from the numbers of a study.

use crate::plots::{seconds, short, signed, unique};
use crate::stats::student::central_probability;
use crate::tables::{ResultRow, SceneRecord, SlopeRow, StudyRecord};
use linelit_elementary::{ln, pow};

/// Over all rows of a study, unbiased estimators are suspected this rarely.
const ALPHA: f64 = 0.01;

/// Paragraphs on measurements left out, on results, and on how far to trust them.
pub(super) fn paragraphs(record: &StudyRecord) -> Vec<String> {
    let found: Vec<Comparison<'_>> = record
        .scenes
        .iter()
        .filter_map(|scene| comparison(record, &scene.scene))
        .collect();
    let scenes = record.scenes.iter();
    let headlines: Vec<String> = scenes.filter_map(|scene| headline(record, scene)).collect();
    let mut results: Vec<String> = overall(&found).into_iter().collect();
    results.extend(orders(&record.slopes));
    let mut trust = vec![bias(record)];
    trust.extend(references(record));
    let left_out = record.left_out_sentences();
    [left_out, headlines, results, trust]
        .map(|sentences| sentences.join(" "))
        .into_iter()
        .filter(|text| !text.is_empty())
        .collect()
}

/// What one scene shows in a sentence: how many points do what a middling number of lines does,
/// what each takes, and what has no noise at all.
fn headline(record: &StudyRecord, scene: &SceneRecord) -> Option<String> {
    let rows: Vec<&ResultRow> = record
        .rows
        .iter()
        .filter(|r| r.scene == scene.scene)
        .collect();
    let line = middling(&rows).and_then(|n| {
        let noisy = rows.iter().filter(|r| r.samples == n && timed(r));
        let lines = noisy.filter(|r| is_kind(&r.estimator, "line"));
        lines.copied().min_by(|a, b| a.mse.total_cmp(&b.mse))
    });
    let against = line.and_then(|line| {
        let error = line.mse.sqrt();
        let relative = match scene.power {
            power if power > 0.0 => format!(
                " ({} % of the root mean square)",
                short(100.0 * error / power.sqrt())
            ),
            _ => String::new(),
        };
        Some(format!(
            "{} lines ({}, {}) leave a root mean squared error of {}{relative} in {}: {}",
            line.samples,
            line.estimator,
            line.sampler,
            super::scientific(error),
            seconds(line.cpu_seconds),
            points_for(&rows, line, error)?
        ))
    });
    let known = |r: &&&ResultRow| r.is_noiseless() && r.cpu_seconds > 0.0;
    let mut closed = rows.iter().filter(known);
    let first = closed.next().map(|first| {
        let quickest = closed.fold(
            first,
            |a, b| if b.cpu_seconds < a.cpu_seconds { b } else { a },
        );
        format!(
            "{} has no noise, and takes {}",
            quickest.estimator,
            seconds(quickest.cpu_seconds)
        )
    });
    let told: Vec<String> = against.into_iter().chain(first).collect();
    (!told.is_empty()).then(|| format!("On {}, {}.", scene.scene, told.join("; ")))
}

/// How many points have an error, the pattern being the one that needs fewest, and what they take.
fn points_for(rows: &[&ResultRow], line: &ResultRow, error: f64) -> Option<String> {
    let points = || {
        rows.iter()
            .copied()
            .filter(|r| timed(r) && is_kind(&r.estimator, "point"))
    };
    let fewest = points()
        .filter_map(|row| {
            let samples = time_to(&curve(rows, row, |r| f64::from(r.samples)), error)?;
            let time = time_to(&curve(rows, row, |r| r.cpu_seconds), error)?;
            Some((row, samples, time))
        })
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((row, samples, time)) = fewest else {
        let best = points().min_by(|a, b| a.mse.total_cmp(&b.mse))?;
        return Some(format!(
            "less than {} points, which leave {} in {} ({}, {})",
            best.samples,
            super::scientific(best.mse.sqrt()),
            seconds(best.cpu_seconds),
            best.estimator,
            best.sampler
        ));
    };
    let ratio = short(time / line.cpu_seconds);
    Some(format!(
        "as {samples:.0} points do ({}, {}), in {} or {ratio} times the time",
        row.estimator,
        row.sampler,
        seconds(time)
    ))
}

/// The middle one of the numbers of samples of lines.
fn middling(rows: &[&ResultRow]) -> Option<u32> {
    let lines = rows
        .iter()
        .filter(|r| timed(r) && is_kind(&r.estimator, "line"));
    let mut counts: Vec<u32> = lines.map(|r| r.samples).collect();
    counts.sort_unstable();
    counts.dedup();
    counts.get(counts.len() / 2).copied()
}

/// Whether an error is the estimator's own, and more than what the reference leaves open: before
/// that is taken off, no mean of squares is below its standard error.
fn measured(row: &ResultRow) -> bool {
    row.mse > 0.0 && !(row.mse < row.mse_stderr) && !row.is_noiseless()
}

/// Whether the time is known, too.
fn timed(row: &ResultRow) -> bool {
    measured(row) && row.cpu_seconds > 0.0
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
    let noisy = || rows.iter().copied().filter(|r| timed(r));
    let samples = noisy().map(|r| r.samples).max()?;
    let best = |kind: &str| {
        noisy()
            .filter(|r| r.samples == samples && is_kind(&r.estimator, kind))
            .min_by(|a, b| a.mse.total_cmp(&b.mse))
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
            "With {} samples, {} ({}) leaves an RMSE of {}, {} {} ({})",
            line.samples,
            line.estimator,
            line.sampler,
            super::scientific(line.mse.sqrt()),
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

pub(super) fn less_or_more(ratio: f64) -> String {
    if ratio >= 1.0 {
        format!("{} times less error than", short(ratio))
    } else {
        format!("{} times the error of", short(ratio.recip()))
    }
}

/// All scenes in one sentence.
fn overall(found: &[Comparison<'_>]) -> Option<String> {
    let same_samples = span(found.iter().map(|c| c.ratio))?;
    let mut counts: Vec<u32> = found.iter().map(|c| c.line.samples).collect();
    counts.sort_unstable();
    counts.dedup();
    let counts: Vec<String> = counts.iter().map(u32::to_string).collect();
    let mut text = format!(
        "With {} samples, the most that were taken, the best points leave {same_samples} times the \
         root mean squared error of the best lines",
        counts.join(" or ")
    );
    if let Some(same_time) = span(found.iter().filter_map(|c| c.equal_time).map(|(_, r)| r)) {
        text += &format!(", and {same_time} times for as much processor time");
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
    let [lines, points] = [line, point].map(|of| {
        let mut curve = curve(rows, of, |r| r.cpu_seconds);
        curve.retain(|[_, error]| *error > 0.0);
        curve
    });
    let time = lines.last()?[0].min(points.last()?[0]);
    Some((
        time,
        interpolate(&points, time)? / interpolate(&lines, time)?,
    ))
}

/// The root mean squared errors of one estimator and pattern over time, or over another cost,
/// ascending; zero where there is no noise.
pub(super) fn curve(
    rows: &[&ResultRow],
    of: &ResultRow,
    cost: fn(&ResultRow) -> f64,
) -> Vec<[f64; 2]> {
    let mut curve: Vec<[f64; 2]> = rows
        .iter()
        .filter(|r| r.estimator == of.estimator && r.sampler == of.sampler)
        .filter(|r| measured(r) || r.is_noiseless())
        .filter(|r| cost(r) > 0.0)
        .map(|r| [cost(r), if r.is_noiseless() { 0.0 } else { r.mse.sqrt() }])
        .collect();
    curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
    curve
}

/// The least cost at which a curve reaches an error: straight between its points on logarithmic
/// scales, but for what has none. `None` where it does not.
pub(super) fn time_to(curve: &[[f64; 2]], error: f64) -> Option<f64> {
    let reached = curve.iter().find(|point| point[1] <= error).map(|p| p[0]);
    let between = curve.windows(2).find_map(|pair| {
        let ([x, above], [y, below]) = (pair[0], pair[1]);
        let t = ln(error / above) / ln(below / above);
        (above > error && error >= below && below > 0.0).then(|| x * pow(y / x, t))
    });
    match (between, reached) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// The value of a curve at `x`, straight between its points on logarithmic scales; `None` outside.
fn interpolate(curve: &[[f64; 2]], x: f64) -> Option<f64> {
    if let Some(exact) = curve.iter().find(|point| (point[0] - x).abs() <= 0.0) {
        return Some(exact[1]);
    }
    let pair = curve
        .windows(2)
        .find(|pair| pair[0][0] < x && x < pair[1][0])?;
    let t = ln(x / pair[0][0]) / ln(pair[1][0] / pair[0][0]);
    Some(pair[0][1] * pow(pair[1][1] / pair[0][1], t))
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
    let threshold = 1.0 - pow(1.0 - ALPHA, 1.0 / count as f64);
    let found = format!(
        "{} standard errors, p = {}",
        signed(*z, 1),
        super::scientific(*p)
    );
    let measurement = format!(
        "{} ({}), N = {}, on {}",
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
            "The references' own squared error, which is taken off, is at most {} % of the smallest \
             variance that is scored.",
            short((100.0 * worst).max(0.01))
        )
    } else {
        format!(
            "On {scene} the reference's own squared error, which is taken off, is {} % of the \
             smallest variance that is scored, more than the tenth that it should be: the smallest \
             errors there have wide intervals. The orders need no reference.",
            short(100.0 * worst)
        )
    })
}

/// The reference's squared error over the smallest variance of the scene.
pub(super) fn reference_share(record: &StudyRecord, scene: &SceneRecord) -> Option<f64> {
    let smallest = record
        .rows
        .iter()
        .filter(|row| row.scene == scene.scene && row.variance > 0.0)
        .map(|row| row.variance)
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
            variance: mse,
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
                power: 0.25,
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
        assert_eq!(
            text[0],
            "On room, 16 lines (line-area, stratified) leave a root mean squared error of 1.00·10⁻³ \
             (0.2 % of the root mean square) in 8 s: less than 16 points, which leave 1.00·10⁻² in \
             4 s (point-area, stratified)."
        );
        // At 4 s points are at 0.01; lines halfway between 0.01 and 0.001 in logarithms: 0.00316.
        assert_eq!(
            text[1],
            "With 16 samples, the most that were taken, the best points leave 10 times the root mean \
             squared error of the best lines, and 3.16 times for as much processor time. The standard \
             deviation falls with the order: lines −1.10 with stratified samples."
        );
        assert_eq!(
            comparison(&record(), "room").unwrap().sentence(),
            "With 16 samples, line-area (stratified) leaves an RMSE of 1.00·10⁻³, 10 times less error \
             than point-area (stratified); in the same 4 s, 3.16 times less error than it. "
        );
        let text = &text[1..];
        assert!(
            text[1].starts_with("No estimator shows a bias"),
            "{}",
            text[1]
        );
        assert!(text[1].contains("at most 0.1 %"), "{}", text[1]);
    }

    #[test]
    fn lines_are_told_by_the_points_that_do_the_same() {
        let mut record = record();
        // 4 lines among 1, 4 and 16 leave 0.01, which 16 points do: 4 s against 2.
        record.rows.push(row("line-area", 1, 4e-4, 1.0));
        let closed = ResultRow {
            variance: 0.0,
            ..row("exact", 4, 1e-12, 0.5)
        };
        record.rows.push(closed);
        assert_eq!(
            headline(&record, &record.scenes[0]).unwrap(),
            "On room, 4 lines (line-area, stratified) leave a root mean squared error of 1.00·10⁻² \
             (2 % of the root mean square) in 2 s: as 16 points do (point-area, stratified), in 4 s \
             or 2 times the time; exact has no noise, and takes 500 ms."
        );
        // What has no noise is not what the reference is held to.
        let share = reference_share(&record, &record.scenes[0]).unwrap();
        assert!((share - 1e-3).abs() < 1e-12, "{share}");
    }

    #[test]
    fn curves_are_read_at_an_error() {
        let curve = [[1.0, 1e-1], [10.0, 1e-2], [100.0, 0.0]];
        let near = |error, want: f64| (time_to(&curve, error).unwrap() / want - 1.0).abs() < 1e-12;
        assert!(near(1e-1, 1.0) && near(0.1 / 10f64.sqrt(), 10f64.sqrt()));
        assert!(near(1e-3, 100.0) && near(1.0, 1.0));
        assert!(time_to(&curve[..2], 1e-3).is_none());
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

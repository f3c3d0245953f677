//! What numbers of a study say together: bias, the reference's share, the cost of an error.

use crate::plots::signed;
use crate::stats::student::central_probability;
use crate::tables::{ResultRow, SceneRecord, StudyRecord};
use linelit_elementary::{ln, pow};

/// Over all rows of a study, unbiased estimators are suspected this rarely.
const ALPHA: f64 = 0.01;

/// Whether an error is the estimator's own, and more than what the reference leaves open: before
/// that is taken off, no mean of squares is below its standard error.
fn measured(row: &ResultRow) -> bool {
    row.mse > 0.0 && !(row.mse < row.mse_stderr) && !row.is_noiseless()
}

/// The root mean squared errors of one estimator and pattern over processor time,
/// ascending; zero where there is no noise.
pub(super) fn curve(rows: &[&ResultRow], of: &ResultRow) -> Vec<[f64; 2]> {
    let mut curve: Vec<[f64; 2]> = rows
        .iter()
        .filter(|r| r.estimator == of.estimator && r.sampler == of.sampler)
        .filter(|r| measured(r) || r.is_noiseless())
        .filter(|r| r.cpu_seconds > 0.0)
        .map(|r| {
            [
                r.cpu_seconds,
                if r.is_noiseless() { 0.0 } else { r.mse.sqrt() },
            ]
        })
        .collect();
    curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
    curve
}

/// The least time at which a curve reaches an error: straight between its points on logarithmic
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

/// The least likely of all biases of a study, in a sentence; none where nothing was tested.
pub(super) fn bias(record: &StudyRecord) -> Option<String> {
    let tests: Vec<(f64, f64, &ResultRow)> = record
        .rows
        .iter()
        .filter_map(|row| {
            let scene = record.scenes.iter().find(|s| s.scene == row.scene);
            bias_test(row, scene).map(|(z, p)| (z, p, row))
        })
        .collect();
    let worst = tests.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
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
    Some(if *p >= threshold {
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

    fn row(samples: u32, mse: f64, cpu_seconds: f64) -> ResultRow {
        ResultRow {
            scene: "room".to_owned(),
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
                ..SceneRecord::default()
            }],
            rows: vec![row(4, 4e-4, 1.0), row(16, 1e-6, 8.0)],
            ..StudyRecord::default()
        }
    }

    #[test]
    fn the_share_of_a_reference_is_that_of_the_smallest_variance_with_noise() {
        let mut record = record();
        record.rows.push(ResultRow {
            variance: 0.0,
            ..row(4, 1e-12, 0.5)
        });
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
    fn a_bias_is_said() {
        let mut record = record();
        let text = bias(&record).unwrap();
        assert!(text.starts_with("No estimator shows a bias"), "{text}");
        record.rows[1].bias = 0.1;
        let text = bias(&record).unwrap();
        assert!(
            text.starts_with("1 of 2 mean errors are larger than chance explains"),
            "{text}"
        );
        assert!(bias(&StudyRecord::default()).is_none());
    }

    #[test]
    fn the_bias_test_uses_few_trials_and_the_references_error() {
        let scene = SceneRecord {
            reference_mse: 3e-6,
            shading_points: 100,
            ..SceneRecord::default()
        };
        let (z, p) = bias_test(&row(1, 1.0, 1.0), Some(&scene)).unwrap();
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
}

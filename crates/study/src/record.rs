//! The record of a study: results are added to it scene by scene, and it writes the tables, plots
//! and report.

use crate::engine::{CellResult, Method, Results};
use crate::report::{Exhibits, Report, plot_files};
use crate::stats::least;
use crate::stats::slopes::{SlopePoint, fit_trials};
use crate::stats::student::central_probability;
use crate::tables::{ResultRow, SceneRecord, SlopeRow, StudyRecord, commit, cpu_name};
use linelit_film::FilmError;

/// An order of convergence that a paper reports, for comparison with ours.
#[derive(Clone, Debug)]
pub struct PaperOrder {
    /// The short name of the scene.
    pub scene: String,
    /// The name of the estimator, as our estimators print themselves.
    pub estimator: String,
    /// The name of the sampling pattern, as our patterns print themselves.
    pub sampler: String,
    /// The order of the standard deviation.
    pub order: f64,
    /// The figure or table of the paper.
    pub source: String,
}

impl StudyRecord {
    /// Creates a record without results. The record states linelit's version and commit, the
    /// processor and the number of threads.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            version: crate::version(),
            commit: commit(),
            cpu: cpu_name(),
            threads: rayon::current_num_threads(),
            ..Self::default()
        }
    }

    /// Adds the results on one scene: a row for each measurement, and for each method an order of
    /// convergence together with the papers' order. `pixels` names the pixels that were measured,
    /// for the column of that name in `results.csv`.
    pub fn add<S>(
        &mut self,
        mut scene: SceneRecord,
        pixels: &str,
        methods: &[Method<S>],
        results: &Results,
        papers: &[PaperOrder],
    ) {
        // Complete the scene's record by what the results say of the scene.
        let name = scene.scene.clone();
        scene.shading_points = results.integrals;
        scene.pixels = results.pixels;
        scene.power = results.power;
        scene.reference_mse = results.reference.mse;
        scene.reference.clone_from(&results.reference.source);
        self.scenes.push(scene);
        // Add a row for each measurement, and for each that was left out.
        self.rows.extend(results.cells.iter().map(|cell| ResultRow {
            scene: name.clone(),
            pixels: pixels.to_owned(),
            ..cell.row.clone()
        }));
        if let processors @ [_, ..] = self.processors().as_slice() {
            self.cpu = processors.join("; ");
        }
        for mut cell in results.left_out.iter().cloned() {
            cell.scene.clone_from(&name);
            self.left_out.push(cell);
        }
        // Fit an order for each method.
        for method in methods {
            let names = [&name, &method.estimator, &method.sampler];
            self.slopes.extend(slope(names, results, papers));
        }
    }

    /// Returns the processors that the measurements ran on, the one with the most rows first.
    #[must_use]
    pub fn processors(&self) -> Vec<&str> {
        let mut found: Vec<(&str, usize)> = Vec::new();
        for row in &self.rows {
            match found.iter_mut().find(|(name, _)| *name == row.processor) {
                Some((_, count)) => *count += 1,
                None => found.push((&row.processor, 1)),
            }
        }
        found.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        found.into_iter().map(|(name, _)| name).collect()
    }

    /// Returns a copy of the record with the times that were measured on `processor` only. Times
    /// that were measured on other processors become unknown, since times on different processors
    /// are not compared.
    #[must_use]
    pub fn timed_on(&self, processor: &str) -> Self {
        let mut record = self.clone();
        for row in record.rows.iter_mut().filter(|r| r.processor != processor) {
            (row.cpu_seconds, row.cpu_error, row.wall_seconds) = (f64::NAN, f64::NAN, f64::NAN);
        }
        record
    }

    /// Returns the least time in which the scene, estimator and sampler of the row `of` reach this
    /// root mean squared error.
    pub(crate) fn time_to(&self, of: &ResultRow, error: f64) -> Option<f64> {
        let own = self.rows.iter().filter(|r| {
            (&r.scene, &r.estimator, &r.sampler) == (&of.scene, &of.estimator, &of.sampler)
        });
        let point = |r: &ResultRow| {
            let error = if r.is_noiseless() { 0.0 } else { r.mse.sqrt() };
            let known = r.cpu_seconds > 0.0 && (r.is_known() || r.is_noiseless());
            known.then_some([error, r.cpu_seconds])
        };
        let mut curve: Vec<[f64; 2]> = own.filter_map(point).collect();
        curve.sort_by(|a, b| a[1].total_cmp(&b[1]));
        least(curve, error)
    }

    /// Returns the files of a study, by name: its tables, `plots/*.svg`, and `report.html`, which
    /// shows the exhibits.
    ///
    /// # Errors
    /// [`FilmError`] if a number cannot be written as JSON.
    pub fn files(&self, exhibits: Exhibits) -> Result<Vec<(String, Vec<u8>)>, FilmError> {
        let mut files: Vec<(String, String)> = Vec::new();
        files.extend(self.tables()?.map(|(name, text)| (name.to_owned(), text)));
        let plots = plot_files(self).into_iter();
        files.extend(plots.map(|(name, svg)| (format!("plots/{name}"), svg)));
        let page = Report::of_study(self, exhibits).render();
        files.push(("report.html".to_owned(), page));
        let bytes = |(name, text): (String, String)| (name, text.into_bytes());
        Ok(files.into_iter().map(bytes).collect())
    }
}

impl ResultRow {
    /// Returns the measured bias over its standard error, and the probability that a measured bias
    /// is at least as large where there is no true bias. The result is `None` if there is only one
    /// trial, or if the standard error is not known. The probability is Student's, because the
    /// standard error is itself estimated from few trials.
    pub(crate) fn bias_test(&self) -> Option<[f64; 2]> {
        if self.bias.abs() <= 0.0 {
            return Some([0.0, 1.0]);
        }
        let z = self.bias / self.bias_stderr;
        let freedom = self.trials.checked_sub(1).filter(|&f| f > 0)?;
        let p = 1.0 - central_probability(z.abs(), freedom);
        z.is_finite().then_some([z, p])
    }
}

/// The least number of noisy measurements to which an order is fitted where other measurements of
/// the method have no noise.
const LEAST_NOISY: usize = 3;

/// Fits the order of the standard deviation of one estimator and sampler, from the spread of its
/// trials (which needs no reference). Measurements without noise are left out of the fit; the
/// result is `None` where too few others remain, as for an estimator that changes to a closed form.
fn slope(
    [scene, estimator, sampler]: [&String; 3],
    results: &Results,
    papers: &[PaperOrder],
) -> Option<SlopeRow> {
    // Find the measurements of the method that have noise.
    let of = |cell: &&CellResult| (&cell.row.estimator, &cell.row.sampler) == (estimator, sampler);
    let (noisy, noiseless): (Vec<_>, Vec<_>) =
        (results.cells.iter().filter(of)).partition(|cell| cell.row.variance > 0.0);
    if !noiseless.is_empty() && noisy.len() < LEAST_NOISY {
        return None;
    }
    // Fit the order, and look up the paper's.
    let point = |cell: &CellResult| SlopePoint {
        samples: f64::from(cell.row.samples),
        trial_variances: cell.score.trial_variance.clone(),
    };
    let points: Vec<SlopePoint> = noisy.into_iter().map(point).collect();
    let paper = papers
        .iter()
        .find(|p| (&p.scene, &p.estimator, &p.sampler) == (scene, estimator, sampler));
    Some(SlopeRow {
        scene: scene.clone(),
        estimator: estimator.clone(),
        sampler: sampler.clone(),
        fit: fit_trials(&points, 0.95)?,
        paper_order: paper.map(|p| p.order),
        paper_source: paper.map(|p| p.source.clone()),
    })
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

    #[test]
    fn times_are_read_at_an_error() {
        let closed = ResultRow {
            variance: 0.0,
            ..row(64, 1e-30, 100.0)
        };
        // Its error is below its standard error, so that it is ignored.
        let vague = ResultRow {
            mse_stderr: 1.0,
            ..row(1, 1e-20, 0.1)
        };
        let mut record = StudyRecord {
            rows: vec![row(4, 1e-2, 1.0), row(16, 1e-4, 10.0), vague, closed],
            ..StudyRecord::default()
        };
        let near = |error, want: f64| {
            let time = record.time_to(&record.rows[0], error).unwrap();
            assert!((time / want - 1.0).abs() < 1e-12, "{error}: {time}");
        };
        near(1e-1, 1.0);
        near(0.1 / 10f64.sqrt(), 10f64.sqrt());
        near(1e-3, 100.0);
        near(1.0, 1.0);
        record.rows.pop();
        assert!(record.time_to(&record.rows[0], 1e-3).is_none());
    }

    #[test]
    fn the_bias_test_knows_of_few_trials() {
        let biased = ResultRow {
            bias_stderr: 2e-4,
            ..row(1, 1.0, 1.0)
        };
        let [z, p] = biased.bias_test().unwrap();
        assert!((z - 0.5).abs() < 1e-12);
        assert!((p - (1.0 - central_probability(0.5, 7))).abs() < 1e-12);
        let single = ResultRow {
            trials: 1,
            bias: 1.0,
            ..ResultRow::default()
        };
        assert!(single.bias_test().is_none());
    }
}

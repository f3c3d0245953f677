//! From what was measured to what is told: the record of a study.

use crate::engine::{CellResult, Method, Results};
use crate::report::{Exhibits, Report, plot_files};
use crate::stats::slopes::{SlopePoint, fit_trials};
use crate::tables::{ResultRow, SceneRecord, SlopeRow, StudyRecord, commit, cpu_name};
use linelit_film::FilmError;

/// An order of convergence that a paper reports.
#[derive(Clone, Debug)]
pub struct PaperOrder {
    /// Our scene.
    pub scene: String,
    /// Our estimator, as it prints itself.
    pub estimator: &'static str,
    /// The pattern, as it prints itself.
    pub sampler: String,
    /// The order of the standard deviation.
    pub order: f64,
    /// Figure or table of the paper.
    pub source: &'static str,
}

impl StudyRecord {
    /// A record without results, which says what made it: linelit's version, commit, processor and
    /// threads.
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

    /// Adds the results on one scene: a row for each measurement, and an order for each method,
    /// beside the papers'. `pixels` names the integrals that were looked at, for the column of that
    /// name in `results.csv`.
    pub fn add<S>(
        &mut self,
        mut scene: SceneRecord,
        pixels: &str,
        methods: &[Method<S>],
        results: &Results,
        papers: &[PaperOrder],
    ) {
        let name = scene.scene.clone();
        scene.shading_points = results.integrals;
        scene.pixels = results.pixels;
        scene.power = results.power;
        scene.reference_mse = results.reference.mse;
        scene.reference.clone_from(&results.reference.source);
        self.scenes.push(scene);
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
        for method in methods {
            let names = [&name, &method.estimator, &method.sampler];
            self.slopes.extend(slope(names, results, papers));
        }
    }

    /// The processors that measured: the one of most rows first.
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

    /// The same record with times on one processor alone: those on others are not known in it, as
    /// times on different processors are not compared.
    #[must_use]
    pub fn timed_on(&self, processor: &str) -> Self {
        let mut record = self.clone();
        for row in record.rows.iter_mut().filter(|r| r.processor != processor) {
            (row.cpu_seconds, row.cpu_error, row.wall_seconds) = (f64::NAN, f64::NAN, f64::NAN);
        }
        record
    }

    /// The files of a study, by name: its tables, `plots/*.svg` and `report.html`, which shows the
    /// exhibits.
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

/// The fewest numbers of samples with noise that an order is fitted to where others have none.
const LEAST_NOISY: usize = 3;

/// The order of the standard deviation of one estimator and pattern, from the spread of the trials
/// (which needs no reference). What has no noise has no part in the fit; `None` where too little
/// else is left, as of an estimator that changes to a closed form.
fn slope(
    [scene, estimator, sampler]: [&String; 3],
    results: &Results,
    papers: &[PaperOrder],
) -> Option<SlopeRow> {
    let of = |cell: &&CellResult| (&cell.row.estimator, &cell.row.sampler) == (estimator, sampler);
    let (noisy, noiseless): (Vec<_>, Vec<_>) =
        (results.cells.iter().filter(of)).partition(|cell| cell.row.variance > 0.0);
    if !noiseless.is_empty() && noisy.len() < LEAST_NOISY {
        return None;
    }
    let point = |cell: &CellResult| SlopePoint {
        samples: f64::from(cell.row.samples),
        trial_variances: cell.score.trial_variance.clone(),
    };
    let points: Vec<SlopePoint> = noisy.into_iter().map(point).collect();
    let fit = fit_trials(&points, 0.95)?;
    let paper = papers
        .iter()
        .find(|p| (&p.scene, p.estimator, &p.sampler) == (scene, estimator, sampler));
    Some(SlopeRow {
        scene: scene.clone(),
        estimator: estimator.clone(),
        sampler: sampler.clone(),
        n_min: fit.n_min,
        n_max: fit.n_max,
        order: fit.order,
        ci_low: fit.ci_low,
        ci_high: fit.ci_high,
        lack_of_fit: fit.lack_of_fit,
        paper_order: paper.map(|p| p.order),
        paper_source: paper.map(|p| p.source.to_owned()),
    })
}

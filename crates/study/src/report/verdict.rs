//! The verdict of a study, which its report states first: the time that points need to reach the
//! error of lines.

use super::{Cell, Table, scientific};
use crate::plots::{seconds, short};
use crate::tables::{Family, ResultRow, StudyRecord};
use std::collections::BTreeSet;

/// The number of line samples whose error is compared with the error of points. If this number was
/// not measured, the next smaller measured number is used.
const LINES: u32 = 16;

/// The best lines of a scene at one number of samples, and the times in which points and noiseless
/// estimators reach their error.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The scene.
    pub scene: String,
    /// The estimator and sampler of the lines.
    pub estimator: String,
    /// The number of lines.
    pub samples: u32,
    /// The root mean squared error of the lines.
    pub error: f64,
    /// The processor seconds of a trial of the lines.
    pub time: f64,
    /// The best points: their estimator, and the processor seconds in which they reach the same
    /// error; `None` if they do not reach it at any number of samples.
    pub points: Option<(String, f64)>,
    /// The processor seconds of the fastest estimator without noise.
    pub exact: Option<f64>,
}

impl Verdict {
    /// Returns a verdict for each scene on which lines with noise were timed. Estimators that are
    /// not linelit's count neither as lines nor as points.
    #[must_use]
    pub fn all(record: &StudyRecord) -> Vec<Self> {
        let scenes = record.scenes.iter();
        scenes.filter_map(|s| Self::of(record, &s.scene)).collect()
    }

    /// Returns the verdict at the largest number of lines, up to [`LINES`], whose error is also
    /// reached by points. If points reach none of these errors, it is the verdict at the largest
    /// number of lines up to [`LINES`].
    fn of(record: &StudyRecord, scene: &str) -> Option<Self> {
        let rows = record.rows.iter().filter(|row| row.scene == scene);
        let counts: BTreeSet<u32> = rows.map(|row| row.samples).collect();
        let counts = || counts.iter().rev().filter(|n| **n <= LINES);
        let mut all = counts().filter_map(|n| Self::at(record, scene, *n));
        let most = all.next()?;
        if most.points.is_some() {
            return Some(most);
        }
        Some(all.find(|fewer| fewer.points.is_some()).unwrap_or(most))
    }

    /// Returns the verdict at one number of lines; `None` if no lines with noise were timed with
    /// it.
    fn at(record: &StudyRecord, scene: &str, samples: u32) -> Option<Self> {
        // Find the most efficient lines.
        let rows = || record.rows.iter().filter(|row| row.scene == scene);
        let is_noisy = |row: &&ResultRow| !row.is_noiseless() && row.mse > 0.0;
        let is_lines = |row: &&ResultRow| row.family() == Some(Family::Lines);
        let lines = rows().filter(is_lines).filter(is_noisy);
        let timed = lines.filter(|row| row.samples == samples && row.cpu_seconds > 0.0);
        let best = timed.min_by(|a, b| a.cost().total_cmp(&b.cost()))?;
        // Find the points that reach their error first, and the fastest estimator without noise.
        let error = best.mse.sqrt();
        let points = rows().filter(|row| row.is_points());
        let reached = points.filter_map(|row| {
            let time = record.time_to(row, error)?;
            Some((format!("{} ({})", row.estimator, row.sampler), time))
        });
        let noiseless = rows().filter(|row| row.is_noiseless() && row.cpu_seconds > 0.0);
        Some(Self {
            scene: scene.to_owned(),
            estimator: format!("{} ({})", best.estimator, best.sampler),
            samples,
            error,
            time: best.cpu_seconds,
            points: reached.min_by(|a, b| a.1.total_cmp(&b.1)),
            exact: noiseless.map(|row| row.cpu_seconds).reduce(f64::min),
        })
    }

    /// The headings of [`Verdict::cells`], separated by commas.
    pub const COLUMNS: &'static str =
        "scene,lines,RMSE,their time,best points,time to that RMSE,ratio,no noise in";

    /// Returns the verdict as the cells of a table.
    #[must_use]
    pub fn cells(&self) -> [String; 8] {
        let dash = || "–".to_owned();
        let (points, time, ratio) = match &self.points {
            Some((name, time)) => (name.clone(), seconds(*time), short(time / self.time)),
            None => ("not reached".to_owned(), dash(), dash()),
        };
        [
            self.scene.clone(),
            format!("{} × {}", self.samples, self.estimator),
            scientific(self.error),
            seconds(self.time),
            points,
            time,
            ratio,
            self.exact.map_or_else(dash, seconds),
        ]
    }

    /// Returns the table of all verdicts, under a sentence that explains it.
    pub(super) fn table(all: &[Self]) -> Table {
        let rows = all.iter().map(|v| v.cells().map(Cell::text).to_vec());
        let caption = "What the best points take to reach the error of the best lines. A ratio above one \
             says that lines are faster; below one, that points are.";
        Table::new(caption, Self::COLUMNS.split(','), rows)
    }
}

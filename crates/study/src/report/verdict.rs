//! What a study says first: what points cost for the error of lines.

use super::{Cell, Table, scientific};
use crate::plots::{seconds, short};
use crate::tables::{Family, ResultRow, StudyRecord};
use std::collections::BTreeSet;

/// The samples of lines whose error others are held to, unless all counts are smaller.
const LINES: u32 = 16;

/// The best lines of a scene at one number of samples, and what reaches their error else.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The scene.
    pub scene: String,
    /// The lines' estimator and pattern.
    pub estimator: String,
    /// Their number of samples.
    pub samples: u32,
    /// Their root mean squared error.
    pub error: f64,
    /// Processor seconds of a trial by them.
    pub time: f64,
    /// The best points: their estimator, and processor seconds to the same error; `None` if none
    /// of their numbers of samples reaches it.
    pub points: Option<(String, f64)>,
    /// Processor seconds of the fastest estimator without noise.
    pub exact: Option<f64>,
}

impl Verdict {
    /// One for each scene that has lines with noise, in addition to points. Estimators that are not
    /// linelit's are neither.
    #[must_use]
    pub fn all(record: &StudyRecord) -> Vec<Self> {
        let scenes = record.scenes.iter();
        scenes.filter_map(|s| Self::of(record, &s.scene)).collect()
    }

    /// At the most lines, up to [`LINES`], whose error points reach; else at the most lines.
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

    fn at(record: &StudyRecord, scene: &str, samples: u32) -> Option<Self> {
        let rows = || record.rows.iter().filter(|row| row.scene == scene);
        let is_noisy = |row: &&ResultRow| !row.is_noiseless() && row.mse > 0.0;
        let is_lines = |row: &&ResultRow| row.family() == Some(Family::Lines);
        let lines = rows().filter(is_lines).filter(is_noisy);
        let timed = lines.filter(|row| row.samples == samples && row.cpu_seconds > 0.0);
        let best = timed.min_by(|a, b| a.cost().total_cmp(&b.cost()))?;
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

    /// The names of [`Verdict::cells`].
    pub const COLUMNS: &'static str =
        "scene,lines,RMSE,their time,best points,time to that RMSE,ratio,no noise in";

    /// The verdict in words and numbers.
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

    /// A table of all of them, and a sentence.
    pub(super) fn table(all: &[Self]) -> Table {
        let rows = all.iter().map(|v| v.cells().map(Cell::text).to_vec());
        let caption = "What the best points take to reach the error of the best lines. A ratio above one \
             says that lines are faster; below one, that points are.";
        Table::new(caption, Self::COLUMNS.split(','), rows)
    }
}

//! The tables of a study as data: `results.csv`, `slopes.csv`, `results.json`.
//!
//! Numbers are written so that reading them gives the same bits (the shortest such decimals); what
//! is not a number is an empty field in CSV and `null` in JSON.
#![allow(clippy::disallowed_methods, reason = "what tables say of the machine")]

use std::collections::BTreeMap;
use std::sync::OnceLock;

use crate::stats::slopes::Order;
use linelit_estimators::Estimator;
use linelit_film::FilmError;
use serde::Serialize;
use serde_json::Value;

/// The columns of `results.csv`, in order.
pub const RESULT_COLUMNS: &str = "scene,pixels,estimator,sampler,samples,trials,mse,mse_stderr,mrse,\
    variance,bias,bias_stderr,cpu_seconds,cpu_error,wall_seconds,rays,line_queries,node_tests,triangle_tests,\
    intervals,processor";

/// The columns of `slopes.csv`, in order.
pub const SLOPE_COLUMNS: &str =
    "scene,estimator,sampler,n_min,n_max,order,ci_low,ci_high,paper_order";

/// The measurement of one estimator with one sampler and number of samples on one scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ResultRow {
    /// The short name of the scene.
    pub scene: String,
    /// The pixels that were measured: `32x32`, or `x,y;x,y`.
    pub pixels: String,
    /// The estimator with its options, as on the command line.
    pub estimator: String,
    /// The sampler, as on the command line.
    pub sampler: String,
    /// The number of light samples of a shading point.
    pub samples: u32,
    /// The number of independent trials.
    pub trials: u32,
    /// The mean squared error of one estimate less the error of the reference, in linear radiance
    /// squared; 0 where that is negative.
    pub mse: f64,
    /// The standard error of `mse`, from the spread over the trials and the error of the reference.
    pub mse_stderr: f64,
    /// The mean relative squared error less the error of the reference, with ε = 1e-6; 0 where that
    /// is negative.
    pub mrse: f64,
    /// The mean squared distance of one estimate from the mean of its trials, which needs no
    /// reference; zero where it is only rounding, that is, where the estimator has no noise.
    pub variance: f64,
    /// The mean error.
    pub bias: f64,
    /// The standard error of `bias`, from the spread over the trials, the error of the reference,
    /// and rounding.
    pub bias_stderr: f64,
    /// The processor seconds of one trial, without set-up.
    pub cpu_seconds: f64,
    /// The standard deviation of the time over passes of 10 ms or more; `cpu_seconds` is their
    /// mean.
    pub cpu_error: f64,
    /// The wall seconds of one trial, without set-up.
    pub wall_seconds: f64,
    /// The number of rays of all trials.
    pub rays: u64,
    /// The number of line queries of all trials.
    pub line_queries: u64,
    /// The number of tests against nodes of the hierarchy, of all trials.
    pub node_tests: u64,
    /// The number of tests against triangles, of all trials.
    pub triangle_tests: u64,
    /// The number of visible intervals that all trials found.
    pub intervals: u64,
    /// The processor on which the times were taken. It is `several`, and times are missing, where
    /// no single one ran the whole measurement.
    pub processor: String,
}

/// The two kinds of estimators that a study compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// Estimators that draw only points.
    Points,
    /// All other estimators of linelit: lines and closed forms, possibly combined with points.
    Lines,
}

impl ResultRow {
    /// Returns whether the trials of this row differ only by rounding, so that any remaining error
    /// is the reference's, or bias.
    #[must_use]
    pub fn is_noiseless(&self) -> bool {
        self.trials > 1 && self.variance <= 0.0
    }

    /// Returns whether all techniques of the estimator draw points. Estimators that are not
    /// linelit's never count, whatever their names begin with.
    pub(crate) fn is_points(&self) -> bool {
        self.family() == Some(Family::Points)
    }

    /// Returns the kind of the estimator; `None` if it is not linelit's.
    pub(crate) fn family(&self) -> Option<Family> {
        let estimator: Estimator = self.estimator.parse().ok()?;
        let mut names = estimator.parts().iter().map(|part| part.technique.name());
        match names.all(|name| name.starts_with("point-")) {
            true => Some(Family::Points),
            false => Some(Family::Lines),
        }
    }

    /// Returns whether the error is known, that is, positive and at least its standard error. A
    /// smaller error says more about the reference than about the estimator: without the correction
    /// for the reference's error, no mean of squares is below its standard error.
    pub(crate) fn is_known(&self) -> bool {
        self.mse > 0.0 && !(self.mse < self.mse_stderr)
    }

    /// Returns the mean squared error times the processor time, the inverse of efficiency.
    pub(crate) fn cost(&self) -> f64 {
        self.mse * self.cpu_seconds
    }

    /// Returns the row that efficiencies on a scene, 1/cost, are relative to: the most efficient
    /// points with noise, or the most efficient of all estimators with noise where no points were
    /// measured.
    pub(crate) fn unit_of_efficiency<'a>(rows: &'a [Self], scene: &str) -> Option<&'a Self> {
        let noisy = |r: &&Self| r.scene == scene && !r.is_noiseless() && r.is_known();
        let timed = rows.iter().filter(noisy).filter(|r| r.cpu_seconds > 0.0);
        timed.min_by(|a, b| {
            let points_first = b.is_points().cmp(&a.is_points());
            points_first.then(a.cost().total_cmp(&b.cost()))
        })
    }
}

/// The order of convergence of one estimator with one sampler on one scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SlopeRow {
    /// The short name of the scene.
    pub scene: String,
    /// The estimator with its options.
    pub estimator: String,
    /// The sampler.
    pub sampler: String,
    /// The order of the standard deviation with its 95 % interval, and the range of samples that it
    /// was fitted to.
    #[serde(flatten)]
    pub fit: Order,
    /// The order that a paper reports.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper_order: Option<f64>,
    /// The figure or table of the paper that reports `paper_order` (JSON only).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper_source: Option<String>,
}

/// The size, set-up times and reference of a scene of the study.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SceneRecord {
    /// The short name.
    pub scene: String,
    /// The number of triangles; zero for a problem that is not a scene.
    pub triangles: usize,
    /// The number of pixels of the study.
    pub pixels: usize,
    /// The number of pixels whose ray meets a surface to shade.
    pub shading_points: usize,
    /// The seconds to read the file.
    pub load_seconds: f64,
    /// The seconds to build the hierarchy and the plan.
    pub build_seconds: f64,
    /// The bytes of the hierarchy.
    pub hierarchy_bytes: usize,
    /// The mean over pixels and channels of the square of the reference.
    pub power: f64,
    /// The mean squared error of the reference itself.
    pub reference_mse: f64,
    /// The estimator and samples of the reference.
    pub reference: String,
}

/// One picture of a gallery: its cost and its error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GalleryRow {
    /// The short name of the scene.
    pub scene: String,
    /// The estimator.
    pub estimator: String,
    /// The number of samples at each shading point and light.
    pub samples: u32,
    /// The processor seconds of the picture.
    pub cpu_seconds: f64,
    /// The mean relative squared error less the error of the reference; 0 where that is negative.
    pub mrse: f64,
}

/// A measurement that was left out because the time budget was spent, or the study was interrupted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftOutRow {
    /// The short name of the scene.
    pub scene: String,
    /// The estimator with its options.
    pub estimator: String,
    /// The sampler.
    pub sampler: String,
    /// The number of light samples of a shading point.
    pub samples: u32,
}

/// A whole study: the contents of `results.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StudyRecord {
    /// The title.
    pub title: String,
    /// The command that repeats the study.
    pub command: String,
    /// The version of linelit.
    pub version: String,
    /// The commit of the sources, if known.
    pub commit: String,
    /// The processor, or all processors that took measurements.
    pub cpu: String,
    /// The number of threads that were used.
    pub threads: usize,
    /// The first seed.
    pub seed: u64,
    /// The wall seconds of the whole study.
    pub seconds: f64,
    /// All other settings.
    pub settings: BTreeMap<String, String>,
    /// The scenes, in order.
    pub scenes: Vec<SceneRecord>,
    /// The measurements.
    pub rows: Vec<ResultRow>,
    /// Whether the study was interrupted and can be continued; `left_out` lists what it had not
    /// measured by then.
    pub unfinished: bool,
    /// The measurements that were left out.
    pub left_out: Vec<LeftOutRow>,
    /// The orders of convergence.
    pub slopes: Vec<SlopeRow>,
    /// The pictures by several estimators.
    pub gallery: Vec<GalleryRow>,
}

impl StudyRecord {
    /// Returns the files `results.csv`, `slopes.csv` and `results.json`: names and texts.
    ///
    /// # Errors
    /// As [`StudyRecord::to_json`].
    pub fn tables(&self) -> Result<[(&'static str, String); 3], FilmError> {
        Ok([
            ("results.csv", csv(RESULT_COLUMNS, &self.rows)?),
            ("slopes.csv", csv(SLOPE_COLUMNS, &self.slopes)?),
            ("results.json", self.to_json()?),
        ])
    }

    /// Returns, for each scene of which measurements were left out, a sentence that lists them.
    #[must_use]
    pub fn left_out_sentences(&self) -> Vec<String> {
        let scenes = self.scenes.iter();
        scenes
            .filter_map(|scene| self.left_out_of(&scene.scene))
            .collect()
    }

    /// Returns the sentence that lists the measurements of a scene that were left out, if there are
    /// any.
    pub(crate) fn left_out_of(&self, scene: &str) -> Option<String> {
        // List the numbers of samples by estimator and sampler.
        let mut series: Vec<(String, String)> = Vec::new();
        for cell in self.left_out.iter().filter(|cell| cell.scene == scene) {
            let name = format!("{} ({}) with ", cell.estimator, cell.sampler);
            match series.iter_mut().find(|(known, _)| *known == name) {
                Some((_, list)) => *list += &format!(", {}", cell.samples),
                None => series.push((name, cell.samples.to_string())),
            }
        }
        // Count all measurements of the scene.
        let of = |name: &str| name == scene;
        let left_out = self.left_out.iter().filter(|cell| of(&cell.scene)).count();
        let all = left_out + self.rows.iter().filter(|row| of(&row.scene)).count();
        let list: Vec<String> = (series.into_iter())
            .map(|(name, samples)| format!("{name}{samples} samples"))
            .collect();
        let why = if self.unfinished {
            "The study is unfinished: it was interrupted"
        } else {
            "The time budget was spent"
        };
        (left_out > 0).then(|| {
            format!(
                "{why} before {left_out} of {all} measurements on {scene}, which are left out: {}.",
                list.join("; ")
            )
        })
    }

    /// Returns the text of `results.json`.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] if serialization fails, which it does for no content of these fields.
    pub fn to_json(&self) -> Result<String, FilmError> {
        let mut text = serde_json::to_string_pretty(self).map_err(invalid)?;
        text.push('\n');
        Ok(text)
    }
}

/// Writes some columns of rows as CSV.
fn csv<T: Serialize>(columns: &str, rows: &[T]) -> Result<String, FilmError> {
    let mut text = columns.to_owned() + "\n";
    for row in rows {
        let row = serde_json::to_value(row).map_err(invalid)?;
        let fields: Vec<String> = columns.split(',').map(|c| field(&row[c])).collect();
        text += &(fields.join(",") + "\n");
    }
    Ok(text)
}

/// Writes a CSV field after RFC 4180, in quotes where necessary. A real number is the shortest
/// decimal that reads back as the same number.
fn field(value: &Value) -> String {
    match value {
        Value::String(text) if text.contains([',', '"', '\n', '\r']) => {
            format!("\"{}\"", text.replace('"', "\"\""))
        }
        Value::String(text) => text.clone(),
        Value::Number(n) => match n.as_f64().filter(|_| n.is_f64()) {
            Some(v) if v.abs() <= 0.0 || (1e-4..1e9).contains(&v.abs()) => format!("{v}"),
            Some(v) => format!("{v:e}"),
            None => n.to_string(),
        },
        // Infinities and NaN are null in JSON.
        _ => String::new(),
    }
}

/// Returns the error of a failed serialization.
fn invalid(error: serde_json::Error) -> FilmError {
    FilmError::Invalid(error.to_string())
}

/// Returns the processor's name where the system reports it (Linux), with the number of logical
/// cores.
#[must_use]
pub fn cpu_name() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text
        .lines()
        .find_map(|line| {
            line.strip_prefix("model name")?
                .split_once(':')
                .map(|(_, name)| name.trim())
        })
        .unwrap_or(std::env::consts::ARCH);
    format!("{name} ({cores} logical cores)")
}

/// The commit that [`set_commit`] stored.
static COMMIT: OnceLock<&str> = OnceLock::new();

/// Stores the commit that the program was built from, for the whole process. A program calls this
/// at its start; only the first call has an effect.
pub fn set_commit(commit: &'static str) {
    COMMIT.get_or_init(|| commit);
}

/// Returns the commit stored by [`set_commit`], for reports; `unknown` if there is none.
#[must_use]
pub fn commit() -> String {
    (*COMMIT.get().unwrap_or(&"unknown")).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row() -> ResultRow {
        ResultRow {
            scene: "grid".to_owned(),
            pixels: "32x32".to_owned(),
            estimator: "line-area[orientation=fixed:0.25,offset=length]".to_owned(),
            sampler: "sobol".to_owned(),
            samples: 16,
            trials: 8,
            mse: 1.25e-7,
            bias_stderr: f64::NAN,
            cpu_seconds: 0.1 + 0.2,
            cpu_error: 0.01,
            rays: u64::MAX,
            ..ResultRow::default()
        }
    }

    #[test]
    fn the_columns_are_the_contract() {
        let text = csv(RESULT_COLUMNS, &[row()]).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "scene,pixels,estimator,sampler,samples,trials,mse,mse_stderr,mrse,variance,bias,bias_stderr,\
             cpu_seconds,cpu_error,wall_seconds,rays,line_queries,node_tests,triangle_tests,\
             intervals,processor"
        );
        assert_eq!(
            lines[1],
            "grid,32x32,\"line-area[orientation=fixed:0.25,offset=length]\",sobol,16,8,1.25e-7,0,0,0,0,,\
             0.30000000000000004,0.01,0,18446744073709551615,0,0,0,0,"
        );
        let slope = SlopeRow {
            scene: "a\"b".to_owned(),
            fit: Order {
                n_min: 4.0,
                order: -1.5,
                ..Order::default()
            },
            ..SlopeRow::default()
        };
        assert_eq!(
            csv(SLOPE_COLUMNS, &[slope]).unwrap(),
            "scene,estimator,sampler,n_min,n_max,order,ci_low,ci_high,paper_order\n\"a\"\"b\",,,4,0,-1.5,0,0,\n"
        );
    }

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        for value in [
            0.1,
            1e-300,
            -3.5e12,
            123_456.789,
            f64::MIN_POSITIVE,
            1.0 / 3.0,
            -0.0,
        ] {
            assert_eq!(
                field(&value.into()).parse::<f64>().unwrap().to_bits(),
                value.to_bits()
            );
        }
        assert_eq!(field(&serde_json::json!(f64::INFINITY)), "");
    }

    #[test]
    fn json_holds_all_of_it() {
        let record = StudyRecord {
            seed: 7,
            rows: vec![row()],
            slopes: vec![SlopeRow {
                paper_order: Some(-1.15),
                paper_source: Some("Fig. 9".to_owned()),
                ..SlopeRow::default()
            }],
            ..StudyRecord::default()
        };
        let value: Value = serde_json::from_str(&record.to_json().unwrap()).unwrap();
        assert_eq!(value["seed"], 7);
        assert_eq!(value["rows"][0]["rays"], u64::MAX);
        assert!(value["rows"][0]["bias_stderr"].is_null());
        assert_eq!(value["slopes"][0]["paper_source"], "Fig. 9");
        for column in RESULT_COLUMNS.split(',') {
            assert!(value["rows"][0].get(column).is_some(), "{column}");
        }
        for column in SLOPE_COLUMNS.split(',') {
            assert!(value["slopes"][0].get(column).is_some(), "{column}");
        }
    }
}

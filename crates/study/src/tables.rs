//! What a study found, as data: `results.csv`, `slopes.csv`, `results.json`.
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

/// One estimator with one sampler and number of samples on one scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ResultRow {
    /// Short name of the scene.
    pub scene: String,
    /// The pixels that were measured: `32x32`, or `x,y;x,y`.
    pub pixels: String,
    /// The estimator with its options, as on the command line.
    pub estimator: String,
    /// The sampler, as on the command line.
    pub sampler: String,
    /// Light samples of a shading point.
    pub samples: u32,
    /// Independent trials.
    pub trials: u32,
    /// Mean squared error of one estimate less the reference's own, linear radiance squared; 0
    /// where that is negative.
    pub mse: f64,
    /// The standard error of `mse`, over the trials and by the reference's own.
    pub mse_stderr: f64,
    /// Mean relative squared error less the reference's own, ε = 1e-6; 0 where that is negative.
    pub mrse: f64,
    /// Mean squared distance of one estimate from the mean of its trials, which needs no reference;
    /// zero where it is rounding alone: the estimator has no noise.
    pub variance: f64,
    /// Mean error.
    pub bias: f64,
    /// The standard error of `bias`, over the trials, by the reference's own and by rounding.
    pub bias_stderr: f64,
    /// Processor seconds of one trial, without set-up.
    pub cpu_seconds: f64,
    /// The standard deviation of `cpu_seconds` over passes of 10 ms or more, whose mean it is.
    pub cpu_error: f64,
    /// Wall seconds of one trial, without set-up.
    pub wall_seconds: f64,
    /// Rays of all trials.
    pub rays: u64,
    /// Line queries of all trials.
    pub line_queries: u64,
    /// Tests against nodes of the hierarchy.
    pub node_tests: u64,
    /// Tests against triangles.
    pub triangle_tests: u64,
    /// Visible intervals.
    pub intervals: u64,
    /// The processor that the times were taken on; `several`, and no times, where no single one ran
    /// all of it.
    pub processor: String,
}

/// The two kinds of estimators that a study compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// Points alone.
    Points,
    /// Lines and closed forms, whatever else they draw.
    Lines,
}

impl ResultRow {
    /// Whether trials differ by rounding alone: the remaining error is the reference's, or
    /// bias.
    #[must_use]
    pub fn is_noiseless(&self) -> bool {
        self.trials > 1 && self.variance <= 0.0
    }

    /// Whether it is of point samples: all techniques of its estimator draw points. Estimators that
    /// are not linelit's are none, whatever their names begin with.
    pub(crate) fn is_points(&self) -> bool {
        self.family() == Some(Family::Points)
    }

    /// What its estimator does; `None` of one that is not linelit's.
    pub(crate) fn family(&self) -> Option<Family> {
        let estimator: Estimator = self.estimator.parse().ok()?;
        let mut names = estimator.parts().iter().map(|part| part.technique.name());
        match names.all(|name| name.starts_with("point-")) {
            true => Some(Family::Points),
            false => Some(Family::Lines),
        }
    }

    /// Whether the error is known: before the reference's own is taken off, no mean of squares is
    /// below its standard error; what is says more of the reference.
    pub(crate) fn is_known(&self) -> bool {
        self.mse > 0.0 && !(self.mse < self.mse_stderr)
    }

    /// Mean squared error times processor time, of which efficiency is the inverse.
    pub(crate) fn cost(&self) -> f64 {
        self.mse * self.cpu_seconds
    }

    /// The row that efficiencies on a scene, 1/cost, are relative to: the most efficient points
    /// with noise, or what else is most efficient where no points were measured.
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
    /// Short name of the scene.
    pub scene: String,
    /// The estimator with its options.
    pub estimator: String,
    /// The sampler.
    pub sampler: String,
    /// The order of the standard deviation with its 95 % interval, and the samples that it is of.
    #[serde(flatten)]
    pub fit: Order,
    /// The order that a paper reports.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper_order: Option<f64>,
    /// Figure or table of that paper (JSON only).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper_source: Option<String>,
}

/// Size, set-up times and reference of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SceneRecord {
    /// Short name.
    pub scene: String,
    /// Triangles.
    pub triangles: usize,
    /// Pixels of the study.
    pub pixels: usize,
    /// Pixels whose ray meets something to shade.
    pub shading_points: usize,
    /// Seconds to read the file.
    pub load_seconds: f64,
    /// Seconds to build the hierarchy and the plan.
    pub build_seconds: f64,
    /// Bytes of the hierarchy.
    pub hierarchy_bytes: usize,
    /// Mean over pixels and channels of the reference's square.
    pub power: f64,
    /// Mean squared error of the reference itself.
    pub reference_mse: f64,
    /// Estimator and samples of the reference.
    pub reference: String,
}

/// One picture of a gallery: what it cost, and how wrong it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GalleryRow {
    /// Short name of the scene.
    pub scene: String,
    /// The estimator.
    pub estimator: String,
    /// Samples at each shading point and light.
    pub samples: u32,
    /// Processor seconds of the picture.
    pub cpu_seconds: f64,
    /// Mean relative squared error less the reference's own; 0 where that is negative.
    pub mrse: f64,
}

/// A measurement that was left out because the time budget was spent.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftOutRow {
    /// Short name of the scene.
    pub scene: String,
    /// The estimator with its options.
    pub estimator: String,
    /// The sampler.
    pub sampler: String,
    /// Light samples of a shading point.
    pub samples: u32,
}

/// A whole study: what `results.json` holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StudyRecord {
    /// Title.
    pub title: String,
    /// The command that repeats it.
    pub command: String,
    /// Version of linelit.
    pub version: String,
    /// Commit of the sources, if known.
    pub commit: String,
    /// The processor, or those that measured, where there are several.
    pub cpu: String,
    /// Threads that were used.
    pub threads: usize,
    /// First seed.
    pub seed: u64,
    /// Wall seconds of the whole study.
    pub seconds: f64,
    /// Everything else that was set.
    pub settings: BTreeMap<String, String>,
    /// The scenes, in order.
    pub scenes: Vec<SceneRecord>,
    /// The rows of errors.
    pub rows: Vec<ResultRow>,
    /// Whether the study was interrupted, and may be gone on with: what it had not measured by then
    /// is in `left_out`.
    pub unfinished: bool,
    /// Measurements that the time budget left out.
    pub left_out: Vec<LeftOutRow>,
    /// The rows of orders of convergence.
    pub slopes: Vec<SlopeRow>,
    /// Pictures by several estimators.
    pub gallery: Vec<GalleryRow>,
}

impl StudyRecord {
    /// The files `results.csv`, `slopes.csv` and `results.json`: names and texts.
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

    /// A sentence for each scene of which measurements were left out.
    #[must_use]
    pub fn left_out_sentences(&self) -> Vec<String> {
        let scenes = self.scenes.iter();
        scenes
            .filter_map(|scene| self.left_out_of(&scene.scene))
            .collect()
    }

    /// The measurements of a scene that were left out, in a sentence.
    pub(crate) fn left_out_of(&self, scene: &str) -> Option<String> {
        let mut series: Vec<(String, String)> = Vec::new();
        for cell in self.left_out.iter().filter(|cell| cell.scene == scene) {
            let name = format!("{} ({}) with ", cell.estimator, cell.sampler);
            match series.iter_mut().find(|(known, _)| *known == name) {
                Some((_, list)) => *list += &format!(", {}", cell.samples),
                None => series.push((name, cell.samples.to_string())),
            }
        }
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

    /// The text of `results.json`.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] if serialisation fails, which no content of these fields makes it.
    pub fn to_json(&self) -> Result<String, FilmError> {
        let mut text = serde_json::to_string_pretty(self).map_err(invalid)?;
        text.push('\n');
        Ok(text)
    }
}

/// Some columns of rows, as CSV.
fn csv<T: Serialize>(columns: &str, rows: &[T]) -> Result<String, FilmError> {
    let mut text = columns.to_owned() + "\n";
    for row in rows {
        let row = serde_json::to_value(row).map_err(invalid)?;
        let fields: Vec<String> = columns.split(',').map(|c| field(&row[c])).collect();
        text += &(fields.join(",") + "\n");
    }
    Ok(text)
}

/// A CSV field after RFC 4180, in quotes where it needs them; a real number as the shortest decimal
/// that reads back as the same.
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
        // What is no number is null.
        _ => String::new(),
    }
}

fn invalid(error: serde_json::Error) -> FilmError {
    FilmError::Invalid(error.to_string())
}

/// The processor's name where the system tells it (Linux), with the number of logical cores.
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

static COMMIT: OnceLock<&str> = OnceLock::new();

/// A program says at its start which commit it was built from; what it says first stays. This is
/// for the whole process, as the program is.
pub fn set_commit(commit: &'static str) {
    COMMIT.get_or_init(|| commit);
}

/// Returns the commit set by [`set_commit`], for reports; `unknown` if none was.
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

//! The page of a convergence study, made from its record: for each scene the plots, the tables and
//! the pictures.

use std::collections::BTreeMap;

use super::{Cell, Comparison, Entry, Picture, Plot, Report, Section, Table, Verdict, scientific};
use crate::plots::{self, Palette, seconds, short, signed};
use crate::tables::{ResultRow, SceneRecord, SlopeRow, StudyRecord};
use linelit_elementary::pow;

/// The parts of a page that a record does not contain: pictures, and words about estimators.
#[derive(Clone, Debug, Default)]
pub struct Exhibits {
    /// Pictures, by the scenes' short names.
    pub pictures: BTreeMap<String, Vec<Picture>>,
    /// Two pictures under a slider, by the scenes' short names.
    pub comparisons: BTreeMap<String, Comparison>,
    /// The estimators in words.
    pub compared: Vec<Entry>,
}

impl Report {
    /// Creates the page of a convergence study.
    #[must_use]
    pub fn of_study(record: &StudyRecord, mut exhibits: Exhibits) -> Self {
        // Compare times on the processor with the most rows.
        let palette = palette(record);
        let processors = record.processors();
        let first = processors.first().copied().unwrap_or_default();
        let timed = &record.timed_on(first);
        // A section for each scene.
        let mut sections: Vec<Section> = timed
            .scenes
            .iter()
            .map(|scene| Section {
                pictures: exhibits.pictures.remove(&scene.scene).unwrap_or_default(),
                comparison: exhibits.comparisons.remove(&scene.scene),
                ..section(timed, scene, &palette)
            })
            .collect();
        // The verdicts come first, the times on other processors last.
        let verdicts = Verdict::all(timed);
        let first = (!verdicts.is_empty()).then(|| Section {
            title: "In short".to_owned(),
            tables: vec![Verdict::table(&verdicts)],
            ..Section::default()
        });
        for other in processors.iter().skip(1) {
            sections.extend(times_on(record, other, &palette));
        }
        // The summary lists what is missing, and tests for biases.
        let unfinished = ["", " (unfinished)"][usize::from(record.unfinished)];
        let mut summary = record.left_out_sentences();
        summary.extend(bias(timed));
        Self {
            title: format!("{}{unfinished}", record.title),
            summary,
            first,
            compared: exhibits.compared,
            sections,
            facts: facts(record),
            command: record.command.clone(),
        }
    }
}

/// Returns the colours of a study's estimators.
fn palette(record: &StudyRecord) -> Palette {
    Palette::new(record.rows.iter().map(|row| row.estimator.as_str()))
}

/// Returns the section of times that were measured on a processor other than the study's main one;
/// `None` if it took no times.
fn times_on(record: &StudyRecord, processor: &str, palette: &Palette) -> Option<Section> {
    // Keep the rows and scenes of that processor.
    let mut own = record.timed_on(processor);
    own.rows.retain(|row| row.processor == processor);
    own.rows.iter().find(|row| row.cpu_seconds > 0.0)?;
    let is_timed = |scene: &SceneRecord| own.rows.iter().any(|row| row.scene == scene.scene);
    own.scenes.retain(is_timed);
    let plot = |scene: &SceneRecord| {
        let mut all = scene_plots(&own, &scene.scene, palette).into_iter();
        all.find(|(kind, _)| *kind == "time").map(|(_, plot)| plot)
    };
    let table = |scene: &SceneRecord| all_rows(&own, scene);
    Some(Section {
        title: format!("Times on {processor}"),
        lead: format!(
            "{} of {} measurements were timed there, and are not compared with the others in time.",
            own.rows.len(),
            record.rows.len()
        ),
        plots: own.scenes.iter().filter_map(plot).collect(),
        tables: own.scenes.iter().map(table).collect(),
        ..Section::default()
    })
}

/// Returns the SVG plots of a study, each with the name of its file: `SCENE-samples.svg`,
/// `SCENE-time.svg`, `SCENE-efficiency.svg`. Times are taken from the processor that ran the most
/// measurements.
#[must_use]
pub fn plot_files(record: &StudyRecord) -> Vec<(String, String)> {
    let first = record.processors().first().copied().unwrap_or_default();
    let (palette, record) = (palette(record), record.timed_on(first));
    let mut files = Vec::new();
    for scene in &record.scenes {
        let name = &scene.scene;
        for (kind, plot) in scene_plots(&record, name, &palette) {
            files.push((format!("{}-{kind}.svg", file_name(name)), plot.svg));
        }
    }
    files
}

/// Replaces the characters of a name that file systems may refuse.
fn file_name(name: &str) -> String {
    name.replace(|c: char| !(c.is_alphanumeric() || "-_.".contains(c)), "-")
}

/// Returns the three plots of a scene with the names of their kinds.
fn scene_plots(record: &StudyRecord, scene: &str, palette: &Palette) -> [(&'static str, Plot); 3] {
    let rows = &record.rows;
    let plot = |svg: String, caption: &str| Plot {
        svg,
        caption: caption.to_owned(),
    };
    // Plot the error over the samples, then over the time.
    let samples = plot(
        plots::error_over_samples(scene, rows, palette).render(),
        "Error over samples. Dashed: the orders −0.5, −1 and −1.5 from the worst estimator's first \
         point. Bars: one standard error over the trials. Open marks on the lower edge: no noise.",
    );
    let time = plot(
        plots::error_over_time(scene, rows, palette).render(),
        "Equal time: the same errors over the processor time that they cost. What is lower at the \
         same place is better; open marks have no noise from that time on. Bars along the axis: one \
         standard deviation over passes.",
    );
    // Plot the efficiency over the samples.
    let efficiency = plot(
        plots::efficiency_over_samples(scene, rows, palette).render(),
        &(efficiency_words(rows, scene) + " Open marks on the upper edge: no noise."),
    );
    [
        ("samples", samples),
        ("time", time),
        ("efficiency", efficiency),
    ]
}

/// Returns the sentence that says what the efficiencies on a scene are relative to.
fn efficiency_words(rows: &[ResultRow], scene: &str) -> String {
    let Some(unit) = ResultRow::unit_of_efficiency(rows, scene) else {
        return String::new();
    };
    let kind = if unit.is_points() {
        "points"
    } else {
        "estimator"
    };
    let (estimator, sampler) = (&unit.estimator, &unit.sampler);
    format!(
        "Efficiency is 1/(MSE · time) over that of the scene's best {kind}, {estimator} ({sampler}) with \
         {} samples.",
        unit.samples
    )
}

/// Returns the measurements on a scene.
fn rows_of<'a>(record: &'a StudyRecord, scene: &SceneRecord) -> Vec<&'a ResultRow> {
    let rows = record.rows.iter();
    rows.filter(|row| row.scene == scene.scene).collect()
}

/// Returns the section of a scene, without pictures.
fn section(record: &StudyRecord, scene: &SceneRecord, palette: &Palette) -> Section {
    let plots = scene_plots(record, &scene.scene, palette);
    Section {
        title: scene.scene.clone(),
        lead: lead(scene),
        plots: plots.into_iter().map(|(_, plot)| plot).collect(),
        tables: [at_most_samples, orders, all_rows]
            .map(|of| of(record, scene))
            .into(),
        notes: notes(record, scene),
        ..Section::default()
    }
}

/// Returns the sentence on the size and set-up times of a scene.
fn lead(scene: &SceneRecord) -> String {
    // The problem is not a scene.
    if scene.triangles == 0 {
        return String::new();
    }
    format!(
        "{} triangles, {} of {} pixels with something to shade; read in {}, built in {}.",
        grouped(scene.triangles),
        grouped(scene.shading_points),
        grouped(scene.pixels),
        seconds(scene.load_seconds.max(1e-9)),
        seconds(scene.build_seconds.max(1e-9)),
    )
}

/// Formats a whole number with thin spaces between thousands.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// Returns the table of all estimators and samplers at the largest number of samples. An estimator
/// without noise by any sampler has one row for all samplers.
fn at_most_samples(record: &StudyRecord, scene: &SceneRecord) -> Table {
    let rows = rows_of(record, scene);
    let most = rows.iter().map(|row| row.samples).max().unwrap_or(0);
    let last = || rows.iter().copied().filter(|row| row.samples == most);
    // Find the best value of each column, the unit of efficiency, and the error that is to be
    // reached.
    let smallest = COMPARED.map(|value| {
        let noisy = last().filter(|row| !row.is_noiseless());
        let positive = noisy.map(value).filter(|v| *v > 0.0);
        positive.reduce(f64::min).unwrap_or(f64::NAN)
    });
    let unit = ResultRow::unit_of_efficiency(&record.rows, &scene.scene);
    let unit = unit.map_or(f64::NAN, ResultRow::cost);
    let target = PERCENT * scene.power.sqrt();
    // A row for each estimator and sampler.
    let mut body: Vec<Vec<Cell>> = Vec::new();
    for row in last() {
        let own: Vec<&ResultRow> = last().filter(|r| r.estimator == row.estimator).collect();
        let alike = own.iter().all(|r| r.is_noiseless());
        if alike && own[0].sampler != row.sampler {
            continue;
        }
        let any = alike && own.len() > 1;
        let sampler = if any { "any" } else { &row.sampler };
        let reached = match record.time_to(row, target) {
            Some(time) => Cell::number(seconds(time)).sorted_by(time),
            None => Cell::number("–").hover("not reached"),
        };
        let mut cells = vec![Cell::text(&row.estimator), Cell::text(sampler)];
        cells.extend(errors(row, smallest, unit));
        cells.push(reached);
        body.push(cells);
    }
    let columns = "estimator,sampler,RMSE,MRSE,time,efficiency,time to 1 %";
    let caption = format!(
        "With {most} samples; the best with noise of a column is marked. {} Time to 1 %: to an RMSE of \
         a hundredth of the root mean square, {}.",
        efficiency_words(&record.rows, &scene.scene),
        scientific(target)
    );
    Table::new(caption, columns.split(','), body)
}

/// The error for which the table reports the time to reach it: the root mean squared error, as a
/// fraction of the root mean square of the reference.
const PERCENT: f64 = 0.01;

/// The measures that are smaller for a better estimator: MSE, MRSE, and MSE · time.
const COMPARED: [fn(&ResultRow) -> f64; 3] = [|row| row.mse, |row| row.mrse, ResultRow::cost];

/// Returns the cells RMSE, MRSE, time and efficiency of a row, where efficiency is `unit` over the
/// row's cost. The least values of the table, `least`, are emphasized.
fn errors(row: &ResultRow, least: [f64; 3], unit: f64) -> [Cell; 4] {
    let [mse, mrse, cost] = COMPARED.map(|value| value(row));
    let spread = format!("MSE {} ± {}", scientific(mse), scientific(row.mse_stderr));
    if row.is_noiseless() {
        let none = Cell::number("no noise").sorted_by(0.0);
        let left = format!("what is left is rounding, or the reference's own error: {spread}");
        let efficiency = Cell::number("∞").sorted_by(f64::MAX);
        return [none.clone().hover(left), none, time(row), efficiency];
    }
    let best = |value: f64, least: f64| value > 0.0 && value <= least;
    let efficiency = match unit / cost {
        known if known.is_finite() => Cell::number(short(known)).sorted_by(known),
        _ => Cell::number("–"),
    };
    [
        Cell::scientific(mse.sqrt())
            .strong(best(mse, least[0]))
            .hover(spread),
        Cell::scientific(mrse).strong(best(mrse, least[1])),
        time(row),
        efficiency.strong(best(cost, least[2])),
    ]
}

/// Returns the table of a scene's orders of convergence.
fn orders(record: &StudyRecord, scene: &SceneRecord) -> Table {
    let own = record.slopes.iter().filter(|s| s.scene == scene.scene);
    let columns = "estimator,sampler,samples,order,95 %,last slope,lack of fit,paper";
    let caption = "Orders of the standard deviation. Lack of fit: χ² of the fit over its degrees of \
                   freedom. Last slope: between the last two numbers of samples ± standard error, \
                   where the curve bends, that is, lack of fit is above one and a slope between \
                   neighbours off the order by more than its 95 % interval (Bonferroni).";
    Table::new(caption, columns.split(','), own.map(|s| order(s).into()))
}

/// Returns a row of the table of orders.
fn order(s: &SlopeRow) -> [Cell; 8] {
    let dash = || "–".to_owned();
    let (fit, paper) = (s.fit, s.paper_order.map(|p| signed(p, 3)));
    let last = |[slope, error]: [f64; 2]| {
        Cell::number(format!("{} ± {error:.3}", signed(slope, 3))).sorted_by(slope)
    };
    let lack = Some(fit.lack_of_fit).filter(|lack| lack.is_finite());
    [
        Cell::text(&s.estimator),
        Cell::text(&s.sampler),
        Cell::number(format!("{} to {}", fit.n_min, fit.n_max)).sorted_by(fit.n_max),
        Cell::number(signed(fit.order, 3)),
        Cell::number(interval(s).unwrap_or_else(dash)),
        fit.last.map_or_else(|| Cell::number(""), last),
        Cell::number(lack.map_or_else(dash, short)).sorted_by(fit.lack_of_fit),
        Cell::number(paper.unwrap_or_else(dash)).hover(s.paper_source.clone().unwrap_or_default()),
    ]
}

/// Formats the interval of an order, if there is one.
fn interval(row: &SlopeRow) -> Option<String> {
    let ends = Some([row.fit.ci_low, row.fit.ci_high]).filter(|e| e.iter().all(|v| v.is_finite()));
    ends.map(|[low, high]| format!("[{}, {}]", signed(low, 3), signed(high, 3)))
}

/// Returns the cell of a time, or of a dash if it was not measured on the processor of the table.
fn time(row: &ResultRow) -> Cell {
    if row.cpu_seconds.is_nan() {
        return Cell::number("–").hover(format!("on {}", row.processor));
    }
    let text = Cell::number(seconds(row.cpu_seconds)).sorted_by(row.cpu_seconds);
    text.hover(format!("± {}", error_of_time(row)))
}

/// Formats the error of a time, or a dash where it is not known.
fn error_of_time(row: &ResultRow) -> String {
    if row.cpu_error > 0.0 {
        seconds(row.cpu_error)
    } else {
        "–".to_owned()
    }
}

/// Returns the folded table of all measurements on a scene.
fn all_rows(record: &StudyRecord, scene: &SceneRecord) -> Table {
    let rows = rows_of(record, scene);
    // Make a row of each measurement: what was measured, its errors and its bias, and what it cost.
    let body = rows.iter().map(|row| {
        let test = row.bias_test();
        vec![
            Cell::text(&row.estimator),
            Cell::text(&row.sampler),
            Cell::number(row.samples.to_string()),
            Cell::scientific(row.mse),
            Cell::scientific(row.mse_stderr),
            Cell::scientific(row.mrse),
            Cell::scientific(row.variance),
            Cell::scientific(row.bias),
            Cell::number(test.map_or("–".to_owned(), |[z, _]| signed(z, 1)))
                .hover(test.map_or(String::new(), |[_, p]| format!("p = {}", scientific(p)))),
            time(row),
            Cell::number(error_of_time(row)).sorted_by(row.cpu_error),
            Cell::scientific(row.rays as f64),
            Cell::scientific(row.line_queries as f64),
            Cell::scientific(row.node_tests as f64),
            Cell::scientific(row.triangle_tests as f64),
        ]
    });
    let columns = "estimator,sampler,samples,MSE,± (s.e.),MRSE,variance,bias,bias / s.e.,time,± (s.d.),rays,\
                   line queries,node tests,triangle tests";
    let caption = format!("All {} measurements", rows.len());
    Table {
        folded: true,
        ..Table::new(caption, columns.split(','), body)
    }
}

/// The least number of trials of a measurement whose bias is tested. Measurements with fewer trials
/// are not tested, as these say little about their own spread.
const LEAST_TRIALS: u32 = 8;

/// Returns a sentence on the least likely of all biases of a study; `None` if no bias could be
/// tested.
fn bias(record: &StudyRecord) -> Option<String> {
    // Test each measurement with enough trials.
    let rows = record.rows.iter().filter(|row| row.trials >= LEAST_TRIALS);
    let tests = rows.filter_map(|row| Some((row.bias_test()?, row)));
    let tests: Vec<([f64; 2], &ResultRow)> = tests.collect();
    let ([z, p], row) = tests.iter().min_by(|a, b| a.0[1].total_cmp(&b.0[1]))?;
    // Correct for the number of tests (Šidák): the smallest of `count` independent p values is this
    // small by chance that often.
    let count = tests.len();
    let chance = 1.0 - pow(1.0 - p, count as f64);
    Some(format!(
        "The least likely of {count} biases is {} standard errors with {} degrees of freedom, by {} \
         ({}), N = {}, on {}: estimators without bias have one as large in {}\u{a0}% of such studies \
         (Student's t, Šidák).",
        signed(*z, 1),
        row.trials - 1,
        row.estimator,
        row.sampler,
        row.samples,
        row.scene,
        short(100.0 * chance)
    ))
}

/// Returns remarks on a scene: which measurements were left out, and how good its reference is.
fn notes(record: &StudyRecord, scene: &SceneRecord) -> Vec<String> {
    let mut notes: Vec<String> = record.left_out_of(&scene.scene).into_iter().collect();
    if !scene.reference.is_empty() {
        let variances = rows_of(record, scene).into_iter().map(|row| row.variance);
        let smallest = variances.filter(|v| *v > 0.0).reduce(f64::min);
        let share = smallest.map_or(String::new(), |smallest| {
            let percent = short((100.0 * scene.reference_mse / smallest).max(0.01));
            format!(", {percent} % of the smallest variance scored, and taken off")
        });
        notes.push(format!(
            "Reference: {}; its own mean squared error is {}{share}.",
            scene.reference,
            scientific(scene.reference_mse)
        ));
    }
    notes
}

/// Returns the settings and circumstances of a study that are not empty.
fn facts(record: &StudyRecord) -> Vec<(String, String)> {
    let own = [
        ("version", record.version.clone()),
        ("commit", record.commit.clone()),
        ("processor", record.cpu.clone()),
        ("threads", record.threads.to_string()),
        ("seed", record.seed.to_string()),
        ("run time", seconds(record.seconds.max(1e-9))),
    ];
    let own = own.map(|(name, value)| (name.to_owned(), value));
    let mut facts: Vec<_> = own.into_iter().chain(record.settings.clone()).collect();
    facts.retain(|(_, value)| !value.is_empty());
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_likely_bias_is_named() {
        let row = |bias| ResultRow {
            trials: 8,
            bias,
            bias_stderr: 2e-4,
            ..ResultRow::default()
        };
        let record = |biases: [f64; 2]| StudyRecord {
            rows: biases.map(row).into(),
            ..StudyRecord::default()
        };
        // p = .632 for t = .5 with 7 degrees of freedom, and 1 − (1 − p)² = .865.
        let text = bias(&record([1e-4, 0.0])).unwrap();
        assert!(
            text.contains("of 2 biases is 0.5 standard errors"),
            "{text}"
        );
        assert!(text.contains("in 86.5\u{a0}% of"), "{text}");
        let text = bias(&record([1e-4, -0.1])).unwrap();
        assert!(text.contains("is −500.0 standard errors"), "{text}");
    }

    #[test]
    fn names_and_numbers_are_for_people() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(grouped(100), "100");
        assert_eq!(file_name("a/b c:ü.x"), "a-b-c-ü.x");
        let mut slope = SlopeRow::default();
        assert_eq!(order(&slope)[5].text, "");
        slope.fit.last = Some([-1.31, 0.02]);
        assert_eq!(order(&slope)[5].text, "−1.310 ± 0.020");
    }

    #[test]
    fn an_empty_study_is_a_page_too() {
        let html = Report::of_study(&StudyRecord::default(), Exhibits::default()).render();
        assert!(html.contains("How it was made"));
    }
}

//! From a convergence study to its page.

use std::collections::BTreeMap;

use super::summary::{bias, bias_test, curve, reference_share, time_to};
use super::{Cell, Comparison, Entry, Picture, Plot, Report, Section, Table, scientific};
use crate::plots::{self, Palette, interval, seconds, short, signed};
use crate::tables::{ResultRow, SceneRecord, SlopeRow, StudyRecord};

/// What a page shows beside the numbers of its record.
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
    /// The page of a convergence study.
    #[must_use]
    pub fn of_study(record: &StudyRecord, mut exhibits: Exhibits) -> Self {
        let palette = Palette::new(record.rows.iter().map(|row| row.estimator.as_str()));
        let processors = record.processors();
        let first = processors.first().copied().unwrap_or_default();
        let timed = &record.timed_on(first);
        let mut sections: Vec<Section> = timed
            .scenes
            .iter()
            .map(|scene| Section {
                pictures: exhibits.pictures.remove(&scene.scene).unwrap_or_default(),
                comparison: exhibits.comparisons.remove(&scene.scene),
                ..section(timed, scene, &palette)
            })
            .collect();
        for other in processors.iter().skip(1) {
            sections.extend(times_on(record, other, &palette));
        }
        let unfinished = if record.unfinished {
            " (unfinished)"
        } else {
            ""
        };
        Self {
            title: format!("{}{unfinished}", record.title),
            summary: record
                .left_out_sentences()
                .into_iter()
                .chain(bias(timed))
                .collect(),
            compared: exhibits.compared,
            sections,
            facts: facts(record),
            command: record.command.clone(),
        }
    }
}

/// What was timed on a processor that is not the one of most measurements.
fn times_on(record: &StudyRecord, processor: &str, palette: &Palette) -> Option<Section> {
    let own: Vec<&ResultRow> = record
        .rows
        .iter()
        .filter(|row| row.processor == processor)
        .collect();
    let timed = own.iter().any(|row| row.cpu_seconds > 0.0);
    let record = record.timed_on(processor);
    let plots = record.scenes.iter().flat_map(|scene| {
        let plots = scene_plots(&record, &scene.scene, palette).into_iter();
        let there = own.iter().any(|row| row.scene == scene.scene);
        plots.filter_map(move |(kind, plot)| (there && kind == "time").then_some(plot))
    });
    let lead = format!(
        "{} of {} measurements were timed there, and are not compared with the others in time.",
        own.len(),
        record.rows.len()
    );
    Some(Section {
        title: format!("Times on {processor}"),
        lead,
        plots: plots.collect(),
        tables: record
            .scenes
            .iter()
            .map(|scene| {
                let rows = own.iter().copied().filter(|row| row.scene == scene.scene);
                all_rows(&rows.collect::<Vec<_>>(), scene)
            })
            .collect(),
        ..Section::default()
    })
    .filter(|_| timed)
}

/// The plots of a study by the names under which they are stored: `SCENE-samples.svg`,
/// `SCENE-time.svg`, `SCENE-efficiency.svg`, `SCENE-orders.svg`. Times are those of the processor
/// that most measurements ran on.
#[must_use]
pub fn plot_files(record: &StudyRecord) -> Vec<(String, String)> {
    let first = record.processors().first().copied().unwrap_or_default();
    let record = &record.timed_on(first);
    let palette = Palette::new(record.rows.iter().map(|row| row.estimator.as_str()));
    let mut files = Vec::new();
    for scene in &record.scenes {
        let name = &scene.scene;
        for (kind, plot) in scene_plots(record, name, &palette) {
            files.push((format!("{}-{kind}.svg", file_name(name)), plot.svg));
        }
    }
    files
}

/// A name without what file systems mind.
fn file_name(name: &str) -> String {
    let safe = |c: char| {
        if c.is_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '-'
        }
    };
    name.chars().map(safe).collect()
}

fn scene_plots(record: &StudyRecord, scene: &str, palette: &Palette) -> Vec<(&'static str, Plot)> {
    let mut all = vec![
        (
            "samples",
            Plot {
                svg: plots::error_over_samples(scene, &record.rows, palette).render(),
                caption: "Error over samples. Dashed: the orders −0.5, −1 and −1.5 from the worst \
                          estimator's first point. Bars: one standard error over the trials. Open \
                          marks on the lower edge: no noise."
                    .to_owned(),
            },
        ),
        (
            "time",
            Plot {
                svg: plots::error_over_time(scene, &record.rows, palette).render(),
                caption: "Equal time: the same errors over the processor time that they cost. What is \
                          lower at the same place is better; open marks have no noise from that time \
                          on. Bars along the axis: one standard deviation over passes."
                    .to_owned(),
            },
        ),
        (
            "efficiency",
            Plot {
                svg: plots::efficiency_over_samples(scene, &record.rows, palette).render(),
                caption: "Efficiency, 1/(MSE · time), over the least of the scene. Open marks on the \
                          upper edge: no noise."
                    .to_owned(),
            },
        ),
    ];
    if record.slopes.iter().any(|row| row.scene == scene) {
        let papers = record.slopes.iter().filter(|row| row.scene == scene);
        let sources: Vec<&str> = papers
            .filter_map(|row| row.paper_source.as_deref())
            .collect();
        let paper = sources.first().map_or(String::new(), |source| {
            format!(" Open diamonds: the order that the paper reports ({source}).")
        });
        all.push((
            "orders",
            Plot {
                svg: plots::orders(scene, &record.slopes, palette),
                caption: format!("Order of the standard deviation with its 95 % interval.{paper}"),
            },
        ));
    }
    all
}

fn section(record: &StudyRecord, scene: &SceneRecord, palette: &Palette) -> Section {
    let rows: Vec<&ResultRow> = record
        .rows
        .iter()
        .filter(|r| r.scene == scene.scene)
        .collect();
    let slopes: Vec<&SlopeRow> = record
        .slopes
        .iter()
        .filter(|r| r.scene == scene.scene)
        .collect();
    Section {
        title: scene.scene.clone(),
        lead: lead(scene),
        plots: scene_plots(record, &scene.scene, palette)
            .into_iter()
            .map(|(_, plot)| plot)
            .collect(),
        tables: vec![
            at_most_samples(&rows, &slopes, scene),
            all_rows(&rows, scene),
        ],
        notes: notes(record, scene),
        ..Section::default()
    }
}

fn lead(scene: &SceneRecord) -> String {
    // A problem that is no scene.
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

/// Whole numbers with thin spaces between thousands.
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

/// One row for each estimator and sampler at its largest number of samples, with its order. What
/// has no noise by any sampler has one row.
fn at_most_samples(rows: &[&ResultRow], slopes: &[&SlopeRow], scene: &SceneRecord) -> Table {
    let most = rows.iter().map(|row| row.samples).max().unwrap_or(0);
    let last = || rows.iter().copied().filter(|row| row.samples == most);
    let of = |row: &ResultRow| {
        let name = row.estimator.clone();
        last().filter(move |other| other.estimator == name)
    };
    let least = COMPARED.map(|value| {
        let noisy = last().filter(|row| !row.is_noiseless());
        let positive = noisy.map(value).filter(|v| *v > 0.0);
        positive.reduce(f64::min).unwrap_or(f64::NAN)
    });
    let target = PERCENT * scene.power.sqrt();
    let mut body: Vec<Vec<Cell>> = Vec::new();
    for row in last() {
        let alike = of(row).all(ResultRow::is_noiseless);
        let first = of(row).next().is_some_and(|r| r.sampler == row.sampler);
        if alike && !first {
            continue;
        }
        let sampler = if alike && of(row).count() > 1 {
            "any"
        } else {
            &row.sampler
        };
        let names = [&row.estimator, sampler].map(Cell::text);
        // An order belongs to one pattern, and to what has noise.
        let mut own = slopes.iter().filter(|_| !alike);
        let slope = own.find(|s| s.estimator == row.estimator && s.sampler == row.sampler);
        let time_to = time_to(&curve(rows, row), target);
        let reached = match time_to {
            Some(time) => Cell::number(seconds(time)).sorted_by(time),
            None => Cell::number("–").hover("not reached"),
        };
        let numbers = errors(row, least);
        body.push([&names[..], &numbers[..], &[reached], &order(slope.copied())].concat());
    }
    let columns =
        "estimator,sampler,RMSE,MRSE,time,efficiency,time to 1 %,order,95 %,lack of fit,paper";
    let caption = format!(
        "With {most} samples. Efficiency is 1/(MSE · time), the best with noise being one; the best \
         with noise of a column is marked. Time to 1 %: to an RMSE of a hundredth of the root mean \
         square, {}. Lack of fit: χ² of the fitted line over its degrees of freedom, far above one where the curve bends.",
        scientific(target)
    );
    Table::new(caption, columns.split(','), body)
}

/// The relative error whose time is told.
const PERCENT: f64 = 0.01;

/// The measures that are smaller for a better estimator: MSE, MRSE, and MSE · time.
const COMPARED: [fn(&ResultRow) -> f64; 3] = [
    |row| row.mse,
    |row| row.mrse,
    |row| row.mse * row.cpu_seconds,
];

/// The cells from the error up to the efficiency; the least values of the table are marked.
fn errors(row: &ResultRow, least: [f64; 3]) -> [Cell; 4] {
    let [mse, mrse, cost] = COMPARED.map(|value| value(row));
    let spread = format!("MSE {} ± {}", scientific(mse), scientific(row.mse_stderr));
    if row.is_noiseless() {
        let none = Cell::number("no noise").sorted_by(0.0);
        let left = format!("what is left is rounding, or the reference's own error: {spread}");
        let efficiency = Cell::number("∞").sorted_by(f64::MAX);
        return [none.clone().hover(left), none, time(row), efficiency];
    }
    let best = |value: f64, least: f64| value > 0.0 && value <= least;
    let efficiency = if cost > 0.0 {
        Cell::number(short(least[2] / cost)).sorted_by(least[2] / cost)
    } else {
        Cell::number("–")
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

/// The cells from the order on.
fn order(slope: Option<&SlopeRow>) -> Vec<Cell> {
    let dash = || "–".to_owned();
    let Some(s) = slope else {
        return [dash(), String::new(), dash(), dash()]
            .map(Cell::number)
            .to_vec();
    };
    let ends = interval(s).unwrap_or_else(dash);
    let paper = s.paper_order.map_or_else(dash, |p| signed(p, 3));
    let fit = Some(s.lack_of_fit).filter(|fit| fit.is_finite());
    let fit = fit.map_or_else(dash, short);
    vec![
        Cell::number(signed(s.order, 3)),
        Cell::number(ends),
        Cell::number(fit).sorted_by(s.lack_of_fit),
        Cell::number(paper).hover(s.paper_source.clone().unwrap_or_default()),
    ]
}

fn time(row: &ResultRow) -> Cell {
    if row.cpu_seconds.is_nan() {
        return Cell::number("–").hover(format!("on {}", row.processor));
    }
    let text = Cell::number(seconds(row.cpu_seconds)).sorted_by(row.cpu_seconds);
    text.hover(format!("± {}", error_of_time(row)))
}

/// A dash where it is not known.
fn error_of_time(row: &ResultRow) -> String {
    if row.cpu_error > 0.0 {
        seconds(row.cpu_error)
    } else {
        "–".to_owned()
    }
}

fn all_rows(rows: &[&ResultRow], scene: &SceneRecord) -> Table {
    let body = rows.iter().map(|row| {
        let test = bias_test(row, Some(scene));
        vec![
            Cell::text(&row.estimator),
            Cell::text(&row.sampler),
            Cell::number(row.samples.to_string()),
            Cell::scientific(row.mse),
            Cell::scientific(row.mse_stderr),
            Cell::scientific(row.mrse),
            Cell::scientific(row.variance),
            Cell::scientific(row.bias),
            Cell::number(test.map_or("–".to_owned(), |(z, _)| signed(z, 1)))
                .hover(test.map_or(String::new(), |(_, p)| format!("p = {}", scientific(p)))),
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

fn notes(record: &StudyRecord, scene: &SceneRecord) -> Vec<String> {
    let mut notes = record
        .left_out_of(&scene.scene)
        .into_iter()
        .collect::<Vec<_>>();
    if !scene.reference.is_empty() {
        let share = reference_share(record, scene).map_or(String::new(), |share| {
            format!(
                ", {} % of the smallest variance scored, and taken off",
                short((100.0 * share).max(0.01))
            )
        });
        notes.push(format!(
            "Reference: {}; its own mean squared error is {}{share}.",
            scene.reference,
            scientific(scene.reference_mse)
        ));
    }
    notes
}

fn facts(record: &StudyRecord) -> Vec<(String, String)> {
    let mut facts = vec![
        ("version".to_owned(), record.version.clone()),
        ("commit".to_owned(), record.commit.clone()),
        ("processor".to_owned(), record.cpu.clone()),
        ("threads".to_owned(), record.threads.to_string()),
        ("seed".to_owned(), record.seed.to_string()),
        ("run time".to_owned(), seconds(record.seconds.max(1e-9))),
    ];
    facts.extend(
        record
            .settings
            .iter()
            .map(|(name, value)| (name.clone(), value.clone())),
    );
    facts.retain(|(_, value)| !value.is_empty());
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_by_thousands() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(grouped(100), "100");
    }

    #[test]
    fn files_have_safe_names() {
        assert_eq!(file_name("a/b c:ü.x"), "a-b-c-ü.x");
    }

    #[test]
    fn an_empty_study_is_a_page_too() {
        let html = Report::of_study(&StudyRecord::default(), Exhibits::default()).render();
        assert!(html.contains("How it was made"));
    }
}

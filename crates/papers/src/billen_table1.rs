//! Billen & Dutré 2016, Table 1: what the visibility of 1024 lines a point costs.

use crate::Findings;
use crate::picture_study::Context;
use crate::scene_study::{Targets, all_pixels};
use anyhow::Result;
use linelit_integrator::{Estimator, Renderer, Settings};
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use linelit_study::engine::{CELL_SECONDS, Cell, run_cell};
use linelit_study::report::{Cell as TableCell, Report, Section, Table};
use serde::Serialize;

/// Lines at each shading point, as in the paper.
const LINES: u32 = 1024;
/// Pixels of our images; the paper does not say how many it had.
const SIZE: u32 = 32;

/// The paper's columns: seconds, box tests, triangle tests (millions).
struct Paper {
    ours: &'static str,
    theirs: &'static str,
    seconds: f64,
    boxes: f64,
    triangles: f64,
}

const PAPER: [Paper; 6] = [
    paper(
        "grid-planes-small",
        "Grid planes, small",
        [7.9, 1462.0, 136.3],
    ),
    paper(
        "grid-planes-large",
        "Grid planes, large",
        [11.0, 1926.4, 268.2],
    ),
    paper(
        "triangle-soup-small",
        "Triangle soup, small",
        [22.7, 7686.7, 344.9],
    ),
    paper(
        "triangle-soup-large",
        "Triangle soup, large",
        [58.0, 13848.6, 1238.2],
    ),
    paper("colonnade-small", "Sponza, small", [39.7, 7809.1, 1498.3]),
    paper(
        "colonnade-large",
        "Sponza, large",
        [455.7, 53729.2, 21474.2],
    ),
];

const fn paper(ours: &'static str, theirs: &'static str, columns: [f64; 3]) -> Paper {
    let [seconds, boxes, triangles] = columns;
    Paper {
        ours,
        theirs,
        seconds,
        boxes,
        triangles,
    }
}

/// One row of our table.
#[derive(Clone, Debug, Serialize)]
struct Row {
    /// Our scene.
    scene: String,
    /// Shading points.
    points: usize,
    /// Line samples.
    lines: u64,
    /// Processor seconds.
    seconds: f64,
    /// Their standard deviation over passes, of which they are the mean.
    seconds_error: f64,
    /// Nanoseconds per line.
    ns_per_line: f64,
    /// Box tests, millions.
    box_tests_m: f64,
    /// Triangle tests, millions.
    triangle_tests_m: f64,
    /// Box tests, millions per second.
    box_rate_m: f64,
    /// Triangle tests, millions per second.
    triangle_rate_m: f64,
    /// The paper's scene.
    paper_scene: &'static str,
    /// The paper's seconds.
    paper_seconds: f64,
    /// The paper's box tests, millions per second.
    paper_box_rate_m: f64,
    /// The paper's triangle tests, millions per second.
    paper_triangle_rate_m: f64,
    /// The paper's box tests for each triangle test.
    paper_boxes_per_triangle: f64,
}

/// Runs the table.
///
/// # Errors
/// If a built-in scene cannot be loaded.
pub(crate) fn run(context: &Context<'_>) -> Result<Findings> {
    // All scenes are opened before the first is measured.
    let open = |paper: &'static Paper| -> Result<(&'static Paper, Scene)> {
        Ok((paper, context.library.load(paper.ours)?.scene))
    };
    let opened = PAPER.iter().map(open).collect::<Result<Vec<_>>>()?;
    let rows = opened.into_iter();
    let rows: Vec<Row> = rows
        .map(|(paper, scene)| row(paper, scene, context))
        .collect();
    Ok(Findings {
        report: report(&rows),
        files: vec![("billen-table1.txt".to_owned(), text(&rows).into_bytes())],
        text: text(&rows),
        rows: serde_json::to_value(&rows)?,
    })
}

/// The page of the table.
fn report(rows: &[Row]) -> Report {
    let columns = "scene,points,lines,seconds,ns/line,box tests (M),triangle tests (M),M boxes/s,\
                   M triangles/s,paper: scene,paper: seconds,paper: M boxes/s,paper: M triangles/s";
    let number = |v: f64| TableCell::number(format!("{v:.1}"));
    let row = |r: &Row| {
        vec![
            TableCell::text(r.scene.clone()),
            TableCell::number(r.points.to_string()),
            TableCell::number(r.lines.to_string()),
            TableCell::number(format!("{:.3}", r.seconds)).hover(format!(
                "± {:.3}, standard deviation of two runs",
                r.seconds_error
            )),
            number(r.ns_per_line),
            number(r.box_tests_m),
            number(r.triangle_tests_m),
            number(r.box_rate_m),
            number(r.triangle_rate_m),
            TableCell::text(r.paper_scene),
            number(r.paper_seconds),
            number(r.paper_box_rate_m),
            number(r.paper_triangle_rate_m),
        ]
    };
    let caption =
        "1024 lines at each shading point. Seconds are of the processor, all threads together.";
    let table = Table::new(caption, columns.split(','), rows.iter().map(row));
    let section = Section {
        title: "Table 1".to_owned(),
        lead: "Our box and triangle tests are counted as if one at a time; all lines of a point \
               share one traversal, so both are far fewer for each line than in the paper."
            .to_owned(),
        tables: vec![table],
        notes: vec![
            "The paper names neither its machine nor its resolution: compare rates and ratios."
                .to_owned(),
        ],
        ..Section::default()
    };
    let title = "Cost of visibility: Billen & Dutré 2016, Table 1";
    Report::new(title, Vec::new(), vec![section])
}

fn row(paper: &Paper, mut scene: Scene, context: &Context<'_>) -> Row {
    let [width, height] = context.size([SIZE; 2]);
    scene.set_resolution(width, height);
    let renderer = Renderer::new(&scene);
    let targets = Targets::find(&renderer, &all_pixels(width, height));
    let settings = Settings {
        estimator: Estimator::analytic(),
        sampler: SamplerKind::Stratified,
        skip: false,
        ..Settings::default()
    };
    let cell = Cell {
        settings,
        samples: LINES,
        seed: context.seed,
        trials: 1,
    };
    let mut run = run_cell(&targets, cell);
    // A second time at least: one says nothing of its error.
    while !run.time_again(&targets, CELL_SECONDS) {}
    let seconds = run.times.seconds();
    #[allow(clippy::cast_precision_loss, reason = "counts fit 53 bits")]
    let millions = |n: u64| n as f64 * 1e-6;
    let (boxes, triangles) = (
        millions(run.counts.node_tests),
        millions(run.counts.triangle_tests),
    );
    Row {
        scene: paper.ours.to_owned(),
        points: targets.points.len(),
        lines: run.counts.lines,
        seconds,
        seconds_error: run.times.error(),
        ns_per_line: 1e3 * seconds / millions(run.counts.lines).max(1e-6),
        box_tests_m: boxes,
        triangle_tests_m: triangles,
        box_rate_m: boxes / seconds,
        triangle_rate_m: triangles / seconds,
        paper_scene: paper.theirs,
        paper_seconds: paper.seconds,
        paper_box_rate_m: paper.boxes / paper.seconds,
        paper_triangle_rate_m: paper.triangles / paper.seconds,
        paper_boxes_per_triangle: paper.boxes / paper.triangles,
    }
}

/// The table as text.
fn text(rows: &[Row]) -> String {
    use std::fmt::Write;
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<22} {:>7} {:>9} {:>9} {:>9} {:>11} {:>11} {:>9} {:>9}   paper: {:<21} {:>8} {:>8} {:>8}",
        "scene",
        "points",
        "lines",
        "seconds",
        "ns/line",
        "boxes M",
        "triangles M",
        "M box/s",
        "M tri/s",
        "scene",
        "seconds",
        "M box/s",
        "M tri/s"
    );
    for r in rows {
        let _ = writeln!(
            out,
            "{:<22} {:>7} {:>9} {:>9.3} {:>9.1} {:>11.3} {:>11.3} {:>9.1} {:>9.1}   paper: {:<21} {:>8.1} {:>8.1} {:>8.1}",
            r.scene,
            r.points,
            r.lines,
            r.seconds,
            r.ns_per_line,
            r.box_tests_m,
            r.triangle_tests_m,
            r.box_rate_m,
            r.triangle_rate_m,
            r.paper_scene,
            r.paper_seconds,
            r.paper_box_rate_m,
            r.paper_triangle_rate_m
        );
    }
    out
}

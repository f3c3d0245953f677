//! Billen & Dutré 2016, Table 1: what the visibility of 1024 lines a point costs.

use crate::Findings;
use crate::picture_study::Context;
use crate::scene_study::{Targets, all_pixels};
use anyhow::Result;
use linelit_integrator::{Renderer, Settings};
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use linelit_study::engine::{CELL_SECONDS, Cell, run_cell};
use linelit_study::report::{Cell as TableCell, Report, Section, Table};
use serde_json::{Value, json};

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
struct Row {
    paper: &'static Paper,
    /// Shading points.
    points: usize,
    /// Line samples.
    lines: u64,
    /// Processor seconds.
    seconds: f64,
    /// Standard deviation of the seconds over passes, of which they are the mean.
    seconds_error: f64,
    /// Box tests, millions.
    boxes: f64,
    /// Triangle tests, millions.
    triangles: f64,
}

impl Row {
    fn ns_per_line(&self) -> f64 {
        let millions = self.lines as f64 * 1e-6;
        1e3 * self.seconds / millions.max(1e-6)
    }

    /// Millions of box and triangle tests in a second: ours, the paper's.
    fn rates(&self) -> [f64; 4] {
        let (seconds, paper) = (self.seconds, self.paper);
        [
            self.boxes / seconds,
            self.triangles / seconds,
            paper.boxes / paper.seconds,
            paper.triangles / paper.seconds,
        ]
    }

    fn json(&self) -> Value {
        let [box_rate, triangle_rate, paper_box_rate, paper_triangle_rate] = self.rates();
        json!({
            "scene": self.paper.ours,
            "points": self.points,
            "lines": self.lines,
            "seconds": self.seconds,
            "seconds_error": self.seconds_error,
            "ns_per_line": self.ns_per_line(),
            "box_tests_m": self.boxes,
            "triangle_tests_m": self.triangles,
            "box_rate_m": box_rate,
            "triangle_rate_m": triangle_rate,
            "paper_scene": self.paper.theirs,
            "paper_seconds": self.paper.seconds,
            "paper_box_rate_m": paper_box_rate,
            "paper_triangle_rate_m": paper_triangle_rate,
            "paper_boxes_per_triangle": self.paper.boxes / self.paper.triangles,
        })
    }
}

/// Runs the table.
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
        rows: rows.iter().map(Row::json).collect(),
    })
}

/// The page of the table.
fn report(rows: &[Row]) -> Report {
    let columns = "scene,points,lines,seconds,ns/line,box tests (M),triangle tests (M),M boxes/s,\
                   M triangles/s,paper: scene,paper: seconds,paper: M boxes/s,paper: M triangles/s";
    let number = |v: f64| TableCell::number(format!("{v:.1}"));
    let row = |r: &Row| {
        let spread = format!("± {:.3}, standard deviation of two runs", r.seconds_error);
        let rates = r.rates();
        vec![
            TableCell::text(r.paper.ours),
            TableCell::number(r.points.to_string()),
            TableCell::number(r.lines.to_string()),
            TableCell::number(format!("{:.3}", r.seconds)).hover(spread),
            number(r.ns_per_line()),
            number(r.boxes),
            number(r.triangles),
            number(rates[0]),
            number(rates[1]),
            TableCell::text(r.paper.theirs),
            number(r.paper.seconds),
            number(rates[2]),
            number(rates[3]),
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

fn row(paper: &'static Paper, mut scene: Scene, context: &Context<'_>) -> Row {
    let [width, height] = context.size([SIZE; 2]);
    scene.set_resolution(width, height);
    let renderer = Renderer::new(&scene);
    let targets = Targets::find(&renderer, &all_pixels(width, height));
    let settings = Settings {
        estimator: crate::billen_orders::LINES
            .parse()
            .expect("names an estimator"),
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
    let millions = |n: u64| n as f64 * 1e-6;
    Row {
        paper,
        points: targets.points.len(),
        lines: run.counts.lines,
        seconds: run.times.seconds(),
        seconds_error: run.times.error(),
        boxes: millions(run.counts.node_tests),
        triangles: millions(run.counts.triangle_tests),
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
        let (ours, theirs) = (r.paper.ours, r.paper.theirs);
        let [b, t, paper_b, paper_t] = r.rates();
        let _ = writeln!(
            out,
            "{ours:<22} {:>7} {:>9} {:>9.3} {:>9.1} {:>11.3} {:>11.3} {b:>9.1} {t:>9.1}   paper: {theirs:<21} {:>8.1} {paper_b:>8.1} {paper_t:>8.1}",
            r.points,
            r.lines,
            r.seconds,
            r.ns_per_line(),
            r.boxes,
            r.triangles,
            r.paper.seconds,
        );
    }
    out
}

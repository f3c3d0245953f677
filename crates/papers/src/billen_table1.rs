//! Billen & Dutré 2016, Table 1: what the visibility of 1024 lines a point costs.

use crate::Findings;
use crate::measured::Measured;
use crate::picture_study::Context;
use anyhow::{Context as _, Result, bail};
use linelit_integrator::{Renderer, Settings};
use linelit_lights::{Light, LineSampler, LineTechnique, OffsetDensity};
use linelit_samplers::{Sampler, SamplerKind};
use linelit_scene::Scene;
use linelit_study::engine::{CELL_SECONDS, Cell, run_cell};
use linelit_study::report::{Cell as TableCell, Report, Section, Table};
use linelit_study::scene_study::{Targets, all_pixels};
use linelit_visibility::{Scratch, ShaftQuery, VisibleLines};
use serde_json::{Value, json};
use std::f64::consts::PI;

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

const PAPER: [Paper; 8] = [
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
    paper("logo-small", "Logo, small", [22.0, 1929.3, 412.7]),
    paper("logo-large", "Logo, large", [22.7, 1929.3, 415.5]),
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
pub(crate) struct Row {
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
    pub boxes: f64,
    /// Triangle tests, millions.
    pub triangles: f64,
    /// Shadow triangles that were traced one by one, each by a walk of its own, as the paper's are.
    alone: Alone,
}

/// Tests of single shadow triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Alone {
    /// Box tests of each.
    pub boxes: Measured,
    /// Triangle tests of each.
    pub triangles: Measured,
}

/// Traces single lines of random directions from the points, each by itself: the paper's units.
pub(crate) fn alone(targets: &Targets<'_>, seed: u64) -> Result<Alone> {
    let renderer = targets.renderer;
    let light = renderer.plan().lights().first().context("no light")?;
    let Light::Area(area) = &*light.light else {
        bail!("the first light is no polygon");
    };
    let numbers = Sampler::new(SamplerKind::Independent, seed);
    let mut scratch = Scratch::new();
    let occluders = renderer.light_occluders();
    let (mut boxes, mut triangles) = (Vec::new(), Vec::new());
    for (pixel, point) in &targets.points {
        let set = numbers.points(*pixel, 0, LINES_ALONE);
        for k in 0..LINES_ALONE {
            let [u, v] = set.get_2d(k);
            let lines = LineSampler::new(&area.polygon, PI * u, OffsetDensity::Length);
            let line = lines.sample(v).segment;
            let ends = [line.p0, line.p1];
            let mut query = ShaftQuery::new(point.position, &ends);
            query.exclude = light.triangles.clone();
            let mut visible = VisibleLines::new();
            let mut shaft = occluders.shaft(query, &mut scratch);
            shaft.visible(std::slice::from_ref(&line), &mut visible);
            let counts = std::mem::take(&mut scratch.counters);
            boxes.push(counts.node_tests as f64);
            triangles.push(counts.triangle_tests as f64);
        }
    }
    Ok(Alone {
        boxes: Measured::mean(&boxes),
        triangles: Measured::mean(&triangles),
    })
}

/// Lines traced one by one at each point.
const LINES_ALONE: u32 = 4;

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
            "alone_boxes_per_line": self.alone.boxes,
            "alone_triangles_per_line": self.alone.triangles,
            "alone_boxes_per_triangle": self.alone.boxes.value / self.alone.triangles.value,
            "paper_boxes_per_triangle": self.paper.boxes / self.paper.triangles,
        })
    }
}

/// The rows of the table.
pub(crate) fn rows(context: &Context<'_>) -> Result<Vec<Row>> {
    // All scenes are opened before the first is measured.
    let open = |paper: &'static Paper| -> Result<(&'static Paper, Scene)> {
        Ok((paper, context.library.load(paper.ours)?.scene))
    };
    let opened = PAPER.iter().map(open).collect::<Result<Vec<_>>>()?;
    let row = |(paper, scene)| row(paper, scene, context);
    opened.into_iter().map(row).collect()
}

/// Runs the table.
pub(super) fn run(context: &Context<'_>) -> Result<Findings> {
    let rows = rows(context)?;
    Ok(Findings {
        report: report(&rows),
        files: vec![("billen-table1.txt".to_owned(), text(&rows).into_bytes())],
        text: text(&rows),
        rows: rows.iter().map(Row::json).collect(),
        failures: Vec::new(),
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
    Report::new(title, Vec::new(), vec![section, alone_section(rows)])
}

fn row(paper: &'static Paper, mut scene: Scene, context: &Context<'_>) -> Result<Row> {
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
    Ok(Row {
        paper,
        alone: alone(&targets, context.seed)?,
        points: targets.points.len(),
        lines: run.counts.lines,
        seconds: run.times.seconds(),
        seconds_error: run.times.error(),
        boxes: millions(run.counts.node_tests),
        triangles: millions(run.counts.triangle_tests),
    })
}

/// A large light over a small one: tests of single shadow triangles and times, ours and theirs.
struct Larger {
    scene: &'static str,
    /// Box tests, triangle tests, seconds: ours, the paper's.
    times: [[f64; 2]; 3],
}

fn larger(rows: &[Row]) -> Vec<Larger> {
    let pairs = rows.chunks_exact(2).map(|pair| {
        let [small, large] = [&pair[0], &pair[1]];
        let ratio = |ours: fn(&Row) -> f64, theirs: fn(&Paper) -> f64| {
            [
                ours(large) / ours(small),
                theirs(large.paper) / theirs(small.paper),
            ]
        };
        Larger {
            scene: small.paper.ours.trim_end_matches("-small"),
            times: [
                ratio(|r| r.alone.boxes.value, |p| p.boxes),
                ratio(|r| r.alone.triangles.value, |p| p.triangles),
                ratio(|r| r.seconds, |p| p.seconds),
            ],
        }
    });
    pairs.collect()
}

/// The paper's units: single shadow triangles.
fn alone_section(rows: &[Row]) -> Section {
    let row = |r: &Row| {
        let ours = r.alone.boxes.value / r.alone.triangles.value;
        vec![
            TableCell::text(r.paper.ours),
            TableCell::number(r.alone.boxes.to_string()),
            TableCell::number(r.alone.triangles.to_string()),
            TableCell::number(format!("{ours:.2}")),
            TableCell::number(format!("{:.2}", r.paper.boxes / r.paper.triangles)),
        ]
    };
    let columns = "scene,box tests of a line,triangle tests of a line,boxes for each triangle,\
                   paper: boxes for each triangle";
    let caption = "Single shadow triangles, each with a walk of its own, in random directions.";
    let alone = Table::new(caption, columns.split(','), rows.iter().map(row));
    let larger = larger(rows);
    let row = |l: &Larger| {
        let cells = l.times.iter().flatten();
        let mut row = vec![TableCell::text(l.scene)];
        row.extend(cells.map(|v| TableCell::number(format!("{v:.2}"))));
        row
    };
    let columns = "scene,box tests,paper: box tests,triangle tests,paper: triangle tests,seconds,paper: seconds";
    let caption = "The large light over the small one.";
    let ratios = Table::new(caption, columns.split(','), larger.iter().map(row));
    let more = larger.iter().filter(|l| l.times[0][0] > 1.0).count();
    let by = |k: usize| {
        let values = larger.iter().map(|l| l.times[k][0]);
        let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        format!("{low:.2} to {high:.2}")
    };
    Section {
        title: "In the paper's units".to_owned(),
        lead: format!(
            "The paper finds that larger lights take more tests and more time. Of single shadow triangles that is so \
             on {more} of {} scenes: {} times the box tests, {} times the triangle tests; the time of 1024 lines, \
             which share one walk here, is {} times as long. Its box tests are of a binary tree, ours of the children \
             of nodes of eight.",
            larger.len(),
            by(0),
            by(1),
            by(2),
        ),
        tables: vec![alone, ratios],
        ..Section::default()
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

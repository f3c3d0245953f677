//! Plots of error over samples or time: one panel for each sampler, one line for each estimator.

use super::axis::{self, LogAxis, Unit, scientific};
use super::palette::Palette;
use super::svg::{Anchor, Canvas, text_width};
use crate::tables::ResultRow;
use linelit_elementary::pow;

/// One measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlotPoint {
    /// The number of samples, or seconds.
    pub x: f64,
    /// The standard deviation of `x`, for the horizontal bar; zero or NaN for no bar.
    pub x_error: f64,
    /// The error, or efficiency.
    pub y: f64,
    /// The standard error of `y`, for the vertical bar; zero or NaN for no bar.
    pub y_error: f64,
    /// Whether the measurement has no noise. It is then drawn as an open mark at the better edge of
    /// the panel, whatever `y` is.
    pub noiseless: bool,
}

impl PlotPoint {
    /// Returns whether the measurement has a position on logarithmic axes; others are left out.
    fn is_drawn(&self) -> bool {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        self.noiseless || (positive(self.x) && positive(self.y))
    }

    /// Returns whether the measurement has noise and is drawn.
    fn is_noisy(&self) -> bool {
        !self.noiseless && self.is_drawn()
    }
}

/// The measurements of one estimator with one sampler.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The estimator, which determines the colour and the mark.
    pub estimator: String,
    /// The sampler, which determines the panel.
    pub sampler: String,
    /// The measurements. A line joins the noisy ones in this order.
    pub points: Vec<PlotPoint>,
}

/// A plot with two logarithmic axes.
#[derive(Clone, Debug)]
pub struct ConvergencePlot {
    /// The description of the plot for screen readers.
    pub title: String,
    /// The label of the horizontal axis.
    pub x_label: String,
    /// The label of the vertical axis.
    pub y_label: String,
    /// Whether the horizontal axis has seconds; otherwise it has samples, with a tick at each
    /// number.
    pub x_is_time: bool,
    /// Whether larger values are better. Open marks are then at the upper edge instead of the lower
    /// one.
    pub more_is_better: bool,
    /// The slopes that are drawn as dashed lines from the first point of the worst estimator.
    pub guides: Vec<f64>,
    /// The data. Points that are not positive cannot be drawn and are left out.
    pub series: Vec<Series>,
    /// The colours. A report uses one palette for all its plots, so that an estimator has the same
    /// colour in each.
    pub palette: Palette,
}

/// The left margin of the plot, in pixels.
const LEFT: f64 = 64.0;
/// The right margin of the plot, in pixels.
const RIGHT: f64 = 22.0;
/// The distance between panels, in pixels.
const GAP: f64 = 18.0;
/// The height of a panel, and the heights of the title above it and the labels of ticks below it,
/// in pixels.
const PANEL_HEIGHT: f64 = 236.0;
const PANEL_HEAD: f64 = 24.0;
const TICKS: f64 = 22.0;
/// The height of the label of the horizontal axis, in pixels.
const X_LABEL: f64 = 26.0;
/// The width of the plot, in pixels.
const WIDTH: f64 = 900.0;
/// The height of a row of the legend, in pixels.
const LEGEND_ROW: f64 = 20.0;

/// Plots the root mean squared error over the number of samples, with the slopes −½, −1 and −3/2.
pub(crate) fn error_over_samples(
    scene: &str,
    rows: &[ResultRow],
    palette: &Palette,
) -> ConvergencePlot {
    let series = gather(scene, rows, |row| PlotPoint {
        x: row.samples.into(),
        ..rmse(row)
    });
    ConvergencePlot {
        title: format!("{scene}: error over samples"),
        x_label: "light samples of a shading point".to_owned(),
        y_label: "root mean squared error".to_owned(),
        x_is_time: false,
        more_is_better: false,
        guides: vec![-0.5, -1.0, -1.5],
        series,
        palette: palette.clone(),
    }
}

/// Plots the root mean squared error over processor seconds. Horizontal bars are the standard
/// deviation of the times of passes, that is, how much another run may differ.
pub(crate) fn error_over_time(
    scene: &str,
    rows: &[ResultRow],
    palette: &Palette,
) -> ConvergencePlot {
    let timed = rows.iter().filter(|r| r.cpu_seconds > 0.0);
    let series = gather(scene, timed, |row| PlotPoint {
        x: row.cpu_seconds,
        x_error: row.cpu_error,
        ..rmse(row)
    });
    ConvergencePlot {
        title: format!("{scene}: error over time"),
        x_label: "processor time of one trial, without set-up".to_owned(),
        x_is_time: true,
        guides: Vec::new(),
        series,
        ..error_over_samples(scene, &[], palette)
    }
}

/// Plots the efficiency, 1/(mean squared error · processor time), over the number of samples,
/// relative to [`ResultRow::unit_of_efficiency`]. It is level for independent samples, and rises
/// where stratification pays.
pub(crate) fn efficiency_over_samples(
    scene: &str,
    rows: &[ResultRow],
    palette: &Palette,
) -> ConvergencePlot {
    let timed = rows.iter().filter(|r| r.cpu_seconds > 0.0);
    let unit = ResultRow::unit_of_efficiency(rows, scene).map_or(f64::NAN, ResultRow::cost);
    let series = gather(scene, timed, |row| PlotPoint {
        x: row.samples.into(),
        y: unit / row.cost(),
        // The error of the time is left to the tables: a disturbance of the machine changes all
        // measurements of that moment together.
        y_error: unit / row.cost() * row.mse_stderr / row.mse,
        ..PlotPoint::default()
    });
    ConvergencePlot {
        title: format!("{scene}: efficiency over samples"),
        y_label: "efficiency".to_owned(),
        more_is_better: true,
        guides: Vec::new(),
        series,
        ..error_over_samples(scene, &[], palette)
    }
}

/// Returns a point at the root mean squared error of a row, with its standard error. The x of the
/// point is not set yet.
fn rmse(row: &ResultRow) -> PlotPoint {
    let rmse = row.mse.sqrt();
    PlotPoint {
        y: rmse,
        // d√m = dm/(2√m).
        y_error: 0.5 * row.mse_stderr / rmse,
        ..PlotPoint::default()
    }
}

/// Returns the series of a scene: its rows as points, by estimator and sampler.
fn gather<'a>(
    scene: &str,
    rows: impl IntoIterator<Item = &'a ResultRow>,
    point: impl Fn(&ResultRow) -> PlotPoint,
) -> Vec<Series> {
    let mut all: Vec<Series> = Vec::new();
    for row in rows.into_iter().filter(|row| row.scene == scene) {
        let point = PlotPoint {
            noiseless: row.is_noiseless(),
            ..point(row)
        };
        let same = |s: &&mut Series| s.estimator == row.estimator && s.sampler == row.sampler;
        match all.iter_mut().find(same) {
            Some(series) => series.points.push(point),
            None => all.push(Series {
                estimator: row.estimator.clone(),
                sampler: row.sampler.clone(),
                points: vec![point],
            }),
        }
    }
    all
}

/// The two axes of a panel.
#[derive(Clone, Copy)]
struct Panel {
    x: LogAxis,
    y: LogAxis,
}

impl Panel {
    /// Returns the pixel of a point.
    fn pixel(&self, x: f64, y: f64) -> [f64; 2] {
        [self.x.pixel(x), self.y.pixel(y)]
    }
}

impl ConvergencePlot {
    /// Draws the plot as SVG.
    #[must_use]
    pub fn render(&self) -> String {
        // Lay out the panels, one for each sampler, in up to three columns below the legend.
        let samplers = unique(self.series.iter().map(|s| s.sampler.as_str()));
        let estimators = unique(self.series.iter().map(|s| s.estimator.as_str()));
        let columns = samplers.len().clamp(1, 3);
        let rows = samplers.len().div_ceil(columns).max(1);
        let room = WIDTH - LEFT - RIGHT - GAP * (columns - 1) as f64;
        let panel_width = room / columns as f64;
        let mut canvas = Canvas::new(WIDTH);
        let legend_height = self.draw_legend(&mut canvas, &estimators);
        let row_height = PANEL_HEAD + PANEL_HEIGHT + TICKS;
        let height = legend_height + row_height * rows as f64 + X_LABEL;
        // Draw each panel; the labels of the guides come last, so that no line crosses them.
        let (x_axis, y_axis) = self.axes();
        for (index, sampler) in samplers.iter().enumerate() {
            let (column, row) = (index % columns, index / columns);
            let left = LEFT + column as f64 * (panel_width + GAP);
            let top = legend_height + row as f64 * row_height + PANEL_HEAD;
            let panel = Panel {
                x: x_axis.over(left, left + panel_width),
                y: y_axis.over(top + PANEL_HEIGHT, top),
            };
            canvas.text("ll-head", [left, top - 8.0], Anchor::Start, sampler);
            self.draw_frame(&mut canvas, panel, column == 0);
            let labels = self.draw_guides(&mut canvas, panel, sampler);
            for series in self.series.iter().filter(|s| s.sampler == *sampler) {
                self.draw_series(&mut canvas, panel, series);
            }
            for (end, order) in labels {
                canvas.text("ll-halo", end, Anchor::End, &order);
            }
        }
        // Label the two axes once for all panels.
        let (x, y) = (
            0.5 * (LEFT + WIDTH - RIGHT),
            0.5 * (legend_height + height - X_LABEL),
        );
        canvas.text("", [x, height - 7.0], Anchor::Middle, &self.x_label);
        canvas.upright("", [15.0, y + 2.0], &self.y_label);
        canvas.finish(height, &self.title)
    }

    /// Returns all points that can be drawn.
    fn points(&self) -> impl Iterator<Item = &PlotPoint> {
        let points = self.series.iter().flat_map(|series| &series.points);
        points.filter(|point| point.is_drawn())
    }

    /// Returns the x coordinates of all points that can be drawn.
    fn abscissae(&self) -> impl Iterator<Item = f64> {
        self.points().map(|point| point.x)
    }

    /// Returns the axes that hold all panels' points.
    fn axes(&self) -> (LogAxis, LogAxis) {
        let mut x = LogAxis::spanning(self.abscissae(), 1.35);
        if !self.guides.is_empty() {
            // Leave a margin beyond the last point, for the labels of the guides.
            x.high *= pow(x.high / x.low, 0.1).max(1.2);
        }
        let noisy = self.points().filter(|point| point.is_noisy());
        (x, LogAxis::spanning(noisy.map(|p| p.y), 1.6))
    }

    /// Draws each estimator's name with its mark, in as many rows as necessary, and returns the
    /// height of the legend.
    fn draw_legend(&self, canvas: &mut Canvas, estimators: &[&str]) -> f64 {
        let (mut x, mut y) = (LEFT, 14.0);
        for estimator in estimators {
            let width = 30.0 + text_width(estimator, 12.0) + 22.0;
            if x + width > WIDTH && x > LEFT {
                (x, y) = (LEFT, y + LEGEND_ROW);
            }
            let colour = self.palette.index(estimator);
            canvas.line(&format!("ll-l{colour}"), [x, y - 4.0], [x + 22.0, y - 4.0]);
            canvas.mark(&format!("ll-m{colour}"), colour, [x + 11.0, y - 4.0], "");
            canvas.text("", [x + 29.0, y], Anchor::Start, estimator);
            x += width;
        }
        y + 12.0
    }

    /// Draws the grid and frame of a panel, with labels of the ticks; only a `labelled` panel has
    /// them at the vertical axis.
    fn draw_frame(&self, canvas: &mut Canvas, panel: Panel, labelled: bool) {
        let Panel { x, y } = panel;
        // Draw the horizontal lines of the grid.
        for tick in y.ticks() {
            let at = y.pixel(tick);
            canvas.line("ll-grid", [x.from, at], [x.to, at]);
            if labelled {
                let text = axis::label(tick, Unit::Number);
                canvas.text("ll-small", [x.from - 7.0, at + 4.0], Anchor::End, &text);
            }
        }
        // Draw the vertical lines: at round times, or at the numbers of samples that were measured.
        let (ticks, unit) = if self.x_is_time {
            (x.ticks(), Unit::Seconds)
        } else {
            let mut counts: Vec<f64> = self.abscissae().collect();
            counts.sort_by(f64::total_cmp);
            counts.dedup();
            (counts, Unit::Count)
        };
        for tick in x.thinned(&ticks) {
            let at = x.pixel(tick);
            canvas.line("ll-grid", [at, y.from], [at, y.to]);
            let text = axis::label(tick, unit);
            canvas.text("ll-small", [at, y.from + 16.0], Anchor::Middle, &text);
        }
        canvas.rect("ll-panel", [x.from, y.to], [x.to - x.from, y.from - y.to]);
    }

    /// Draws dashed lines of given slopes from the first point of the worst estimator in the panel.
    /// Returns the labels with their positions, as they have to be drawn after the data.
    fn draw_guides(
        &self,
        canvas: &mut Canvas,
        panel: Panel,
        sampler: &str,
    ) -> Vec<([f64; 2], String)> {
        // Find the worst first point of all estimators.
        let own = self.series.iter().filter(|s| s.sampler == sampler);
        let firsts = own.filter_map(|s| s.points.iter().find(|point| point.is_noisy()));
        let Some(start) = firsts.max_by(|a, b| a.y.total_cmp(&b.y)) else {
            return Vec::new();
        };
        // Draw each guide up to where it leaves the panel, on the right or at the bottom.
        let mut draw = |&slope: &f64| {
            let right = start.y * pow(panel.x.high / start.x, slope);
            let leaves_right = right >= panel.y.low;
            let end = if leaves_right {
                panel.pixel(panel.x.high, right)
            } else {
                let x = start.x * pow(panel.y.low / start.y, slope.recip());
                panel.pixel(x, panel.y.low)
            };
            let first = panel.pixel(start.x, start.y);
            canvas.line("ll-guide", first, end);
            // Put its label on the steep side of the guide, where no data are expected, and above
            // open marks.
            let (t, aside) = match leaves_right {
                true => (1.0, [5.0, 7.0]),
                false => (0.75, [8.0, -9.0]),
            };
            let label = [0, 1].map(|k| first[k] + t * (end[k] - first[k]) - aside[k]);
            (label, format!("−{}", axis::short(-slope)))
        };
        self.guides.iter().map(&mut draw).collect()
    }

    /// Draws the points of an estimator with their error bars, and the line that joins the noisy
    /// ones.
    fn draw_series(&self, canvas: &mut Canvas, panel: Panel, series: &Series) {
        let colour = self.palette.index(&series.estimator);
        // Join the noisy points.
        let noisy = series.points.iter().filter(|p| p.is_noisy());
        let line: Vec<[f64; 2]> = noisy.map(|p| panel.pixel(p.x, p.y)).collect();
        canvas.polyline(&format!("ll-l{colour}"), &line);
        let edge = if self.more_is_better {
            panel.y.high
        } else {
            panel.y.low
        };
        // Draw each point with its bars; points without noise lie on the edge.
        for point in series.points.iter().filter(|p| p.is_drawn()) {
            let [x, y] = panel.pixel(point.x, if point.noiseless { edge } else { point.y });
            let bars = format!("ll-e{colour}");
            if let Some([low, high]) = panel.y.bar([point.y, point.y_error])
                && !point.noiseless
            {
                canvas.bar(&bars, [x, high], [x, low]);
            }
            if let Some([low, high]) = panel.x.bar([point.x, point.x_error]) {
                canvas.bar(&bars, [low, y], [high, y]);
            }
            // Draw the mark, which shows its numbers on hovering.
            let (shape, found) = if point.noiseless {
                ('o', "no noise".to_owned())
            } else {
                let [y, error] = [point.y, point.y_error].map(scientific);
                ('m', format!("{y} ± {error}"))
            };
            let (estimator, sampler) = (&series.estimator, &series.sampler);
            let hover = format!(
                "{estimator} · {sampler} · {}: {found}",
                self.abscissa(point)
            );
            canvas.mark(&format!("ll-{shape}{colour}"), colour, [x, y], &hover);
        }
    }

    /// Returns the samples or the time of a point in words.
    fn abscissa(&self, point: &PlotPoint) -> String {
        let [x, error] = [point.x, point.x_error];
        if !self.x_is_time {
            format!("{x} samples")
        } else if error > 0.0 {
            format!("{} ± {}", axis::seconds(x), axis::seconds(error))
        } else {
            axis::seconds(x)
        }
    }
}

/// Returns the distinct names, in the order of their first occurrence.
pub(super) fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut all = Vec::new();
    for name in names {
        if !all.contains(&name) {
            all.push(name);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a row whose error bar is a tenth of its error, and which has no noise at 64 samples.
    fn row(samples: u32, mse: f64) -> ResultRow {
        ResultRow {
            scene: "s".to_owned(),
            estimator: "a<b".to_owned(),
            samples,
            trials: 8,
            mse,
            mse_stderr: 0.1 * mse,
            variance: f64::from(u32::from(samples < 64)),
            cpu_seconds: 1e-3 * f64::from(samples),
            ..ResultRow::default()
        }
    }

    #[test]
    fn impossible_values_are_left_out_and_all_numbers_are_finite() {
        let vague = ResultRow {
            mse_stderr: f64::NAN,
            ..row(32, 1e-3)
        };
        let rows = [
            row(1, 0.5),
            row(4, 0.0),
            row(16, f64::NAN),
            vague,
            row(64, 1e-9),
        ];
        let svg = error_over_samples("s", &rows, &Palette::default()).render();
        // Two points with noise, and one without noise on the lower edge.
        assert_eq!(svg.matches("<title>").count(), 3);
        assert_eq!(svg.matches(r#"class="ll-o"#).count(), 1);
        assert!(!svg.contains("inf") && !svg.contains("\"NaN"), "{svg}");
        assert!(svg.contains("a&lt;b") && !svg.contains("a<b"));
        assert_eq!(svg.matches("ll-guide\"").count(), 3);
        for rows in [&rows[1..2], &[]] {
            let empty = error_over_samples("s", rows, &Palette::default()).render();
            assert!(empty.ends_with("</svg>\n") && !empty.contains("<title>"));
        }
    }

    /// There is a bar along each axis, and none for an unknown error.
    #[test]
    fn bars_say_how_sure_times_are() {
        let timed = |samples, cpu_error| ResultRow {
            cpu_error,
            mse_stderr: 0.0,
            ..row(samples, 1.0 / f64::from(samples))
        };
        let rows = [
            timed(1, 1e-4),
            timed(4, 9.0),
            timed(16, f64::NAN),
            timed(64, 8e-3),
        ];
        let svg = error_over_time("s", &rows, &Palette::default()).render();
        // Each of the three known errors is drawn as a line with two ends.
        assert_eq!(svg.matches(r#"class="ll-e"#).count(), 9, "{svg}");
        assert!(
            svg.contains("1 ms ± 100 µs") && svg.contains("64 ms ± 8 ms: no noise"),
            "{svg}"
        );
        assert!(!svg.contains("inf") && !svg.contains("NaN\""));
        let axis = LogAxis::spanning([1.0, 100.0].into_iter(), 1.0).over(0.0, 20.0);
        // From 10 − 9 to 10 + 990, which is beyond the axis.
        assert_eq!(axis.bar([10.0, 9.0]), Some([0.0, axis.pixel(19.0)]));
        assert_eq!(axis.bar([10.0, 990.0]), Some([0.0, 20.0]));
        assert_eq!(axis.bar([10.0, f64::NAN]), None);
        let none = error_over_samples("s", &rows, &Palette::default()).render();
        assert_eq!(none.matches(r#"class="ll-e"#).count(), 0);
    }

    #[test]
    fn rows_become_series_with_the_error_of_the_root() {
        let other = ResultRow {
            scene: "other".to_owned(),
            ..row(1, 1.0)
        };
        let rows = [row(1, 4.0), other, row(4, 0.25), row(64, 1e-12)];
        let plot = error_over_samples("s", &rows, &Palette::default());
        let points = &plot.series[0].points;
        assert_eq!((plot.series.len(), points.len()), (1, 3));
        let (first, last) = (points[0], points[2]);
        assert!(last.noiseless && !first.noiseless);
        // 10 % of the squared error is 5 % of its root.
        assert!((first.y - 2.0).abs() < 1e-15 && (first.y_error - 0.1).abs() < 1e-15);
        // The costs are .004 and .001; those of points are .008 and a smaller one below its
        // standard error, which does not count.
        let values = |rows: &[ResultRow]| {
            let plot = efficiency_over_samples("s", rows, &Palette::default());
            [0, 1].map(|k| plot.series[0].points[k].y).to_vec()
        };
        assert_eq!(values(&rows), [0.25, 1.0]);
        let point = |row| ResultRow {
            estimator: "point-area".to_owned(),
            ..row
        };
        let vague = ResultRow {
            mse_stderr: 1.0,
            ..row(1, 1e-9)
        };
        let rows = [rows.to_vec(), vec![point(row(2, 4.0)), point(vague)]].concat();
        assert_eq!(values(&rows), [2.0, 8.0]);
    }
}

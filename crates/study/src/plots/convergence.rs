//! Error over samples or time: one panel for each sampler, one line for each estimator.

use super::axis::{self, LogAxis, Unit};
use super::palette::Palette;
use super::svg::{Anchor, Canvas, text_width};
use crate::report::scientific;
use crate::tables::ResultRow;
use linelit_elementary::pow;

/// One measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlotPoint {
    /// Samples or seconds.
    pub x: f64,
    /// Standard deviation of `x`, for the horizontal bar; zero or NaN for none.
    pub x_error: f64,
    /// Error.
    pub y: f64,
    /// Standard error of `y`, for the bar.
    pub y_error: f64,
}

/// The measurements of one estimator with one sampler.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The estimator, which chooses the colour and mark.
    pub estimator: String,
    /// The pattern, which chooses the panel.
    pub sampler: String,
    /// The measurements, in the order in which a line joins them.
    pub points: Vec<PlotPoint>,
    /// Samples or seconds at which there is no noise, with their standard deviations: open marks on
    /// the edge towards which better ones lie.
    pub noiseless: Vec<[f64; 2]>,
}

/// A log–log plot.
#[derive(Clone, Debug)]
pub struct ConvergencePlot {
    /// Description of the plot for screen readers.
    pub title: String,
    /// Label of the horizontal axis.
    pub x_label: String,
    /// Label of the vertical axis.
    pub y_label: String,
    /// Ticks of the horizontal axis, else powers of ten (as seconds).
    pub x_ticks: Option<Vec<f64>>,
    /// Whether more is better: where open marks stand above, not below.
    pub more_is_better: bool,
    /// Slopes drawn as dashed lines from the first point of the worst estimator.
    pub guides: Vec<f64>,
    /// The data. Points that are not positive cannot be drawn and are left out.
    pub series: Vec<Series>,
    /// Colours; of the whole report, so that they are the same in all its plots.
    pub palette: Palette,
}

const LEFT: f64 = 64.0;
const RIGHT: f64 = 22.0;
const GAP: f64 = 18.0;
const PANEL_HEIGHT: f64 = 236.0;
const PANEL_HEAD: f64 = 24.0;
const TICKS: f64 = 22.0;
const X_LABEL: f64 = 26.0;
const WIDTH: f64 = 900.0;
const LEGEND_ROW: f64 = 20.0;

/// Root mean squared error over the number of samples, with the slopes −½, −1 and −3/2.
#[must_use]
pub fn error_over_samples(scene: &str, rows: &[ResultRow], palette: &Palette) -> ConvergencePlot {
    let series = gather(scene, rows, samples, rmse);
    ConvergencePlot {
        title: format!("{scene}: error over samples"),
        x_label: "light samples of a shading point".to_owned(),
        y_label: "root mean squared error".to_owned(),
        x_ticks: Some(counts(&series)),
        more_is_better: false,
        guides: vec![-0.5, -1.0, -1.5],
        series,
        palette: palette.clone(),
    }
}

/// The number of samples, which has no error.
fn samples(row: &ResultRow) -> [f64; 2] {
    [row.samples.into(), 0.0]
}

/// The rows whose time is known.
fn timed(rows: &[ResultRow]) -> Vec<ResultRow> {
    let known = rows.iter().filter(|row| row.cpu_seconds > 0.0);
    known.cloned().collect()
}

/// Root mean squared error over processor seconds; horizontal bars are the standard deviation of
/// the times of passes, how far another run may be.
#[must_use]
pub fn error_over_time(scene: &str, rows: &[ResultRow], palette: &Palette) -> ConvergencePlot {
    let rows = &timed(rows);
    ConvergencePlot {
        title: format!("{scene}: error over time"),
        x_label: "processor time of one trial, without set-up".to_owned(),
        y_label: "root mean squared error".to_owned(),
        x_ticks: None,
        more_is_better: false,
        guides: Vec::new(),
        series: gather(scene, rows, |row| [row.cpu_seconds, row.cpu_error], rmse),
        palette: palette.clone(),
    }
}

/// Efficiency, 1/(mean squared error · processor time), over the number of samples, the least on
/// the scene being one: level for independent samples, rising where stratification pays.
#[must_use]
pub fn efficiency_over_samples(
    scene: &str,
    rows: &[ResultRow],
    palette: &Palette,
) -> ConvergencePlot {
    let rows = &timed(rows);
    let cost = |row: &ResultRow| row.mse * row.cpu_seconds;
    let noisy = rows
        .iter()
        .filter(|r| r.scene == scene && !r.is_noiseless());
    let most = noisy
        .map(cost)
        .filter(|c| c.is_finite())
        .fold(0.0, f64::max);
    let efficiency = |row: &ResultRow| {
        let value = most / cost(row);
        // The time's error belongs to all measurements of a moment: it is left to the tables.
        (value, value * row.mse_stderr / row.mse)
    };
    let series = gather(scene, rows, samples, efficiency);
    ConvergencePlot {
        title: format!("{scene}: efficiency over samples"),
        x_label: "light samples of a shading point".to_owned(),
        y_label: "efficiency".to_owned(),
        x_ticks: Some(counts(&series)),
        more_is_better: true,
        guides: Vec::new(),
        series,
        palette: palette.clone(),
    }
}

/// The root mean squared error and its standard error.
fn rmse(row: &ResultRow) -> (f64, f64) {
    let rmse = row.mse.sqrt();
    // d√m = dm/(2√m).
    (rmse, 0.5 * row.mse_stderr / rmse)
}

/// All abscissae, ascending.
fn counts(series: &[Series]) -> Vec<f64> {
    let mut ticks: Vec<f64> = series.iter().flat_map(Series::abscissae).collect();
    ticks.sort_by(f64::total_cmp);
    ticks.dedup();
    ticks
}

impl Series {
    fn abscissae(&self) -> impl Iterator<Item = f64> + '_ {
        let noisy = self.points.iter().filter(|p| drawable(p)).map(|p| p.x);
        noisy.chain(self.noiseless.iter().map(|[x, _]| *x))
    }
}

fn gather(
    scene: &str,
    rows: &[ResultRow],
    x: impl Fn(&ResultRow) -> [f64; 2],
    y: impl Fn(&ResultRow) -> (f64, f64),
) -> Vec<Series> {
    let mut all: Vec<Series> = Vec::new();
    for row in rows.iter().filter(|row| row.scene == scene) {
        let same = |s: &Series| s.estimator == row.estimator && s.sampler == row.sampler;
        let index = all.iter().position(same).unwrap_or(all.len());
        if index == all.len() {
            all.push(Series {
                estimator: row.estimator.clone(),
                sampler: row.sampler.clone(),
                points: Vec::new(),
                noiseless: Vec::new(),
            });
        }
        if row.is_noiseless() {
            all[index].noiseless.push(x(row));
            continue;
        }
        let ([x, x_error], (y, y_error)) = (x(row), y(row));
        all[index].points.push(PlotPoint {
            x,
            x_error,
            y,
            y_error,
        });
    }
    all
}

/// Position, alignment and text of a guide's order.
type GuideLabel = ([f64; 2], Anchor, String);

/// A panel's two axes.
#[derive(Clone, Copy)]
struct Panel {
    x: LogAxis,
    y: LogAxis,
}

impl Panel {
    fn pixel(&self, x: f64, y: f64) -> [f64; 2] {
        [self.x.pixel(x), self.y.pixel(y)]
    }
}

impl ConvergencePlot {
    /// The SVG.
    #[must_use]
    pub fn render(&self) -> String {
        let samplers = unique(self.series.iter().map(|s| s.sampler.as_str()));
        let estimators = unique(self.series.iter().map(|s| s.estimator.as_str()));
        let columns = samplers.len().clamp(1, 3);
        let rows = samplers.len().div_ceil(columns).max(1);
        let room = WIDTH - LEFT - RIGHT - GAP * (columns - 1) as f64;
        let panel_width = room / columns as f64;
        let legend_rows = self.legend_rows(&estimators);
        let legend_height = LEGEND_ROW * legend_rows.len() as f64 + 6.0;
        let row_height = PANEL_HEAD + PANEL_HEIGHT + TICKS;
        let height = legend_height + row_height * rows as f64 + X_LABEL;
        let mut canvas = Canvas::new(WIDTH, height);
        self.draw_legend(&mut canvas, &legend_rows);
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
            for (point, anchor, text) in labels {
                canvas.text("ll-halo", point, anchor, &text);
            }
        }
        let middle = LEFT + 0.5 * (WIDTH - LEFT - RIGHT);
        canvas.text("", [middle, height - 7.0], Anchor::Middle, &self.x_label);
        let centre = legend_height + 0.5 * (row_height * rows as f64) + 2.0;
        canvas.upright("", [15.0, centre], &self.y_label);
        canvas.finish(&self.title)
    }

    fn points(&self) -> impl Iterator<Item = &PlotPoint> {
        self.series
            .iter()
            .flat_map(|series| &series.points)
            .filter(|point| drawable(point))
    }

    fn axes(&self) -> (LogAxis, LogAxis) {
        let abscissae = self.series.iter().flat_map(Series::abscissae);
        let mut x = LogAxis::spanning(abscissae, 1.35);
        if !self.guides.is_empty() {
            // Room beyond the last point, where the guides' orders stand.
            x.high *= pow(x.high / x.low, 0.1).max(1.2);
        }
        let y = LogAxis::spanning(self.points().map(|p| p.y), 1.6);
        (x, y)
    }

    /// Which estimators stand in each row of the legend.
    fn legend_rows<'a>(&self, estimators: &[&'a str]) -> Vec<Vec<(f64, &'a str)>> {
        let mut rows: Vec<Vec<(f64, &str)>> = vec![Vec::new()];
        let mut at = LEFT;
        for &estimator in estimators {
            let width = 30.0 + text_width(estimator, 12.0) + 22.0;
            if at + width > WIDTH && at > LEFT {
                rows.push(Vec::new());
                at = LEFT;
            }
            if let Some(row) = rows.last_mut() {
                row.push((at, estimator));
            }
            at += width;
        }
        rows
    }

    fn draw_legend(&self, canvas: &mut Canvas, rows: &[Vec<(f64, &str)>]) {
        for (index, row) in rows.iter().enumerate() {
            let y = 14.0 + LEGEND_ROW * index as f64;
            for &(x, estimator) in row {
                let colour = self.palette.index(estimator);
                canvas.line(&format!("ll-l{colour}"), [x, y - 4.0], [x + 22.0, y - 4.0]);
                canvas.mark(&format!("ll-m{colour}"), colour, [x + 11.0, y - 4.0], "");
                canvas.text("", [x + 29.0, y], Anchor::Start, estimator);
            }
        }
    }

    fn draw_frame(&self, canvas: &mut Canvas, panel: Panel, labelled: bool) {
        let Panel { x, y } = panel;
        for tick in y.ticks() {
            let at = y.pixel(tick);
            canvas.line("ll-grid", [x.from, at], [x.to, at]);
            if labelled {
                let text = axis::label(tick, Unit::Number);
                canvas.markup("ll-small", [x.from - 7.0, at + 4.0], Anchor::End, &text);
            }
        }
        let (ticks, unit) = match &self.x_ticks {
            Some(ticks) => (thin(ticks, x), Unit::Count),
            None => (thin(&x.ticks(), x), Unit::Seconds),
        };
        for tick in ticks {
            let at = x.pixel(tick);
            canvas.line("ll-grid", [at, y.from], [at, y.to]);
            let text = axis::label(tick, unit);
            canvas.markup("ll-small", [at, y.from + 16.0], Anchor::Middle, &text);
        }
        canvas.rect("ll-panel", [x.from, y.to], [x.to - x.from, y.from - y.to]);
    }

    /// Dashed slopes from the first point of the worst estimator in the panel; their orders, to
    /// stand where they leave it, come back, as they must be drawn above the data.
    fn draw_guides(&self, canvas: &mut Canvas, panel: Panel, sampler: &str) -> Vec<GuideLabel> {
        let start = self
            .series
            .iter()
            .filter(|series| series.sampler == sampler)
            .filter_map(|series| series.points.iter().find(|point| drawable(point)))
            .max_by(|a, b| a.y.total_cmp(&b.y));
        let mut labels = Vec::new();
        let Some(start) = start else { return labels };
        for &slope in &self.guides {
            let at = |x: f64| start.y * pow(x / start.x, slope);
            let right = at(panel.x.high);
            let leaves_right = right >= panel.y.low;
            let (x, y) = if leaves_right {
                (panel.x.high, right)
            } else {
                let x = start.x * pow(panel.y.low / start.y, slope.recip());
                (x, panel.y.low)
            };
            let end = panel.pixel(x, y);
            canvas.line("ll-guide", panel.pixel(start.x, start.y), end);
            let text = format!("−{}", axis::short(-slope));
            // Below, on the steep side of the guide, where no data are expected.
            let aside = if leaves_right { 5.0 } else { 12.0 };
            labels.push(([end[0] - aside, end[1] - 7.0], Anchor::End, text));
        }
        labels
    }

    fn draw_series(&self, canvas: &mut Canvas, panel: Panel, series: &Series) {
        let colour = self.palette.index(&series.estimator);
        let points: Vec<&PlotPoint> = series.points.iter().filter(|p| drawable(p)).collect();
        let pixels: Vec<[f64; 2]> = points.iter().map(|p| panel.pixel(p.x, p.y)).collect();
        canvas.polyline(&format!("ll-l{colour}"), &pixels);
        for (point, pixel) in points.iter().zip(&pixels) {
            let (y, class) = ([point.y, point.y_error], format!("ll-e{colour}"));
            if let Some([low, high]) = bar(y, panel.y) {
                let x = pixel[0];
                canvas.line(&class, [x, high], [x, low]);
                for y in [high, low] {
                    canvas.line(&class, [x - 3.0, y], [x + 3.0, y]);
                }
            }
            draw_spread(canvas, panel, colour, [point.x, point.x_error], pixel[1]);
            let hover = format!(
                "{} · {} · {}: {} ± {}",
                series.estimator,
                series.sampler,
                self.abscissa([point.x, point.x_error]),
                scientific(point.y),
                scientific(point.y_error)
            );
            canvas.mark(&format!("ll-m{colour}"), colour, *pixel, &hover);
        }
        let edge = if self.more_is_better {
            panel.y.high
        } else {
            panel.y.low
        };
        for &x in &series.noiseless {
            let at = panel.pixel(x[0], edge);
            draw_spread(canvas, panel, colour, x, at[1]);
            let hover = format!(
                "{} · {} · {}: no noise",
                series.estimator,
                series.sampler,
                self.abscissa(x)
            );
            canvas.mark(&format!("ll-o{colour}"), colour, at, &hover);
        }
    }

    fn abscissa(&self, [x, error]: [f64; 2]) -> String {
        if self.x_ticks.is_some() {
            format!("{x} samples")
        } else if error > 0.0 {
            format!("{} ± {}", axis::seconds(x), axis::seconds(error))
        } else {
            axis::seconds(x)
        }
    }
}

/// The horizontal bar of an abscissa with its standard deviation, at a height.
fn draw_spread(canvas: &mut Canvas, panel: Panel, colour: usize, x: [f64; 2], y: f64) {
    let Some([low, high]) = bar(x, panel.x) else {
        return;
    };
    let class = format!("ll-e{colour}");
    canvas.line(&class, [low, y], [high, y]);
    for x in [low, high] {
        canvas.line(&class, [x, y - 3.0], [x, y + 3.0]);
    }
}

/// The ends of an error bar along an axis, which end where the axis does; `None` for no error.
fn bar([value, error]: [f64; 2], axis: LogAxis) -> Option<[f64; 2]> {
    let ends = [(value - error).max(axis.low), value + error];
    (error > 0.0).then(|| ends.map(|end| axis.pixel(end)))
}

fn drawable(point: &PlotPoint) -> bool {
    point.x > 0.0 && point.x.is_finite() && point.y > 0.0 && point.y.is_finite()
}

pub(crate) fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut all = Vec::new();
    for name in names {
        if !all.contains(&name) {
            all.push(name);
        }
    }
    all
}

/// Leaves out ticks whose labels would touch: every second, every third….
fn thin(ticks: &[f64], axis: LogAxis) -> Vec<f64> {
    let inside: Vec<f64> = ticks
        .iter()
        .copied()
        .filter(|&tick| axis.holds(tick))
        .collect();
    let enough_room = |step: usize| {
        let kept: Vec<f64> = inside
            .iter()
            .step_by(step)
            .map(|&tick| axis.pixel(tick))
            .collect();
        kept.windows(2).all(|pair| pair[1] - pair[0] >= 38.0)
    };
    let step = (1..=inside.len().max(1))
        .find(|&step| enough_room(step))
        .unwrap_or(1);
    inside.into_iter().step_by(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: &[[f64; 3]]) -> ConvergencePlot {
        let points = points
            .iter()
            .map(|&[x, y, y_error]| PlotPoint {
                x,
                y,
                y_error,
                ..PlotPoint::default()
            })
            .collect();
        let series = Series {
            estimator: "a<b".to_owned(),
            sampler: "sobol".to_owned(),
            points,
            noiseless: vec![[4.0, 0.0]],
        };
        ConvergencePlot {
            title: "t".to_owned(),
            x_label: "x".to_owned(),
            y_label: "y".to_owned(),
            x_ticks: Some(vec![1.0, 4.0, 16.0]),
            more_is_better: false,
            guides: vec![-0.5, -1.5],
            series: vec![series],
            palette: Palette::new(["a<b"]),
        }
    }

    #[test]
    fn impossible_values_are_left_out_and_all_numbers_are_finite() {
        let svg = plot(&[
            [1.0, 0.5, 9.0],
            [4.0, 0.0, 0.0],
            [16.0, f64::NAN, 1.0],
            [64.0, 1e-3, f64::NAN],
        ])
        .render();
        // Two with noise, and one without on the lower edge.
        assert_eq!(svg.matches("<title>").count(), 3);
        assert_eq!(svg.matches(r#"class="ll-o"#).count(), 1);
        assert!(!svg.contains("inf") && !svg.contains("\"NaN"), "{svg}");
        assert!(svg.contains("a&lt;b") && !svg.contains("a<b"));
        assert_eq!(svg.matches("ll-guide\"").count(), 2);
    }

    /// A bar along the axis, one across it, and none for an error that is not known.
    #[test]
    fn bars_say_how_sure_times_are() {
        let row = |samples: u32, cpu_error| ResultRow {
            scene: "s".to_owned(),
            samples,
            trials: 8,
            mse: 1.0 / f64::from(samples),
            variance: f64::from(u32::from(samples < 64)),
            cpu_seconds: 1e-3 * f64::from(samples),
            cpu_error,
            ..ResultRow::default()
        };
        let rows = [row(1, 1e-4), row(4, 9.0), row(16, f64::NAN), row(64, 8e-3)];
        let plot = error_over_time("s", &rows, &Palette::default());
        let errors = plot.series[0].points.iter().map(|p| p.x_error);
        assert_eq!(errors.take(2).collect::<Vec<_>>(), [1e-4, 9.0]);
        assert_eq!(plot.series[0].noiseless, [[64e-3, 8e-3]]);
        // Each of the three that are known is a line and its two ends; no error of the error is.
        let svg = plot.render();
        assert_eq!(svg.matches(r#"class="ll-e"#).count(), 9, "{svg}");
        assert!(svg.contains("1 ms ± 100 µs"), "{svg}");
        assert!(!svg.contains("inf") && !svg.contains("NaN\""));
        let axis = LogAxis {
            low: 1.0,
            high: 100.0,
            from: 0.0,
            to: 20.0,
        };
        // From 10 − 9 to 10 + 990, which is beyond.
        assert_eq!(bar([10.0, 9.0], axis), Some([0.0, axis.pixel(19.0)]));
        assert_eq!(bar([10.0, 990.0], axis), Some([0.0, 20.0]));
        assert_eq!(bar([10.0, f64::NAN], axis), None);
        let none = error_over_samples("s", &rows, &Palette::default()).render();
        assert_eq!(none.matches(r#"class="ll-e"#).count(), 0);
    }

    #[test]
    fn a_plot_without_data_is_still_a_picture() {
        let svg = ConvergencePlot {
            series: Vec::new(),
            ..plot(&[])
        }
        .render();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
        assert!(plot(&[]).render().contains("</svg>"));
    }

    #[test]
    fn rows_become_series_with_the_error_of_the_root() {
        let row = |samples, mse| ResultRow {
            scene: "s".to_owned(),
            estimator: "e".to_owned(),
            sampler: "r".to_owned(),
            samples,
            mse,
            mse_stderr: 0.1 * mse,
            trials: 8,
            variance: mse,
            cpu_seconds: 1e-3,
            ..ResultRow::default()
        };
        let other = ResultRow {
            scene: "other".to_owned(),
            ..row(1, 1.0)
        };
        let closed = ResultRow {
            variance: 0.0,
            ..row(16, 1e-12)
        };
        let rows = [row(1, 4.0), other, row(4, 1.0), closed];
        let plot = error_over_samples("s", &rows, &Palette::default());
        assert_eq!(plot.series.len(), 1);
        assert_eq!(plot.series[0].noiseless, [[16.0, 0.0]]);
        let efficiency = efficiency_over_samples("s", &rows, &Palette::default());
        let values = efficiency.series[0].points.iter().map(|p| p.y);
        assert_eq!(values.collect::<Vec<_>>(), [1.0, 4.0]);
        let points = &plot.series[0].points;
        assert_eq!(
            (points.len(), points[0].y.to_bits()),
            (2, 2.0_f64.to_bits())
        );
        // 10 % of the square is 5 % of the root.
        assert!((points[0].y_error - 0.1).abs() < 1e-15);
    }
}

//! Orders of convergence with their intervals, the papers' beside them.

use super::convergence::unique;
use super::palette::Palette;
use super::svg::{Anchor, Canvas};
use crate::tables::SlopeRow;

const WIDTH: f64 = 900.0;
const LEFT: f64 = 196.0;
const RIGHT: f64 = 250.0;
const ROW: f64 = 22.0;
const HEAD: f64 = 30.0;

/// One row for each estimator, grouped by sampler: our order as a dot with its 95 % interval, the
/// paper's as an open diamond, both in figures at the right.
#[must_use]
pub fn orders(scene: &str, slopes: &[SlopeRow], palette: &Palette) -> String {
    let rows: Vec<&SlopeRow> = slopes.iter().filter(|row| row.scene == scene).collect();
    let samplers = unique(rows.iter().map(|row| row.sampler.as_str()));
    let height = 24.0 + HEAD * samplers.len() as f64 + ROW * rows.len() as f64 + 30.0;
    let mut canvas = Canvas::new(WIDTH, height);
    let axis = Axis::spanning(&rows);
    let bottom = height - 26.0;
    for tick in axis.ticks() {
        let x = axis.pixel(tick);
        let strong = (tick * 2.0 - (tick * 2.0).round()).abs() < 1e-9;
        canvas.line(
            if strong { "ll-strong" } else { "ll-grid" },
            [x, 22.0],
            [x, bottom],
        );
        canvas.text(
            "ll-small",
            [x, bottom + 16.0],
            Anchor::Middle,
            &signed(tick, 2),
        );
    }
    canvas.text(
        "ll-small",
        [WIDTH - RIGHT + 16.0, 14.0],
        Anchor::Start,
        "order and 95 % interval",
    );
    canvas.text("ll-small", [WIDTH - 4.0, 14.0], Anchor::End, "paper");
    let mut y = 22.0;
    for sampler in samplers {
        y += HEAD;
        canvas.text("ll-head", [8.0, y - 9.0], Anchor::Start, sampler);
        for row in rows.iter().filter(|row| row.sampler == sampler) {
            draw_row(&mut canvas, &axis, row, palette.index(&row.estimator), y);
            y += ROW;
        }
    }
    canvas.finish(&format!("{scene}: orders of convergence"))
}

fn draw_row(canvas: &mut Canvas, axis: &Axis, row: &SlopeRow, colour: usize, top: f64) {
    let y = top + 0.5 * ROW;
    canvas.text(
        "",
        [LEFT - 14.0, y + 4.0],
        Anchor::End,
        &shorten(&row.estimator, 26),
    );
    if let Some(paper) = row.paper_order {
        canvas.mark(
            "ll-paperdot",
            3,
            [axis.pixel(paper), y],
            &format!("paper: {}", signed(paper, 3)),
        );
        canvas.text("", [WIDTH - 4.0, y + 4.0], Anchor::End, &signed(paper, 3));
    }
    if row.order.is_finite() {
        let (low, high) = (axis.pixel(row.ci_low), axis.pixel(row.ci_high));
        if row.ci_low.is_finite() && row.ci_high.is_finite() {
            let class = format!("ll-e{colour}");
            canvas.line(&class, [low, y], [high, y]);
            for x in [low, high] {
                canvas.line(&class, [x, y - 4.0], [x, y + 4.0]);
            }
        }
        let hover = format!(
            "{} · {} · N = {} to {}: {}",
            row.estimator,
            row.sampler,
            row.n_min,
            row.n_max,
            with_interval(row)
        );
        canvas.mark(
            &format!("ll-m{colour}"),
            colour,
            [axis.pixel(row.order), y],
            &hover,
        );
    }
    canvas.text(
        "",
        [WIDTH - RIGHT + 16.0, y + 4.0],
        Anchor::Start,
        &with_interval(row),
    );
}

fn with_interval(row: &SlopeRow) -> String {
    let interval = interval(row).unwrap_or_default();
    format!("{}  {interval}", signed(row.order, 3))
}

/// The interval of an order, if there is one.
pub(crate) fn interval(row: &SlopeRow) -> Option<String> {
    let known = row.ci_low.is_finite() && row.ci_high.is_finite();
    let [low, high] = [row.ci_low, row.ci_high].map(|end| signed(end, 3));
    known.then(|| format!("[{low}, {high}]"))
}

/// A number with a true minus sign; a dash for none.
pub(crate) fn signed(value: f64, digits: usize) -> String {
    if value.is_finite() {
        format!("{value:.digits$}").replace('-', "−")
    } else {
        "–".to_owned()
    }
}

fn shorten(name: &str, most: usize) -> String {
    if name.chars().count() <= most {
        return name.to_owned();
    }
    let mut short: String = name.chars().take(most - 1).collect();
    short.push('…');
    short
}

/// The linear axis of orders.
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    fn spanning(rows: &[&SlopeRow]) -> Self {
        let values = || {
            rows.iter()
                .flat_map(|r| {
                    [
                        Some(r.order),
                        Some(r.ci_low),
                        Some(r.ci_high),
                        r.paper_order,
                    ]
                })
                .flatten()
                .filter(|v| v.is_finite())
        };
        // Absurdly wide intervals are clamped, not followed.
        let low = values().fold(-1.0, f64::min).max(-3.0);
        let high = values().fold(-0.5, f64::max).min(0.5);
        Self {
            low: low - 0.06,
            high: high + 0.06,
        }
    }

    fn pixel(&self, value: f64) -> f64 {
        let t = (value.clamp(self.low, self.high) - self.low) / (self.high - self.low);
        LEFT + t * (WIDTH - RIGHT - LEFT)
    }

    fn ticks(&self) -> Vec<f64> {
        let quarters = |v: f64| v * 4.0;
        #[allow(
            clippy::cast_possible_truncation,
            reason = "the axis lies within −4 and 1"
        )]
        let (first, last) = (
            quarters(self.low).ceil() as i32,
            quarters(self.high).floor() as i32,
        );
        (first..=last).map(|k| f64::from(k) / 4.0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_drawn_with_the_papers_order() {
        let row = |estimator: &str, order: f64| SlopeRow {
            scene: "s".to_owned(),
            estimator: estimator.to_owned(),
            sampler: "stratified".to_owned(),
            order,
            ci_low: order - 0.02,
            ci_high: order + 0.02,
            ..SlopeRow::default()
        };
        let rows = [
            row("line-area", -1.1).with_paper(-1.152, "Fig. 9"),
            row("x", f64::NAN),
        ];
        let svg = orders("s", &rows, &Palette::new(["line-area", "x"]));
        assert!(svg.contains("−1.100  [−1.120, −1.080]") && svg.contains("−1.152"));
        assert!(!svg.contains("NaN"), "{svg}");
        assert!(orders("none", &rows, &Palette::default()).contains("</svg>"));
    }
}

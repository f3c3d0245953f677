//! Figures with their intervals, one below the other, on a scale that they share.

use super::axis::signed;
use super::convergence::unique;
use super::palette::Palette;
use super::svg::{Anchor, Canvas, text_width};
use crate::tables::SlopeRow;

const WIDTH: f64 = 900.0;
const ROW: f64 = 20.0;
const TOP: f64 = 34.0;

/// A figure with its interval, and the band that it is expected in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IntervalRow {
    /// The label at the left.
    pub label: String,
    /// Whether the label is a heading, of rows that follow.
    pub heading: bool,
    /// The figure.
    pub value: f64,
    /// The confidence interval of the figure.
    pub interval: [f64; 2],
    /// The band in which the figure is expected, if there is one.
    pub band: Option<[f64; 2]>,
    /// The figure that others report, if they do, drawn as an open diamond.
    pub other: Option<f64>,
    /// The text at the right.
    pub figures: String,
    /// Colour and shape of the mark, by a number.
    pub kind: usize,
    /// Shown on hovering.
    pub hover: String,
}

/// A row for each figure: a mark with its interval over the band that it is expected in. `guides`
/// are places on the scale with names above them. What is beyond `range` is drawn at its edge.
///
/// ```
/// use linelit_study::plots::{IntervalRow, intervals};
/// let row = IntervalRow {
///     label: "a gain".to_owned(),
///     value: 0.8,
///     interval: [0.7, 0.9],
///     ..IntervalRow::default()
/// };
/// let svg = intervals("gains", &[row], &[(0.0, "none"), (1.0, "paper")], [-0.5, 1.5]);
/// assert!(svg.contains("a gain") && svg.ends_with("</svg>\n"));
/// ```
#[must_use]
pub fn intervals(
    title: &str,
    rows: &[IntervalRow],
    guides: &[(f64, &str)],
    range: [f64; 2],
) -> String {
    let widest = |of: fn(&IntervalRow) -> &str| {
        let widths = rows.iter().map(|row| text_width(of(row), 12.0));
        widths.fold(0.0, f64::max)
    };
    let scale = Scale {
        range,
        left: widest(|row| &row.label) + 20.0,
        right: WIDTH - widest(|row| &row.figures) - 24.0,
    };
    let height = TOP + ROW * rows.len() as f64 + 12.0;
    let mut canvas = Canvas::new(WIDTH);
    for (value, name) in guides {
        let x = scale.pixel(*value);
        canvas.line("ll-strong", [x, TOP - 8.0], [x, height - 8.0]);
        canvas.text("ll-small", [x, 16.0], Anchor::Middle, name);
    }
    for (k, row) in rows.iter().enumerate() {
        scale.draw(&mut canvas, row, TOP + ROW * (k as f64 + 0.5));
    }
    canvas.finish(height, title)
}

/// A linear scale between two pixels.
struct Scale {
    range: [f64; 2],
    left: f64,
    right: f64,
}

impl Scale {
    fn pixel(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        let t = (value.clamp(low, high) - low) / (high - low);
        self.left + t * (self.right - self.left)
    }

    fn draw(&self, canvas: &mut Canvas, row: &IntervalRow, y: f64) {
        if row.heading {
            canvas.text("ll-head", [8.0, y + 4.0], Anchor::Start, &row.label);
            return;
        }
        let label = [self.left - 14.0, y + 4.0];
        canvas.text("", label, Anchor::End, &row.label);
        let figures = [self.right + 16.0, y + 4.0];
        canvas.text("", figures, Anchor::Start, &row.figures);
        if let Some(band) = row.band.filter(|b| b.iter().all(|v| v.is_finite())) {
            let [a, b] = [band[0].min(band[1]), band[0].max(band[1])].map(|v| self.pixel(v));
            let size = [(b - a).max(1.0), 0.6 * ROW];
            canvas.rect("ll-panel", [a, y - 0.3 * ROW], size);
        }
        if let Some(other) = row.other {
            canvas.mark("ll-paperdot", 3, [self.pixel(other), y], "");
        }
        if row.value.is_finite() {
            if row.interval.iter().all(|v| v.is_finite()) {
                let [a, b] = row.interval.map(|v| self.pixel(v));
                canvas.bar(&format!("ll-e{}", row.kind), [a, y], [b, y]);
            }
            let class = format!("ll-m{}", row.kind);
            canvas.mark(&class, row.kind, [self.pixel(row.value), y], &row.hover);
        }
    }
}

/// Orders of convergence on a scene, grouped by sampler: ours as a mark with its 95 % interval, the
/// paper's as an open diamond, both in figures at the right.
pub(crate) fn orders(scene: &str, slopes: &[SlopeRow], palette: &Palette) -> String {
    let own: Vec<&SlopeRow> = slopes.iter().filter(|row| row.scene == scene).collect();
    let mut rows = Vec::new();
    for sampler in unique(own.iter().map(|row| row.sampler.as_str())) {
        rows.push(IntervalRow {
            label: sampler.to_owned(),
            heading: true,
            ..IntervalRow::default()
        });
        let ours = own.iter().filter(|row| row.sampler == sampler);
        rows.extend(ours.map(|row| order(row, palette)));
    }
    let values = || {
        let fits = own.iter().map(|row| (row.fit, row.paper_order));
        let all =
            fits.flat_map(|(f, paper)| [Some(f.order), Some(f.ci_low), Some(f.ci_high), paper]);
        all.flatten().filter(|v| v.is_finite())
    };
    // Absurdly wide intervals are clamped, not followed.
    let low = values().fold(-1.0, f64::min).max(-3.0) - 0.06;
    let high = values().fold(-0.5, f64::max).min(0.5) + 0.06;
    let guides = [
        (-2.0, "−2"),
        (-1.5, "−1.5"),
        (-1.0, "−1"),
        (-0.5, "−0.5"),
        (0.0, "0"),
    ];
    let inside: Vec<(f64, &str)> = (guides.into_iter())
        .filter(|(value, _)| (low..high).contains(value))
        .collect();
    let title = format!("{scene}: orders of convergence");
    intervals(&title, &rows, &inside, [low, high])
}

fn order(row: &SlopeRow, palette: &Palette) -> IntervalRow {
    let ours = format!(
        "{}  {}",
        signed(row.fit.order, 3),
        interval(row).unwrap_or_default()
    );
    let paper = row
        .paper_order
        .map(|order| format!("  paper {}", signed(order, 3)));
    let (estimator, sampler, fit) = (&row.estimator, &row.sampler, row.fit);
    let range = format!("N = {} to {}", fit.n_min, fit.n_max);
    IntervalRow {
        label: estimator.clone(),
        value: fit.order,
        interval: [fit.ci_low, fit.ci_high],
        other: row.paper_order,
        hover: format!("{estimator} · {sampler} · {range}: {ours}"),
        figures: ours + &paper.unwrap_or_default(),
        kind: palette.index(estimator),
        ..IntervalRow::default()
    }
}

/// The interval of an order, if there is one.
pub(crate) fn interval(row: &SlopeRow) -> Option<String> {
    let ends = Some([row.fit.ci_low, row.fit.ci_high]).filter(|e| e.iter().all(|v| v.is_finite()));
    ends.map(|[low, high]| format!("[{}, {}]", signed(low, 3), signed(high, 3)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::slopes::Order;

    #[test]
    fn what_is_no_number_has_a_label_alone_and_the_rest_stays_inside() {
        let row = |label: &str, value: f64| IntervalRow {
            label: label.to_owned(),
            value,
            interval: [value - 0.1, value + 0.1],
            band: Some([0.9, 1.1]),
            ..IntervalRow::default()
        };
        let rows = [
            row("known", 0.5),
            row("far", 90.0),
            row("unknown", f64::NAN),
        ];
        let svg = intervals("t", &rows, &[(1.0, "paper")], [0.0, 2.0]);
        assert!(!svg.contains("NaN"), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 2);
        // The far one is at the right edge: 900 − 24.
        assert!(svg.contains(r#"cx="876""#), "{svg}");
        assert!(svg.contains("unknown"));
    }

    #[test]
    fn every_order_is_drawn_with_the_papers() {
        let row = |estimator: &str, order: f64, paper_order| SlopeRow {
            scene: "s".to_owned(),
            estimator: estimator.to_owned(),
            sampler: "stratified".to_owned(),
            fit: Order {
                order,
                ci_low: order - 0.02,
                ci_high: order + 0.02,
                ..Order::default()
            },
            paper_order,
            ..SlopeRow::default()
        };
        let rows = [
            row("line-area", -1.1, Some(-1.152)),
            row("x", f64::NAN, None),
        ];
        let svg = orders("s", &rows, &Palette::new(["line-area", "x"]));
        assert!(svg.contains("−1.100  [−1.120, −1.080]") && svg.contains("−1.152"));
        assert!(!svg.contains("NaN"), "{svg}");
        assert!(orders("none", &rows, &Palette::default()).contains("</svg>"));
    }
}

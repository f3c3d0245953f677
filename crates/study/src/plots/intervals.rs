//! Figures with their intervals, one below the other, on a scale that they share.

use super::svg::{Anchor, Canvas};

const WIDTH: f64 = 900.0;
const LEFT: f64 = 330.0;
const RIGHT: f64 = 24.0;
const ROW: f64 = 20.0;
const TOP: f64 = 34.0;

/// A figure with its interval, and the band that it is expected in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IntervalRow {
    /// What stands at the left.
    pub label: String,
    /// The figure.
    pub value: f64,
    /// Its interval.
    pub interval: [f64; 2],
    /// Where it is expected, if that is a band.
    pub band: Option<[f64; 2]>,
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
    [low, high]: [f64; 2],
) -> String {
    let height = TOP + ROW * rows.len() as f64 + 12.0;
    let mut canvas = Canvas::new(WIDTH, height);
    let place = |v: f64| {
        let t = (v.clamp(low, high) - low) / (high - low);
        LEFT + t * (WIDTH - RIGHT - LEFT)
    };
    for (value, name) in guides {
        let x = place(*value);
        canvas.line("ll-strong", [x, TOP - 8.0], [x, height - 8.0]);
        canvas.text("ll-small", [x, 16.0], Anchor::Middle, name);
    }
    for (k, row) in rows.iter().enumerate() {
        let y = TOP + ROW * (k as f64 + 0.5);
        canvas.text("", [LEFT - 14.0, y + 4.0], Anchor::End, &row.label);
        if let Some(band) = row.band.filter(|b| b.iter().all(|v| v.is_finite())) {
            let [a, b] = [place(band[0].min(band[1])), place(band[0].max(band[1]))];
            canvas.rect(
                "ll-panel",
                [a, y - 0.3 * ROW],
                [(b - a).max(1.0), 0.6 * ROW],
            );
        }
        if !row.value.is_finite() {
            continue;
        }
        if row.interval.iter().all(|v| v.is_finite()) {
            let [a, b] = row.interval.map(place);
            let class = format!("ll-e{}", row.kind);
            canvas.line(&class, [a, y], [b, y]);
            for x in [a, b] {
                canvas.line(&class, [x, y - 4.0], [x, y + 4.0]);
            }
        }
        let class = format!("ll-m{}", row.kind);
        canvas.mark(&class, row.kind, [place(row.value), y], &row.hover);
    }
    canvas.finish(title)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}

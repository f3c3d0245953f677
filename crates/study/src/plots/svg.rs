//! The few SVG elements that the plots are made of.

use linelit_elementary::{cos, sin};

use super::palette;

/// A drawing that collects elements. Coordinates are rounded to hundredths of a pixel.
#[derive(Debug)]
pub(crate) struct Canvas {
    width: f64,
    body: String,
}

/// The alignment of a text about its point.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    /// Returns the value of the attribute `text-anchor`.
    fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

impl Canvas {
    /// Creates an empty drawing of this width.
    pub(crate) fn new(width: f64) -> Self {
        Self {
            width,
            body: String::new(),
        }
    }

    /// Adds an element.
    fn raw(&mut self, element: &str) {
        self.body.push_str(element);
        self.body.push('\n');
    }

    /// Draws a line.
    pub(crate) fn line(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        let ([x1, y1], [x2, y2]) = (from.map(num), to.map(num));
        self.raw(&format!(
            r#"<line class="{class}" x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"/>"#
        ));
    }

    /// Draws an error bar along one of the axes, with a short line across each end.
    pub(crate) fn bar(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        self.line(class, from, to);
        let level = (from[1] - to[1]).abs() <= 0.0;
        let [dx, dy] = if level { [0.0, 3.0] } else { [3.0, 0.0] };
        for [x, y] in [from, to] {
            self.line(class, [x - dx, y - dy], [x + dx, y + dy]);
        }
    }

    /// Draws a rectangle.
    pub(crate) fn rect(&mut self, class: &str, corner: [f64; 2], size: [f64; 2]) {
        let ([x, y], [width, height]) = (corner.map(num), size.map(num));
        self.raw(&format!(
            r#"<rect class="{class}" x="{x}" y="{y}" width="{width}" height="{height}"/>"#
        ));
    }

    /// Draws the lines between consecutive points.
    pub(crate) fn polyline(&mut self, class: &str, points: &[[f64; 2]]) {
        let list = list(points, [0.0, 0.0]);
        self.raw(&format!(r#"<polyline class="{class}" points="{list}"/>"#));
    }

    /// Writes a text.
    pub(crate) fn text(&mut self, class: &str, at: [f64; 2], anchor: Anchor, text: &str) {
        let ([x, y], anchor, text) = (at.map(num), anchor.name(), escape(text));
        self.raw(&format!(
            r#"<text class="{class}" x="{x}" y="{y}" text-anchor="{anchor}">{text}</text>"#
        ));
    }

    /// Draws a text that reads upwards.
    pub(crate) fn upright(&mut self, class: &str, at: [f64; 2], text: &str) {
        let ([x, y], text) = (at.map(num), escape(text));
        self.raw(&format!(
            r#"<text class="{class}" transform="translate({x} {y}) rotate(-90)" text-anchor="middle">{text}</text>"#
        ));
    }

    /// Draws a mark of one of [`palette::MARK_COUNT`] shapes; `hover` is shown as a tooltip.
    pub(crate) fn mark(&mut self, class: &str, shape: usize, at: [f64; 2], hover: &str) {
        let title = if hover.is_empty() {
            String::new()
        } else {
            format!("<title>{}</title>", escape(hover))
        };
        let star = star();
        let corners: &[[f64; 2]] = match shape % palette::MARK_COUNT {
            0 => &[],
            1 => &[[-3.2, -3.2], [3.2, -3.2], [3.2, 3.2], [-3.2, 3.2]],
            2 => &[[0.0, -4.3], [4.0, 3.0], [-4.0, 3.0]],
            3 => &[[0.0, -4.6], [4.6, 0.0], [0.0, 4.6], [-4.6, 0.0]],
            4 => &[[0.0, 4.3], [4.0, -3.0], [-4.0, -3.0]],
            _ => &star,
        };
        let ([x, y], list) = (at.map(num), list(corners, at));
        self.raw(&if corners.is_empty() {
            format!(r#"<circle class="{class}" cx="{x}" cy="{y}" r="3.6">{title}</circle>"#)
        } else {
            format!(r#"<polygon class="{class}" points="{list}">{title}</polygon>"#)
        });
    }

    /// Returns the whole SVG at this height, with the style sheet and a label for screen readers.
    pub(crate) fn finish(self, height: f64, label: &str) -> String {
        let ([width, height], label) = ([self.width, height].map(num), escape(label));
        let (style, body) = (palette::css(), self.body);
        format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" class="ll" viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img" aria-label="{label}">
<style>{style}</style>
<rect class="ll-paper" width="{width}" height="{height}"/>
{body}</svg>
"#
        )
    }
}

/// Formats points relative to a centre as an SVG attribute.
fn list(points: &[[f64; 2]], [x, y]: [f64; 2]) -> String {
    let texts = points
        .iter()
        .map(|[dx, dy]| [x + dx, y + dy].map(num).join(","));
    texts.collect::<Vec<_>>().join(" ")
}

/// Returns the corners of a five-pointed star.
fn star() -> [[f64; 2]; 10] {
    let mut corners = [[0.0; 2]; 10];
    for (index, corner) in (0_u8..).zip(&mut corners) {
        let radius = if index % 2 == 0 { 5.4 } else { 2.3 };
        let angle = f64::from(index) * std::f64::consts::PI / 5.0;
        *corner = [radius * sin(angle), -radius * cos(angle)];
    }
    corners
}

/// Escapes text for markup, and replaces control characters by spaces.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// Formats a coordinate by hundredths, without trailing zeros.
fn num(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    let text = if text == "-0" { "0" } else { text };
    text.to_owned()
}

/// Returns a rough width of a text at a font size, in pixels, for layout.
pub(crate) fn text_width(text: &str, size: f64) -> f64 {
    0.56 * size * text.chars().count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_break_out() {
        assert_eq!(escape("a<b>&\"c\"\u{1}"), "a&lt;b&gt;&amp;&quot;c&quot; ");
        let mut canvas = Canvas::new(10.0);
        canvas.text("t", [1.0, 2.0], Anchor::End, "</text><script>");
        let svg = canvas.finish(20.5, "x\" onload=\"y");
        assert!(!svg.contains("<script>") && !svg.contains("onload=\"y\""));
        assert!(svg.contains(r#"viewBox="0 0 10 20.5""#));
    }

    #[test]
    fn coordinates_are_short() {
        assert_eq!(
            (num(1.0), num(-0.001), num(2.346)),
            ("1".into(), "0".into(), "2.35".into())
        );
    }
}

//! The palette of a report: each estimator has one colour and one mark in all plots.

use std::collections::BTreeMap;

/// The number of different shapes of marks.
pub(crate) const MARK_COUNT: usize = 6;

/// The estimators that have a colour of their own: cold colours for points, warm ones for lines.
const KNOWN: [&str; 8] = [
    "point-area",
    "point-solid-angle",
    "point-bsdf",
    "line-area",
    "line-solid-angle",
    "line-analytic",
    "exact",
    "hybrid",
];

/// The index of `exact` in [`KNOWN`].
const GREY: usize = 6;

/// The colours of series in the light and in the dark theme: first one for each of [`KNOWN`], then
/// spares for combinations and options. Each has a contrast of at least 3 : 1 with its background.
const COLOURS: [[&str; 2]; 13] = [
    ["#2a6db5", "#6fb0f2"],
    ["#12857a", "#4fd0bf"],
    ["#7652b8", "#b9a0f5"],
    ["#c96f00", "#ffb04d"],
    ["#a3286e", "#f08cc0"],
    ["#cc2f2f", "#ff8377"],
    ["#5b6570", "#a9b4c0"],
    ["#3f7d3a", "#86cc80"],
    ["#6d7500", "#ccd24f"],
    ["#8a5a3a", "#d8a583"],
    ["#40708c", "#8fc0dc"],
    ["#b0498f", "#e39ad2"],
    ["#8c6a00", "#e0bd45"],
];

/// The colours and marks of a study's estimators.
///
/// Names without options have one colour everywhere. Others (options, combinations) get the spare
/// colours in the order in which they are named; the order of the study makes this the same in all
/// of its plots.
///
/// ```
/// use linelit_study::plots::Palette;
/// let palette = Palette::new(["line-area", "line-area+point-bsdf", "point-area"]);
/// assert_eq!(palette.index("line-area"), Palette::new(["line-area"]).index("line-area"));
/// assert_ne!(palette.index("line-area+point-bsdf"), palette.index("line-area"));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Palette {
    indices: BTreeMap<String, usize>,
}

impl Palette {
    /// Creates a palette for these estimators.
    pub fn new<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        let spares = COLOURS.len() - KNOWN.len();
        let mut indices = BTreeMap::new();
        let mut next = 0;
        for name in names {
            if indices.contains_key(name) {
                continue;
            }
            let index = KNOWN
                .iter()
                .position(|&known| known == name)
                .unwrap_or_else(|| {
                    next += 1;
                    KNOWN.len() + (next - 1) % spares
                });
            indices.insert(name.to_owned(), index);
        }
        Self { indices }
    }

    /// Returns the index of an estimator's colour and mark; an unknown name gets the grey of
    /// `exact`.
    #[must_use]
    pub fn index(&self, name: &str) -> usize {
        self.indices.get(name).copied().unwrap_or(GREY)
    }
}

/// The part of the style sheet that does not depend on the theme.
const SHAPES: &str = "\
    .ll{font-family:system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif}\
    .ll text{font-size:12px}.ll text.ll-small,.ll text.ll-halo{font-size:11px}\
    .ll text.ll-head{font-size:13px;font-weight:600}\
    .ll text.ll-halo{paint-order:stroke;stroke-width:4;stroke-linejoin:round}\
    .ll .ll-panel{fill:none}.ll .ll-guide{stroke-dasharray:4 4}";

/// The colours of the style sheet: fills and strokes of the light and of the dark theme.
const INKS: [(&str, [&str; 2]); 9] = [
    (" text{fill:", ["#3d4650", "#c6ced8"]),
    (" .ll-paper{fill:", PAPER),
    (" .ll-panel{stroke:", ["#c3cad2", "#46505c"]),
    (" .ll-grid{stroke:", ["#e6e9ee", "#262e38"]),
    (" .ll-guide{stroke:", ["#8b95a1", "#7a8591"]),
    (" text.ll-small{fill:", ["#6b7580", "#98a3af"]),
    (" text.ll-halo{fill:", ["#56616d", "#a9b4c0"]),
    (" text.ll-halo{stroke:", PAPER),
    (" text.ll-head{fill:", ["#1d242c", "#eef2f6"]),
];

/// The background of the light and of the dark theme.
const PAPER: [&str; 2] = ["#ffffff", "#151a21"];

/// Returns the style sheet of every plot: light by default, dark where the reader prefers it.
pub(crate) fn css() -> String {
    let theme = |dark: usize| {
        let inks = INKS.map(|(rule, colours)| format!(".ll{rule}{}}}", colours[dark]));
        let paper = PAPER[dark];
        let series = COLOURS.iter().enumerate().map(|(k, colours)| {
            let ink = colours[dark];
            format!(
                ".ll .ll-l{k}{{fill:none;stroke:{ink};stroke-width:1.8;stroke-linejoin:round}}\
                 .ll .ll-m{k}{{fill:{ink};stroke:{paper};stroke-width:.8}}\
                 .ll .ll-o{k}{{fill:{paper};stroke:{ink};stroke-width:1.5}}\
                 .ll .ll-e{k}{{stroke:{ink};stroke-width:1.1}}"
            )
        });
        inks.into_iter().chain(series).collect::<String>()
    };
    let (light, dark) = (theme(0), theme(1));
    format!("{SHAPES}{light}@media(prefers-color-scheme:dark){{{dark}}}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(colour: &str) -> f64 {
        let byte = |at: usize| f64::from(u8::from_str_radix(&colour[at..at + 2], 16).unwrap());
        let linear = |at| linelit_film::srgb_decode(byte(at) / 255.0);
        0.2126 * linear(1) + 0.7152 * linear(3) + 0.0722 * linear(5)
    }

    fn contrast(a: &str, b: &str) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn colours_are_readable_on_their_paper() {
        // WCAG 2.1, 1.4.11: graphics need 3 : 1.
        for [light, dark] in COLOURS {
            assert!(contrast(light, PAPER[0]) >= 3.0, "{light}");
            assert!(contrast(dark, PAPER[1]) >= 3.0, "{dark}");
        }
    }

    #[test]
    fn spares_are_used_in_order_and_known_names_keep_theirs() {
        let palette = Palette::new(["a+b", "exact", "c", "a+b"]);
        assert_eq!(
            [
                palette.index("a+b"),
                palette.index("c"),
                palette.index("exact")
            ],
            [8, 9, 6]
        );
        assert_eq!(palette.index("never named"), 6);
    }
}

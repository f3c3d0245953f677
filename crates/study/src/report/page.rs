//! The HTML and CSS of a report. Each function returns the markup of one kind of element.

use base64::{Engine as _, prelude::BASE64_STANDARD as STANDARD};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Cell, Comparison, Entry, Picture, Report, Section, Table, scientific};
use crate::plots::short;

const CSS: &str = include_str!("style.css");

/// The script that moves the sliders and sorts tables; the page is complete without it.
const SCRIPT: &str = include_str!("script.js");

impl Report {
    /// Returns the page as HTML.
    #[must_use]
    pub fn render(&self) -> String {
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta name="generator" content={ "linelit " (env!("CARGO_PKG_VERSION")) };
                    title { (self.title) }
                    style { (PreEscaped(css())) }
                }
                body {
                    header { (self.head()) }
                    main {
                        @if let Some(first) = &self.first { (section("first", first)) }
                        @if !self.compared.is_empty() {
                            section #compared { h2 { "What is compared" } (entries(&self.compared)) }
                        }
                        @for (index, part) in self.sections.iter().enumerate() {
                            (section(&format!("part-{index}"), part))
                        }
                        (self.circumstances())
                    }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        }
        .into_string()
    }

    /// Returns the markup of the title, the summary, and links to the sections.
    fn head(&self) -> Markup {
        html! {
            p.brand { "linelit" }
            h1 { (self.title) }
            @for (index, paragraph) in self.summary.iter().enumerate() {
                p class=(if index == 0 { "lede" } else { "more" }) { (paragraph) }
            }
            @if self.sections.len() > 1 {
                nav {
                    @if !self.compared.is_empty() { a href="#compared" { "what is compared" } }
                    @for (index, part) in self.sections.iter().enumerate() {
                        a href={ "#part-" (index) } { (part.title) }
                    }
                    a href="#circumstances" { "how it was made" }
                }
            }
        }
    }

    /// Returns the markup of the section that says by which command, version and settings the page
    /// was made.
    fn circumstances(&self) -> Markup {
        html! {
            section #circumstances {
                h2 { "How it was made" }
                @if !self.command.is_empty() {
                    p { "The same command in the same folder, by the same version, gives the same numbers on any number of threads (times aside):" }
                    pre { code { (self.command) } }
                }
                dl.facts {
                    @for (name, value) in &self.facts {
                        div { dt { (name) } dd { (value) } }
                    }
                }
            }
        }
    }
}

/// Returns the markup of a list of names with their meanings and sources.
fn entries(list: &[Entry]) -> Markup {
    html! {
        dl.entries {
            @for entry in list {
                div {
                    dt { (entry.name) }
                    dd {
                        (entry.words)
                        @for (citation, address) in &entry.sources {
                            " " a href=(address) { (citation) }
                        }
                    }
                }
            }
        }
    }
}

/// Returns the markup of a comparison: two pictures under a slider, the magnified details below the
/// slider, and the maps of the errors.
fn comparison(part: &Comparison) -> Markup {
    let [left, right] = &part.sides;
    html! {
        p.caption { (part.lead) }
        div.slide {
            div.stage {
                @for side in [left, right] {
                    figure { (image(side, "pixels")) figcaption { (side.caption) } }
                }
            }
            input type="range" min="0" max="100" value="50" step="1"
                aria-label={ "left of the slider " (left.caption) ", right of it " (right.caption) };
        }
        @if !part.details.is_empty() {
            p.caption { "Magnified where " (left.caption) " is most wrong for the brightness:" }
            @for detail in &part.details {
                div.details { @for picture in detail { (figure(picture)) } }
            }
        }
        p.caption {
            "The reference, and the distance from it, pixel by pixel, on one logarithmic scale:"
        }
        div.pictures {
            (figure(&part.truth))
            @for picture in &part.errors { (figure(picture)) }
        }
    }
}

/// Returns the markup of a section with its pictures, plots, tables and notes. `id` is the target
/// of links to the section.
fn section(id: &str, part: &Section) -> Markup {
    html! {
        section id=(id) {
            h2 { (part.title) }
            @if !part.lead.is_empty() { p.lead { (part.lead) } }
            @if let Some(shown) = &part.comparison { (comparison(shown)) }
            @if !part.pictures.is_empty() {
                div.pictures { @for picture in &part.pictures { (figure(picture)) } }
            }
            @for plot in &part.plots {
                figure.plot {
                    (scroll(&plot.caption, &PreEscaped(plot.svg.clone())))
                    @if !plot.caption.is_empty() { figcaption { (plot.caption) } }
                }
            }
            @for table in part.tables.iter().filter(|t| !t.rows.is_empty()) { (folded(table)) }
            @if !part.notes.is_empty() {
                ul.notes { @for note in &part.notes { li { (note) } } }
            }
        }
    }
}

/// Returns the markup of a picture with its scale and caption. The style sheet magnifies small
/// pictures, and lets a large one take the whole width if it is alone.
fn figure(picture: &Picture) -> Markup {
    let small = picture.width.max(picture.height) <= 128;
    let wide = picture.width >= 512;
    html! {
        figure class=[wide.then_some("wide")] {
            (image(picture, if small { "small" } else { "" }))
            @if let Some(scale) = picture.scale {
                div.scale {
                    span { (end(scale.low)) }
                    span.bar {}
                    span { (end(scale.high)) }
                }
            }
            figcaption { (picture.caption) }
        }
    }
}

/// Formats an end of a scale with few digits.
fn end(value: f64) -> String {
    if value.abs() >= 0.01 || value.abs() <= 0.0 {
        short(value).replace('-', "−")
    } else {
        scientific(value)
    }
}

/// Returns the markup of a picture that is embedded in the page.
fn image(picture: &Picture, class: &str) -> Markup {
    let source = format!("data:image/png;base64,{}", STANDARD.encode(&picture.png));
    html! {
        img class=(class) src=(source) alt=(picture.caption)
            width=(picture.width) height=(picture.height);
    }
}

/// Returns the markup of a table under its caption; a folded table appears on a click on the
/// caption.
fn folded(content: &Table) -> Markup {
    if content.folded {
        return html! {
            details {
                summary { (content.caption) }
                (scroll(&content.caption, &table(content)))
            }
        };
    }
    html! {
        div.block {
            @if !content.caption.is_empty() { p.caption { (content.caption) } }
            (scroll(&content.caption, &table(content)))
        }
    }
}

/// Wraps content that may be wider than the page, so that it can be reached and scrolled by the
/// keyboard.
fn scroll(name: &str, content: &Markup) -> Markup {
    let name = if name.is_empty() { "wide" } else { name };
    html! { div.scroll tabindex="0" role="group" aria-label=(name) { (content) } }
}

/// Returns the markup of a table. A column is aligned to the right if its first cell is numeric.
fn table(content: &Table) -> Markup {
    let numeric = |column: usize| {
        content
            .rows
            .first()
            .and_then(|row| row.get(column))
            .is_some_and(|cell| cell.numeric)
    };
    // Rows that are mostly words are read one by one: on narrow pages each becomes a list of cells
    // with headings.
    let numbers = (0..content.columns.len()).filter(|k| numeric(*k)).count();
    let is_words = 2 * numbers < content.columns.len();
    html! {
        table.stack[is_words] {
            thead {
                tr {
                    @for (column, heading) in content.columns.iter().enumerate() {
                        th class=(if numeric(column) { "n" } else { "" }) { (heading) }
                    }
                }
            }
            tbody {
                @for row in &content.rows {
                    tr {
                        @for (item, heading) in row.iter().zip(&content.columns) {
                            (cell(item, is_words.then_some(heading)))
                        }
                    }
                }
            }
        }
    }
}

/// Returns the markup of a cell of a table, with the heading that the cell shows on narrow pages.
fn cell(cell: &Cell, heading: Option<&String>) -> Markup {
    // Long texts may break into lines, so that the columns after them stay in sight.
    const NAME: usize = 40;
    let class = [
        cell.numeric.then_some("n"),
        cell.strong.then_some("s"),
        (!cell.numeric && cell.text.chars().count() > NAME).then_some("w"),
    ];
    let class: Vec<&str> = class.into_iter().flatten().collect();
    let class = class.join(" ");
    let hover = (!cell.hover.is_empty()).then_some(cell.hover.as_str());
    let value = cell.value.map(|v| format!("{v:e}"));
    html! { td class=(class) title=[hover] data-v=[value] data-h=[heading] { (cell.text) } }
}

/// Returns the style sheet, with the false-colour scale as a gradient.
fn css() -> String {
    let stops: Vec<String> = (0..=8)
        .map(|k| {
            let [r, g, b] = linelit_film::heat_colour(f64::from(k) / 8.0);
            format!("rgb({r},{g},{b})")
        })
        .collect();
    CSS.replace(
        "@HEAT@",
        &format!("linear-gradient(90deg,{})", stops.join(",")),
    )
}

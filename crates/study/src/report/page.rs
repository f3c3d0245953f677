//! HTML and CSS.

use base64::{Engine as _, prelude::BASE64_STANDARD as STANDARD};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Cell, Picture, Report, Section, Table};
use crate::plots::short;

const CSS: &str = include_str!("style.css");

impl Report {
    /// The page.
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
                        @for (index, part) in self.sections.iter().enumerate() {
                            (section(index, part))
                        }
                        (self.circumstances())
                    }
                }
            }
        }
        .into_string()
    }

    fn head(&self) -> Markup {
        html! {
            p.brand { "linelit" }
            h1 { (self.title) }
            @for (index, paragraph) in self.summary.iter().enumerate() {
                p class=(if index == 0 { "lede" } else { "more" }) { (paragraph) }
            }
            @if self.sections.len() > 1 {
                nav {
                    @for (index, part) in self.sections.iter().enumerate() {
                        a href={ "#part-" (index) } { (part.title) }
                    }
                    a href="#circumstances" { "how it was made" }
                }
            }
        }
    }

    fn circumstances(&self) -> Markup {
        html! {
            section #circumstances {
                h2 { "How it was made" }
                @if !self.command.is_empty() {
                    p { "The same command, seed and version give the same numbers on any number of threads (times aside):" }
                    pre { code { (self.command) } }
                }
                dl {
                    @for (name, value) in &self.facts {
                        div { dt { (name) } dd { (value) } }
                    }
                }
            }
        }
    }
}

fn section(index: usize, part: &Section) -> Markup {
    html! {
        section id={ "part-" (index) } {
            h2 { (part.title) }
            @if !part.lead.is_empty() { p.lead { (part.lead) } }
            @if !part.pictures.is_empty() {
                div.pictures { @for picture in &part.pictures { (figure(picture)) } }
            }
            @for plot in &part.plots {
                figure.plot {
                    div.scroll { (PreEscaped(&plot.svg)) }
                    @if !plot.caption.is_empty() { figcaption { (plot.caption) } }
                }
            }
            @for table in &part.tables { (folded(table)) }
            @if !part.notes.is_empty() {
                ul.notes { @for note in &part.notes { li { (note) } } }
            }
        }
    }
}

fn figure(picture: &Picture) -> Markup {
    let source = format!("data:image/png;base64,{}", STANDARD.encode(&picture.png));
    let small = picture.width.max(picture.height) <= 128;
    html! {
        figure {
            img class=(if small { "small" } else { "" }) src=(source) alt=(picture.caption)
                width=(picture.width) height=(picture.height);
            @if let Some(scale) = picture.scale {
                div.scale {
                    span { (short(scale.low)) }
                    span.bar {}
                    span { (short(scale.high)) }
                }
            }
            figcaption { (picture.caption) }
        }
    }
}

fn folded(content: &Table) -> Markup {
    if content.folded {
        return html! {
            details {
                summary { (content.caption) }
                div.scroll { (table(content)) }
            }
        };
    }
    html! {
        div.block {
            @if !content.caption.is_empty() { p.caption { (content.caption) } }
            div.scroll { (table(content)) }
        }
    }
}

fn table(content: &Table) -> Markup {
    let numeric = |column: usize| {
        content
            .rows
            .first()
            .and_then(|row| row.get(column))
            .is_some_and(|cell| cell.numeric)
    };
    html! {
        table {
            thead {
                tr {
                    @for (column, heading) in content.columns.iter().enumerate() {
                        th class=(if numeric(column) { "n" } else { "" }) { (heading) }
                    }
                }
            }
            tbody {
                @for row in &content.rows {
                    tr { @for item in row { (cell(item)) } }
                }
            }
        }
    }
}

fn cell(cell: &Cell) -> Markup {
    let class = match (cell.numeric, cell.strong) {
        (true, true) => "n s",
        (true, false) => "n",
        (false, true) => "s",
        (false, false) => "",
    };
    let hover = (!cell.hover.is_empty()).then_some(cell.hover.as_str());
    html! { td class=(class) title=[hover] { (cell.text) } }
}

/// The style sheet, with the false-colour scale as a gradient.
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

//! The report of a study: one self-contained HTML page for people to read. Come here to build a
//! page from pictures, plots and tables of your own.
//!
//! [`Report`] is the content of any page. [`Report::of_study`] fills it from a
//! [`StudyRecord`](crate::tables::StudyRecord): whether an estimator shows a bias, and for each
//! scene its pictures, the plots of error and efficiency, the orders of convergence next to the
//! papers' orders, and the tables. The page loads nothing from elsewhere. A short script moves the
//! slider between two pictures and sorts tables; without it both pictures are shown side by side,
//! and everything else is the same.

mod comparison;
mod page;
mod study;
mod verdict;

pub use comparison::{Comparison, Named};
pub use study::{Exhibits, plot_files};
pub use verdict::Verdict;

pub use crate::plots::scientific;
use crate::tables::{commit, cpu_name};
use linelit_film::{Exposure, FilmError, HeatMap, Image, encode_png};

/// The content of a page.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The title.
    pub title: String,
    /// The paragraphs under the title.
    pub summary: Vec<String>,
    /// The section before all others.
    pub first: Option<Section>,
    /// The methods that were compared, each in words.
    pub compared: Vec<Entry>,
    /// The sections, in order.
    pub sections: Vec<Section>,
    /// The settings and circumstances: name and value.
    pub facts: Vec<(String, String)>,
    /// The command that makes the same page again.
    pub command: String,
}

impl Report {
    /// Creates a page that states the version of linelit and the machine that made it, without the
    /// command.
    #[must_use]
    pub fn new(title: &str, summary: Vec<String>, sections: Vec<Section>) -> Self {
        Self {
            title: title.to_owned(),
            summary,
            sections,
            facts: vec![
                ("version".to_owned(), crate::version()),
                ("commit".to_owned(), commit()),
                ("processor".to_owned(), cpu_name()),
            ],
            ..Self::default()
        }
    }
}

/// A name with its meaning and sources.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Entry {
    /// The name.
    pub name: String,
    /// The meaning of the name, in a sentence or two.
    pub words: String,
    /// The sources: how each is cited, and its address.
    pub sources: Vec<(String, String)>,
}

/// A section of a page: one scene, or one figure.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// The heading.
    pub title: String,
    /// The sentence under the heading.
    pub lead: String,
    /// Two pictures under a slider.
    pub comparison: Option<Comparison>,
    /// Pictures, side by side.
    pub pictures: Vec<Picture>,
    /// Plots, one below the other.
    pub plots: Vec<Plot>,
    /// Tables; tables without rows are not shown.
    pub tables: Vec<Table>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// A picture with its caption.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The bytes of a PNG file.
    pub png: Vec<u8>,
    /// The width in pixels.
    pub width: u32,
    /// The height in pixels.
    pub height: u32,
    /// The caption below the picture.
    pub caption: String,
    /// The scale of a false-colour picture.
    pub scale: Option<HeatMap>,
}

impl Picture {
    /// Creates a picture from linear radiance with a given exposure, so that several pictures can
    /// be compared.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] for a picture without pixels.
    pub fn exposed(image: &Image, exposure: Exposure, caption: &str) -> Result<Self, FilmError> {
        Ok(Self {
            png: encode_png(image, exposure)?,
            width: image.width,
            height: image.height,
            caption: caption.to_owned(),
            scale: None,
        })
    }

    /// Creates a picture in false colour from one number per pixel, with its scale.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] when there is not one value per pixel.
    pub fn of_scalars(
        width: u32,
        height: u32,
        values: &[f32],
        map: HeatMap,
        caption: &str,
    ) -> Result<Self, FilmError> {
        Ok(Self {
            png: map.encode_png(width, height, values)?,
            width,
            height,
            caption: caption.to_owned(),
            scale: Some(map),
        })
    }
}

/// A plot with its caption.
#[derive(Clone, Debug)]
pub struct Plot {
    /// The plot as SVG text, as [`crate::plots`] makes it.
    pub svg: String,
    /// The caption below the plot.
    pub caption: String,
}

/// A table.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// The caption above the table.
    pub caption: String,
    /// The headings.
    pub columns: Vec<String>,
    /// The rows, each with one cell per column.
    pub rows: Vec<Vec<Cell>>,
    /// Whether the table is hidden until its caption is clicked.
    pub folded: bool,
}

impl Table {
    /// Creates a table that is not folded.
    #[must_use]
    pub fn new<'a>(
        caption: impl Into<String>,
        columns: impl IntoIterator<Item = &'a str>,
        rows: impl IntoIterator<Item = Vec<Cell>>,
    ) -> Self {
        Self {
            caption: caption.into(),
            columns: columns.into_iter().map(str::to_owned).collect(),
            rows: rows.into_iter().collect(),
            folded: false,
        }
    }
}

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    /// The visible text.
    pub text: String,
    /// Whether the cell is aligned to the right, as numbers are.
    pub numeric: bool,
    /// Whether the cell is emphasized, for example because it is the best of its column.
    pub strong: bool,
    /// The text shown on hovering.
    pub hover: String,
    /// The number by which tables are sorted, if there is one.
    pub value: Option<f64>,
}

impl Cell {
    /// Creates a cell of words.
    #[must_use]
    pub fn text(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            ..Self::default()
        }
    }

    /// Creates a cell of a number that is already formatted. Tables are sorted by the number that
    /// the text represents, if it represents one.
    #[must_use]
    pub fn number(text: impl Into<String>) -> Self {
        let text = text.into();
        Self {
            value: text.replace('−', "-").parse().ok(),
            text,
            numeric: true,
            ..Self::default()
        }
    }

    /// Creates a cell of a number in the notation of [`scientific`].
    #[must_use]
    pub fn scientific(value: f64) -> Self {
        Self::number(scientific(value)).sorted_by(value)
    }

    /// Returns the cell with the number by which tables sort it; a number that is not finite is
    /// ignored.
    #[must_use]
    pub fn sorted_by(self, value: f64) -> Self {
        Self {
            value: Some(value).filter(|v| v.is_finite()),
            ..self
        }
    }

    /// Returns the cell, emphasized if `strong`.
    #[must_use]
    pub fn strong(self, strong: bool) -> Self {
        Self { strong, ..self }
    }

    /// Returns the cell with a text that is shown on hovering.
    #[must_use]
    pub fn hover(self, hover: impl Into<String>) -> Self {
        Self {
            hover: hover.into(),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_sorted_by_what_they_are() {
        assert_eq!(Cell::number("−0.25").value, Some(-0.25));
        assert_eq!(Cell::scientific(1.5e-7).value, Some(1.5e-7));
        assert_eq!(Cell::scientific(f64::NAN).value, None);
        assert_eq!(Cell::number("12 ms").sorted_by(0.012).value, Some(0.012));
        assert_eq!(Cell::text("a").value, None);
    }

    #[test]
    fn a_page_is_self_contained_and_escapes() {
        let image = Image::from_fn(4, 2, |x, y| [x as f32, y as f32, 0.5]);
        let report = Report {
            first: None,
            title: "A <b> & title".to_owned(),
            summary: vec!["One </p> paragraph.".to_owned()],
            sections: vec![Section {
                title: "scene".to_owned(),
                pictures: vec![
                    Picture::exposed(&image, Exposure::default(), "a \"picture\"").unwrap(),
                ],
                tables: vec![Table {
                    columns: vec!["<x>".to_owned()],
                    rows: vec![vec![Cell::number("1").strong(true)]],
                    ..Table::default()
                }],
                notes: vec!["<script>alert(1)</script>".to_owned()],
                ..Section::default()
            }],
            facts: vec![("seed".to_owned(), "7".to_owned())],
            command: "linelit converge \"a b\"".to_owned(),
            compared: vec![Entry {
                name: "line-area".to_owned(),
                words: "N < 3 lines.".to_owned(),
                sources: vec![(
                    "A & B 2016".to_owned(),
                    "https://doi.org/10.1111/x".to_owned(),
                )],
            }],
        };
        let html = report.render();
        assert!(html.starts_with("<!DOCTYPE html>"));
        assert!(
            html.contains("A &lt;b&gt; &amp; title") && html.contains("One &lt;/p&gt; paragraph.")
        );
        assert_eq!(html.matches("<script").count(), 1, "ours alone");
        assert!(html.contains("&lt;script&gt;alert(1)"));
        assert!(html.contains(r#"<a href="https://doi.org/10.1111/x">A &amp; B 2016</a>"#));
        // Only links refer to other addresses.
        let rest = html.replace(r#"<a href="https://"#, "");
        for loading in [
            "http://", "https://", "@import", "url(", "src=\"h", "fetch(",
        ] {
            assert!(!rest.contains(loading), "{loading}");
        }
        assert!(html.contains("src=\"data:image/png;base64,iVBORw0KGgo"));
    }
}

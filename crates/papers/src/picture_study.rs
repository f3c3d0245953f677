//! Studies that are shown rather than fitted: pictures, tables and the numbers behind them.

use crate::Findings;
use crate::measured::Measured;
use anyhow::Result;
use indicatif::ProgressBar;
use linelit_elementary::{exp, log10};
use linelit_film::{Exposure, HeatMap, Image, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, ShadingPoint, Workspace};
use linelit_scenes::Library;
use linelit_study::report::{Cell, Picture, Report, Section, Table, scientific};
use linelit_study::scene_study;
use serde::Serialize;
use std::collections::BTreeMap;

/// Settings of a study of pictures and tables.
#[derive(Debug)]
pub struct Context<'a> {
    /// The reader of scenes.
    pub library: Library,
    /// The first seed.
    pub seed: u64,
    /// Whether every step runs at the smallest size, for tests.
    pub smallest: bool,
    /// Whether what has a quick form runs in full.
    pub full: bool,
    /// The most pixels on a side of a picture.
    pub most_side: u32,
    /// The progress bar.
    pub progress: &'a ProgressBar,
}

impl Context<'_> {
    /// The resolution of a picture: the one given, unless the smallest is wanted.
    #[must_use]
    pub(crate) fn size(&self, full: [u32; 2]) -> [u32; 2] {
        let most = if self.smallest { 8 } else { self.most_side };
        full.map(|side| side.min(most))
    }

    /// One of two: the first, unless the smallest is wanted.
    #[must_use]
    pub(crate) fn or_least<T>(&self, full: T, least: T) -> T {
        if self.smallest { least } else { full }
    }
}

/// Pictures and tables: what goes to the page, and its numbers.
#[derive(Debug, Default)]
pub(crate) struct PictureStudy {
    /// Title of the page.
    pub title: String,
    /// Paragraphs under it.
    pub summary: Vec<String>,
    /// The parts of the page.
    pub sections: Vec<Section>,
    /// The numbers, for the table on the terminal and the JSON file.
    pub rows: Vec<Row>,
}

/// A row of numbers.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Row {
    /// Label of the row.
    pub what: String,
    /// The numbers, by name.
    pub values: BTreeMap<&'static str, f64>,
    /// The intervals of those numbers that have any, of 95 %.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub intervals: BTreeMap<&'static str, [f64; 2]>,
}

impl Row {
    /// A row of named numbers.
    pub(crate) fn new(what: impl Into<String>, values: &[(&'static str, f64)]) -> Self {
        Self {
            what: what.into(),
            values: values.iter().copied().collect(),
            intervals: BTreeMap::new(),
        }
    }

    /// A row of measured numbers, some with intervals.
    pub(crate) fn measured(what: impl Into<String>, values: &[(&'static str, Measured)]) -> Self {
        let interval = |(name, m): &(&'static str, Measured)| {
            let [low, high] = m.interval?;
            (low < high).then_some((*name, [low, high]))
        };
        Self {
            what: what.into(),
            values: values.iter().map(|(name, m)| (*name, m.value)).collect(),
            intervals: values.iter().filter_map(interval).collect(),
        }
    }
}

impl PictureStudy {
    /// The page, each picture as a PNG, and the numbers.
    pub(crate) fn findings(self, name: &str) -> Result<Findings> {
        let pictures = self.sections.iter().flat_map(|s| &s.pictures);
        let file = |(picture, number): (&Picture, u32)| {
            (format!("{name}-{number}.png"), picture.png.clone())
        };
        Ok(Findings {
            files: pictures.zip(1u32..).map(file).collect(),
            text: self.text(),
            rows: serde_json::to_value(&self.rows)?,
            report: Report::new(&self.title, self.summary, self.sections),
            failures: Vec::new(),
        })
    }

    /// The numbers as text.
    fn text(&self) -> String {
        let width = self.rows.iter().map(|r| r.what.chars().count()).max();
        let width = width.unwrap_or(0);
        let mut out = String::new();
        for row in &self.rows {
            out.push_str(&format!("{:<width$}", row.what));
            for (name, value) in &row.values {
                out.push_str(&format!("  {name} {}", scientific(*value)));
            }
            out.push('\n');
        }
        out
    }
}

/// A table of a section from rows that have the same numbers, in the order of `columns`.
pub(crate) fn table(caption: &str, columns: &[&'static str], rows: &[Row]) -> Table {
    let body = rows.iter().map(|row| {
        let mut cells = vec![Cell::text(row.what.clone())];
        cells.extend(columns.iter().map(|column| {
            let value = row.values.get(column).copied().unwrap_or(f64::NAN);
            let interval = row.intervals.get(column).copied();
            let interval = Some(interval.unwrap_or([value; 2]));
            Cell::number(Measured { value, interval }.to_string())
        }));
        cells
    });
    Table::new(caption, [&[""], columns].concat(), body)
}

/// A section of pictures.
pub(crate) fn section(
    title: &str,
    lead: &str,
    pictures: Vec<Picture>,
    tables: Vec<Table>,
) -> Section {
    Section {
        title: title.to_owned(),
        lead: lead.to_owned(),
        pictures,
        tables,
        ..Section::default()
    }
}

/// Renders with a change of each shading point, such as another material.
pub(crate) fn render_with(
    renderer: &Renderer<'_>,
    settings: &Settings,
    size: [u32; 2],
    progress: &ProgressBar,
    change: impl Fn(&mut ShadingPoint) + Sync,
) -> Image {
    let shade = |pixel: [u32; 2], workspace: &mut Workspace| {
        let Some(mut point) = renderer.shading_point(pixel, workspace) else {
            return DVec3::ZERO;
        };
        change(&mut point);
        renderer.direct(settings, &point, pixel, 0, workspace)
    };
    let window = Tile::whole(size[0], size[1]);
    scene_study::map(window, progress, shade).0
}

/// Root mean squared error over pixels and channels.
pub(crate) fn rmse(a: &Image, b: &Image) -> f64 {
    let square = |(p, q): (&[f32; 3], &[f32; 3])| -> f64 {
        p.iter()
            .zip(q)
            .map(|(x, y)| (f64::from(*x) - f64::from(*y)).powi(2))
            .sum()
    };
    let sum: f64 = a.rgb.iter().zip(&b.rgb).map(square).sum();
    let n = 3.0 * a.rgb.len() as f64;
    (sum / n).sqrt()
}

/// The RMSE that is left when the error is blurred by a Gaussian of `sigma` pixels: what an eye at
/// a distance, or a filter, sees. Noise without structure loses a factor of about 2√π σ; blue noise
/// more.
pub(crate) fn blurred_rmse(a: &Image, b: &Image, sigma: f64) -> f64 {
    let error: Vec<[f64; 3]> = a
        .rgb
        .iter()
        .zip(&b.rgb)
        .map(|(p, q)| [0, 1, 2].map(|c| f64::from(p[c]) - f64::from(q[c])))
        .collect();
    let (w, h) = (a.width as usize, a.height as usize);
    let across = blur(&error, w, h, sigma, 1);
    let both = blur(&across, w, h, sigma, w);
    let sum: f64 = both.iter().flatten().map(|e| e * e).sum();
    let n = 3.0 * both.len() as f64;
    (sum / n).sqrt()
}

/// One pass of a separable blur, along rows (`stride` 1) or columns (`stride` the width); what is
/// outside the image does not count.
fn blur(image: &[[f64; 3]], w: usize, h: usize, sigma: f64, stride: usize) -> Vec<[f64; 3]> {
    let reach: i32 = 6;
    let weight = |d: i32| exp(-0.5 * (f64::from(d) / sigma).powi(2));
    let length = if stride == 1 { w } else { h };
    (0..w * h)
        .map(|i| {
            let at = if stride == 1 { i % w } else { i / w };
            let (mut sum, mut total) = ([0.0; 3], 0.0);
            for d in -reach..=reach {
                let Some(other) = at.checked_add_signed(d as isize).filter(|k| *k < length) else {
                    continue;
                };
                let pixel = image[i + other * stride - at * stride];
                let g = weight(d);
                total += g;
                for c in 0..3 {
                    sum[c] += g * pixel[c];
                }
            }
            sum.map(|s| s / total)
        })
        .collect()
}

/// A picture exposed like another, so that they can be compared.
pub(crate) fn exposed(image: &Image, like: &Image, caption: &str) -> Result<Picture> {
    Ok(Picture::exposed(
        image,
        Exposure::fitting(like, 0.95),
        caption,
    )?)
}

/// A picture of one number a pixel on a scale of powers of ten from `low` to `high`.
pub(crate) fn logarithmic(
    size: [u32; 2],
    values: &[f64],
    [low, high]: [f64; 2],
    caption: &str,
) -> Result<Picture> {
    #[allow(clippy::cast_possible_truncation, reason = "colours need no more")]
    let shown: Vec<f32> = values
        .iter()
        .map(|v| log10(v.max(low).min(high)) as f32)
        .collect();
    #[allow(clippy::cast_possible_truncation, reason = "colours need no more")]
    let map = HeatMap::spanning(&[log10(low) as f32, log10(high) as f32]);
    let caption = format!("{caption}; the scale is the power of ten");
    Ok(Picture::of_scalars(
        size[0], size[1], &shown, map, &caption,
    )?)
}

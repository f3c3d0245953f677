//! The comparison as a page: ours, theirs, and the difference, side by side.

use super::judge::{Comparison, Row};
use anyhow::Result;
use linelit_cli::folder::OutputFolder;
use linelit_film::{Exposure, HeatMap};
use linelit_study::report::{Cell, Picture, Report, Section, Table, scientific};

/// The scale of relative differences.
const DIFFERENCES: HeatMap = HeatMap {
    low: 1e-5,
    high: 1.0,
    logarithmic: true,
};

/// Writes `report.html` and the pictures as PNG files.
pub(super) fn write(mut out: OutputFolder, all: &[Comparison]) -> Result<()> {
    let mut sections = vec![Section {
        title: "All references".to_owned(),
        lead: "Means leave out the pixels that differ for a reason found; “of all” does not."
            .to_owned(),
        tables: vec![numbers(all), reasons(all)],
        ..Section::default()
    }];
    for found in all {
        let section = section(found)?;
        for (picture, kind) in section
            .pictures
            .iter()
            .zip(["ours", "theirs", "difference"])
        {
            let name = format!("{}-{kind}.png", found.row.name.replace('/', "-"));
            out.add(&name, picture.png.clone());
        }
        sections.push(section);
    }
    let report = Report {
        title: "Our renders against those of other renderers".to_owned(),
        summary: vec![summary(all)],
        sections,
        command: "cargo xtask check-references FOLDER --out OUT".to_owned(),
        ..Report::default()
    };
    out.add("report.html", report.render());
    out.finish()
}

fn summary(all: &[Comparison]) -> String {
    let good = all.iter().filter(|found| found.row.ok).count();
    let worst = all
        .iter()
        .map(|found| (found.row.mean_ratio - 1.0).abs())
        .fold(0.0, f64::max);
    format!(
        "{good} of {} references agree: means within {:.4} %, and at least 99.75 % of the pixels \
         within noise (z test at α = 0.01, corrected after Šidák over pixels and channels).",
        all.len(),
        100.0 * worst
    )
}

fn numbers(all: &[Comparison]) -> Table {
    let row = |r: &Row| {
        vec![
            Cell::text(r.name).strong(!r.ok).hover(r.estimator),
            Cell::number(r.pixels.to_string()),
            Cell::number(format!("{:.6}", r.mean)),
            Cell::number(format!("{:.6}", r.reference_mean)),
            Cell::number(format!("{:.6}", r.mean_ratio)),
            Cell::number(scientific(r.ratio_error)),
            Cell::number(format!("{:.6}", r.mean_ratio_of_all)),
            Cell::number(scientific(r.mrse)),
            Cell::number(format!("{:.3} %", 100.0 * r.passing)),
        ]
    };
    let caption = "±: one standard error of the ratio, by the noise of both.";
    let columns = "reference,pixels,mean,theirs,ratio,±,of all,MRSE,passing";
    let rows = all.iter().map(|found| row(&found.row));
    Table::new(caption, columns.split(','), rows)
}

fn reasons(all: &[Comparison]) -> Table {
    let row = |r: &Row| {
        let count = |list: &[[u32; 2]]| Cell::number(list.len().to_string());
        vec![
            Cell::text(r.name),
            count(&r.unexplained),
            count(&r.edges),
            count(&r.horizon),
            count(&r.lights),
            count(&r.wrong),
        ]
    };
    let caption = "Pixels that differ, by reason. Edges: rays a hundredth of a pixel apart meet other \
                   surfaces. Horizon: light below the smooth normal's horizon counts there, not here. \
                   Lights: the light itself, rounded by sums in single precision. Theirs wrong: a \
                   brute-force estimate gives our value and not theirs.";
    let columns = "reference,no reason,edges,horizon,lights,theirs wrong";
    let rows = all.iter().map(|found| row(&found.row));
    Table::new(caption, columns.split(','), rows)
}

fn section(found: &Comparison) -> Result<Section> {
    let Comparison {
        row,
        ours,
        reference,
    } = found;
    let exposure = Exposure::fitting(reference, 0.84);
    let differences: Vec<f32> = ours
        .rgb
        .iter()
        .zip(&reference.rgb)
        .map(|(a, b)| {
            let gap = (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
            gap / (b.iter().copied().fold(0.0, f32::max) + 1e-3)
        })
        .collect();
    let pictures = vec![
        Picture::exposed(ours, exposure, &format!("Ours: {}", row.estimator))?,
        Picture::exposed(reference, exposure, "Theirs")?,
        Picture::of_scalars(
            ours.width,
            ours.height,
            &differences,
            DIFFERENCES,
            "Difference over value (+ 0.001), the largest channel",
        )?,
    ];
    let verdict = if row.ok { "They agree" } else { "They differ" };
    let notes = [
        ("differ for no reason found", &row.unexplained),
        (
            "a brute-force estimate gives our value and not theirs",
            &row.wrong,
        ),
        ("light between the two horizons", &row.horizon),
    ];
    let notes = notes
        .iter()
        .filter(|(_, list)| !list.is_empty() && list.len() <= 60)
        .map(|(why, list)| format!("Pixels, {why}: {}.", coordinates(list)))
        .collect();
    Ok(Section {
        title: row.name.to_owned(),
        lead: format!(
            "{verdict}: ratio of means {:.6}, {:.3} % of {} pixels within noise.",
            row.mean_ratio,
            100.0 * row.passing,
            row.pixels
        ),
        pictures,
        notes,
        ..Section::default()
    })
}

fn coordinates(list: &[[u32; 2]]) -> String {
    let pixels: Vec<String> = list.iter().map(|[x, y]| format!("({x}, {y})")).collect();
    pixels.join(", ")
}

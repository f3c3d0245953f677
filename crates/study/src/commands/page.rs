//! From results to report pages.

use crate::engine::SceneResult;
use crate::folder::OutputFolder;
use crate::report::{Cell, Picture, Report, Section, Table, plot_files, scientific};
use crate::studies::{Exhibition, Figure, Table1Row};
use crate::tables::{StudyRecord, commit, cpu_name};
use anyhow::Result;
use linelit_film::{Exposure, HeatMap, Image};
use std::collections::BTreeMap;

/// Adds `report.html` and `plots/*.svg` of a convergence study.
pub(super) fn add_study(
    out: &mut OutputFolder,
    record: &StudyRecord,
    results: &[SceneResult],
) -> Result<()> {
    for (name, svg) in plot_files(record) {
        out.add(&format!("plots/{name}"), svg);
    }
    let mut pictures = BTreeMap::new();
    for result in results {
        let caption = format!(
            "{}: line-analytic, 16 stratified lines a point",
            result.scene
        );
        let picture = Picture::exposed(&result.picture, exposure(&result.picture), &caption)?;
        let mut shown = vec![picture];
        for one in &result.gallery {
            let caption = format!(
                "{}: N = {}, {:.2} s of CPU, MRSE {}",
                one.estimator,
                one.samples,
                one.cpu_seconds,
                scientific(one.mrse)
            );
            let exposure = exposure(&result.gallery[0].image);
            shown.push(Picture::exposed(&one.image, exposure, &caption)?);
        }
        pictures.insert(result.scene.clone(), shown);
    }
    add_report(out, &Report::of_study(record, pictures));
    Ok(())
}

/// Adds `report.html` of figures, and each of them as a PNG.
pub(super) fn add_figures(out: &mut OutputFolder, figures: &[Figure], command: &str) -> Result<()> {
    let mut sections: Vec<Section> = Vec::new();
    for (index, figure) in figures.iter().enumerate() {
        let picture = figure_picture(figure)?;
        let name = format!(
            "{}-{}-{}.png",
            figure.figure.replace([' ', '.'], ""),
            figure.scene,
            index + 1
        );
        out.add(&name, picture.png.clone());
        let title = format!("{}: {}", figure.figure, figure.scene);
        match sections.last_mut() {
            Some(section) if section.title == title => section.pictures.push(picture),
            _ => sections.push(Section {
                title,
                lead: figure.about.to_owned(),
                pictures: vec![picture],
                plots: Vec::new(),
                tables: Vec::new(),
                notes: Vec::new(),
            }),
        }
    }
    let summary = vec![
        "The pictures of Billen & Dutré 2016, Figs. 2, 3 and 5, on our scenes; every picture names \
         the estimator that made it."
            .to_owned(),
    ];
    let title = "Figures of Billen & Dutré 2016";
    add_report(out, &page(title, summary, sections, command));
    Ok(())
}

fn figure_picture(figure: &Figure) -> Result<Picture> {
    let error = figure
        .rmse
        .map_or(String::new(), |r| format!("; RMSE {}", scientific(r)));
    let caption = format!("{}{error}", figure.caption);
    if !figure.counts {
        return Ok(Picture::exposed(
            &figure.image,
            exposure(&figure.image),
            &caption,
        )?);
    }
    let values: Vec<f32> = figure.image.rgb.iter().map(|p| p[0]).collect();
    let (w, h) = (figure.image.width, figure.image.height);
    Ok(Picture::of_scalars(
        w,
        h,
        &values,
        HeatMap::spanning(&values),
        &caption,
    )?)
}

/// Shows a tenth of the pixels as white, so that a light in the picture leaves the rest bright.
fn exposure(image: &Image) -> Exposure {
    Exposure::fitting(image, 0.9)
}

/// Adds `report.html` of Table 1.
pub(super) fn add_table1(out: &mut OutputFolder, rows: &[Table1Row], command: &str) {
    let columns = [
        "scene",
        "points",
        "lines",
        "seconds",
        "ns/line",
        "box tests (M)",
        "triangle tests (M)",
        "M boxes/s",
        "M triangles/s",
        "paper: scene",
        "paper: seconds",
        "paper: M boxes/s",
        "paper: M triangles/s",
    ];
    let number = |v: f64| Cell::number(format!("{v:.1}"));
    let row = |r: &Table1Row| {
        vec![
            Cell::text(r.scene.clone()),
            Cell::number(r.points.to_string()),
            Cell::number(r.lines.to_string()),
            Cell::number(format!("{:.3}", r.seconds)).hover(format!(
                "± {:.3}, standard deviation of two runs",
                r.seconds_error
            )),
            number(r.ns_per_line),
            number(r.box_tests_m),
            number(r.triangle_tests_m),
            number(r.box_rate_m),
            number(r.triangle_rate_m),
            Cell::text(r.paper_scene),
            number(r.paper_seconds),
            number(r.paper_box_rate_m),
            number(r.paper_triangle_rate_m),
        ]
    };
    let table = Table {
        caption:
            "1024 lines at each shading point. Seconds are of the processor, all threads together."
                .to_owned(),
        columns: columns.map(str::to_owned).to_vec(),
        rows: rows.iter().map(row).collect(),
        folded: false,
    };
    let section = Section {
        title: "Table 1".to_owned(),
        lead: "Our box and triangle tests are counted as if one at a time; all lines of a point \
               share one traversal, so both are far fewer for each line than in the paper."
            .to_owned(),
        pictures: Vec::new(),
        plots: Vec::new(),
        tables: vec![table],
        notes: vec![
            "The paper names neither its machine nor its resolution: compare rates and ratios."
                .to_owned(),
        ],
    };
    let title = "Cost of visibility: Billen & Dutré 2016, Table 1";
    add_report(out, &page(title, Vec::new(), vec![section], command));
}

/// Adds `report.html` of an exhibition, and each of its pictures as a PNG.
pub(super) fn add_exhibition(
    out: &mut OutputFolder,
    name: &str,
    exhibition: Exhibition,
    command: &str,
) {
    let pictures = exhibition.sections.iter().flat_map(|s| &s.pictures);
    for (picture, number) in pictures.zip(1u32..) {
        out.add(&format!("{name}-{number}.png"), picture.png.clone());
    }
    let Exhibition {
        title,
        summary,
        sections,
        ..
    } = exhibition;
    add_report(out, &page(&title, summary, sections, command));
}

fn page(title: &str, summary: Vec<String>, sections: Vec<Section>, command: &str) -> Report {
    Report {
        title: title.to_owned(),
        summary,
        sections,
        facts: vec![
            ("version".to_owned(), crate::version()),
            ("commit".to_owned(), commit()),
            ("processor".to_owned(), cpu_name()),
        ],
        command: command.to_owned(),
    }
}

fn add_report(out: &mut OutputFolder, report: &Report) {
    out.add("report.html", report.render());
}

//! Billen & Dutré 2016, Figs. 2, 3 and 5: orientations, offset densities, visible pieces.

use crate::Findings;
use crate::measured::settings;
use crate::picture_study::{Context, rmse};
use anyhow::Result;
use linelit_film::{Exposure, HeatMap, Image, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use linelit_study::report::{Picture, Report, Section, scientific};
use linelit_study::scene_study;
use serde::Serialize;

/// One picture of the figures.
#[derive(Clone, Debug, Serialize)]
struct Figure {
    /// Which figure of the paper.
    figure: &'static str,
    /// The scene.
    scene: &'static str,
    /// Caption of the picture.
    caption: String,
    /// Linear radiance, or counts in all channels.
    #[serde(skip)]
    image: Image,
    /// Whether the picture is of counts, to be shown in false colour.
    counts: bool,
    /// Root mean squared error against the converged picture, where there is one.
    rmse: Option<f64>,
}

/// Side of the pictures in pixels.
const SIZE: u32 = 256;
/// Lines at each point in Figs. 2 and 3: few, so that their patterns show.
const FEW: u32 = 4;
/// Lines at each point of the converged picture.
const MANY: u32 = 256;
/// Lines at each point in Fig. 5.
const COUNTED: u32 = 64;

/// Renders all figures.
pub(crate) fn run(context: &Context<'_>) -> Result<Findings> {
    let orientations = [
        (
            "fixed direction",
            "line-analytic[orientation=fixed:0,control=none]",
        ),
        (
            "uniform direction for each line",
            "line-analytic[orientation=uniform]",
        ),
        (
            "parallel for each shading point",
            "line-analytic[orientation=parallel,control=none]",
        ),
    ];
    let densities = [
        (
            "offsets uniform",
            "line-analytic[orientation=parallel,offset=uniform,control=none]",
        ),
        (
            "offsets in proportion to length",
            "line-analytic[orientation=parallel,control=none]",
        ),
    ];
    let counted = [
        "grid-planes-large",
        "triangle-soup-large",
        "colonnade-large",
    ];
    // All scenes are opened before the first is rendered.
    let [width, height] = context.size([SIZE; 2]);
    let open = |name: &'static str| -> Result<(&'static str, Scene)> {
        let mut scene = context.library.load(name)?.scene;
        scene.set_resolution(width, height);
        Ok((name, scene))
    };
    let (cornell, soup) = (open("cornell-box-large")?, open("triangle-soup-large")?);
    let logo = open("logo-large")?;
    let counted = counted.into_iter().map(open).collect::<Result<Vec<_>>>()?;
    let mut figures = Vec::new();
    compare("Fig. 2", &cornell, &orientations, context, &mut figures)?;
    compare("Fig. 2", &logo, &orientations, context, &mut figures)?;
    compare("Fig. 3", &soup, &densities, context, &mut figures)?;
    for scene in &counted {
        figures.push(pieces(scene, context)?);
    }
    findings(&figures)
}

/// The page, each picture as a PNG, and the errors.
fn findings(figures: &[Figure]) -> Result<Findings> {
    let mut found = Findings::default();
    let mut sections: Vec<Section> = Vec::new();
    for (index, figure) in figures.iter().enumerate() {
        let picture = figure_picture(figure)?;
        let name = format!(
            "{}-{}-{}.png",
            figure.figure.replace([' ', '.'], ""),
            figure.scene,
            index + 1
        );
        found.files.push((name, picture.png.clone()));
        let title = format!("{}: {}", figure.figure, figure.scene);
        let same = |f: &&Figure| (f.figure, f.scene) == (figure.figure, figure.scene);
        match sections.last_mut() {
            Some(section) if section.title == title => section.pictures.push(picture),
            _ => sections.push(Section {
                title,
                lead: about(&figures.iter().filter(same).collect::<Vec<_>>()),
                pictures: vec![picture],
                ..Section::default()
            }),
        }
    }
    let summary = vec![
        "The pictures of Billen & Dutré 2016, Figs. 2, 3 and 5, on our scenes; every picture names \
         the estimator that made it."
            .to_owned(),
    ];
    let title = "Figures of Billen & Dutré 2016";
    found.report = Report::new(title, summary, sections);
    for figure in figures {
        let rmse = figure
            .rmse
            .map_or(String::new(), |r| format!("  RMSE {r:.5}"));
        let (name, scene, caption) = (figure.figure, figure.scene, &figure.caption);
        found.text += &format!("{name} {scene}: {caption}{rmse}\n");
    }
    found.rows = serde_json::to_value(figures)?;
    Ok(found)
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

fn stratified(estimator: &str, samples: u32, seed: u64) -> Result<Settings> {
    Ok(Settings {
        samples,
        seed,
        // A light in the picture would leave the penumbrae dark.
        show_lights: false,
        ..settings(estimator, SamplerKind::Stratified)?
    })
}

fn compare(
    figure: &'static str,
    (scene_name, scene): &(&'static str, Scene),
    variants: &[(&str, &str)],
    context: &Context<'_>,
    out: &mut Vec<Figure>,
) -> Result<()> {
    let renderer = Renderer::new(scene);
    let window = Tile::whole(scene.film.width, scene.film.height);
    let render = |estimator: &str, samples| -> Result<Image> {
        Ok(scene_study::render(
            &renderer,
            &stratified(estimator, samples, context.seed)?,
            window,
            context.progress,
        )
        .0)
    };
    let converged = render("line-analytic", MANY)?;
    for (what, estimator) in variants {
        let image = render(estimator, FEW)?;
        let rmse = Some(rmse(&image, &converged));
        let caption = format!("{what}: {FEW} lines a point, `{estimator}`");
        out.push(Figure {
            figure,
            scene: scene_name,
            caption,
            image,
            counts: false,
            rmse,
        });
    }
    let caption = format!("converged: {MANY} lines a point");
    out.push(Figure {
        figure,
        scene: scene_name,
        caption,
        image: converged,
        counts: false,
        rmse: None,
    });
    Ok(())
}

/// What the errors of a figure's pictures say: each over that of the best.
fn about(figures: &[&Figure]) -> String {
    let errors = figures.iter().filter_map(|f| Some((f, f.rmse?)));
    let Some((best, least)) = errors.clone().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        let mean = |f: &&&Figure| {
            let sum: f64 = f.image.rgb.iter().map(|p| f64::from(p[0])).sum();
            sum / f.image.rgb.len() as f64
        };
        let means: Vec<String> = figures.iter().map(|f| format!("{:.2}", mean(&f))).collect();
        return format!(
            "How many visible pieces a line is cut into: {} on average.",
            means.join(", ")
        );
    };
    let name = |f: &Figure| f.caption.split(':').next().unwrap_or_default().to_owned();
    let others: Vec<String> = errors
        .filter(|(f, _)| !std::ptr::eq(**f, *best))
        .map(|(f, error)| format!("{:.2} times that ({})", error / least, name(f)))
        .collect();
    format!(
        "With {FEW} lines a point the least RMSE is that of \"{}\"; {}.",
        name(best),
        others.join(", ")
    )
}

/// The mean number of visible pieces of a line, pixel by pixel.
fn pieces((scene_name, scene): &(&'static str, Scene), context: &Context<'_>) -> Result<Figure> {
    let renderer = Renderer::new(scene);
    let settings = stratified("line-analytic", COUNTED, context.seed)?;
    let count = |pixel: [u32; 2], workspace: &mut Workspace| {
        let Some(point) = renderer.shading_point(pixel, workspace) else {
            return DVec3::ZERO;
        };
        workspace.take_counts();
        let _ = renderer.direct(&settings, &point, pixel, 0, workspace);
        let counts = workspace.take_counts();
        let mean = counts.segments.pieces as f64 / (counts.segments.lines.max(1)) as f64;
        DVec3::splat(mean)
    };
    let window = Tile::whole(scene.film.width, scene.film.height);
    let (image, _) = scene_study::map(window, context.progress, count);
    let caption = format!("mean number of visible pieces of a line, {COUNTED} lines a point");
    Ok(Figure {
        figure: "Fig. 5",
        scene: scene_name,
        caption,
        image,
        counts: true,
        rmse: None,
    })
}

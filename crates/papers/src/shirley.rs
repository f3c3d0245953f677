//! Shirley & Wang 1991: one sample for all luminaires, and thousands of them.
#![allow(clippy::disallowed_methods, reason = "times beside errors")]

use crate::measured::trial_variances;
use crate::picture_study::{
    Context, PictureStudy, Row, exposed, render_with, rmse, section, table,
};
use crate::shirley_advice;
use anyhow::Result;
use linelit_elementary::log2;
use linelit_film::{Image, Tile};
use linelit_formats::LoadOptions;
use linelit_geometry::DVec3;
use linelit_integrator::{LightChoice, Renderer, Settings, Spheres, Workspace};
use linelit_lights::Light;
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use linelit_scenes::luminaires;
use linelit_selection::{LightTree, diffuse};
use linelit_study::plots::{ConvergencePlot, Palette, PlotPoint, Series};
use linelit_study::report::{Picture, Plot, Section};
use linelit_study::scene_study::{self, Targets};
use std::hint::black_box;
use std::time::Instant;

/// The paper's resolution.
const SIZE: [u32; 2] = [128; 2];
/// Lines to each luminaire for references, and for one that every single pixel is held to.
const LINES: u32 = 64;
const SHARP: u32 = 1024;
/// Rays through a pixel in Figs. 6 and 8.
const RAYS: u32 = 100;

/// Everything of the paper, and the light tree.
pub(super) fn run(context: &Context<'_>) -> Result<PictureStudy> {
    let mut rows = Vec::new();
    let mut sections = paper(context, &mut rows)?;
    sections.push(shirley_advice::proxies(context, &mut rows)?);
    sections.push(shirley_advice::hidden_light(context, &mut rows)?);
    sections.push(thousands(context, &mut rows)?);
    sections.push(logarithm(context, &mut rows)?);
    let summary = "One shadow ray for the union of all luminaires, with the probabilities α of Shirley & \
                   Wang and of a light tree.";
    Ok(PictureStudy {
        title: "Many luminaires: Shirley & Wang 1991".to_owned(),
        summary: vec![summary.to_owned()],
        sections,
        rows,
    })
}

/// The paper's figures.
fn paper(context: &Context<'_>, rows: &mut Vec<Row>) -> Result<Vec<Section>> {
    let mut sections = Vec::new();
    let two = scene(&luminaires::room(2), context)?;
    let many = scene(&luminaires::room(32), context)?;
    for (name, scene) in [
        ("Figs. 5 and 6: 2 luminaires", &two),
        ("Figs. 7 and 8: 32 luminaires", &many),
    ] {
        sections.push(all_or_one(name, scene, context, rows)?);
    }
    sections.push(alphas(&many, context, rows)?);
    sections.push(bands(&two, context, rows)?);
    sections.push(balls(context, rows)?);
    Ok(sections)
}

pub(super) fn scene(text: &str, context: &Context<'_>) -> Result<Scene> {
    let options = LoadOptions {
        strict: context.library.options.strict,
        ..LoadOptions::default()
    };
    let mut scene = linelit_formats::from_pbrt_str(text, "luminaires.pbrt", &options)?.scene;
    let [width, height] = context.or_least(SIZE, [8; 2]);
    scene.set_resolution(width, height);
    Ok(scene)
}

pub(super) fn settings(
    lights: LightChoice,
    samples: u32,
    pixel_samples: u32,
    seed: u64,
) -> Result<Settings> {
    Ok(Settings {
        estimator: "point-solid-angle".parse()?,
        sampler: SamplerKind::Independent,
        lights,
        samples,
        pixel_samples,
        seed,
        show_lights: false,
        ..Settings::default()
    })
}

/// Whole pixels, camera samples and all: as many as are wanted of the picture at its own
/// resolution, for what a pixel of another size sees of edges is not what this one does.
fn pixels(renderer: &Renderer<'_>, settings: &Settings, context: &Context<'_>) -> Image {
    let film = &renderer.scene().film;
    let step = film.width.max(film.height).div_ceil(context.most_side);
    let window = Tile::whole(film.width.div_ceil(step), film.height.div_ceil(step));
    let shade = |pixel: [u32; 2], workspace: &mut Workspace| {
        renderer.pixel(settings, pixel.map(|k| k * step), workspace)
    };
    scene_study::map(window, context.progress, shade).0
}

/// Whole pixels, lit by one sample of the lights that are chosen, or several.
fn picture(
    renderer: &Renderer<'_>,
    context: &Context<'_>,
    choice: LightChoice,
    samples: u32,
    rays: u32,
) -> Result<Image> {
    let settings = settings(choice, samples, rays, context.seed)?;
    Ok(pixels(renderer, &settings, context))
}

/// The exact light of the pixels' centres: enough lines of each luminaire.
fn exact(renderer: &Renderer<'_>, samples: u32, context: &Context<'_>) -> Result<Image> {
    let settings = Settings {
        estimator: "line-analytic".parse()?,
        sampler: SamplerKind::Stratified,
        samples,
        show_lights: false,
        seed: 77,
        ..Settings::default()
    };
    Ok(pixels(renderer, &settings, context))
}

/// The mean of two independent pictures, and its root mean squared error: it is as far from the
/// truth as half their difference. No reference is needed, which would have an error of its own.
fn halved(mut mean: Image, other: &Image) -> (Image, f64) {
    let error = 0.5 * rmse(&mean, other);
    for (p, q) in mean.rgb.iter_mut().zip(&other.rgb) {
        *p = [0, 1, 2].map(|c| 0.5 * (p[c] + q[c]));
    }
    (mean, error)
}

/// Figs. 5–8: a shadow ray for each luminaire or one for all, with 1 and 100 rays through a pixel.
fn all_or_one(
    name: &str,
    scene: &Scene,
    context: &Context<'_>,
    rows: &mut Vec<Row>,
) -> Result<Section> {
    let renderer = Renderer::new(scene);
    let lights = renderer.plan().lights().len();
    let centre = exact(&renderer, LINES, context)?;
    let (mut pictures, mut own) = (Vec::new(), Vec::new());
    for rays in [1, RAYS] {
        for (choice, shadows) in [(LightChoice::All, lights), (LightChoice::Estimate, 1)] {
            let half = |seed| -> Result<Image> {
                let settings = settings(choice, 1, rays.div_ceil(2), seed)?;
                Ok(pixels(&renderer, &settings, context))
            };
            let first = half(context.seed)?;
            let (image, error) = if rays == 1 {
                let error = rmse(&first, &centre);
                (first, error)
            } else {
                halved(first, &half(context.seed ^ (1 << 40))?)
            };
            let many = |count: usize| if count == 1 { "" } else { "s" };
            let caption = format!(
                "{rays} ray{} a pixel, {shadows} shadow ray{} each: RMSE {error:.4}",
                many(rays as usize),
                many(shadows),
            );
            pictures.push(exposed(&image, &centre, &caption)?);
            let total = (shadows * rays as usize) as f64;
            let values = [("RMSE", error), ("shadow rays a pixel", total)];
            own.push(Row::new(format!("{name}: {rays} rays, {choice}"), &values));
        }
    }
    let error = |k: usize| value(&own[k], "RMSE");
    let lead = format!(
        "Left of each pair: a shadow ray to each of {lights} luminaires; right: one to the union of all, with α by an \
         estimate of the unshadowed light. With 1 ray through a pixel the union has {:.2} times the RMSE, with {RAYS} rays {:.2} \
         times, for 1/{lights} of the shadow rays.",
        error(1) / error(0),
        error(3) / error(2),
    );
    let tables = vec![table(
        "Against 64 lines a luminaire (1 ray), and by what two halves differ (100 rays).",
        &["shadow rays a pixel", "RMSE"],
        &own,
    )];
    rows.extend(own);
    Ok(section(name, &lead, pictures, tables))
}

/// A number of a row.
fn value(row: &Row, name: &str) -> f64 {
    row.values.get(name).copied().unwrap_or(f64::NAN)
}

/// The choices of one light of many.
const CHOICES: [LightChoice; 5] = [
    LightChoice::Uniform,
    LightChoice::Power,
    LightChoice::Estimate,
    LightChoice::Exact,
    LightChoice::Tree,
];

/// Fig. 9: equal α and better ones; the error over the number of shadow rays.
fn alphas(scene: &Scene, context: &Context<'_>, rows: &mut Vec<Row>) -> Result<Section> {
    let renderer = Renderer::new(scene);
    let reference = exact(&renderer, LINES, context)?;
    let (mut pictures, mut errors) = (Vec::new(), Vec::new());
    for choice in CHOICES {
        let image = picture(&renderer, context, choice, 1, 1)?;
        let error = rmse(&image, &reference);
        let caption = format!("α by {choice}: RMSE {error:.4}");
        pictures.push(exposed(&image, &reference, &caption)?);
        errors.push((choice, error));
        let name = format!("Fig. 9: {choice}, 1 ray");
        rows.push(Row::new(name, &[("RMSE", error)]));
    }
    let mut series = Vec::new();
    for choice in CHOICES {
        let points = [1u32, 4, 16, 64]
            .into_iter()
            .map(|n| error_at(&renderer, choice, n, &reference, context))
            .collect::<Result<_>>()?;
        series.push(line(choice.to_string(), points));
    }
    let all = error_at(&renderer, LightChoice::All, 1, &reference, context)?;
    series.push(line("a ray for each".to_owned(), vec![all]));
    let others: Vec<String> = errors[1..]
        .iter()
        .map(|(choice, error)| format!("{:.2} times by {choice}", error / errors[0].1))
        .collect();
    let lead = format!(
        "Left: α = 1/32. The RMSE of one ray to the union with other α is {} of that.",
        others.join(", ")
    );
    let mut out = section("Fig. 9", &lead, pictures, Vec::new());
    out.plots.push(plot(series));
    Ok(out)
}

fn line(name: String, points: Vec<PlotPoint>) -> Series {
    Series {
        estimator: name,
        sampler: "independent".to_owned(),
        points,
    }
}

fn plot(series: Vec<Series>) -> Plot {
    let palette = Palette::new(series.iter().map(|s| s.estimator.as_str()));
    let plot = ConvergencePlot {
        title: "error over shadow rays".to_owned(),
        x_label: "shadow rays of a shading point".to_owned(),
        y_label: "root mean squared error".to_owned(),
        x_is_time: false,
        more_is_better: false,
        guides: vec![-0.5],
        series,
        palette,
    };
    Plot {
        svg: plot.render(),
        caption: "32 luminaires: error over shadow rays.".to_owned(),
    }
}

fn error_at(
    renderer: &Renderer<'_>,
    choice: LightChoice,
    samples: u32,
    reference: &Image,
    context: &Context<'_>,
) -> Result<PlotPoint> {
    let settings = settings(choice, samples, 1, context.seed.wrapping_add(5))?;
    let image = pixels(renderer, &settings, context);
    let rays = if choice == LightChoice::All {
        renderer.plan().lights().len() as f64
    } else {
        1.0
    };
    Ok(PlotPoint {
        x: rays * f64::from(samples),
        y: rmse(&image, reference),
        ..PlotPoint::default()
    })
}

/// Fig. 10: α by centres loses light; with the rule of false zeros none is lost.
fn bands(scene: &Scene, context: &Context<'_>, rows: &mut Vec<Row>) -> Result<Section> {
    let renderer = Renderer::new(scene);
    let reference = exact(&renderer, SHARP, context)?;
    let mut pictures = vec![exposed(&reference, &reference, "reference")?];
    let mut own = Vec::new();
    for choice in [
        LightChoice::Centre,
        LightChoice::Estimate,
        LightChoice::Tree,
    ] {
        let image = picture(&renderer, context, choice, 1024, 1)?;
        // Light that is lost: pixels that are dark, or less than half as bright, though noise at
        // 1024 samples is a few percent.
        let lost = |(p, q): &(&[f32; 3], &[f32; 3])| q[0] > 1e-3 && p[0] < 0.5 * q[0];
        let count = image.rgb.iter().zip(&reference.rgb).filter(lost).count();
        let mean = |i: &Image| i.rgb.iter().map(|p| f64::from(p[0])).sum::<f64>();
        let missing = 1.0 - mean(&image) / mean(&reference);
        let caption = format!("α by {choice}, 1024 rays: {count} pixels have lost light");
        pictures.push(exposed(&image, &reference, &caption)?);
        let values = [
            ("pixels that lost light", count as f64),
            ("light missing in all", missing),
        ];
        own.push(Row::new(format!("Fig. 10: {choice}"), &values));
    }
    let lost: Vec<f64> = own
        .iter()
        .map(|row| value(row, "pixels that lost light"))
        .collect();
    let lead = format!(
        "α by the luminaires' centres is zero where a centre is below the horizon of the ball and the rest is not: {} pixels \
         lose light. With the rule that α may vanish only where no point can contribute, {} lose any.",
        lost[0],
        lost[1..].iter().sum::<f64>(),
    );
    let tables = vec![table(
        "",
        &["pixels that lost light", "light missing in all"],
        &own,
    )];
    rows.extend(own);
    Ok(section("Fig. 10", &lead, pictures, tables))
}

/// Figs. 2 and 3: a sphere by three densities.
fn balls(context: &Context<'_>, rows: &mut Vec<Row>) -> Result<Section> {
    let scene = scene(&luminaires::shining_ball(), context)?;
    let renderer = Renderer::new(&scene);
    let shade = |estimator: &str, samples, seed| -> Result<Image> {
        let settings = Settings {
            estimator: estimator.parse()?,
            spheres: Spheres::Exact,
            ..settings(LightChoice::All, samples, 1, seed)?
        };
        Ok(pixels(&renderer, &settings, context))
    };
    let reference = shade("point-solid-angle", 1024, 9)?;
    let (mut pictures, mut own): (Vec<Picture>, _) = (Vec::new(), Vec::new());
    for (what, estimator) in [
        ("whole area", "point-area"),
        ("visible area", "point-visible-area"),
        ("solid angle", "point-solid-angle"),
    ] {
        let image = shade(estimator, 1, context.seed)?;
        let error = rmse(&image, &reference);
        let caption = format!("{what}: RMSE {error:.4}");
        pictures.push(exposed(&image, &reference, &caption)?);
        let name = format!("Figs. 2-3: {what}, 1 ray");
        own.push(Row::new(name, &[("RMSE", error)]));
    }
    let error = |k: usize| value(&own[k], "RMSE") / value(&own[0], "RMSE");
    let lead = format!(
        "A sphere by points on the part that is seen has {:.2} times the RMSE of points on all of its area, by points uniform \
         in solid angle {:.2} times.",
        error(1),
        error(2)
    );
    let tables = vec![table("One ray a pixel.", &["RMSE"], &own)];
    rows.extend(own);
    Ok(section("Figs. 2 and 3: spheres", &lead, pictures, tables))
}

/// Ten thousand luminaires: the tree against the probabilities that are best without knowing
/// shadows.
fn thousands(context: &Context<'_>, rows: &mut Vec<Row>) -> Result<Section> {
    let hall = luminaires::hall(context.or_least(100, 4));
    let mut scene = scene(&hall, context)?;
    scene.set_resolution(64, 64);
    let renderer = Renderer::new(&scene);
    let across = || (0..64u32).step_by(4);
    let grid: Vec<[u32; 2]> = across()
        .flat_map(|y| across().map(move |x| [x, y]))
        .collect();
    let targets = Targets::find(&renderer, &grid);
    let ideal = deviation(&targets, LightChoice::Exact, context.seed)?;
    let mut own = Vec::new();
    for choice in CHOICES {
        let deviation = deviation(&targets, choice, context.seed)?;
        let values = [("RMSE", deviation), ("over ideal", deviation / ideal)];
        own.push(Row::new(format!("10,000 luminaires: {choice}"), &values));
    }
    let size = context.size(SIZE);
    scene.set_resolution(size[0], size[1]);
    let renderer = Renderer::new(&scene);
    let render = |choice| -> Result<Image> {
        Ok(render_with(
            &renderer,
            &settings(choice, 4, 1, context.seed)?,
            size,
            context.progress,
            |_| {},
        ))
    };
    let tree = render(LightChoice::Tree)?;
    let power = render(LightChoice::Power)?;
    let pictures = vec![
        exposed(&power, &tree, "by power, 4 rays")?,
        exposed(&tree, &tree, "by the tree, 4 rays")?,
    ];
    let lead = "A hall with 10,000 luminaires and columns between them. The ideal without knowledge of \
                shadows is α in proportion to the exact unshadowed light of each.";
    let tables = vec![table(
        "Standard deviation of one ray a point.",
        &["RMSE", "over ideal"],
        &own,
    )];
    rows.extend(own);
    Ok(section("Ten thousand luminaires", lead, pictures, tables))
}

/// Standard deviation of one ray a point.
///
/// α by an estimate is drawn anew for each trial, so that it needs trials; of the others the
/// samples of a trial are independent, too, and α costs once.
fn deviation(targets: &Targets<'_>, choice: LightChoice, seed: u64) -> Result<f64> {
    let (samples, trials) = match choice {
        LightChoice::Estimate => (1, 32),
        _ => (128, 8),
    };
    let settings = settings(choice, samples, 1, seed)?;
    let variances = trial_variances(targets, settings, samples, trials, seed);
    let mean = variances.iter().sum::<f64>() / variances.len() as f64;
    Ok((mean * f64::from(samples)).sqrt())
}

/// Time of a pick by the number of lights.
fn logarithm(context: &Context<'_>, rows: &mut Vec<Row>) -> Result<Section> {
    let mut own = Vec::new();
    let mut costs = Vec::new();
    for &side in context.or_least(&[4u32, 13, 40, 126][..], &[4]) {
        let scene = scene(&luminaires::hall(side), context)?;
        let lights: Vec<Light> = scene.lights.iter().map(|l| *l.light).collect();
        let tree = LightTree::new(&lights);
        let points: Vec<DVec3> = (0..256)
            .map(|i| {
                let at = |k: f64| 30.0 * ((f64::from(i) + 0.5) * k).fract() - 15.0;
                DVec3::new(at(0.618_034), 0.0, at(0.754_878))
            })
            .collect();
        let mut least = f64::INFINITY;
        for _ in 0..40 {
            let start = Instant::now();
            for (i, x) in points.iter().enumerate() {
                let u = (i as f64 * 0.381_966).fract();
                black_box(tree.pick(|i| &lights[i], &diffuse(black_box(*x), DVec3::Y), u));
            }
            least = least.min(start.elapsed().as_secs_f64() * 1e9 / 256.0);
        }
        let count = f64::from(side * side);
        costs.push((log2(count), least));
        let values = [
            ("ns per pick", least),
            ("ns per doubling", least / log2(count)),
        ];
        own.push(Row::new(format!("tree of {count} luminaires"), &values));
    }
    rows.extend(own.clone());
    let lead = straightness(&costs);
    let tables = vec![table("", &["ns per pick", "ns per doubling"], &own)];
    Ok(section("The cost of the tree", &lead, Vec::new(), tables))
}

/// How straight costs are over the logarithm of the number of lights: nanoseconds that each
/// doubling adds, in the first and in the last part of the range.
fn straightness(costs: &[(f64, f64)]) -> String {
    let slope = |[a, b]: [(f64, f64); 2]| (b.1 - a.1) / (b.0 - a.0);
    let slopes: Vec<f64> = costs.windows(2).map(|w| slope([w[0], w[1]])).collect();
    let (Some(first), Some(last)) = (slopes.first(), slopes.last()) else {
        return "The cost of choosing one light by the tree, for one number of lights.".to_owned();
    };
    let shape = match last / first {
        r if r > 1.5 => "it bends upwards: more than the logarithm",
        r if r < 2.0 / 3.0 => "it bends downwards: less than the logarithm",
        _ => "a straight line over the logarithm to within a factor of 1.5",
    };
    format!(
        "The cost of choosing one light by the tree grows by {first:.0} ns with each doubling of few lights and by {last:.0} ns \
         of many: {shape}."
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_tell_the_error_of_their_mean() {
        let picture = |values: [f32; 2]| Image {
            width: 2,
            height: 1,
            rgb: values.map(|v| [v; 3]).to_vec(),
        };
        // Half of the differences 4 and 0: √((2² + 0²)/2).
        let (mean, error) = halved(picture([2.0, 7.0]), &picture([6.0, 7.0]));
        assert_eq!(mean.rgb, picture([4.0, 7.0]).rgb);
        assert!((error - 2f64.sqrt()).abs() < 4.0 * f64::EPSILON, "{error}");
    }

    #[test]
    fn bends_are_said() {
        let line = |f: fn(f64) -> f64| [4.0, 8.0, 12.0].map(|x| (x, f(x)));
        assert!(straightness(&line(|x| 3.0 * x + 5.0)).contains("straight"));
        assert!(straightness(&line(|x| x * x)).contains("upwards"));
        assert!(straightness(&line(f64::ln)).contains("downwards"));
    }
}

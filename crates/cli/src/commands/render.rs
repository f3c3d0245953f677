//! `linelit render`.

use super::aovs::{self, Rendered};
use super::checkpoints::{self, Kept};
use super::{bar, pool};
use crate::args::{ImageArgs, PictureArgs, RenderArgs, UsageError};
use crate::inputs;
use crate::output::{Output, OutputError};
use crate::words::Crop;
use anyhow::{Result, bail};
use linelit_film::{Document, Exposure, Image, Tile, ToneCurve};
use linelit_integrator::{Counts, Renderer, Settings};
use linelit_scene::Scene;
use linelit_study::memory;
use linelit_study::{short_name, version};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

/// Renders a scene to an image.
///
/// # Errors
/// If the scene cannot be read or the image cannot be written.
pub fn run(args: &RenderArgs, out: &mut Output) -> Result<()> {
    check_file(&args.file, &args.output)?;
    aovs::check(&args.picture, is_png(&args.output))?;
    // Before the work, lest that be lost.
    linelit_film::check_writable(&args.output)?;
    let pool = pool(&args.common)?;
    let start = Instant::now();
    let planned = inputs::plan(&args.scene, &args.common.read, false)?;
    let mut scene = planned.loaded.scene;
    let window = set_film(&mut scene, &args.picture);
    pool.install(|| memory::check_picture(window, aovs::bytes_per_pixel(&args.picture)))?;
    let load_seconds = start.elapsed().as_secs_f64();
    let built = Instant::now();
    let mut renderer = pool.install(|| Renderer::new(&scene));
    set_lights(&mut renderer, &args.picture)?;
    let build_seconds = built.elapsed().as_secs_f64();
    let drawn = Instant::now();
    let kept = checkpoints::wanted(args, &scene, window)
        .then(|| Kept::open(args, &scene, window, planned.input))
        .transpose()?;
    let mut counts = Counts::default();
    let (rendered, found) = if let Some(kept) = &kept {
        kept.render(&renderer, &pool)?
    } else {
        let rendered;
        (rendered, counts) = pool.install(|| directly(args, &renderer, window));
        (rendered, counted(&counts))
    };
    let seconds = drawn.elapsed().as_secs_f64();
    let times = [load_seconds, build_seconds, seconds];
    let result = args
        .common
        .json
        .then(|| json(args, &rendered.image, found, times));
    let to = (&*args.output, &args.file);
    pool.install(|| write(rendered, to, &args.scene, &args.picture))?;
    if let Some(kept) = kept {
        kept.finish()?;
    }
    if let Some(result) = result {
        writeln!(out, "{result}")?;
    } else if args.explain {
        explain(&renderer, &args.picture.settings(), &counts, times, out)?;
    }
    Ok(())
}

/// The picture, by the threads of the current pool.
fn directly(args: &RenderArgs, renderer: &Renderer<'_>, window: Tile) -> (Rendered, Counts) {
    aovs::render(renderer, &args.picture, window, &bar("rendering"))
}

/// That the flags of a file are for files of its format.
pub(super) fn check_file(args: &ImageArgs, path: &Path) -> Result<(), UsageError> {
    let contradiction = |text: &str| Err(UsageError(text.to_owned()));
    if args.compression.is_some() && is_png(path) {
        return contradiction("--compression is for EXR files");
    }
    if (args.exposure.abs() > 0.0 || args.tone_curve != ToneCurve::Clip) && !is_png(path) {
        return contradiction(
            "--exposure and --tone-curve are for PNG files: EXR files hold radiance",
        );
    }
    Ok(())
}

/// Gives a scene the resolution that is asked for, and says which part of its film is.
pub(super) fn set_film(scene: &mut Scene, args: &PictureArgs) -> Tile {
    if let Some(resolution) = args.resolution {
        scene.set_resolution(resolution.width, resolution.height);
    }
    window(scene, args.crop)
}

/// That the lights that are asked for are there.
pub(super) fn check_lights(scene: &Scene, args: &PictureArgs) -> Result<()> {
    let count = scene.lights.len();
    let own = args.light_estimator.iter().map(|own| own.light);
    for light in own.chain(args.light_apart.iter().copied()) {
        if light as usize >= count {
            bail!("no light {light}: the scene has {count}, counted from 0");
        }
    }
    Ok(())
}

/// Gives lights what is asked for them alone.
pub(super) fn set_lights(renderer: &mut Renderer<'_>, args: &PictureArgs) -> Result<()> {
    check_lights(renderer.scene(), args)?;
    for own in &args.light_estimator {
        renderer.set_light_estimator(own.light, Some(own.estimator));
    }
    for light in &args.light_apart {
        renderer.set_light_apart(*light, true);
    }
    Ok(())
}

fn window(scene: &Scene, crop: Option<Crop>) -> Tile {
    let [x0, x1, y0, y1] = scene.film.crop;
    let (width, height) = (scene.film.width, scene.film.height);
    crop.map_or(Tile { x0, x1, y0, y1 }, |crop| crop.window(width, height))
}

pub(super) fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "png")
}

/// Takes the image, whose memory the file's text needs.
pub(super) fn write(
    rendered: Rendered,
    (path, file): (&Path, &ImageArgs),
    scene: &str,
    picture: &PictureArgs,
) -> Result<()> {
    let image = &rendered.image;
    if is_png(path) {
        let exposure = Exposure {
            stops: file.exposure,
        };
        match file.tone_curve {
            ToneCurve::Clip => linelit_film::write_png(path, image, exposure)?,
            curve => {
                let shown = curve.apply(image, exposure);
                linelit_film::write_png(path, &shown, Exposure::default())?;
            }
        }
        return Ok(());
    }
    let mut document = Document::new(image.width, image.height);
    document.placement = rendered.placement;
    document.add_image("", image)?;
    aovs::add(&mut document, &rendered, picture)?;
    drop(rendered);
    document.set("scene", short_name(scene));
    document.set("estimator", picture.estimator);
    for own in &picture.light_estimator {
        let name = format!("estimatorOfLight{}", own.light);
        document.set(&name, own.estimator);
    }
    document.set("sampler", picture.sampler);
    document.set("samples", picture.samples);
    document.set("pixelSamples", picture.pixel_samples);
    document.set("trials", picture.trials);
    document.set("seed", picture.seed);
    document.set("linelit", version());
    linelit_film::write_atomically(
        path,
        &document.into_bytes(file.compression.unwrap_or_default())?,
    )?;
    Ok(())
}

fn explain(
    renderer: &Renderer<'_>,
    settings: &Settings,
    counts: &Counts,
    times: [f64; 3],
    out: &mut Output,
) -> Result<(), OutputError> {
    writeln!(
        out,
        "{:>14}  lights, {} of them dark",
        renderer.plan().lights().len(),
        renderer.plan().dark_lights()
    )?;
    for pair in renderer.methods(settings) {
        let methods: Vec<_> = pair.methods.iter().map(ToString::to_string).collect();
        let materials = &renderer.scene().materials;
        let name = |k: &u32| format!("`{}`", materials[*k as usize].name);
        let names: BTreeSet<_> = pair.materials.iter().map(name).collect();
        let (count, light, methods) = (pair.lights.len(), pair.light, methods.join("; "));
        let names: Vec<_> = names.into_iter().collect();
        let names = names.join(", ");
        writeln!(out, "{count:>14}  of them ({light}): {methods}; on {names}")?;
    }
    write!(out, "{}", counts.plan)?;
    writeln!(out, "{:>14}  rays", counts.visibility.rays)?;
    writeln!(
        out,
        "{:>14}  shafts, {} of them too dense to keep",
        counts.visibility.shafts, counts.visibility.dense_shafts
    )?;
    writeln!(out, "{:>14}  box tests", counts.visibility.node_tests)?;
    writeln!(
        out,
        "{:>14}  triangle tests",
        counts.visibility.triangle_tests
    )?;
    writeln!(
        out,
        "{:>14}  visible pieces of {} lines",
        counts.segments.pieces, counts.segments.lines
    )?;
    let [load, build, render] = times;
    writeln!(
        out,
        "load {load:.3} s, build {build:.3} s, render {render:.3} s"
    )
}

fn json(args: &RenderArgs, image: &Image, counted: Map<String, Value>, times: [f64; 3]) -> Value {
    let mut found = picture_json(&args.scene, &args.output, image, counted);
    for (name, seconds) in ["load_seconds", "build_seconds", "render_seconds"]
        .iter()
        .zip(times)
    {
        found.insert((*name).to_owned(), seconds.into());
    }
    found.into()
}

/// What is said of a picture that was written.
pub(super) fn picture_json(
    scene: &str,
    output: &Path,
    image: &Image,
    counted: Map<String, Value>,
) -> Map<String, Value> {
    let mut found = counted;
    for (name, value) in [
        ("scene", scene.into()),
        ("output", json!(output)),
        ("width", image.width.into()),
        ("height", image.height.into()),
        ("mean", json!(image.mean())),
    ] {
        found.insert(name.to_owned(), value);
    }
    found
}

/// What was counted, by name.
pub(super) fn counted(counts: &Counts) -> Map<String, Value> {
    let plan = counts.plan.rows().map(|(k, v)| (k.to_owned(), v.into()));
    let plan: Map<String, Value> = plan.collect();
    let visibility = &counts.visibility;
    let mut found = Map::new();
    found.insert("plan".to_owned(), plan.into());
    for (name, count) in [
        ("rays", visibility.rays),
        ("shafts", visibility.shafts),
        ("line_queries", visibility.line_queries),
        ("node_tests", visibility.node_tests),
        ("triangle_tests", visibility.triangle_tests),
        ("intervals", visibility.intervals),
    ] {
        found.insert(name.to_owned(), count.into());
    }
    found
}

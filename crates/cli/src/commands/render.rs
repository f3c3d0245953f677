//! `linelit render`.

use super::aovs::{self, Rendered};
use super::{bar, pool};
use crate::args::{RenderArgs, UsageError};
use crate::output::{Output, OutputError};
use crate::words::Crop;
use anyhow::{Result, bail};
use linelit_film::{Document, Exposure, Image, Tile, ToneCurve};
use linelit_integrator::{Counts, Renderer, Settings};
use linelit_study::engine::{CpuClock, image};
use linelit_study::{short_name, version};
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

/// Renders a scene to an image.
///
/// # Errors
/// If the scene cannot be read or the image cannot be written.
pub fn run(args: &RenderArgs, out: &mut Output) -> Result<()> {
    if args.compression.is_some() && is_png(&args.output) {
        return Err(UsageError("--compression is for EXR files".to_owned()).into());
    }
    if (args.exposure.abs() > 0.0 || args.tone_curve != ToneCurve::Clip) && !is_png(&args.output) {
        let text = "--exposure and --tone-curve are for PNG files: EXR files hold radiance";
        return Err(UsageError(text.to_owned()).into());
    }
    aovs::check(args, is_png(&args.output))?;
    // Before the work, lest that be lost.
    linelit_film::check_writable(&args.output)?;
    let pool = pool(&args.common)?;
    let start = Instant::now();
    let mut scene = args.common.read.library().load_lit(&args.scene)?.scene;
    if let Some(resolution) = args.resolution {
        scene.set_resolution(resolution.width, resolution.height);
    }
    let window = window(&scene, args.crop);
    pool.install(|| image::check_memory(window))?;
    let load_seconds = start.elapsed().as_secs_f64();
    let built = Instant::now();
    let mut renderer = pool.install(|| Renderer::new(&scene));
    set_lights(&mut renderer, args)?;
    if args.calibrate {
        let clock = CpuClock::start();
        renderer.calibrate(|| clock.seconds());
    }
    let build_seconds = built.elapsed().as_secs_f64();
    let settings = Settings {
        estimator: args.estimator,
        sampler: args.sampler,
        samples: args.samples,
        lights: args.lights,
        spheres: args.spheres,
        pixel_samples: args.pixel_samples,
        seed: args.seed,
        show_lights: !args.hide_lights,
        bounces: args.bounces,
        skip: true,
        share: true,
    };
    let drawn = Instant::now();
    let rendered =
        pool.install(|| aovs::render(&renderer, &settings, window, &args.aovs, &bar("rendering")));
    let seconds = drawn.elapsed().as_secs_f64();
    let times = [load_seconds, build_seconds, seconds];
    let result = args
        .common
        .json
        .then(|| json(args, &rendered.image, &rendered.counts, times));
    let counts = rendered.counts;
    pool.install(|| write(rendered, &renderer, window, args, &settings))?;
    if let Some(result) = result {
        writeln!(out, "{result}")?;
    } else if args.explain {
        explain(&renderer, &settings, &counts, times, out)?;
        if args.calibrate {
            costs(&renderer, out)?;
        }
    }
    Ok(())
}

/// What the calibration found.
fn costs(renderer: &Renderer<'_>, out: &mut Output) -> Result<(), OutputError> {
    for light in renderer.plan().lights() {
        let (cost, k) = (light.occlusion.exact_cost, light.index);
        writeln!(
            out,
            "{cost:>14.2}  times the table's: the closed form past what hides light {k}"
        )?;
    }
    Ok(())
}

fn set_lights(renderer: &mut Renderer<'_>, args: &RenderArgs) -> Result<()> {
    let count = renderer.scene().lights.len();
    let own = args.light_estimator.iter().map(|own| own.light);
    for light in own.chain(args.light_apart.iter().copied()) {
        if light as usize >= count {
            bail!("no light {light}: the scene has {count}, counted from 0");
        }
    }
    for own in &args.light_estimator {
        renderer.set_light_estimator(own.light, Some(own.estimator));
    }
    for light in &args.light_apart {
        renderer.set_light_apart(*light, true);
    }
    Ok(())
}

fn window(scene: &linelit_scene::Scene, crop: Option<Crop>) -> Tile {
    let [x0, x1, y0, y1] = scene.film.crop;
    let (width, height) = (scene.film.width, scene.film.height);
    crop.map_or(Tile { x0, x1, y0, y1 }, |crop| crop.window(width, height))
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "png")
}

/// Takes the image, whose memory the file's text needs.
fn write(
    rendered: Rendered,
    renderer: &Renderer<'_>,
    window: Tile,
    args: &RenderArgs,
    settings: &Settings,
) -> Result<()> {
    let (path, image) = (&args.output, &rendered.image);
    if is_png(path) {
        let exposure = Exposure {
            stops: args.exposure,
        };
        match args.tone_curve {
            ToneCurve::Clip => linelit_film::write_png(path, image, exposure)?,
            curve => {
                let shown = curve.apply(image, exposure);
                linelit_film::write_png(path, &shown, Exposure::default())?;
            }
        }
        return Ok(());
    }
    let mut document = Document::new(image.width, image.height);
    document.add_image("", image)?;
    aovs::add(&mut document, &rendered, renderer, window, &args.aovs)?;
    drop(rendered);
    document.set("scene", short_name(&args.scene));
    document.set("estimator", settings.estimator);
    for own in &args.light_estimator {
        let name = format!("estimatorOfLight{}", own.light);
        document.set(&name, own.estimator);
    }
    document.set("sampler", settings.sampler);
    document.set("samples", settings.samples);
    document.set("pixelSamples", settings.pixel_samples);
    document.set("seed", settings.seed);
    document.set("linelit", version());
    linelit_film::write_atomically(
        path,
        &document.into_bytes(args.compression.unwrap_or_default())?,
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

fn json(args: &RenderArgs, image: &Image, counts: &Counts, times: [f64; 3]) -> serde_json::Value {
    let plan: serde_json::Map<_, _> = counts
        .plan
        .rows()
        .map(|(k, v)| (k.to_owned(), v.into()))
        .collect();
    serde_json::json!({
        "scene": args.scene,
        "output": args.output,
        "width": image.width,
        "height": image.height,
        "mean": image.mean(),
        "load_seconds": times[0],
        "build_seconds": times[1],
        "render_seconds": times[2],
        "plan": plan,
        "rays": counts.visibility.rays,
        "shafts": counts.visibility.shafts,
        "line_queries": counts.visibility.line_queries,
        "node_tests": counts.visibility.node_tests,
        "triangle_tests": counts.visibility.triangle_tests,
        "intervals": counts.visibility.intervals,
    })
}

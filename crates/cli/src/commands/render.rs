//! `linelit render`.

use super::aovs::{self, Rendered};
use super::picture::{Cut, Picture, pixel_seconds};
use super::pool;
use super::tev::Viewer;
use super::units::{keep, work_off};
use crate::args::{Checkpoints, ImageArgs, PictureArgs, RenderArgs, UsageError};
use crate::folder::{Lock, remove_all};
use crate::inputs::Sources;
use crate::output::{Output, OutputError};
use anyhow::{Result, bail};
use linelit_film::{Document, Exposure, Tile};
use linelit_integrator::{Counts, LightChoice, Renderer, Settings, Spheres};
use linelit_plan::{Folder, Shard};
use linelit_scene::SceneDescription;
use linelit_study::memory;
use linelit_study::{short_name, version};
use rayon::ThreadPool;
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Pictures of less are not kept: seconds of one thread, as guessed.
const LONG: f64 = 30.0;

/// Renders a scene to an image.
pub fn run(args: &RenderArgs, out: &mut Output) -> Result<()> {
    check_file(&args.file, &args.output)?;
    aovs::check(&args.picture, !ends_in(&args.output, "exr"))?;
    // Before the work, lest that be lost.
    linelit_film::check_writable(&args.output)?;
    let pool = pool(&args.common)?;
    let start = Instant::now();
    let sources = Sources::new(&args.common.read);
    let mut scene = sources.load(&args.scene)?;
    let window = set_film(&mut scene, &args.picture);
    pool.install(|| memory::check_picture(window, aovs::bytes_per_pixel(&args.picture)))?;
    let load_seconds = start.elapsed().as_secs_f64();
    let built = Instant::now();
    let renderer = pool.install(|| renderer(&scene, &args.picture))?;
    let build_seconds = built.elapsed().as_secs_f64();
    let drawn = Instant::now();
    let picture = Picture::new(&args.scene, &scene, &args.picture, window);
    let pixel = pixel_seconds(&scene, &args.picture);
    let is_kept = match args.checkpoints {
        // Parts do not say all that is explained, and are not shown.
        _ if args.explain || args.tev.is_some() => false,
        Checkpoints::Never => false,
        Checkpoints::Always => true,
        Checkpoints::Auto => pixel * window.area() as f64 >= LONG,
    };
    let mut counts = Counts::default();
    let (mut kept, mut viewer) = (None, None);
    let (rendered, counted) = if is_kept {
        let cut = Cut::choose(&args.picture, window, pixel, None, false);
        let picture = picture.cut(cut);
        let (folder, lock) = open(args, &picture, pixel, &sources)?;
        let found = render_kept(&picture, &renderer, &folder, &pool)?;
        kept = Some((folder, lock));
        found
    } else {
        let (rendered, counted);
        let name = args.output.to_string_lossy();
        if let Some(address) = &args.tev {
            viewer = Some(Viewer::new(address, &name, window)?);
        }
        (rendered, counted, counts) = pool.install(|| picture.at_once(&renderer, viewer.as_mut()));
        (rendered, counted)
    };
    let times = [load_seconds, build_seconds, drawn.elapsed().as_secs_f64()];
    let mut result = picture_json(&args.scene, &args.output, &rendered, &counted);
    let to = (&*args.output, &args.file);
    pool.install(|| write(rendered, to, &args.scene, &args.picture))?;
    if let Some((folder, _lock)) = kept {
        remove_all(folder.path())?;
    }
    if args.common.json {
        let names = ["load_seconds", "build_seconds", "render_seconds"].map(str::to_owned);
        result.extend(names.into_iter().zip(times.map(Value::from)));
        writeln!(out, "{}", Value::from(result))?;
    } else if args.explain {
        explain(&renderer, &args.picture.settings(), &counts, times, out)?;
    } else {
        print(&args.output, &result, times, out)?;
    }
    // The picture is written, whatever tev does.
    if let Some(viewer) = viewer {
        viewer.finish();
    }
    Ok(())
}

/// Prints what was written, and what it took.
fn print(
    output: &Path,
    result: &Map<String, Value>,
    times: [f64; 3],
    out: &mut Output,
) -> Result<(), OutputError> {
    let [width, height] = ["width", "height"].map(|name| &result[name]);
    let [rays, lines] = ["rays", "line_queries"].map(|name| &result[name]);
    let (path, seconds) = (output.display(), times.iter().sum::<f64>());
    writeln!(
        out,
        "{path}: {width} x {height} pixels in {seconds:.1} s, {rays} rays, {lines} lines"
    )
}

/// Begins to keep a long picture in a plan beside it, or goes on with what an interrupted command
/// kept. It is ours as long as the lock is held.
fn open(
    args: &RenderArgs,
    picture: &Picture,
    pixel: f64,
    sources: &Sources<'_>,
) -> Result<(Folder, Option<Lock>)> {
    let path = beside(&args.output, "plan");
    let shown = args.output.display();
    let lock = Lock::acquire(&beside(&args.output, "lock"), |holder| {
        format!("process {holder} is rendering {shown}: wait for it, or choose another name")
    })?;
    if args.fresh {
        remove_all(&path)?;
    }
    Ok((
        keep(&path, &picture.plan(pixel, sources)?, "picture")?,
        lock,
    ))
}

/// Renders the missing parts of a picture whose parts are kept, and merges all of them.
fn render_kept(
    picture: &Picture,
    renderer: &Renderer<'_>,
    folder: &Folder,
    pool: &ThreadPool,
) -> Result<(Rendered, Vec<u64>)> {
    let (threads, goes_on) = (pool.current_num_threads(), "the same command");
    work_off(
        folder,
        Shard::ALL,
        threads,
        goes_on,
        &|_| false,
        |options| Ok(picture.run_with(renderer, folder, options)?),
    )?;
    picture.gather(folder)
}

/// The name of something that stands beside a picture for a while.
fn beside(picture: &Path, what: &str) -> PathBuf {
    let name = picture.file_name().unwrap_or_default().to_string_lossy();
    picture.with_file_name(format!(".{name}.linelit-{what}"))
}

/// Checks that the flags of a file are for files of its format.
pub(super) fn check_file(args: &ImageArgs, path: &Path) -> Result<(), UsageError> {
    let contradiction = |text: &str| Err(UsageError(text.to_owned()));
    if args.compression.is_some() && !ends_in(path, "exr") {
        return contradiction("--compression is for EXR files");
    }
    if args.exposure.abs() > 0.0 && !is_png(path) {
        return contradiction("--exposure is for PNG files: others hold radiance");
    }
    Ok(())
}

/// Gives a scene the resolution that is asked for, and says which part of its film is.
pub(super) fn set_film(scene: &mut SceneDescription, args: &PictureArgs) -> Tile {
    if let Some(resolution) = args.resolution {
        scene.set_resolution(resolution.width, resolution.height);
    }
    let ([x0, x1, y0, y1], film) = (scene.film.crop, &scene.film);
    let all = Tile { x0, y0, x1, y1 };
    args.crop
        .map_or(all, |crop| crop.window(film.width, film.height))
}

/// Checks that each light that the flags name is one that is sampled: a number that changes
/// nothing is a mistake.
pub(super) fn check_lights(scene: &SceneDescription, args: &PictureArgs) -> Result<()> {
    let count = scene.lights.len();
    // Check that each number is a light that is sampled by itself and emits.
    let own = || args.light_estimator.iter().map(|own| own.light);
    for light in own().chain(args.light_apart.iter().copied()) {
        let Some(named) = scene.lights.get(light as usize) else {
            bail!("no light {light}: the scene has {count}, counted from 0");
        };
        let whole = scene.whole_of(light).map(|round| round.lights.start);
        if let (Spheres::Exact, Some(first)) = (args.spheres, whole.filter(|k| *k != light)) {
            bail!(
                "light {light} is a facet of light {first}, which is sampled as a whole: name \
                 that, or take --spheres facets (`linelit info` has the numbers)"
            );
        }
        if !(named.light.power() > 0.0) {
            bail!("light {light} emits nothing, and is not sampled");
        }
    }
    // Check that the flags do not contradict each other.
    let mut seen = BTreeSet::new();
    if let Some(twice) = own().find(|light| !seen.insert(*light)) {
        bail!("light {twice} has two estimators by --light-estimator");
    }
    if !args.light_apart.is_empty() && args.lights == LightChoice::All {
        bail!("--light-apart is for --lights that pick one: by default all are sampled apart");
    }
    Ok(())
}

/// The numbers of the lights of a scene, a round shape by that of its first facet where it is
/// sampled as a whole.
pub(super) fn numbers(scene: &SceneDescription, spheres: Spheres) -> impl Iterator<Item = u32> {
    let is_own = move |light: &u32| {
        let whole = scene.whole_of(*light).filter(|_| spheres == Spheres::Exact);
        whole.is_none_or(|round| round.lights.start == *light)
    };
    let all = 0..u32::try_from(scene.lights.len()).unwrap_or(u32::MAX);
    all.filter(is_own)
}

/// A renderer of what is asked for.
pub(super) fn renderer<'s>(
    scene: &'s SceneDescription,
    args: &PictureArgs,
) -> Result<Renderer<'s>> {
    check_lights(scene, args)?;
    let own = args.light_estimator.iter().map(|own| &own.estimator);
    let mut renderer = Renderer::for_estimators(scene, own.chain([&args.settings().estimator]));
    for own in &args.light_estimator {
        renderer.set_light_estimator(own.light, Some(own.estimator));
    }
    for light in &args.light_apart {
        renderer.set_light_apart(*light, true);
    }
    Ok(renderer)
}

pub(super) fn is_png(path: &Path) -> bool {
    ends_in(path, "png")
}

/// Whether a file's name has this ending.
pub(super) fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e == ending)
}

/// Takes the image, whose memory the file's text needs.
pub(super) fn write(
    rendered: Rendered,
    (path, file): (&Path, &ImageArgs),
    scene: &str,
    picture: &PictureArgs,
) -> Result<()> {
    let image = &rendered.image;
    // Write a PNG or PFM file, which holds the image alone.
    if is_png(path) {
        let exposure = Exposure {
            stops: file.exposure,
        };
        linelit_film::write_png(path, image, exposure)?;
        return Ok(());
    }
    if ends_in(path, "pfm") {
        linelit_film::write_atomically(path, &linelit_film::encode_pfm(image)?)?;
        return Ok(());
    }
    // Write an EXR file with all layers, and how the picture was made.
    let mut document = Document::new(image.width, image.height);
    (document.placement, document.world_to) = (rendered.placement, rendered.world_to);
    document.add_image("", image)?;
    aovs::add(&mut document, &rendered, picture)?;
    if rendered.has_lamp {
        document.set("lamp", "not in the file, which has no lights");
    }
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
    let lit = renderer.plan().lights_of(settings.spheres).len();
    let lights = numbers(renderer.scene(), settings.spheres).count();
    let dark = lights - lit;
    writeln!(out, "{lights:>14}  lights, {dark} of them dark")?;
    for pair in renderer.methods(settings) {
        let materials = &renderer.scene().materials;
        let name = |k: &u32| format!("`{}`", materials[*k as usize].name);
        let names: BTreeSet<_> = pair.materials.iter().map(name).collect();
        let (count, light, methods) = (pair.lights.len(), pair.light, pair.methods);
        let names: Vec<_> = names.into_iter().collect();
        let names = names.join(", ");
        writeln!(out, "{count:>14}  of them ({light}): {methods}; on {names}")?;
    }
    write!(out, "{}", counts.plan)?;
    let plan = &counts.plan;
    let settled = plan.facing_away + plan.below_horizon + plan.hidden;
    let closed = plan.closed_form + plan.exact_penumbrae;
    let sampled = plan.point_lights.saturating_sub(settled + closed);
    writeln!(
        out,
        "{sampled:>14}  all other pairs: sampled by lines or points"
    )?;
    let (visibility, segments) = (&counts.visibility, &counts.segments);
    let dense = visibility.dense_shafts;
    for (count, what) in [
        (visibility.rays, "rays".to_owned()),
        (
            visibility.shafts,
            format!("shafts, {dense} of them too dense to keep"),
        ),
        (visibility.node_tests, "box tests".to_owned()),
        (visibility.triangle_tests, "triangle tests".to_owned()),
        (
            segments.pieces,
            format!("visible pieces of {} lines", segments.lines),
        ),
    ] {
        writeln!(out, "{count:>14}  {what}")?;
    }
    let [load, build, render] = times;
    writeln!(
        out,
        "load {load:.3} s, build {build:.3} s, render {render:.3} s"
    )
}

/// Returns the JSON report of a picture that was written, with the numbers of [`counted`].
pub(super) fn picture_json(
    scene: &str,
    output: &Path,
    rendered: &Rendered,
    numbers: &[u64],
) -> Map<String, Value> {
    let (image, none) = (&rendered.image, Counts::default());
    let names = counted(&none).map(|(name, _)| name.to_owned());
    let mut rows = names.zip(numbers.iter().map(|n| Value::from(*n)));
    let plan: Map<String, Value> = rows.by_ref().take(none.plan.rows().count()).collect();
    let mut found: Map<String, Value> = rows.collect();
    for (name, value) in [
        ("plan", plan.into()),
        ("scene", scene.into()),
        ("output", json!(output)),
        ("width", image.width.into()),
        ("height", image.height.into()),
        ("mean", json!(image.mean())),
        ("lamp", rendered.has_lamp.into()),
    ] {
        found.insert(name.to_owned(), value);
    }
    found
}

/// The numbers reported about a picture, by name: those of the plan of what to skip first.
pub(super) fn counted(counts: &Counts) -> impl Iterator<Item = (&'static str, u64)> {
    let visibility = &counts.visibility;
    counts.plan.rows().chain([
        ("rays", visibility.rays),
        ("shafts", visibility.shafts),
        ("line_queries", visibility.line_queries),
        ("node_tests", visibility.node_tests),
        ("triangle_tests", visibility.triangle_tests),
        ("intervals", visibility.intervals),
    ])
}

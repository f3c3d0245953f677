//! `linelit render`.

use super::aovs::{self, Rendered};
use super::cut::{Cut, pixel_seconds};
use super::image::{check_file, ends_in, numbers, picture_json, renderer, set_film, write};
use super::methods::in_place;
use super::picture::Picture;
use super::tev::Viewer;
use super::threads::pool;
use super::units::{keep, work_off};
use crate::args::{Checkpoints, RenderArgs};
use crate::folder::{Lock, remove_all};
use crate::inputs::Sources;
use crate::output::{Output, OutputError};
use anyhow::Result;
use linelit_integrator::{Counts, Renderer, Settings};
use linelit_plan::{Folder, Shard};
use linelit_study::memory;
use rayon::ThreadPool;
use serde_json::{Map, Value};
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

/// Prints what was skipped, which methods were taken, and what it took.
fn explain(
    renderer: &Renderer<'_>,
    settings: &Settings,
    counts: &Counts,
    times: [f64; 3],
    out: &mut Output,
) -> Result<(), OutputError> {
    // Say which methods the lights have.
    let lit = renderer.plan().lights_of(settings.spheres).len();
    let lights = numbers(renderer.scene(), settings.spheres).count();
    let dark = lights - lit;
    writeln!(out, "{lights:>14}  lights, {dark} of them dark")?;
    for pair in renderer.methods(settings) {
        let materials = &renderer.scene().materials;
        let name = |k: &u32| format!("`{}`", materials[*k as usize].name);
        let names: BTreeSet<_> = pair.materials.iter().map(name).collect();
        let (count, light, methods) = (pair.lights.len(), pair.light, pair.methods);
        let note = in_place(pair.points_in_place);
        let names: Vec<_> = names.into_iter().collect();
        let names = names.join(", ");
        writeln!(
            out,
            "{count:>14}  of them ({light}): {methods}{note}; on {names}"
        )?;
    }
    // Say what was skipped, and what is left.
    write!(out, "{}", counts.plan)?;
    let plan = &counts.plan;
    let left_out = plan.facing_away + plan.below_horizon + plan.groups_left_out;
    let settled = left_out + plan.hidden;
    let closed = plan.closed_form + plan.exact_penumbrae;
    let sampled = plan.point_lights.saturating_sub(settled + closed);
    writeln!(
        out,
        "{sampled:>14}  all other pairs: sampled by lines or points"
    )?;
    // Say what visibility took, and the time.
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

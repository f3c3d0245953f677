//! `linelit render`: renders a picture of a scene, and stores the finished parts of a long one
//! until it is whole, so that an interrupted command can be continued.

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

/// The estimated time of a picture, in seconds of one thread, from which its finished parts are
/// stored by default (`--checkpoints auto`). Shorter pictures are computed again if they are
/// interrupted.
const LONG: f64 = 30.0;

/// Renders a scene to an image.
pub fn run(args: &RenderArgs, out: &mut Output) -> Result<()> {
    check_file(&args.file, &args.output)?;
    aovs::check(&args.picture, !ends_in(&args.output, "exr"))?;
    // Check before the work that the result can be written.
    linelit_film::check_writable(&args.output)?;
    // Read the scene and build the renderer.
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
    // Decide whether the finished parts are stored.
    let picture = Picture::new(&args.scene, &scene, &args.picture, window);
    let pixel = pixel_seconds(&scene, &args.picture);
    let is_kept = match args.checkpoints {
        // Stored parts lack some of the counts that `--explain` prints, and cannot be shown in tev.
        _ if args.explain || args.tev.is_some() => false,
        Checkpoints::Never => false,
        Checkpoints::Always => true,
        Checkpoints::Auto => pixel * window.area() as f64 >= LONG,
    };
    // Render by a plan in a folder, or at once.
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
    // Write the picture, and then remove the folder of its parts.
    let times = [load_seconds, build_seconds, drawn.elapsed().as_secs_f64()];
    let mut result = picture_json(&args.scene, &args.output, &rendered, &counted);
    let to = (&*args.output, &args.file);
    pool.install(|| write(rendered, to, &args.scene, &args.picture))?;
    if let Some((folder, _lock)) = kept {
        remove_all(folder.path())?;
    }
    // Print the result.
    if args.common.json {
        let names = ["load_seconds", "build_seconds", "render_seconds"].map(str::to_owned);
        result.extend(names.into_iter().zip(times.map(Value::from)));
        writeln!(out, "{}", Value::from(result))?;
    } else if args.explain {
        explain(&renderer, &args.picture.settings(), &counts, times, out)?;
    } else {
        print(&args.output, &result, times, out)?;
    }
    // Wait for tev only now: the picture is written even if tev fails.
    if let Some(viewer) = viewer {
        viewer.finish();
    }
    Ok(())
}

/// Prints which file was written, its size, and the time and the rays and lines that it took.
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

/// Creates the plan that stores the parts of a long picture, in a hidden folder next to the
/// picture's file, or opens the plan of an interrupted command. No other process uses the plan as
/// long as the returned lock is held.
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

/// Renders the missing parts of a picture whose parts are stored in a folder, and merges all parts.
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

/// Returns the path of a temporary hidden file or folder next to a picture; `what` is the end of
/// its name.
fn beside(picture: &Path, what: &str) -> PathBuf {
    let name = picture.file_name().unwrap_or_default().to_string_lossy();
    picture.with_file_name(format!(".{name}.linelit-{what}"))
}

/// Prints which methods the lights have, what was skipped, and what visibility and the whole
/// picture cost.
fn explain(
    renderer: &Renderer<'_>,
    settings: &Settings,
    counts: &Counts,
    times: [f64; 3],
    out: &mut Output,
) -> Result<(), OutputError> {
    // Print the methods of the lights, by the materials that they light.
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
    // Print how many pairs of a point and a light were skipped or have a closed form, and how many
    // are left.
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
    // Print the counts of visibility, and the times.
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

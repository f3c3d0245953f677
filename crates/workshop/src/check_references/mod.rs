//! `check-references`: compares our renders with pictures by other renderers.

mod judge;

use crate::args::CheckArgs;
use anyhow::{Context, Result, bail};
use judge::Row;
use linelit_cli::commands::{bar, pool};
use linelit_cli::output::{Output, OutputError, note};
use linelit_film::{Image, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings};
use linelit_samplers::SamplerKind;
use linelit_study::scene_study;
use std::path::Path;

/// The number of replicates of points that measure the noise of the reference.
const NOISE_REPLICATES: u32 = 16;

/// An estimator, its number of samples, and the number of independent replicates that are rendered
/// with it.
#[derive(Clone, Copy)]
struct Effort {
    estimator: &'static str,
    samples: u32,
    replicates: u32,
}

/// A reference: the scene, the picture, and how both renderers compute it.
struct Entry {
    name: &'static str,
    scene: String,
    reference: String,
    hide_lights: bool,
    /// The number of light samples of each pixel of the reference.
    samples: f64,
    /// The effort of our rendering. `--samples` multiplies the number of samples (64 means 1).
    ours: Effort,
    /// The effort by which the noise of the other renderer's picture is measured.
    theirs: Effort,
    /// The distance between rows and columns whose pixels are compared: 1 except for large scenes.
    stride: u32,
}

/// Creates an effort from its fields.
fn effort(estimator: &'static str, samples: u32, replicates: u32) -> Effort {
    Effort {
        estimator,
        samples,
        replicates,
    }
}

/// Returns all known references.
fn entries() -> [Entry; 6] {
    // Diffuse scenes are rendered by lines in closed form.
    let lines = effort("line-analytic", 64, 8);
    // Glossy scenes combine lines with BSDF samples, as the highlights of mirror-like plates need
    // both.
    let lines_and_bsdf = effort("line-solid-angle+point-bsdf", 256, 8);
    let points = effort("point-solid-angle", 64, NOISE_REPLICATES);
    let points_and_bsdf = effort("point-solid-angle+point-bsdf", 512, NOISE_REPLICATES);
    // References by the papers' authors with pbrt-v3, and by Mitsuba.
    let authors = |name, scene: &str, image: &str, ours, theirs| Entry {
        name,
        scene: format!("scenes/{scene}.pbrt"),
        reference: format!("references/authors/{image}.pfm"),
        hide_lights: false,
        samples: 4096.0 * 2.0,
        ours,
        theirs,
        stride: 1,
    };
    let mitsuba = |name: &'static str, stride| Entry {
        name,
        scene: format!("references/{name}/{}.pbrt", &name["mitsuba/".len()..]),
        reference: format!("references/{name}/reference_centre.exr"),
        hide_lights: true,
        samples: 4096.0,
        ours: lines,
        theirs: effort("point-area", 64, NOISE_REPLICATES),
        stride,
    };
    let glossy = |name, scene, image| authors(name, scene, image, lines_and_bsdf, points_and_bsdf);
    let cornell = "cornell-box/cornell-box";
    [
        authors(
            "authors/cornell",
            cornell,
            "cornell_ptsa4096x2",
            lines,
            points,
        ),
        glossy(
            "authors/veach",
            "op-veach/op-veach-color",
            "veach_brdf+ptsa4096x2",
        ),
        glossy(
            "authors/kitchen",
            "kitchen/kitchen-play",
            "kitchen_brdf+ptsa4096x2",
        ),
        mitsuba("mitsuba/a_cornell", 1),
        mitsuba("mitsuba/b_grid_quad", 1),
        mitsuba("mitsuba/d_colonnade", 4),
    ]
}

/// Renders every scene that has a reference below the folder, and compares.
pub(crate) fn run(args: &CheckArgs, out: &mut Output) -> Result<()> {
    let mut rows = Vec::new();
    if !args.common.json {
        print_header(out)?;
    }
    // Compare the scenes that are there.
    let wanted = |e: &&Entry| args.only.as_ref().is_none_or(|only| e.name.contains(only));
    for entry in entries().iter().filter(wanted) {
        let scene = args.dir.join(&entry.scene);
        if scene.is_file() {
            let found = check(args, entry, &scene)?;
            if !args.common.json {
                print_row(&found, out)?;
            }
            rows.push(found);
        } else {
            note(format_args!(
                "skipped {}: no {}",
                entry.name,
                scene.display()
            ));
        }
    }
    if rows.is_empty() {
        bail!("no known scene below {}", args.dir.display());
    }
    if args.common.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&rows)?)?;
    }
    // Fail if a row does not pass.
    match rows.iter().filter(|r| !r.ok).count() {
        0 => Ok(()),
        n => bail!("{n} of {} references do not agree", rows.len()),
    }
}

/// Compares one scene with its reference.
fn check(args: &CheckArgs, entry: &Entry, path: &Path) -> Result<Row> {
    let reference = Image::read(&args.dir.join(&entry.reference))?;
    let name = path
        .to_str()
        .with_context(|| format!("{} is not UTF-8", path.display()))?;
    let mut scene = args.common.read.library().load(name)?.scene;
    scene.set_resolution(reference.width, reference.height);
    let renderer = Renderer::new(&scene);
    let pool = pool(&args.common)?;
    let samples = (entry.ours.samples.saturating_mul(args.samples) / 64).max(1);
    let ours = Effort {
        samples,
        ..entry.ours
    };
    let ours = replicate(&pool, &renderer, entry, ours)?;
    let theirs = replicate(&pool, &renderer, entry, entry.theirs)?;
    Ok(judge::judge(entry, &renderer, &reference, &ours, &theirs))
}

/// The mean over replicates of each pixel, and the variance of one replicate.
struct Replicated {
    mean: Vec<DVec3>,
    variance: Vec<DVec3>,
    replicates: f64,
    samples: f64,
}

/// Renders a scene several times with different random numbers.
fn replicate(
    pool: &rayon::ThreadPool,
    renderer: &Renderer<'_>,
    entry: &Entry,
    effort: Effort,
) -> Result<Replicated> {
    let film = &renderer.scene().film;
    let window = Tile::whole(film.width, film.height);
    let estimator = effort.estimator.parse()?;
    let render = |seed: u32| {
        let settings = Settings {
            estimator,
            sampler: SamplerKind::Stratified,
            samples: effort.samples,
            seed: u64::from(seed) + 77,
            show_lights: !entry.hide_lights,
            ..Settings::default()
        };
        pool.install(|| scene_study::render(renderer, &settings, window, &bar(entry.name)))
            .0
    };
    let images: Vec<Image> = (0..effort.replicates).map(render).collect();
    let n = f64::from(effort.replicates);
    // Compute mean and variance of each pixel.
    let mut replicated = Replicated {
        mean: Vec::new(),
        variance: Vec::new(),
        replicates: n,
        samples: f64::from(effort.samples),
    };
    for p in 0..images[0].rgb.len() {
        let values = images
            .iter()
            .map(|i| DVec3::from_array(i.rgb[p].map(f64::from)));
        let mean = values.clone().sum::<DVec3>() / n;
        let squares = values.map(|value| (value - mean) * (value - mean));
        replicated.mean.push(mean);
        replicated.variance.push(squares.sum::<DVec3>() / (n - 1.0));
    }
    Ok(replicated)
}

/// Prints the header of the table.
fn print_header(out: &mut Output) -> Result<(), OutputError> {
    writeln!(
        out,
        "{:<20} {:>6} {:>11} {:>11} {:>20} {:>9} {:>9} {:>8} {:>6}  left out: edges horizon lights wrong",
        "reference", "pixels", "mean", "theirs", "ratio", "of all", "MRSE", "passing", "differ",
    )
}

/// Prints a row of the table, and lists pixels that differ.
fn print_row(r: &Row, out: &mut Output) -> Result<(), OutputError> {
    writeln!(
        out,
        "{:<20} {:>6} {:>11.7} {:>11.7} {:>9.6} ± {:.6} {:>9.6} {:>9.2e} {:>7.3}% {:>6}  {:>15} {:>7} {:>6} {:>5}  {}",
        r.name,
        r.pixels,
        r.mean,
        r.reference_mean,
        r.mean_ratio,
        r.ratio_error,
        r.mean_ratio_of_all,
        r.mrse,
        100.0 * r.passing,
        r.unexplained.len(),
        r.edges.len(),
        r.horizon.len(),
        r.lights.len(),
        r.wrong.len(),
        if r.ok { "ok" } else { "DIFFERS" }
    )?;
    // List the pixels at which the other renderer is wrong, and the pixels that differ for no known
    // reason, if there are few.
    if !r.wrong.is_empty() {
        writeln!(
            out,
            "    left out, a brute-force estimate gives our value and not theirs: {:?}",
            r.wrong
        )?;
    }
    if !r.unexplained.is_empty() && r.unexplained.len() <= 40 {
        writeln!(out, "    differ: {:?}", r.unexplained)?;
    }
    Ok(())
}

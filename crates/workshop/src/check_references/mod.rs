//! `linelit check-references`: our renders against those of other renderers.

mod judge;
mod replicate;

use crate::args::CheckArgs;
use anyhow::{Context, Result, bail};
use judge::Row;
use linelit_cli::commands::pool;
use linelit_cli::output::{Output, OutputError, note};
use linelit_film::Image;
use linelit_integrator::{Estimator, Renderer};
use replicate::replicate;
use std::path::Path;

/// Replicates of points, for the noise of the reference.
const NOISE_REPLICATES: u32 = 16;

/// An estimator and how often it runs.
#[derive(Clone, Copy)]
struct Effort {
    estimator: &'static str,
    samples: u32,
    replicates: u32,
}

struct Entry {
    name: &'static str,
    scene: &'static str,
    reference: &'static str,
    hide_lights: bool,
    /// Light samples behind each pixel of the reference.
    samples: f64,
    /// How we render it; `--samples` multiplies the samples (1 for 64).
    ours: Effort,
    /// How the other renderer chose its points, for the noise of its image.
    theirs: Effort,
    /// Every how many rows and columns a pixel is compared: all, but for large scenes.
    stride: u32,
}

/// Diffuse scenes: lines in closed form.
const LINES: Effort = Effort {
    estimator: "line-analytic",
    samples: 64,
    replicates: 8,
};

/// Glossy scenes: the highlights of mirror-like plates need both.
const LINES_AND_BSDF: Effort = Effort {
    estimator: "line-solid-angle+point-bsdf",
    samples: 256,
    replicates: 8,
};

const fn noise(estimator: &'static str, samples: u32) -> Effort {
    Effort {
        estimator,
        samples,
        replicates: NOISE_REPLICATES,
    }
}

const fn mitsuba(
    name: &'static str,
    scene: &'static str,
    reference: &'static str,
    stride: u32,
) -> Entry {
    Entry {
        name,
        scene,
        reference,
        hide_lights: true,
        samples: 4096.0,
        ours: LINES,
        theirs: noise("point-area", 64),
        stride,
    }
}

const fn authors(
    name: &'static str,
    scene: &'static str,
    reference: &'static str,
    ours: Effort,
    theirs: Effort,
) -> Entry {
    Entry {
        name,
        scene,
        reference,
        hide_lights: false,
        samples: 4096.0 * 2.0,
        ours,
        theirs,
        stride: 1,
    }
}

const ENTRIES: [Entry; 6] = [
    authors(
        "authors/cornell",
        "scenes/cornell-box/cornell-box.pbrt",
        "references/authors/cornell_ptsa4096x2.pfm",
        LINES,
        noise("point-solid-angle", 64),
    ),
    authors(
        "authors/veach",
        "scenes/op-veach/op-veach-color.pbrt",
        "references/authors/veach_brdf+ptsa4096x2.pfm",
        LINES_AND_BSDF,
        noise("point-solid-angle+point-bsdf", 512),
    ),
    authors(
        "authors/kitchen",
        "scenes/kitchen/kitchen-play.pbrt",
        "references/authors/kitchen_brdf+ptsa4096x2.pfm",
        LINES_AND_BSDF,
        noise("point-solid-angle+point-bsdf", 512),
    ),
    mitsuba(
        "mitsuba/a_cornell",
        "references/mitsuba/a_cornell/a_cornell.pbrt",
        "references/mitsuba/a_cornell/reference_centre.exr",
        1,
    ),
    mitsuba(
        "mitsuba/b_grid_quad",
        "references/mitsuba/b_grid_quad/b_grid_quad.pbrt",
        "references/mitsuba/b_grid_quad/reference_centre.exr",
        1,
    ),
    mitsuba(
        "mitsuba/d_colonnade",
        "references/mitsuba/d_colonnade/d_colonnade.pbrt",
        "references/mitsuba/d_colonnade/reference_centre.exr",
        4,
    ),
];

/// Renders every scene that has a reference below the folder and compares.
pub(crate) fn run(args: &CheckArgs, out: &mut Output) -> Result<()> {
    let mut rows = Vec::new();
    if !args.common.json {
        print_header(out)?;
    }
    let wanted = |e: &&Entry| args.only.as_ref().is_none_or(|only| e.name.contains(only));
    for entry in ENTRIES.iter().filter(wanted) {
        let scene = args.dir.join(entry.scene);
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
    match rows.iter().filter(|r| !r.ok).count() {
        0 => Ok(()),
        n => bail!("{n} of {} references do not agree", rows.len()),
    }
}

fn check(args: &CheckArgs, entry: &Entry, path: &Path) -> Result<Row> {
    let reference = Image::read(&args.dir.join(entry.reference))?;
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

fn estimator(effort: Effort) -> Result<Estimator> {
    Ok(effort.estimator.parse()?)
}

fn print_header(out: &mut Output) -> Result<(), OutputError> {
    writeln!(
        out,
        "{:<20} {:>6} {:>11} {:>11} {:>20} {:>9} {:>9} {:>8} {:>6}  left out: edges horizon lights wrong",
        "reference", "pixels", "mean", "theirs", "ratio", "of all", "MRSE", "passing", "differ",
    )
}

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

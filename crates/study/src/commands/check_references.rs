//! `linelit check-references`: our renders against those of other renderers.

use super::{bar, pool};
use crate::cli::CheckArgs;
use crate::engine::image::{self, Window};
use crate::engine::normal::critical_z;
use crate::scenes;
use anyhow::{Context, Result, bail};
use linelit_film::Image;
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, LineOptions, Renderer, Settings, Workspace};
use linelit_samplers::SamplerKind;
use std::path::Path;

/// Independent replicates of our own render, for its error.
const REPLICATES: u32 = 4;
/// Over all pixels and channels of one image.
const ALPHA: f64 = 0.01;
/// The share of pixels that must pass, as in Mitsuba's render tests.
const PASS_SHARE: f64 = 0.9975;

struct Entry {
    name: &'static str,
    scene: &'static str,
    reference: &'static str,
    hide_lights: bool,
    /// Light samples behind each pixel of the reference.
    samples: f64,
    /// Every how many rows and columns a pixel is compared: all, but for large scenes.
    stride: u32,
}

const ENTRIES: [Entry; 4] = [
    Entry {
        name: "authors/cornell",
        scene: "scenes/cornell-box/cornell-box.pbrt",
        reference: "references/authors/cornell_ptsa4096x2.pfm",
        hide_lights: false,
        samples: 4096.0,
        stride: 1,
    },
    Entry {
        name: "mitsuba/a_cornell",
        scene: "references/mitsuba/a_cornell/a_cornell.pbrt",
        reference: "references/mitsuba/a_cornell/reference_centre.exr",
        hide_lights: true,
        samples: 4096.0,
        stride: 1,
    },
    Entry {
        name: "mitsuba/b_grid_quad",
        scene: "references/mitsuba/b_grid_quad/b_grid_quad.pbrt",
        reference: "references/mitsuba/b_grid_quad/reference_centre.exr",
        hide_lights: true,
        samples: 4096.0,
        stride: 1,
    },
    Entry {
        name: "mitsuba/d_colonnade",
        scene: "references/mitsuba/d_colonnade/d_colonnade.pbrt",
        reference: "references/mitsuba/d_colonnade/reference_centre.exr",
        hide_lights: true,
        samples: 4096.0,
        stride: 4,
    },
];

/// One row of the table.
#[derive(Debug, serde::Serialize)]
struct Row {
    name: &'static str,
    pixels: usize,
    mean: f64,
    reference_mean: f64,
    mean_ratio: f64,
    mrse: f64,
    passing: f64,
    outliers: usize,
    edge_pixels: usize,
    ok: bool,
}

/// Renders every scene that has a reference below the folder and compares.
///
/// # Errors
/// If nothing is found, something cannot be read, or a comparison fails.
pub fn run(args: &CheckArgs) -> Result<()> {
    let mut rows = Vec::new();
    if !args.common.json {
        print_header();
    }
    for entry in &ENTRIES {
        let scene = args.dir.join(entry.scene);
        if scene.is_file() {
            let row = check(args, entry, &scene)?;
            if !args.common.json {
                print_row(&row);
            }
            rows.push(row);
        } else {
            eprintln!("skipped {}: no {}", entry.name, scene.display());
        }
    }
    if rows.is_empty() {
        bail!("no known scene below {}", args.dir.display());
    }
    if args.common.json {
        println!("{}", serde_json::to_string_pretty(&rows)?);
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
    let mut scene = scenes::load(name, args.common.strict)?.scene;
    scene.set_resolution(reference.width, reference.height);
    let renderer = Renderer::new(&scene);
    let pool = pool(&args.common)?;
    let ours = replicate(&pool, &renderer, entry, (lines(), args.samples));
    // How noisy the reference is: points, at fewer samples, scaled by the order that stratified
    // points have where the light is partly hidden (variance N^-1.5, the slowest that occurs).
    let point_samples = 64;
    let points = replicate(
        &pool,
        &renderer,
        entry,
        (Estimator::PointSolidAngle, point_samples),
    );
    let noise = (f64::from(point_samples) / entry.samples).powf(1.5);
    Ok(judge(entry, &renderer, &reference, &ours, &points, noise))
}

fn lines() -> Estimator {
    Estimator::LineAnalytic(LineOptions::default())
}

/// Mean and variance of one replicate, per pixel.
struct Replicated {
    mean: Vec<DVec3>,
    variance: Vec<DVec3>,
}

fn replicate(
    pool: &rayon::ThreadPool,
    renderer: &Renderer<'_>,
    entry: &Entry,
    (estimator, samples): (Estimator, u32),
) -> Replicated {
    let film = &renderer.scene().film;
    let window = Window::whole(film.width, film.height);
    let render = |seed: u32| {
        let settings = Settings {
            estimator,
            sampler: SamplerKind::Stratified,
            samples,
            seed: u64::from(seed) + 77,
            show_lights: !entry.hide_lights,
            ..Settings::default()
        };
        pool.install(|| image::render(renderer, &settings, window, &bar(entry.name)))
            .0
    };
    let images: Vec<Image> = (0..REPLICATES).map(render).collect();
    let n = f64::from(REPLICATES);
    let value = |i: &Image, p: usize| DVec3::from_array(i.rgb[p].map(f64::from));
    let pixels = images[0].rgb.len();
    let mean: Vec<DVec3> = (0..pixels)
        .map(|p| images.iter().map(|i| value(i, p)).sum::<DVec3>() / n)
        .collect();
    let spread = |p: usize| {
        let square = |i: &Image| (value(i, p) - mean[p]) * (value(i, p) - mean[p]);
        images.iter().map(square).sum::<DVec3>() / (n - 1.0)
    };
    let variance = (0..pixels).map(spread).collect();
    Replicated { mean, variance }
}

fn judge(
    entry: &Entry,
    renderer: &Renderer<'_>,
    reference: &Image,
    ours: &Replicated,
    points: &Replicated,
    noise: f64,
) -> Row {
    let width = reference.width as usize;
    let stride = entry.stride as usize;
    let on_grid =
        |p: &usize| (p % width).is_multiple_of(stride) && (p / width).is_multiple_of(stride);
    let compared: Vec<usize> = (0..reference.rgb.len()).filter(on_grid).collect();
    let pixels = compared.len();
    #[allow(clippy::cast_precision_loss, reason = "pixels fit 53 bits")]
    let count = pixels as f64;
    // Sidak over pixels and channels.
    let z = critical_z(1.0 - (1.0 - ALPHA).powf(1.0 / (3.0 * count)));
    let mut outliers = Vec::new();
    let (mut sum, mut wanted, mut mrse) = (0.0, 0.0, 0.0);
    for &p in &compared {
        let want = DVec3::from_array(reference.rgb[p].map(f64::from));
        let got = ours.mean[p];
        sum += got.element_sum();
        wanted += want.element_sum();
        mrse += ((got - want) * (got - want) / (want * want + 1e-6)).element_sum() / (3.0 * count);
        let variance = ours.variance[p] / f64::from(REPLICATES) + points.variance[p] * noise;
        // References and scenes are f32: 1e-5 of the value covers the rounding of both renderers'
        // geometry, of which a grazing cosine makes more than of the sums.
        let allowed = variance.map(f64::sqrt) * z + want.abs() * 1e-5 + DVec3::splat(1e-7);
        if (got - want).abs().cmpgt(allowed).any() {
            outliers.push(p);
        }
    }
    let edges = outliers
        .iter()
        .filter(|&&p| is_edge(renderer, p % width, p / width))
        .count();
    #[allow(clippy::cast_precision_loss, reason = "pixels fit 53 bits")]
    let passing = 1.0 - (outliers.len() - edges) as f64 / count;
    let ratio = sum / wanted;
    Row {
        name: entry.name,
        pixels,
        mean: sum / (3.0 * count),
        reference_mean: wanted / (3.0 * count),
        mean_ratio: ratio,
        mrse,
        passing,
        outliers: outliers.len(),
        edge_pixels: edges,
        ok: passing >= PASS_SHARE && (ratio - 1.0).abs() < 1e-3,
    }
}

/// Whether rays a hundredth of a pixel apart meet different surfaces: there two renderers may
/// differ by the rounding of their cameras.
fn is_edge(renderer: &Renderer<'_>, x: usize, y: usize) -> bool {
    let pixel = [u32::try_from(x).unwrap_or(0), u32::try_from(y).unwrap_or(0)];
    renderer.straddles_edge(pixel, 0.01)
}

fn print_header() {
    println!(
        "{:<22} {:>7} {:>12} {:>12} {:>10} {:>9} {:>9} {:>9} {:>6}",
        "reference", "pixels", "mean", "theirs", "ratio", "MRSE", "passing", "outliers", "edges"
    );
}

fn print_row(r: &Row) {
    println!(
        "{:<22} {:>7} {:>12.8} {:>12.8} {:>10.6} {:>9.2e} {:>8.3}% {:>9} {:>6}  {}",
        r.name,
        r.pixels,
        r.mean,
        r.reference_mean,
        r.mean_ratio,
        r.mrse,
        100.0 * r.passing,
        r.outliers,
        r.edge_pixels,
        if r.ok { "ok" } else { "DIFFERS" }
    );
}

//! `linelit check-references`: our renders against those of other renderers.

use super::{bar, pool};
use crate::cli::CheckArgs;
use crate::engine::image::{self, Window};
use crate::scenes;
use crate::stats::student::quantile;
use anyhow::{Context, Result, bail};
use linelit_film::Image;
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, LineOptions, Renderer, Settings, Workspace};
use linelit_samplers::SamplerKind;
use std::path::Path;

/// Independent replicates of our own render, for its error.
const REPLICATES: u32 = 4;
/// Replicates of points, for the noise of the reference.
const NOISE_REPLICATES: u32 = 16;
/// Points in each of them.
const NOISE_SAMPLES: u32 = 64;
/// Lines of the brute-force estimate that decides between two renderers.
const BRUTE_LINES: u32 = 256;
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
    /// How the other renderer chose its points, for the noise of its image.
    theirs: Estimator,
    /// Every how many rows and columns a pixel is compared: all, but for large scenes.
    stride: u32,
}

const ENTRIES: [Entry; 4] = [
    Entry {
        name: "authors/cornell",
        scene: "scenes/cornell-box/cornell-box.pbrt",
        reference: "references/authors/cornell_ptsa4096x2.pfm",
        hide_lights: false,
        samples: 4096.0 * 2.0,
        theirs: Estimator::PointSolidAngle,
        stride: 1,
    },
    Entry {
        name: "mitsuba/a_cornell",
        scene: "references/mitsuba/a_cornell/a_cornell.pbrt",
        reference: "references/mitsuba/a_cornell/reference_centre.exr",
        hide_lights: true,
        samples: 4096.0,
        theirs: Estimator::PointArea,
        stride: 1,
    },
    Entry {
        name: "mitsuba/b_grid_quad",
        scene: "references/mitsuba/b_grid_quad/b_grid_quad.pbrt",
        reference: "references/mitsuba/b_grid_quad/reference_centre.exr",
        hide_lights: true,
        samples: 4096.0,
        theirs: Estimator::PointArea,
        stride: 1,
    },
    Entry {
        name: "mitsuba/d_colonnade",
        scene: "references/mitsuba/d_colonnade/d_colonnade.pbrt",
        reference: "references/mitsuba/d_colonnade/reference_centre.exr",
        hide_lights: true,
        samples: 4096.0,
        theirs: Estimator::PointArea,
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
    /// Pixels that differ and neither lie on an edge nor are proven wrong in the reference.
    unexplained: usize,
    /// Pixels left out because rays a hundredth of a pixel apart meet other surfaces.
    edges: Vec<[u32; 2]>,
    /// Pixels left out because a brute-force estimate gives our value.
    wrong: Vec<[u32; 2]>,
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
    let ours = replicate(&pool, &renderer, entry, (lines(), args.samples), REPLICATES);
    // How noisy the reference is: its own technique at fewer samples, scaled by the order that
    // stratified points have where the light is partly hidden (variance N^-1.5, the slowest).
    let noise = (entry.theirs, NOISE_SAMPLES);
    let points = replicate(&pool, &renderer, entry, noise, NOISE_REPLICATES);
    let scale = (f64::from(NOISE_SAMPLES) / entry.samples).powf(1.5);
    Ok(judge(entry, &renderer, &reference, &ours, &points, scale))
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
    replicates: u32,
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
    let images: Vec<Image> = (0..replicates).map(render).collect();
    let n = f64::from(replicates);
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

/// The pixels that are compared.
fn compared(entry: &Entry, reference: &Image) -> Vec<usize> {
    let (width, stride) = (reference.width as usize, entry.stride as usize);
    let on_grid =
        |p: &usize| (p % width).is_multiple_of(stride) && (p / width).is_multiple_of(stride);
    (0..reference.rgb.len()).filter(on_grid).collect()
}

fn judge(
    entry: &Entry,
    renderer: &Renderer<'_>,
    reference: &Image,
    ours: &Replicated,
    points: &Replicated,
    noise: f64,
) -> Row {
    let mut pixels = compared(entry, reference);
    let total = pixels.len();
    let value = |p: usize| DVec3::from_array(reference.rgb[p].map(f64::from));
    // Sidak over pixels and channels. The spread is estimated from the replicates of the points,
    // so the score follows Student's distribution.
    #[allow(clippy::cast_precision_loss, reason = "pixels fit 53 bits")]
    let confidence = (1.0 - ALPHA).powf(1.0 / (3.0 * total as f64));
    let t = quantile(confidence, NOISE_REPLICATES - 1);
    let differs = |p: &usize| {
        let variance = ours.variance[*p] / f64::from(REPLICATES) + points.variance[*p] * noise;
        // Both hold f32 geometry and pixels: 1e-5 of the value is what a grazing cosine makes of
        // their rounding.
        let allowed = variance.map(f64::sqrt) * t + value(*p).abs() * 1e-5 + DVec3::splat(1e-7);
        (ours.mean[*p] - value(*p)).abs().cmpgt(allowed).any()
    };
    let outliers: Vec<usize> = pixels.iter().copied().filter(differs).collect();
    let width = reference.width as usize;
    let place = |p: usize| [p % width, p / width].map(|c| u32::try_from(c).unwrap_or(0));
    let edges: Vec<usize> = outliers
        .iter()
        .copied()
        .filter(|&p| renderer.straddles_edge(place(p), 0.01))
        .collect();
    let wrong: Vec<usize> = outliers
        .iter()
        .copied()
        .filter(|p| !edges.contains(p) && outliers.len() < 200)
        .filter(|&p| brute_force_agrees(renderer, entry, place(p), ours.mean[p], ours.variance[p]))
        .collect();
    pixels.retain(|p| !edges.contains(p) && !wrong.contains(p));
    let unexplained = outliers.len() - edges.len() - wrong.len();
    row(
        entry,
        total,
        &pixels,
        [&edges, &wrong].map(|list| list.iter().map(|&p| place(p)).collect()),
        unexplained,
        |p| (ours.mean[p], value(p)),
    )
}

/// Whether a brute-force estimate in f64, without hierarchy or kernels, gives our value: then it is
/// the reference that is wrong.
fn brute_force_agrees(
    renderer: &Renderer<'_>,
    entry: &Entry,
    pixel: [u32; 2],
    ours: DVec3,
    variance: DVec3,
) -> bool {
    let mut workspace = Workspace::new();
    let Some(point) = renderer.shading_point(pixel, &mut workspace) else {
        return ours == DVec3::ZERO;
    };
    let emitted = if entry.hide_lights {
        DVec3::ZERO
    } else {
        point.emitted
    };
    let brute = emitted + renderer.brute_force(&point, pixel, BRUTE_LINES, 4711);
    let allowed = variance.map(f64::sqrt) * 5.0 + brute.abs() * 1e-3;
    (brute - ours).abs().cmple(allowed).all()
}

fn row(
    entry: &Entry,
    total: usize,
    pixels: &[usize],
    [edges, wrong]: [Vec<[u32; 2]>; 2],
    unexplained: usize,
    values: impl Fn(usize) -> (DVec3, DVec3),
) -> Row {
    #[allow(clippy::cast_precision_loss, reason = "pixels fit 53 bits")]
    let (count, all) = (3.0 * pixels.len() as f64, total as f64);
    let (mut sum, mut wanted, mut mrse) = (0.0, 0.0, 0.0);
    for &p in pixels {
        let (got, want) = values(p);
        sum += got.element_sum();
        wanted += want.element_sum();
        mrse += ((got - want) * (got - want) / (want * want + 1e-6)).element_sum() / count;
    }
    #[allow(clippy::cast_precision_loss, reason = "pixels fit 53 bits")]
    let passing = 1.0 - unexplained as f64 / all;
    let ratio = sum / wanted;
    Row {
        name: entry.name,
        pixels: total,
        mean: sum / count,
        reference_mean: wanted / count,
        mean_ratio: ratio,
        mrse,
        passing,
        unexplained,
        edges,
        wrong,
        ok: passing >= PASS_SHARE && (ratio - 1.0).abs() < 2e-4,
    }
}

fn print_header() {
    println!(
        "{:<22} {:>7} {:>12} {:>12} {:>10} {:>9} {:>9} {:>9} {:>6}",
        "reference", "pixels", "mean", "theirs", "ratio", "MRSE", "passing", "differ", "edges"
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
        r.unexplained,
        r.edges.len(),
        if r.ok { "ok" } else { "DIFFERS" }
    );
    if !r.wrong.is_empty() {
        println!(
            "    left out, a brute-force estimate gives our value: {:?}",
            r.wrong
        );
    }
}

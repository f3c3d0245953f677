//! What `render --aovs` writes beside the picture: layers of what the camera sees, and of how well
//! each pixel is known.

use crate::args::{Aov, RenderArgs, UsageError};
use anyhow::Result;
use indicatif::ProgressBar;
use linelit_estimators::bsdf::Reflection as _;
use linelit_film::{Document, Image, MomentImage, Moments, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, Renderer, Settings, ShadingPoint, Workspace};
use rayon::prelude::*;

/// A picture, and what was learned of its pixels while it was rendered.
pub(super) struct Rendered {
    pub(super) image: Image,
    pub(super) counts: Counts,
    /// Moments of camera samples, and rays and lines of each pixel, if they are asked for.
    pixels: Option<(MomentImage, [Vec<u32>; 2])>,
}

/// That the file can hold the layers, and that there is something to be known.
pub(super) fn check(args: &RenderArgs, is_png: bool) -> Result<(), UsageError> {
    if is_png && !args.aovs.is_empty() {
        return Err(UsageError("--aovs are layers of EXR files".to_owned()));
    }
    if args.aovs.contains(&Aov::Variance) && args.pixel_samples < 2 {
        let text = "the variance of one camera sample is not known: --aovs variance needs \
                    --pixel-samples 2 or more";
        return Err(UsageError(text.to_owned()));
    }
    Ok(())
}

/// Renders, with moments if they are asked for; the picture is the same to the bit.
pub(super) fn render(
    renderer: &Renderer<'_>,
    settings: &Settings,
    window: Tile,
    aovs: &[Aov],
    progress: &ProgressBar,
) -> Rendered {
    if !aovs.contains(&Aov::Variance) && !aovs.contains(&Aov::Samples) {
        let (image, counts) =
            linelit_papers::scene_study::render(renderer, settings, window, progress);
        let pixels = None;
        return Rendered {
            image,
            counts,
            pixels,
        };
    }
    progress.set_length(u64::from(window.height()));
    let row = |workspace: &mut Workspace, y: u32| -> Vec<Pixel> {
        let pixel = |x| pixel(renderer, settings, [x, y], workspace);
        let row = (window.x0..window.x1).map(pixel).collect();
        progress.inc(1);
        row
    };
    let rows = (window.y0..window.y1).into_par_iter();
    let rows: Vec<Vec<Pixel>> = rows.map_init(Workspace::new, row).collect();
    progress.finish_and_clear();
    let (mut rgb, mut moments, mut cost) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
    let mut counts = Counts::default();
    for pixel in rows.into_iter().flatten() {
        rgb.push(pixel.radiance);
        moments.push(pixel.moments);
        let clamped = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        cost[0].push(clamped(pixel.counts.visibility.rays));
        cost[1].push(clamped(pixel.counts.visibility.line_queries));
        counts += pixel.counts;
    }
    let (width, height) = (window.width(), window.height());
    let pixels = MomentImage::from_pixels(width, height, moments).map(|film| (film, cost));
    let image = Image { width, height, rgb };
    Rendered {
        image,
        counts,
        pixels,
    }
}

struct Pixel {
    radiance: [f32; 3],
    moments: Moments,
    counts: Counts,
}

fn pixel(
    renderer: &Renderer<'_>,
    settings: &Settings,
    pixel: [u32; 2],
    workspace: &mut Workspace,
) -> Pixel {
    let mut moments = Moments::default();
    let push = |sample: DVec3| moments.push(sample.to_array());
    let radiance = renderer.pixel_samples(settings, pixel, workspace, push);
    Pixel {
        radiance: single(radiance),
        moments,
        counts: workspace.take_counts(),
    }
}

/// Adds the layers that are asked for.
pub(super) fn add(
    document: &mut Document,
    rendered: &Rendered,
    renderer: &Renderer<'_>,
    window: Tile,
    aovs: &[Aov],
) -> Result<()> {
    let seen = [Aov::Albedo, Aov::Normal, Aov::Depth];
    if aovs.iter().any(|aov| seen.contains(aov)) {
        let surfaces = surfaces(renderer, window);
        let (width, height) = (window.width(), window.height());
        let picture = |value: fn(&Surface) -> [f32; 3]| Image {
            width,
            height,
            rgb: surfaces.iter().map(value).collect(),
        };
        if aovs.contains(&Aov::Albedo) {
            document.add_image("albedo", &picture(|s| s.albedo))?;
        }
        if aovs.contains(&Aov::Normal) {
            document.add_image("normal", &picture(|s| s.normal))?;
        }
        if aovs.contains(&Aov::Depth) {
            document.add_scalar("depth", surfaces.iter().map(|s| s.depth).collect())?;
        }
    }
    let Some((film, [rays, lines])) = &rendered.pixels else {
        return Ok(());
    };
    if aovs.contains(&Aov::Variance) {
        document.add_image("variance", &film.variance_image())?;
    }
    if aovs.contains(&Aov::Samples) {
        let taken = film.pixels().iter().map(|m| u32::try_from(m.count));
        let taken = taken.map(|n| n.unwrap_or(u32::MAX)).collect();
        document.add_counts("samples", taken)?;
        document.add_counts("rays", rays.clone())?;
        document.add_counts("lines", lines.clone())?;
    }
    Ok(())
}

/// What the ray through the middle of a pixel meets.
#[derive(Clone, Copy)]
struct Surface {
    albedo: [f32; 3],
    normal: [f32; 3],
    depth: f32,
}

fn surfaces(renderer: &Renderer<'_>, window: Tile) -> Vec<Surface> {
    let pixels = (window.y0..window.y1).into_par_iter().flat_map_iter(|y| {
        // Rows are the work that is shared out.
        let mut workspace = Workspace::new();
        (window.x0..window.x1).map(move |x| surface(renderer, [x, y], &mut workspace))
    });
    pixels.collect()
}

fn surface(renderer: &Renderer<'_>, pixel: [u32; 2], workspace: &mut Workspace) -> Surface {
    let Some(point) = renderer.shading_point(pixel, workspace) else {
        return Surface {
            albedo: [0.0; 3],
            normal: [0.0; 3],
            depth: f32::INFINITY,
        };
    };
    let [x, y] = pixel.map(|p| f64::from(p) + 0.5);
    let depth = point
        .position
        .distance(renderer.scene().camera.ray(x, y).origin);
    let [depth, ..] = single(DVec3::splat(depth));
    Surface {
        albedo: single(albedo(&point)),
        normal: single(point.normal),
        depth,
    }
}

/// What a surface sends to the viewer of light that is 1 everywhere above it: the mean of f cos/p
/// over directions by the BSDF, the same 64 stratified ones for all; and what perfect mirrors and
/// glass pass on.
fn albedo(point: &ShadingPoint) -> DVec3 {
    const SIDE: u8 = 8;
    let passed: DVec3 = point.bounces.iter().map(|bounce| bounce.weight).sum();
    if let Some(f) = point.bsdf.constant() {
        return passed + f * std::f64::consts::PI;
    }
    let (outgoing, normal) = (point.outgoing, point.normal);
    let mut sum = DVec3::ZERO;
    for i in 0..SIDE {
        for j in 0..SIDE {
            let u = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(SIDE));
            let Some(incoming) = point.bsdf.sample(u, outgoing, normal) else {
                continue;
            };
            let (cosine, p) = (
                incoming.dot(normal),
                point.bsdf.pdf(incoming, outgoing, normal),
            );
            if cosine > 0.0 && p > 0.0 {
                sum += point.bsdf.eval(incoming, outgoing, normal) * (cosine / p);
            }
        }
    }
    passed + sum / (f64::from(SIDE) * f64::from(SIDE))
}

#[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
fn single(value: DVec3) -> [f32; 3] {
    value.to_array().map(|v| v as f32)
}

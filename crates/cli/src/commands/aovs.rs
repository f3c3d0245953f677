//! What `render --aovs` writes beside the picture: layers of what the camera sees, and of how well
//! each pixel is known.

use crate::args::{Aov, PictureArgs, UsageError};
use anyhow::Result;
use indicatif::ProgressBar;
use linelit_estimators::bsdf::Reflection as _;
use linelit_film::{Document, Image, MomentImage, Moments, Placement, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, Renderer, ShadingPoint, Workspace};
use linelit_study::scene_study;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A picture, and what was learned of its pixels while it was rendered.
#[derive(Debug, Default)]
pub(super) struct Rendered {
    pub(super) image: Image,
    /// Where it lies in the whole picture, if it is a part of it.
    pub(super) placement: Option<Placement>,
    /// Moments of trials or of camera samples, and rays and lines of each pixel, if they are asked
    /// for.
    pub(super) pixels: Option<(MomentImage, [Vec<u32>; 2])>,
    /// What is seen in the middle of each pixel, if it is asked for.
    pub(super) surfaces: Vec<Surface>,
}

/// Where a window lies on a film of so many pixels; `None` if it is all of it.
pub(super) fn placement(window: Tile, film: [u32; 2]) -> Option<Placement> {
    let at = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
    (window != Tile::whole(film[0], film[1])).then(|| Placement {
        origin: [at(window.x0), at(window.y0)],
        full: film,
        corner: [0, 0],
    })
}

/// Whether more than the value of each pixel is asked for.
pub(super) fn wants_moments(aovs: &[Aov]) -> bool {
    aovs.iter().any(|aov| COUNTED.contains(aov))
}

/// Whether it is asked for what is seen.
pub(super) fn wants_surfaces(aovs: &[Aov]) -> bool {
    aovs.iter().any(|aov| SEEN.contains(aov))
}

/// That the file can hold the layers, and that there is something to be known.
pub(super) fn check(args: &PictureArgs, is_png: bool) -> Result<(), UsageError> {
    if is_png && !args.aovs.is_empty() {
        return Err(UsageError("--aovs are layers of EXR files".to_owned()));
    }
    if args.aovs.contains(&Aov::Variance) && args.pixel_samples < 2 && args.trials < 2 {
        let text = "the variance of one camera sample is not known: --aovs variance needs \
                    --trials 2 or more, or --pixel-samples";
        return Err(UsageError(text.to_owned()));
    }
    Ok(())
}

/// Bytes that a pixel takes for the layers, beside what the picture takes: those of the layers
/// twice, in the document and in the file, and what they are made from.
pub(super) fn bytes_per_pixel(picture: &PictureArgs) -> u64 {
    let aovs = &picture.aovs;
    let layer = |aov: &Aov| match aov {
        // The samples, and with them rays and lines.
        Aov::Albedo | Aov::Normal | Aov::Variance | Aov::Samples => 12,
        Aov::Depth => 4,
    };
    let layers: u64 = aovs.iter().map(layer).sum();
    let bytes = |size: usize| u64::try_from(size).unwrap_or(u64::MAX);
    let mut made_from = 0;
    if wants_surfaces(aovs) {
        made_from += bytes(size_of::<Surface>());
    }
    if wants_moments(aovs) || picture.trials > 1 {
        made_from += bytes(size_of::<Pixel>() + size_of::<Moments>() + 2 * size_of::<u32>());
    }
    2 * layers + made_from
}

/// Of the first thing that a camera ray meets.
const SEEN: [Aov; 3] = [Aov::Albedo, Aov::Normal, Aov::Depth];

/// Of all camera samples of a pixel.
const COUNTED: [Aov; 2] = [Aov::Variance, Aov::Samples];

/// Renders, with moments if they are asked for; the picture is the same to the bit.
pub(super) fn render(
    renderer: &Renderer<'_>,
    picture: &PictureArgs,
    window: Tile,
    progress: &ProgressBar,
) -> (Rendered, Counts) {
    let aovs = &picture.aovs;
    let film = &renderer.scene().film;
    let placement = placement(window, [film.width, film.height]);
    let surfaces = if wants_surfaces(aovs) {
        surfaces(renderer, window)
    } else {
        Vec::new()
    };
    if !wants_moments(aovs) && picture.trials <= 1 {
        let settings = picture.settings();
        let (image, counts) = scene_study::render(renderer, &settings, window, progress);
        let rendered = Rendered {
            image,
            placement,
            pixels: None,
            surfaces,
        };
        return (rendered, counts);
    }
    progress.set_length(u64::from(window.height()));
    let row_done = || progress.inc(1);
    let fill = |[x, y]: [u32; 2], pixels: &mut [Pixel], workspace: &mut Workspace| {
        for (x, pixel) in (x..).zip(pixels) {
            *pixel = samples(renderer, picture, [x, y], 0..picture.blocks(), workspace);
        }
    };
    // What was counted is taken pixel by pixel.
    let (values, _) = scene_study::window(window).map(row_done, fill);
    progress.finish_and_clear();
    let (mut rgb, mut moments, mut cost) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
    let mut counts = Counts::default();
    for pixel in values {
        rgb.push(single(pixel.sum / picture.camera_samples()));
        moments.push(pixel.moments);
        cost[0].push(clamped(pixel.counts.visibility.rays));
        cost[1].push(clamped(pixel.counts.visibility.line_queries));
        counts += pixel.counts;
    }
    let (width, height) = (window.width(), window.height());
    let pixels = MomentImage::from_pixels(width, height, moments).map(|film| (film, cost));
    let image = Image { width, height, rgb };
    let rendered = Rendered {
        image,
        placement,
        pixels,
        surfaces,
    };
    (rendered, counts)
}

/// What a film's layer of counts holds.
pub(super) fn clamped(n: u64) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// Some camera samples of a pixel.
#[derive(Clone, Default)]
pub(super) struct Pixel {
    pub(super) sum: DVec3,
    pub(super) moments: Moments,
    pub(super) counts: Counts,
}

/// Some of the blocks of a pixel ([`PictureArgs::blocks`]): they are added up, and their moments
/// merged, so that the bits are the same wherever each block is computed. A trial is one value of
/// the moments; of a single trial each camera sample is.
pub(super) fn samples(
    renderer: &Renderer<'_>,
    picture: &PictureArgs,
    pixel: [u32; 2],
    blocks: Range<u32>,
    workspace: &mut Workspace,
) -> Pixel {
    let (mut moments, mut sum) = (Moments::default(), DVec3::ZERO);
    let mut add = |own: DVec3, part: &Moments| {
        sum += own;
        moments.merge(part);
    };
    if picture.trials > 1 {
        for trial in blocks {
            let settings = picture.settings_of(trial);
            let block = |block| renderer.pixel_block(&settings, pixel, block, workspace, |_| {});
            let whole: DVec3 = settings.sample_blocks().map(block).sum();
            let mut part = Moments::default();
            part.push((whole / f64::from(settings.pixel_samples.max(1))).to_array());
            add(whole, &part);
        }
    } else {
        let (settings, start) = (picture.settings(), blocks.start as usize);
        for block in settings.sample_blocks().skip(start).take(blocks.len()) {
            let mut part = Moments::default();
            let push = |sample: DVec3| part.push(sample.to_array());
            let own = renderer.pixel_block(&settings, pixel, block, workspace, push);
            add(own, &part);
        }
    }
    Pixel {
        sum,
        moments,
        counts: workspace.take_counts(),
    }
}

/// Adds the layers that are asked for.
pub(super) fn add(
    document: &mut Document,
    rendered: &Rendered,
    picture: &PictureArgs,
) -> Result<()> {
    let (aovs, surfaces) = (&picture.aovs, &rendered.surfaces);
    let layer = |value: fn(&Surface) -> [f32; 3]| Image {
        width: rendered.image.width,
        height: rendered.image.height,
        rgb: surfaces.iter().map(value).collect(),
    };
    if aovs.contains(&Aov::Albedo) {
        document.add_image("albedo", &layer(|s| s.albedo))?;
    }
    if aovs.contains(&Aov::Normal) {
        document.add_image("normal", &layer(|s| s.normal))?;
    }
    if aovs.contains(&Aov::Depth) {
        document.add_scalar("depth", surfaces.iter().map(|s| s.depth).collect())?;
    }
    let Some((film, [rays, lines])) = &rendered.pixels else {
        return Ok(());
    };
    if aovs.contains(&Aov::Variance) {
        document.add_image("variance", &film.variance_image())?;
    }
    if aovs.contains(&Aov::Samples) {
        // Of trials, which are one value each.
        let each = if picture.trials > 1 {
            picture.pixel_samples.into()
        } else {
            1
        };
        let taken = film.pixels().iter().map(|m| clamped(each * m.count));
        let taken = taken.collect();
        document.add_counts("samples", taken)?;
        document.add_counts("rays", rays.clone())?;
        document.add_counts("lines", lines.clone())?;
    }
    Ok(())
}

/// What the ray through the middle of a pixel meets.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Surface {
    pub(super) albedo: [f32; 3],
    pub(super) normal: [f32; 3],
    pub(super) depth: f32,
}

fn surfaces(renderer: &Renderer<'_>, window: Tile) -> Vec<Surface> {
    let fill = |[x, y]: [u32; 2], pixels: &mut [Surface], workspace: &mut Workspace| {
        for (x, pixel) in (x..).zip(pixels) {
            *pixel = surface(renderer, [x, y], workspace);
        }
    };
    scene_study::window(window).map(|| {}, fill).0
}

pub(super) fn surface(
    renderer: &Renderer<'_>,
    pixel: [u32; 2],
    workspace: &mut Workspace,
) -> Surface {
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
pub(super) fn single(value: DVec3) -> [f32; 3] {
    value.to_array().map(|v| v as f32)
}

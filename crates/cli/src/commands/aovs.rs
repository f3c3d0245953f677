//! The layers of `render --aovs`, which are written in addition to the picture: the surface that
//! the camera sees, and how precise each pixel is.

use crate::args::{Aov, PictureArgs, UsageError};
use anyhow::Result;
use linelit_estimators::bsdf::Reflection as _;
use linelit_film::{Document, Image, Moments, Placement};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, ShadingPoint, Workspace};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A picture with the data from which its layers are made.
#[derive(Debug, Default)]
pub(super) struct Rendered {
    pub(super) image: Image,
    /// The placement of the image in the whole picture, if it is a part of it.
    pub(super) placement: Option<Placement>,
    /// The matrices from the world to the camera and to the picture, as
    /// [`Document::world_to`](linelit_film::Document::world_to) has them.
    pub(super) world_to: [Option<[f32; 16]>; 2],
    /// Whether the picture is lit by a light that is not in the scene's file.
    pub(super) has_lamp: bool,
    /// The moments of the trials or of the camera samples of each pixel, if they are requested.
    pub(super) moments: Vec<Moments>,
    /// The rays and lines of each pixel, if they are requested.
    pub(super) cost: [Vec<u32>; 2],
    /// The surface at the centre of each pixel, if it is requested.
    pub(super) surfaces: Vec<Surface>,
}

/// Returns whether statistics over the camera samples of pixels are requested.
pub(super) fn wants_moments(aovs: &[Aov]) -> bool {
    aovs.iter().any(|aov| COUNTED.contains(aov))
}

/// Returns whether properties of the visible surface are requested.
pub(super) fn wants_surfaces(aovs: &[Aov]) -> bool {
    aovs.iter().any(|aov| SEEN.contains(aov))
}

/// Checks that the file can store the layers, and that the samples suffice to compute them.
pub(super) fn check(args: &PictureArgs, is_plain: bool) -> Result<(), UsageError> {
    if is_plain && !args.aovs.is_empty() {
        return Err(UsageError("--aovs are layers of EXR files".to_owned()));
    }
    if args.aovs.contains(&Aov::Variance) && args.pixel_samples < 2 && args.trials < 2 {
        let text = "the variance of one camera sample is not known: --aovs variance needs \
                    --trials 2 or more, or --pixel-samples";
        return Err(UsageError(text.to_owned()));
    }
    Ok(())
}

/// Returns the bytes of memory that the layers of a pixel take, in addition to the picture: each
/// layer twice, in the document and in the file, and the data from which it is made.
pub(super) fn bytes_per_pixel(picture: &PictureArgs) -> u64 {
    let aovs = &picture.aovs;
    let layer = |aov: &Aov| match aov {
        // Samples come with two more layers, rays and lines.
        Aov::Albedo | Aov::Normal | Aov::Variance | Aov::Samples => 12,
        Aov::Depth => 4,
    };
    let layers: u64 = aovs.iter().map(layer).sum();
    let bytes = |size: usize| u64::try_from(size).unwrap_or(u64::MAX);
    let mut made_from = 0;
    if wants_surfaces(aovs) {
        made_from += bytes(size_of::<Surface>());
    }
    if wants_moments(aovs) {
        made_from += bytes(size_of::<Moments>() + 2 * size_of::<u32>());
    }
    2 * layers + made_from
}

/// The layers of the first surface that a camera ray meets.
const SEEN: [Aov; 3] = [Aov::Albedo, Aov::Normal, Aov::Depth];

/// The layers (of `--aovs`) that are statistics over all camera samples of a pixel.
const COUNTED: [Aov; 2] = [Aov::Variance, Aov::Samples];

/// Clamps a count to the range of the integers in a layer.
pub(super) fn clamped(n: u64) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// Returns the sum of some of the blocks of a pixel ([`PictureArgs::blocks`]), and their merged
/// moments. The bits are the same wherever each block is computed. If there are several trials,
/// each is one value of the moments; otherwise each camera sample is.
pub(super) fn samples(
    renderer: &Renderer<'_>,
    picture: &PictureArgs,
    pixel: [u32; 2],
    blocks: Range<u32>,
    workspace: &mut Workspace,
) -> (DVec3, Moments) {
    let (mut sum, mut moments) = (DVec3::ZERO, Moments::default());
    let mut add = |own: DVec3, part: &Moments| {
        sum += own;
        moments.merge(part);
    };
    // Each block is a trial.
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
        // Each block consists of camera samples of the only trial.
        let (settings, start) = (picture.settings(), blocks.start as usize);
        for block in settings.sample_blocks().skip(start).take(blocks.len()) {
            let mut part = Moments::default();
            let push = |sample: DVec3| part.push(sample.to_array());
            let own = renderer.pixel_block(&settings, pixel, block, workspace, push);
            add(own, &part);
        }
    }
    (sum, moments)
}

/// Adds the requested layers to a document.
pub(super) fn add(
    document: &mut Document,
    rendered: &Rendered,
    picture: &PictureArgs,
) -> Result<()> {
    let (aovs, surfaces) = (&picture.aovs, &rendered.surfaces);
    let of = |rgb: Vec<[f32; 3]>| Image {
        rgb,
        ..rendered.image
    };
    let layer = |value: fn(&Surface) -> [f32; 3]| of(surfaces.iter().map(value).collect());
    if aovs.contains(&Aov::Albedo) {
        document.add_image("albedo", &layer(|s| s.albedo))?;
    }
    if aovs.contains(&Aov::Normal) {
        document.add_image("normal", &layer(|s| s.normal))?;
    }
    if aovs.contains(&Aov::Depth) {
        document.add_scalar("depth", surfaces.iter().map(|s| s.depth).collect())?;
    }
    if aovs.contains(&Aov::Variance) {
        let variance = |m: &Moments| single(DVec3::from_array(m.variance_of_mean()));
        let variances = rendered.moments.iter().map(variance).collect();
        document.add_image("variance", &of(variances))?;
    }
    if aovs.contains(&Aov::Samples) {
        // The moments of trials count each trial as one value.
        let each = if picture.trials > 1 {
            picture.pixel_samples.into()
        } else {
            1
        };
        let taken = rendered.moments.iter().map(|m| clamped(each * m.count));
        document.add_counts("samples", taken.collect())?;
        let [rays, lines] = &rendered.cost;
        document.add_counts("rays", rays.clone())?;
        document.add_counts("lines", lines.clone())?;
    }
    Ok(())
}

/// The surface that the ray through the centre of a pixel meets.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Surface {
    pub(super) albedo: [f32; 3],
    pub(super) normal: [f32; 3],
    pub(super) depth: f32,
}

/// Finds the surface at the centre of a pixel; if there is none, the depth is infinite.
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

/// Computes the reflection towards the viewer of light that is 1 everywhere above the surface,
/// including what perfect mirrors and glass on the way transmit. It is the mean of f cos/p over 64
/// stratified directions sampled by the BSDF, the same random numbers for all points.
fn albedo(point: &ShadingPoint) -> DVec3 {
    const SIDE: u8 = 8;
    let passed: DVec3 = point.bounces.iter().map(|bounce| bounce.weight).sum();
    // A diffuse surface reflects f π.
    if let Some(f) = point.known().constant() {
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

/// Rounds a colour to the precision of images.
#[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
pub(super) fn single(value: DVec3) -> [f32; 3] {
    value.to_array().map(|v| v as f32)
}

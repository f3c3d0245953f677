//! The image of a picture: its film, its renderer, its file and its report.

use super::aovs::{self, Rendered};
use crate::args::{ImageArgs, PictureArgs, UsageError};
use anyhow::{Result, bail};
use linelit_film::{Document, Exposure, Tile};
use linelit_integrator::{Counts, LightChoice, Renderer, Spheres};
use linelit_scene::SceneDescription;
use linelit_study::{short_name, version};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::path::Path;

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

/// Gives a scene the requested resolution, and returns the part of its film that is requested.
pub(super) fn set_film(scene: &mut SceneDescription, args: &PictureArgs) -> Tile {
    if let Some(resolution) = args.resolution {
        scene.set_resolution(resolution.width, resolution.height);
    }
    let ([x0, x1, y0, y1], film) = (scene.film.crop, &scene.film);
    let all = Tile { x0, y0, x1, y1 };
    args.crop
        .map_or(all, |crop| crop.window(film.width, film.height))
}

/// Checks that each light that the flags refer to exists and is sampled: the index of another light
/// would change nothing, and is a mistake of the user.
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

/// Returns the indices by which options such as `--light-estimator` refer to the lights of a scene.
/// Each light has its own index; a sphere, disk or cylinder that is sampled as a whole has the
/// index of the first of its facets.
pub(super) fn numbers(scene: &SceneDescription, spheres: Spheres) -> impl Iterator<Item = u32> {
    let is_own = move |light: &u32| {
        let whole = scene.whole_of(*light).filter(|_| spheres == Spheres::Exact);
        whole.is_none_or(|round| round.lights.start == *light)
    };
    let all = 0..u32::try_from(scene.lights.len()).unwrap_or(u32::MAX);
    all.filter(is_own)
}

/// Returns a renderer of the scene with the requested estimators for all lights.
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

/// Returns whether a file's name has this extension (without the dot).
pub(super) fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e == ending)
}

/// Writes the picture to a file, in the format of its extension. The function takes the rendered
/// picture by value and frees it early, as the bytes of the file need its memory.
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

/// Returns the counts that are reported about a picture, by name. The counts of the work that the
/// plan skipped come first.
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

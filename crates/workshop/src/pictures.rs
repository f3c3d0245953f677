//! `pictures`: draws the pictures of README and gallery: by points and lines of the same time, and
//! without noise.

use crate::args::PicturesArgs;
use anyhow::{Context as _, Result, bail};
use indicatif::ProgressBar;
use linelit_cli::output::Output;
use linelit_film::{Exposure, Image, Tile, decode_picture, encode_png, write_atomically};
use linelit_integrator::{Estimator, Renderer, Settings, Workspace};
use linelit_papers::default_study;
use linelit_samplers::SamplerKind;
use linelit_scenes::{BuiltIn, Library};
use linelit_study::engine::CpuClock;
use linelit_study::report::plot_files;
use linelit_study::scene_study::{StudySpec, render, with_work};
use std::fs;

/// The longer side of a picture, in pixels.
const SIDE: u32 = 480;
/// The number of camera samples of a pixel in the gallery's pictures, and the number of lines of
/// each camera sample.
const GALLERY: [u32; 2] = [16, 4];
/// The number of camera samples of a pixel in README's pictures, and the number of lines of each
/// camera sample.
const README: [u32; 2] = [4, 1];
/// The number of lines for each camera sample of the true picture, in scenes where the closed form
/// takes more than [`SLOW`] times as long as the lines that are shown. Elsewhere `exact` draws at
/// most 16 lines where it has no closed form.
const TRUTH: u32 = 64;
/// The factor in time between the closed form and the lines that are shown, above which the true
/// picture is by [`TRUTH`] lines for each camera sample.
const SLOW: f64 = 20.0;
/// The scene that README shows by points and by lines of the same time.
const COMPARED: &str = "colonnade-line";
/// The scene that README shows without noise.
const EXACT: &str = "colonnade-large";
/// The scene of README's plot of error over samples.
const PLOTTED: &str = "grid-planes-large";
/// The fraction 1/`INSET[0]` of the picture's width that is magnified in its corner, and the
/// magnification.
const INSET: [u32; 2] = [8, 3];

/// Three pictures of a scene: by points and by lines of the same time, and without noise.
struct Triple {
    /// The number of shadow rays per camera sample that take as long as the lines of `hybrid`.
    rays: u32,
    images: [Image; 3],
    /// The root mean square errors of points and lines, where white is one.
    errors: [f64; 2],
    exposure: Exposure,
}

/// Draws the pictures, or with `--check` fails if some are out of date.
pub(crate) fn run(args: &PicturesArgs, out: &mut Output) -> Result<()> {
    let library = args.read.library();
    let page = args.out.with_file_name("gallery.md");
    let mut text = fs::read_to_string(&page)?;
    let mut files = Vec::new();
    let is_asked = |name: &str| args.scene.as_ref().is_none_or(|only| only == name);
    // Draw the scenes of the gallery, and update their rows on its page.
    for built_in in BuiltIn::ALL.iter().filter(|b| is_asked(b.name)) {
        let known = known_rays(&text, built_in.name).filter(|_| args.check);
        let triple = Triple::new(&library, built_in.name, GALLERY, known)?;
        let (name, about) = (built_in.name, built_in.about);
        let [points, lines] = triple.errors.map(|error| format!("{error:.4}"));
        let rays = triple.rays;
        let row = format!(
            "| ![{name}](pictures/{name}.png) | `{name}` | {about} | {rays} | {points} | {lines} |"
        );
        writeln!(out, "{row}")?;
        replace_row(&mut text, &row);
        files.push((
            format!("{name}.png"),
            encode_png(&triple.strips(), triple.exposure)?,
        ));
    }
    // Draw the pictures of README.
    if !args.check {
        if is_asked(COMPARED) {
            files.extend(compared(&library, out)?);
        }
        if is_asked(EXACT) {
            let Triple {
                images, exposure, ..
            } = Triple::new(&library, EXACT, README, Some(1))?;
            files.push(("exact.png".to_owned(), encode_png(&images[2], exposure)?));
        }
        if is_asked(PLOTTED) {
            files.push(("convergence.svg".to_owned(), plot(&library)?));
        }
        write_atomically(&page, text.as_bytes())?;
    }
    // Find the files whose pixels changed. Bytes do not matter, as files may be compressed further.
    let is_old = |(name, bytes): &&(String, Vec<u8>)| {
        let kept = fs::read(args.out.join(name)).unwrap_or_default();
        let pixels = |bytes: &[u8]| Some(decode_picture(name, bytes)?.ok()?.pixels);
        kept != *bytes && pixels(&kept).is_none_or(|p| Some(p) != pixels(bytes))
    };
    let old: Vec<_> = files.iter().filter(is_old).collect();
    if args.check && !old.is_empty() {
        let names: Vec<_> = old.iter().map(|(name, _)| name.as_str()).collect();
        bail!(
            "of an old state: {}; `cargo xtask pictures` draws them anew",
            names.join(", ")
        );
    }
    // Write them.
    for (name, bytes) in &old {
        write_atomically(&args.out.join(name), bytes)?;
    }
    let bytes: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
    writeln!(
        out,
        "{} pictures, {bytes} bytes, {} of them new",
        files.len(),
        old.len()
    )?;
    Ok(())
}

/// Draws points and lines of the same time for README, and prints the number of rays.
fn compared(library: &Library, out: &mut Output) -> Result<Vec<(String, Vec<u8>)>> {
    let triple = Triple::new(library, COMPARED, README, None)?;
    let (rays, [points, lines]) = (triple.rays, triple.errors);
    writeln!(
        out,
        "README: {rays} rays, errors {points:.4} and {lines:.4}"
    )?;
    let pictures = ["points", "lines"].iter().zip(triple.magnified());
    let png = |image| encode_png(&image, triple.exposure);
    let files = pictures.map(|(name, image)| Ok((format!("{name}.png"), png(image)?)));
    files.collect()
}

/// Replaces the row of the gallery that shows the same picture.
fn replace_row(text: &mut String, row: &str) {
    let picture = row.split_inclusive(')').next().unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with(picture));
    if let Some(old) = line.map(str::to_owned) {
        *text = text.replace(&old, row);
    }
}

/// Returns the number of shadow rays that the gallery's page states for a scene.
fn known_rays(page: &str, scene: &str) -> Option<u32> {
    let row = page
        .lines()
        .find(|line| line.contains(&format!("| `{scene}` |")))?;
    row.split(" | ").nth(3)?.parse().ok()
}

impl Triple {
    /// Draws the three pictures of a scene. `rays` is the number of shadow rays, which is measured
    /// if it is not given.
    fn new(
        library: &Library,
        name: &str,
        [pixel_samples, lines]: [u32; 2],
        rays: Option<u32>,
    ) -> Result<Self> {
        let mut scene = library.load_lit(name)?.scene;
        let [w, h] = [scene.film.width, scene.film.height];
        let [width, height] = [w, h].map(|side| (SIDE * side / w.max(h)).max(1));
        scene.set_resolution(width, height);
        let renderer = Renderer::new(&scene);
        let by = |estimator: Estimator, samples| Settings {
            estimator,
            samples,
            pixel_samples,
            ..Settings::default()
        };
        let points = |samples| by("point-area".parse().unwrap_or(Estimator::hybrid()), samples);
        let lines = by(Estimator::hybrid(), lines);
        // Find how many rays take as long as the lines; time grows linearly with the rays.
        let rays = rays.unwrap_or_else(|| {
            let [one, eight] = [1, 8].map(|n| seconds(&renderer, &points(n), [width, height]));
            let wanted = seconds(&renderer, &lines, [width, height]);
            let more = ((wanted - one) / ((eight - one) / 7.0)).max(0.0);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "few"
            )]
            let more = more.min(1000.0).round() as u32;
            1 + more
        });
        // Take many lines instead of the closed form if that is too slow.
        let window = Tile::whole(width, height);
        let picture =
            |settings: &Settings| render(&renderer, settings, window, &ProgressBar::hidden());
        let [quick, whole] = [&lines, &by(Estimator::exact(), 1)]
            .map(|settings| seconds(&renderer, settings, [width, height]));
        let is_slow = whole > SLOW * quick && pixel_samples == GALLERY[0];
        let exact = match is_slow {
            true => by(Estimator::hybrid(), TRUTH),
            false => by(Estimator::exact(), TRUTH.min(16)),
        };
        // Render, and measure the errors as they are shown.
        let images = [&points(rays), &lines, &exact].map(|settings| picture(settings).0);
        let [points, lines, truth] = &images;
        let exposure = Exposure::fitting(truth, 0.97);
        let errors = [points, lines].map(|image| error(image, truth, exposure.stops.exp2()));
        Ok(Self {
            rays,
            errors,
            exposure,
            images,
        })
    }

    /// Returns one picture whose left third is by points, the middle by lines, and the right
    /// without noise.
    fn strips(&self) -> Image {
        let mut image = self.images[0].clone();
        let width = image.width as usize;
        for (k, pixel) in image.rgb.iter_mut().enumerate() {
            let of = (k % width) * 3 / width;
            // Draw a thin white line between them.
            let next = ((k + 1) % width) * 3 / width;
            *pixel = if next > of {
                [f32::MAX; 3]
            } else {
                self.images[of].rgb[k]
            };
        }
        image
    }

    /// Returns points and lines, with a square magnified in a corner: where points err most in
    /// comparison with how much the true picture itself changes there.
    fn magnified(&self) -> Vec<Image> {
        let [points, _, truth] = &self.images;
        let (width, height) = (points.width as usize, points.height as usize);
        let [part, times] = INSET.map(|x| x as usize);
        let side = width / part;
        // Rate a square by its noise, and by its changes between neighbours.
        let error = |[x0, y0]: [usize; 2]| -> f64 {
            let rows = y0..y0 + side;
            let pixels = rows.flat_map(|y| (x0 + 1..x0 + side).map(move |x| y * width + x));
            let pair = |k: usize| {
                let change = square(truth.rgb[k], truth.rgb[k - 1]);
                [square(points.rgb[k], truth.rgb[k]), change]
            };
            let [noise, change] = pixels
                .map(pair)
                .fold([0.0; 2], |sum, x| [sum[0] + x[0], sum[1] + x[1]]);
            noise * noise / (noise + change).max(f64::MIN_POSITIVE)
        };
        // Find the worst square.
        let steps = |size: usize| (0..=(size - side) / side).map(move |i| i * side);
        let places = steps(height).flat_map(|y| steps(width).map(move |x| [x, y]));
        let worst = places
            .max_by(|a, b| error(*a).total_cmp(&error(*b)))
            .unwrap_or_default();
        // Copy it, magnified and with a white border, into the upper corner that is farther away.
        let with_inset = |image: &Image| {
            let mut out = image.clone();
            let size = side * times;
            let left = if worst[0] > width / 2 {
                0
            } else {
                width - size
            };
            for y in 0..size {
                for x in 0..size {
                    let is_border = x < 2 || y < 2 || x + 2 >= size || y + 2 >= size;
                    let from = (worst[1] + y / times) * width + worst[0] + x / times;
                    let pixel = if is_border {
                        [f32::MAX; 3]
                    } else {
                        image.rgb[from]
                    };
                    out.rgb[y * width + left + x] = pixel;
                }
            }
            out
        };
        self.images[..2].iter().map(with_inset).collect()
    }
}

/// Returns the processor seconds of one thread for every eighth row.
fn seconds(renderer: &Renderer<'_>, settings: &Settings, [width, height]: [u32; 2]) -> f64 {
    let mut workspace = Workspace::new();
    let mut row = vec![linelit_geometry::DVec3::ZERO; width as usize];
    let clock = CpuClock::start();
    for y in (0..height).step_by(8) {
        renderer.row(settings, [0, y], &mut row, &mut workspace);
    }
    clock.seconds()
}

/// Returns the squared distance of two colours.
fn square(a: [f32; 3], b: [f32; 3]) -> f64 {
    let differences = a.into_iter().zip(b).map(|(a, b)| f64::from(a - b));
    differences.map(|d| d * d).sum()
}

/// Returns the root mean square error of a picture as it is shown, where white is one.
fn error(image: &Image, truth: &Image, scale: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation, reason = "a few doublings")]
    let shown = |pixel: [f32; 3]| pixel.map(|x| (x * scale as f32).min(1.0));
    let pixels = image.rgb.iter().zip(&truth.rgb);
    let errors = pixels.map(|(a, b)| square(shown(*a), shown(*b)));
    (errors.sum::<f64>() / (3.0 * truth.rgb.len() as f64)).sqrt()
}

/// Returns the plot of error over samples.
fn plot(library: &Library) -> Result<Vec<u8>> {
    let spec = StudySpec {
        scenes: vec![PLOTTED.to_owned()],
        samplers: vec![SamplerKind::Independent, SamplerKind::Stratified],
        duel: None,
        ..default_study()
    };
    let mut record = spec.record(String::new());
    let load = |name: &str| Ok(library.load_lit(name)?.scene);
    with_work(&spec, &load, |work| work.whole(&mut record))?;
    let mut plots = plot_files(&record).into_iter();
    let plot = plots.find(|(name, _)| name.ends_with("-samples.svg"));
    Ok(plot.context("a study has plots")?.1.into_bytes())
}

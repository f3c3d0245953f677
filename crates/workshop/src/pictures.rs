//! `pictures`: the small pictures of README and gallery.

use crate::args::PicturesArgs;
use anyhow::{Result, bail};
use indicatif::ProgressBar;
use linelit_cli::output::Output;
use linelit_film::{Exposure, Tile, encode_png, write_atomically};
use linelit_integrator::{Estimator, Renderer, Settings};
use linelit_papers::default_study;
use linelit_samplers::SamplerKind;
use linelit_scenes::{BuiltIn, Library};
use linelit_study::report::plot_files;
use linelit_study::scene_study::{Duel, StudySpec, render, with_work};

/// Pixels on the longer side of a picture of the gallery.
const GALLERY: u32 = 112;
/// Pixels on the longer side of a picture under the README's slider.
const README: u32 = 176;
/// Samples of the gallery: what is still noise then is a grain.
const SAMPLES: u32 = 64;
/// What README shows.
const SCENE: &str = "grid-planes-large";

/// Draws the pictures, or says which are of an old state.
pub(crate) fn run(args: &PicturesArgs, out: &mut Output) -> Result<()> {
    let library = args.read.library();
    let mut files = gallery(&library)?;
    if !args.check {
        files.extend(readme(&library, out)?);
    }
    let mut old = Vec::new();
    for (name, bytes) in &files {
        let path = args.out.join(name);
        if std::fs::read(&path).is_ok_and(|kept| kept == *bytes) {
            continue;
        }
        old.push(name.as_str());
        if !args.check {
            write_atomically(&path, bytes)?;
        }
    }
    if args.check && !old.is_empty() {
        bail!(
            "of an old state: {}; `cargo xtask pictures` draws them anew",
            old.join(", ")
        );
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

/// Every built-in scene, by the default estimator.
fn gallery(library: &Library) -> Result<Vec<(String, Vec<u8>)>> {
    let settings = Settings {
        estimator: Estimator::hybrid(),
        samples: SAMPLES,
        ..Settings::default()
    };
    let mut files = Vec::new();
    for built_in in BuiltIn::ALL {
        let mut scene = library.load_lit(built_in.name)?.scene;
        let [w, h] = [scene.film.width, scene.film.height];
        let [width, height] = [w, h].map(|side| (GALLERY * side / w.max(h)).max(1));
        scene.set_resolution(width, height);
        let renderer = Renderer::new(&scene);
        let window = Tile::whole(width, height);
        let (image, _) = render(&renderer, &settings, window, &ProgressBar::hidden());
        let png = encode_png(&image, Exposure::fitting(&image, 0.9))?;
        files.push((format!("{}.png", built_in.name), png));
    }
    Ok(files)
}

/// Points and lines for the same time beside the closed form, and how their errors fall. What was
/// found is printed, for the text about it.
fn readme(library: &Library, out: &mut Output) -> Result<Vec<(String, Vec<u8>)>> {
    let spec = StudySpec {
        scenes: vec![SCENE.to_owned()],
        samplers: vec![SamplerKind::Independent, SamplerKind::Stratified],
        duel: Some(Duel {
            side: README,
            samples: 16,
        }),
        ..default_study()
    };
    let mut record = spec.record(String::new());
    let load = |name: &str| Ok(library.load_lit(name)?.scene);
    let mut exhibits = with_work(&spec, &load, |work| work.whole(&mut record))?;
    let Some(found) = exhibits.comparisons.remove(SCENE) else {
        bail!("the study found no points or no lines to show");
    };
    writeln!(out, "{}", found.lead)?;
    let [points, lines] = found.sides;
    let pictures = [("points", points), ("lines", lines), ("exact", found.truth)];
    let mut files: Vec<(String, Vec<u8>)> = pictures
        .map(|(name, picture)| (format!("{name}.png"), picture.png))
        .into();
    let plots = plot_files(&record).into_iter();
    let plot = plots.filter(|(name, _)| name.ends_with("-samples.svg"));
    files.extend(plot.map(|(_, svg)| ("convergence.svg".to_owned(), svg.into_bytes())));
    Ok(files)
}

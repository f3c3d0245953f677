//! Independent renders of one image, for its mean and its noise.

use super::{Effort, Entry, estimator};
use anyhow::Result;
use linelit_cli::commands::bar;
use linelit_film::{Image, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings};
use linelit_samplers::SamplerKind;
use linelit_study::scene_study;

/// Mean and variance of one replicate, per pixel.
pub(super) struct Replicated {
    pub(super) mean: Vec<DVec3>,
    pub(super) variance: Vec<DVec3>,
    pub(super) replicates: f64,
    pub(super) samples: f64,
}

/// Renders a scene several times with different random numbers.
pub(super) fn replicate(
    pool: &rayon::ThreadPool,
    renderer: &Renderer<'_>,
    entry: &Entry,
    effort: Effort,
) -> Result<Replicated> {
    let film = &renderer.scene().film;
    let window = Tile::whole(film.width, film.height);
    let estimator = estimator(effort)?;
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
    Ok(Replicated {
        mean,
        variance,
        replicates: n,
        samples: f64::from(effort.samples),
    })
}

//! What pictures take, guessed before they are rendered.

use crate::args::PictureArgs;
use linelit_film::Tile;
use linelit_integrator::{Counts, LightChoice, Renderer, Workspace};
use linelit_scene::Scene;

/// Seconds of a pixel's camera samples, within a factor of ten, by what is asked for.
fn rough_seconds(scene: &Scene, picture: &PictureArgs) -> f64 {
    let lights = match picture.lights {
        LightChoice::All => scene.lights.len() as f64,
        _ => 1.0,
    };
    let light = 1e-6 + 5e-7 * f64::from(picture.samples);
    picture.camera_samples() * (1e-6 + lights * light)
}

/// What pixels cost: the same on every machine.
pub(super) struct Cost {
    /// Seconds of a pixel, and where it is.
    pixels: Vec<([u32; 2], f64)>,
}

impl Cost {
    /// Pixels of a grid across and down.
    const GRID: u32 = 24;
    /// Camera samples of each.
    const SAMPLES: u32 = 4;

    /// By what some of the pixels count.
    pub(super) fn find(renderer: &Renderer<'_>, picture: &PictureArgs, window: Tile) -> Self {
        let settings = &picture.settings();
        let mut workspace = Workspace::new();
        let count = settings.pixel_samples.clamp(1, Self::SAMPLES);
        let scale = picture.camera_samples() / f64::from(count);
        let place = |k: u32, from: u32, size: u32| {
            let middle = u64::from(size) * u64::from(2 * k + 1) / u64::from(2 * Self::GRID);
            from + u32::try_from(middle).unwrap_or(0)
        };
        let mut pixels = Vec::new();
        for j in 0..Self::GRID {
            for i in 0..Self::GRID {
                let pixel = [
                    place(i, window.x0, window.width()),
                    place(j, window.y0, window.height()),
                ];
                renderer.pixel_block(settings, pixel, 0..count, &mut workspace, |_| {});
                let seconds = Self::seconds(&workspace.take_counts()) / f64::from(count);
                // A camera ray at least.
                pixels.push((pixel, (seconds + 2e-7) * f64::from(count) * scale));
            }
        }
        Self { pixels }
    }

    /// Seconds of what was counted, within a factor of two or three of those of a core of the
    /// year 2023: for units of a sensible size, and for shares.
    fn seconds(counts: &Counts) -> f64 {
        let visibility = &counts.visibility;
        let count = |n: u64| n as f64;
        6e-9 * count(visibility.node_tests)
            + 1.2e-8 * count(visibility.triangle_tests)
            + 8e-8 * count(visibility.line_queries)
            + 3e-8 * count(visibility.rays)
            + 4e-7 * count(counts.exact_tests())
            + 8e-7 * count(counts.plan.points)
    }

    /// By the size of the picture alone: of all pixels alike.
    pub(super) fn rough(scene: &Scene, picture: &PictureArgs, window: Tile) -> Self {
        let pixel = rough_seconds(scene, picture);
        Self {
            pixels: vec![([window.x0, window.y0], pixel)],
        }
    }

    /// Whether making the scene ready, which [`Cost::find`] needs, takes more than a look at the
    /// picture is worth.
    pub(super) fn is_dear(&self, scene: &Scene, window: Tile) -> bool {
        /// Seconds for each triangle of the hierarchy.
        const TRIANGLE: f64 = 8e-7;
        TRIANGLE * scene.triangles.len() as f64 > 0.02 * self.of(window)
    }

    /// Of a pixel.
    pub(super) fn mean(&self) -> f64 {
        let sum: f64 = self.pixels.iter().map(|(_, seconds)| seconds).sum();
        sum / self.pixels.len() as f64
    }

    /// Of a tile by those of its pixels that are known, or else by all.
    pub(super) fn of(&self, tile: Tile) -> f64 {
        let inside = |&&([x, y], _): &&([u32; 2], f64)| {
            (tile.x0..tile.x1).contains(&x) && (tile.y0..tile.y1).contains(&y)
        };
        let inside = self.pixels.iter().filter(inside);
        let (count, sum) = inside.fold((0.0, 0.0), |(n, sum), (_, s)| (n + 1.0, sum + s));
        let pixel = if count > 0.0 {
            sum / count
        } else {
            self.mean()
        };
        pixel * tile.area() as f64
    }
}

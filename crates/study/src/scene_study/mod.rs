//! Convergence studies of scenes: the integrals of [`Targets`] are the pixels of linelit's own
//! integrator.

mod budget;
mod pictures;
mod spec;
mod stage;
mod words;
mod work;

pub use budget::{Shortage, TimeBudget};
pub use spec::{Budget, Duel, Gallery, Spot, StudySpec, View};
pub use stage::{Load, Work, with_work};
pub use words::about;
pub use work::{EachPart, PartOf, Piece, PlannedUnit, SceneUnit};

use crate::engine::{Counts, Problem, Truth};
use indicatif::ProgressBar;
use linelit_estimators::{Estimator, LineBy, Points};
use linelit_film::{Image, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, ShadingPoint, Spheres, Window, Workspace};

/// The shading points of a picture, which are found once and estimated many times.
#[derive(Debug)]
pub struct Targets<'a> {
    /// The renderer of the scene.
    pub renderer: &'a Renderer<'a>,
    /// The pixels whose rays meet a surface to shade, with the shading points.
    pub points: Vec<([u32; 2], ShadingPoint)>,
    /// The number of pixels that [`Targets::find`] was given.
    pub pixels: usize,
}

impl<'a> Targets<'a> {
    /// Finds the shading points by one ray through the centre of each pixel.
    #[must_use]
    pub fn find(renderer: &'a Renderer<'a>, pixels: &[[u32; 2]]) -> Self {
        let mut workspace = Workspace::new();
        let mut shade = |&pixel: &[u32; 2]| {
            let point = renderer.shading_point(pixel, &mut workspace)?;
            Some((pixel, point))
        };
        Self {
            renderer,
            points: pixels.iter().filter_map(&mut shade).collect(),
            pixels: pixels.len(),
        }
    }

    /// Returns the method of the reference: closed forms along lines where every material has them,
    /// otherwise lines combined with BSDF samples.
    #[must_use]
    pub fn truth(&self, spheres: Spheres) -> Truth<Settings> {
        Truth::Computed(spec::method(self.true_settings(spheres)))
    }

    /// Returns the settings of the method of [`Targets::truth`]: its estimator and its sampler.
    #[must_use]
    pub fn true_settings(&self, spheres: Spheres) -> Settings {
        let closed = self.points.iter().all(|(_, p)| p.has_closed_form());
        let estimator = if closed {
            Estimator::analytic()
        } else {
            Estimator::lines(LineBy::SolidAngle).with(Points::bsdf())
        };
        Settings {
            estimator,
            spheres,
            ..Settings::default()
        }
    }
}

impl Problem for Targets<'_> {
    /// The settings of an estimator. Samples and seed in them are ignored: [`Problem::estimate`]
    /// has its own.
    type Settings = Settings;
    type Workspace = Workspace;

    fn integrals(&self) -> usize {
        self.points.len()
    }

    fn pixels(&self) -> usize {
        self.pixels
    }

    fn estimate(
        &self,
        settings: &Settings,
        samples: u32,
        seed: u64,
        integral: usize,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let settings = Settings {
            samples,
            seed,
            ..*settings
        };
        let (pixel, point) = &self.points[integral];
        self.renderer.direct(&settings, point, *pixel, workspace)
    }

    fn take_counts(&self, workspace: &mut Workspace) -> Counts {
        let counts = workspace.take_counts();
        Counts {
            rays: counts.visibility.rays,
            lines: counts.segments.lines,
            line_queries: counts.visibility.line_queries,
            node_tests: counts.visibility.node_tests,
            triangle_tests: counts.visibility.triangle_tests,
            intervals: counts.visibility.intervals,
            exact_tests: counts.exact_tests(),
        }
    }
}

/// Returns all pixels of an image, row by row.
#[must_use]
pub fn all_pixels(width: u32, height: u32) -> Vec<[u32; 2]> {
    let row = |y| (0..width).map(move |x| [x, y]);
    (0..height).flat_map(row).collect()
}

/// Returns the pixels of a part of a picture.
#[must_use]
pub fn window(tile: Tile) -> Window {
    Window {
        columns: tile.x0..tile.x1,
        rows: tile.y0..tile.y1,
    }
}

/// Renders a part of a picture on the threads of the current pool, and returns it with the sum of
/// all counts.
#[must_use]
pub fn render(
    renderer: &Renderer<'_>,
    settings: &Settings,
    tile: Tile,
    progress: &ProgressBar,
) -> (Image, linelit_integrator::Counts) {
    progress.set_length(u64::from(tile.height()));
    let (rgb, counts) = renderer.picture(settings, &window(tile), || progress.inc(1));
    progress.finish_and_clear();
    (image(tile, rgb), counts)
}

/// Renders a part of a picture by any function of a pixel, and returns it with the sum of all
/// counts.
pub fn map(
    tile: Tile,
    progress: &ProgressBar,
    shade: impl Fn([u32; 2], &mut Workspace) -> DVec3 + Sync,
) -> (Image, linelit_integrator::Counts) {
    progress.set_length(u64::from(tile.height()));
    let row_done = || progress.inc(1);
    let (rgb, counts) = window(tile).map(row_done, |[x0, y], pixels, workspace| {
        for (x, pixel) in (x0..).zip(pixels) {
            #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
            let stored = shade([x, y], workspace).to_array().map(|v| v as f32);
            *pixel = stored;
        }
    });
    progress.finish_and_clear();
    (image(tile, rgb), counts)
}

/// Makes an image from the values of a part of a picture.
fn image(tile: Tile, rgb: Vec<[f32; 3]>) -> Image {
    Image {
        width: tile.width(),
        height: tile.height(),
        rgb,
    }
}

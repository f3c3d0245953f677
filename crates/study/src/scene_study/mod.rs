//! Convergence studies of scenes: our integrator as what `linelit-study` measures.

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

/// The shading points of a picture: found once, estimated many times.
#[derive(Debug)]
pub struct Targets<'a> {
    /// The renderer of their scene.
    pub renderer: &'a Renderer<'a>,
    /// The pixels with something to shade, and where their rays meet the scene.
    pub points: Vec<([u32; 2], ShadingPoint)>,
    /// Number of pixels that were asked for.
    pub pixels: usize,
}

impl<'a> Targets<'a> {
    /// Shoots one ray through the centre of each pixel.
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

    /// Returns the reference that errors are measured by: closed forms along lines where every
    /// material has them, else lines and BSDF samples combined.
    #[must_use]
    pub fn truth(&self, spheres: Spheres) -> Truth<Settings> {
        Truth::Computed(spec::method(self.true_settings(spheres)))
    }

    /// The settings of [`Targets::truth`].
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
    /// Samples and seed are those of [`Problem::estimate`], whatever stands here.
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

/// All pixels of an image, row by row.
#[must_use]
pub fn all_pixels(width: u32, height: u32) -> Vec<[u32; 2]> {
    let row = |y| (0..width).map(move |x| [x, y]);
    (0..height).flat_map(row).collect()
}

/// The pixels of a part of a picture.
#[must_use]
pub fn window(tile: Tile) -> Window {
    Window {
        columns: tile.x0..tile.x1,
        rows: tile.y0..tile.y1,
    }
}

/// Renders a part of a picture on the threads of the current pool; the sum of what was counted
/// stands beside it.
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

/// Renders a part of a picture with any function of a pixel.
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

fn image(tile: Tile, rgb: Vec<[f32; 3]>) -> Image {
    Image {
        width: tile.width(),
        height: tile.height(),
        rgb,
    }
}

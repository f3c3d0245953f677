//! Convergence studies of scenes: our integrator as what `linelit-study` measures.

mod duel;
mod gallery;
mod shown;
mod spec;
mod stage;
mod words;
mod work;

pub use spec::{Budget, Duel, Gallery, Spot, StudySpec, View};
pub use stage::{Load, Work, with_work};
pub use words::about;
pub use work::{EachPart, Piece, PlannedUnit, SceneUnit};

use indicatif::ProgressBar;
use linelit_estimators::{Estimator, LineBy, Points};
use linelit_film::{Image, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, ShadingPoint, Spheres, Workspace};
use linelit_study::engine::image;
use linelit_study::engine::{Counts, Problem, Truth};

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

    /// What errors are measured by: closed forms along lines where every material has them, else
    /// lines and BSDF samples combined.
    #[must_use]
    pub fn truth(&self, spheres: Spheres) -> Truth<Settings> {
        Truth::Computed(spec::method(self.true_settings(spheres)))
    }

    /// The settings of [`Targets::truth`].
    pub(crate) fn true_settings(&self, spheres: Spheres) -> Settings {
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
        self.renderer.direct(&settings, point, *pixel, 0, workspace)
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

/// Renders a window of an image on the threads of the current pool; the sum of what was counted
/// stands beside it.
#[must_use]
pub fn render(
    renderer: &Renderer<'_>,
    settings: &Settings,
    window: Tile,
    progress: &ProgressBar,
) -> (Image, linelit_integrator::Counts) {
    progress.set_length(u64::from(window.height()));
    let row_done = || progress.inc(1);
    let shade = |first, row: &mut [DVec3], workspace: &mut Workspace| {
        renderer.row(settings, first, row, workspace);
    };
    let result = image::map_rows(window, row_done, Workspace::take_counts, shade);
    progress.finish_and_clear();
    result
}

/// Renders a window with any function of a pixel.
pub(crate) fn map(
    window: Tile,
    progress: &ProgressBar,
    shade: impl Fn([u32; 2], &mut Workspace) -> DVec3 + Sync,
) -> (Image, linelit_integrator::Counts) {
    progress.set_length(u64::from(window.height()));
    let row_done = || progress.inc(1);
    let result = image::map(window, row_done, Workspace::take_counts, shade);
    progress.finish_and_clear();
    result
}

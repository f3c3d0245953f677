//! Salesin & Jarosz 2019, Figs. 1 and 8 to 11, at their own terms: independent samples, one light
//! sample (four in Figs. 9 and 11) for each camera ray, errors at equal time; and beside them ours:
//! sixteen multi-jittered samples of one camera ray.

use crate::measured::Measured;
use crate::picture_study::{Context, PictureStudy, Row, section, table};
use crate::salesin;
use anyhow::{Context as _, Result};
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, Renderer, Settings, Spheres, Workspace};
use linelit_samplers::SamplerKind;
use linelit_study::engine::CpuClock;
use linelit_study::scene_study::{Targets, all_pixels};
use linelit_study::stats::metrics::MRSE_EPSILON;
use std::cmp::Ordering;

/// Camera rays of a batch, and batches, in turns with those of other estimators.
const RAYS: u32 = 16;
const BATCHES: u32 = 6;
/// Light samples of a camera ray in our terms.
const OURS: u32 = 16;

/// A figure: its study, a scene, light samples of a camera ray, and what the paper finds best.
#[derive(Clone, Copy, Debug)]
struct Figure {
    /// The study that shows it, whose pictures name the estimators.
    pub study: &'static str,
    /// The scene.
    scene: &'static str,
    size: [u32; 2],
    /// Light samples of a camera ray.
    samples: u32,
    /// The estimator with the lowest MRSE in the paper.
    pub best: &'static str,
    /// What the paper says.
    paper: &'static str,
}

const FIGURES: [Figure; 5] = [
    Figure {
        study: "salesin-fig1",
        scene: "monoliths",
        size: [32, 20],
        samples: 1,
        best: "line-solid-angle[orientation=fixed:0]+point-bsdf",
        paper: "BSDF samples and solid-angle lines by MIS",
    },
    Figure {
        study: "salesin-fig8",
        scene: "cornell-box-large",
        size: [24, 24],
        samples: 1,
        best: "line-solid-angle[orientation=fixed:0]",
        paper: "in shadow lines and their MIS, elsewhere faster methods",
    },
    Figure {
        study: "salesin-fig9",
        scene: "monoliths",
        size: [32, 20],
        samples: 4,
        best: "line-solid-angle:3[orientation=fixed:0.5]+point-bsdf",
        paper: "1 point : 3 lines, in a kitchen that is not ours to ship",
    },
    Figure {
        study: "salesin-fig10",
        scene: "plates",
        size: [32, 21],
        samples: 1,
        best: "line-solid-angle[orientation=fixed:0]+point-bsdf",
        paper: "BSDF samples and solid-angle lines by MIS",
    },
    Figure {
        study: "salesin-fig11",
        scene: "window",
        size: [24, 24],
        samples: 4,
        best: "point-texture",
        paper: "textured points; one line beside them keeps the error comparable",
    },
];

/// Errors of one estimator for the same time.
#[derive(Clone, Debug)]
struct Efficiency {
    /// The estimator.
    pub estimator: Estimator,
    /// MRSE × seconds over the whole picture by the paper's terms, batch by batch.
    pub paper: Vec<f64>,
    /// The same by ours.
    pub ours: Vec<f64>,
    /// MRSE of one camera ray by the paper's terms, whatever it takes, batch by batch.
    pub ray: Vec<f64>,
}

impl Efficiency {
    /// Still without errors.
    fn of(estimator: Estimator) -> Self {
        Self {
            estimator,
            paper: Vec::new(),
            ours: Vec::new(),
            ray: Vec::new(),
        }
    }
}

/// Squared deviations of one pixel's values from their mean, of each channel, over n − 1.
fn variance(values: &[DVec3]) -> DVec3 {
    let n = values.len() as f64;
    let mean = values.iter().copied().sum::<DVec3>() / n;
    let squares = values.iter().map(|v| (*v - mean) * (*v - mean));
    squares.sum::<DVec3>() / (n - 1.0)
}

/// What a squared error is relative to at each pixel: the square of the best that is known of it,
/// whatever estimator is measured. The mean of the few values themselves would be too often too
/// small, and the more so the noisier they are.
fn squares(
    renderer: &Renderer<'_>,
    pixels: &[[u32; 2]],
    [rays, samples]: [u32; 2],
    workspace: &mut Workspace,
) -> Vec<DVec3> {
    let settings = Settings {
        sampler: SamplerKind::Sobol,
        samples,
        pixel_samples: rays,
        show_lights: false,
        // Far from the seeds of batches.
        seed: 0x5EED_0000_0000_0001,
        ..Targets::find(renderer, pixels).true_settings(Spheres::default())
    };
    let square = |pixel: &[u32; 2]| {
        let known = renderer.pixel(&settings, *pixel, workspace);
        known * known + DVec3::splat(MRSE_EPSILON)
    };
    pixels.iter().map(square).collect()
}

/// The mean relative squared error of one value of each pixel: that times the seconds that one
/// takes for all pixels, and alone. All are unbiased, so that the error is the variance.
fn cost(
    pixels: &[[u32; 2]],
    squares: &[DVec3],
    mut values: impl FnMut([u32; 2], &mut Vec<DVec3>),
) -> [f64; 2] {
    let clock = CpuClock::start();
    let mut all: Vec<Vec<DVec3>> = Vec::with_capacity(pixels.len());
    for pixel in pixels {
        let mut own = Vec::with_capacity(RAYS as usize);
        values(*pixel, &mut own);
        all.push(own);
    }
    let seconds = clock.seconds();
    let (mut sum, mut count) = (0.0, 0.0);
    for (own, square) in all.iter().zip(squares) {
        sum += (variance(own) / *square).element_sum() / 3.0;
        count += own.len() as f64;
    }
    let error = sum / all.len() as f64;
    [error * seconds / (count / all.len() as f64), error]
}

/// Measures all estimators of a figure, in turns.
fn measure(context: &Context<'_>, figure: &Figure) -> Result<Vec<Efficiency>> {
    let spec = salesin::spec(figure.study, Some(figure.scene)).context("no such figure")?;
    let estimators = spec
        .gallery
        .context("a figure without pictures")?
        .estimators;
    let mut scene = context.library.load(figure.scene)?.scene;
    let size = context.size(figure.size);
    scene.set_resolution(size[0], size[1]);
    let renderer = Renderer::new(&scene);
    let pixels = all_pixels(size[0], size[1]);
    let mut workspace = Workspace::new();
    let known = context.or_least([[256, 4], [1, 1024]], [[4, 4], [1, 16]]);
    let [whole, centres] = known.map(|n| squares(&renderer, &pixels, n, &mut workspace));
    let mut all: Vec<Efficiency> = estimators.into_iter().map(Efficiency::of).collect();
    let rays = context.or_least(RAYS, 2);
    for batch in 0..context.or_least(u64::from(BATCHES), 2) {
        for entry in &mut all {
            let base = Settings {
                estimator: entry.estimator,
                sampler: SamplerKind::Stratified,
                seed: context.seed.wrapping_add(batch),
                show_lights: false,
                ..Settings::default()
            };
            let theirs = Settings {
                sampler: SamplerKind::Independent,
                samples: figure.samples,
                pixel_samples: rays,
                ..base
            };
            let [paper, ray] = cost(&pixels, &whole, |pixel, out| {
                renderer.pixel_samples(&theirs, pixel, &mut workspace, |v| out.push(v));
            });
            entry.paper.push(paper);
            entry.ray.push(ray);
            let [ours, _] = cost(&pixels, &centres, |pixel, out| {
                let point = renderer.shading_point(pixel, &mut workspace);
                let trial = |k| {
                    let settings = Settings {
                        sampler: SamplerKind::MultiJitter,
                        samples: OURS,
                        seed: base.seed ^ (k << 32),
                        ..base
                    };
                    point.as_ref().map_or(DVec3::ZERO, |point| {
                        renderer.direct(&settings, point, pixel, 0, &mut workspace)
                    })
                };
                out.extend((1..=u64::from(rays.min(4))).map(trial));
            });
            entry.ours.push(ours);
        }
    }
    Ok(all)
}

/// One estimator's error over another's for the same time, one over itself.
fn over(own: &[f64], other: &[f64]) -> Measured {
    if own == other {
        return Measured::exact(1.0);
    }
    Measured::ratio(own, other)
}

/// The estimator with the least error for the same time: of the means over batches, for squared
/// errors add, and rare large ones are most of some.
fn best<'a>(
    all: &'a [Efficiency],
    errors: impl Fn(&'a Efficiency) -> &'a [f64],
) -> Option<&'a Efficiency> {
    let mean = |e: &'a Efficiency| Measured::mean(errors(e)).value;
    let order = |a: &&'a Efficiency, b: &&'a Efficiency| {
        mean(a).partial_cmp(&mean(b)).unwrap_or(Ordering::Equal)
    };
    all.iter().min_by(order)
}

const COLUMNS: [&str; 3] = [
    "paper's terms, same seconds",
    "our terms, same seconds",
    "MRSE of a camera ray",
];

/// The study.
pub(super) fn run(context: &Context<'_>) -> Result<PictureStudy> {
    let (mut sections, mut rows, mut summary) = (Vec::new(), Vec::new(), Vec::new());
    for figure in &FIGURES {
        let all = measure(context, figure)?;
        let (Some(first), Some(own)) = (best(&all, |e| &e.paper), best(&all, |e| &e.ours)) else {
            continue;
        };
        let row = |e: &Efficiency| {
            let values = [
                over(&e.paper, &first.paper),
                over(&e.ours, &own.ours),
                Measured::mean(&e.ray),
            ];
            let values: Vec<_> = COLUMNS.into_iter().zip(values).collect();
            Row::measured(format!("{}: {}", figure.study, e.estimator), &values)
        };
        let table_rows: Vec<Row> = all.iter().map(row).collect();
        let lead = sentence(figure, &all, first, own);
        let caption = format!(
            "MRSE for the same time over that of the best: independent, {} light sample(s) for each camera ray; and \
             multi-jittered, {OURS} of one camera ray. Scene `{}`.",
            figure.samples, figure.scene
        );
        let tables = vec![table(&caption, &COLUMNS, &table_rows)];
        sections.push(section(figure.study, "", Vec::new(), tables));
        summary.push(format!("{}: {lead}", figure.study));
        rows.extend(table_rows);
    }
    Ok(PictureStudy {
        title: "Equal time at the paper's terms: Salesin & Jarosz 2019, Figs. 1 and 8 to 11"
            .to_owned(),
        summary,
        sections,
        rows,
    })
}

/// Who is best, and by how much the paper's is worse.
fn sentence(figure: &Figure, all: &[Efficiency], first: &Efficiency, own: &Efficiency) -> String {
    let theirs = all.iter().find(|e| e.estimator.to_string() == figure.best);
    let theirs = theirs.map_or(String::new(), |e| {
        let [a, b] = [over(&e.paper, &first.paper), over(&e.ours, &own.ours)];
        if a.is_above(1.0) {
            format!(
                "`{}` has {a} times its error by the paper's terms, {b} times by ours",
                e.estimator
            )
        } else {
            format!(
                "`{}` is not told from it by the paper's terms, and has {b} times the least error by ours",
                e.estimator
            )
        }
    });
    format!(
        "For the same time, `{}` has the least error by the paper's terms, `{}` by ours; {theirs}. The paper finds best: {}.",
        first.estimator, own.estimator, figure.paper
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_name_their_best() {
        for figure in FIGURES {
            let spec = salesin::spec(figure.study, Some(figure.scene)).unwrap();
            let named = spec.gallery.unwrap().estimators;
            let is = |e: &Estimator| e.to_string() == figure.best;
            assert!(named.iter().any(is), "{}", figure.study);
        }
    }

    #[test]
    fn the_least_is_best() {
        let entry = |text: &str, paper: f64, ours: f64| Efficiency {
            estimator: text.parse().unwrap(),
            paper: vec![paper; 5],
            ours: vec![ours; 5],
            ray: Vec::new(),
        };
        let all = [entry("point-area", 2.0, 1.0), entry("line-area", 1.0, 3.0)];
        let name = |e: Option<&Efficiency>| e.unwrap().estimator.to_string();
        assert_eq!(name(best(&all, |e| &e.paper)), "line-area");
        assert_eq!(name(best(&all, |e| &e.ours)), "point-area");
    }

    /// The errors of values 1 and 3 and of 0 and 2 are as large, whatever their means are.
    #[test]
    fn errors_are_relative_to_what_is_known() {
        let error = |first: f64| {
            let values = [first, first + 2.0].map(DVec3::splat);
            cost(&[[0, 0]], &[DVec3::splat(4.0)], |_, out| out.extend(values))[1]
        };
        // Whole numbers and halves: exact.
        assert_eq!(
            [0.0, 1.0].map(|first| error(first).to_bits()),
            [0.5_f64.to_bits(); 2]
        );
    }
}

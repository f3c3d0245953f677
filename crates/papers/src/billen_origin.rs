//! Billen & Dutré 2016, section 8: lines through a common origin in random directions, in place of
//! parallel ones, which they leave to future work.

use crate::billen_orders::LINES;
use crate::measured::{Curve, Measured, settings};
use crate::picture_study::{Context, PictureStudy, Row, section, table};
use anyhow::{Context as _, Result, bail};
use linelit_elementary::{atan2, sin_cos};
use linelit_geometry::{ConvexPolygon, DVec3, Segment};
use linelit_integrator::{PlannedLight, Renderer, ShadingPoint};
use linelit_lights::{AreaLight, Light};
use linelit_samplers::{SampleSet, Sampler, SamplerKind};
use linelit_study::scene_study::{Targets, all_pixels};
use linelit_study::stats::slopes::SlopePoint;
use linelit_visibility::{Scratch, ShaftQuery, VisibleLines};
use std::f64::consts::PI;

const SCENES: [&str; 3] = [
    "cornell-box-large",
    "grid-planes-large",
    "triangle-soup-large",
];

/// Where all lines meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// In the middle of the light.
    Middle,
    /// In its first corner.
    Corner,
}

impl Origin {
    const fn name(self) -> &'static str {
        match self {
            Self::Middle => "through the middle",
            Self::Corner => "through a corner",
        }
    }
}

/// The lines of a light through one point of it.
struct Pencil {
    polygon: ConvexPolygon,
    origin: DVec3,
    /// Two unit directions in the plane of the light, perpendicular.
    axes: [DVec3; 2],
    /// Angles over which lines are spread, from the first axis.
    span: f64,
}

impl Pencil {
    fn new(polygon: &ConvexPolygon, origin: Origin) -> Self {
        let corners = polygon.vertices();
        let (first, last) = (
            corners[1] - corners[0],
            corners[corners.len() - 1] - corners[0],
        );
        let along = first.normalize_or_zero();
        let across = polygon.normal().cross(along);
        let (origin, span) = match origin {
            Origin::Middle => (polygon.centroid(), PI),
            Origin::Corner => (corners[0], atan2(last.dot(across), last.dot(along)).abs()),
        };
        Self {
            polygon: *polygon,
            origin,
            axes: [along, across],
            span,
        }
    }

    /// Direction and ends (signed distances from the origin) of the line at a share of the span.
    fn line(&self, share: f64) -> (DVec3, [f64; 2]) {
        let (sin, cos) = sin_cos(share * self.span);
        let direction = self.axes[0] * cos + self.axes[1] * sin;
        let corners = self.polygon.vertices();
        let next = corners.iter().cycle().skip(1);
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (a, b) in corners.iter().zip(next) {
            let inwards = self.polygon.normal().cross(*b - *a);
            let (distance, speed) = (inwards.dot(self.origin - *a), inwards.dot(direction));
            if speed > 0.0 {
                low = low.max(-distance / speed);
            } else if speed < 0.0 {
                high = high.min(-distance / speed);
            }
        }
        (direction, [low.min(0.0), high.max(0.0)])
    }
}

/// Gauss and Legendre's five nodes and weights on [−1, 1].
const NODES: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.0, 0.568_888_888_888_888_9],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.906_179_845_938_664, 0.236_926_885_056_189_1],
];
/// Panels of each part of a line.
const PANELS: u32 = 4;

/// ∫ f(r) |r| dr from `from` to `to`, which are on one side of zero.
fn integral([from, to]: [f64; 2], f: impl Fn(f64) -> DVec3) -> DVec3 {
    let step = (to - from) / f64::from(PANELS);
    let panel = |k: u32| {
        let middle = from + (f64::from(k) + 0.5) * step;
        let node = |[x, w]: [f64; 2]| {
            let r = middle + 0.5 * step * x;
            f(r) * (0.5 * step * w * r.abs())
        };
        NODES.map(node).into_iter().sum::<DVec3>()
    };
    (0..PANELS).map(panel).sum()
}

/// Light at a point by lines through the origin; `numbers` place the lines in the span.
fn estimate(
    (renderer, light, area): (&Renderer<'_>, &PlannedLight, &AreaLight),
    pencil: &Pencil,
    point: &ShadingPoint,
    numbers: &SampleSet,
    (scratch, visible): (&mut Scratch, &mut VisibleLines),
) -> DVec3 {
    if !area.faces(point.position, 0.0) {
        return DVec3::ZERO;
    }
    let count = numbers.count();
    let lines: Vec<_> = (0..count).map(|k| pencil.line(numbers.get_1d(k))).collect();
    let at = |direction: DVec3, r: f64| pencil.origin + direction * r;
    let segments: Vec<Segment> = lines
        .iter()
        .map(|(d, [low, high])| Segment::new(at(*d, *low), at(*d, *high)))
        .collect();
    let query = ShaftQuery::new(point.position, &area.polygon).excluding(light.triangles.clone());
    let mut shaft = renderer.light_occluders().shaft(query, scratch);
    shaft.visible(&segments, visible);
    let mut sum = DVec3::ZERO;
    for (k, (direction, [low, high])) in lines.iter().enumerate() {
        let value = |r: f64| {
            let to = at(*direction, r) - point.position;
            let (square, unit) = (to.length_squared(), to.normalize_or_zero());
            let facing = area.polygon.normal().dot(unit).abs();
            point.reflected(area.emission.radiance, unit) * (facing / square)
        };
        for part in visible.line(k) {
            let [from, to] = [part.lo, part.hi].map(|t| low + t * (high - low));
            if from < 0.0 && to > 0.0 {
                sum += integral([from, 0.0], value) + integral([0.0, to], value);
            } else {
                sum += integral([from, to], value);
            }
        }
    }
    sum * (pencil.span / f64::from(count))
}

/// Numbers of lines, trials, and the first seed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    samples: &'static [u32],
    trials: u32,
    seed: u64,
}

/// Mean light over the points, and variances trial by trial, of each number of lines.
pub(crate) fn curve(
    targets: &Targets<'_>,
    origin: Origin,
    sampler: SamplerKind,
    effort: Effort,
) -> Result<(f64, Curve)> {
    let renderer = targets.renderer;
    let light = renderer.plan().lights().first().context("no light")?;
    let Light::Area(area) = &*light.light else {
        bail!("the first light is no polygon");
    };
    let pencil = Pencil::new(&area.polygon, origin);
    let (mut scratch, mut visible) = (Scratch::new(), VisibleLines::new());
    let (mut mean, mut points) = (0.0, Vec::new());
    let n = f64::from(effort.trials);
    for &samples in effort.samples {
        let mut variances = vec![0.0; effort.trials as usize];
        mean = 0.0;
        for (pixel, point) in &targets.points {
            let of = (renderer, light, area);
            let values: Vec<DVec3> = (0..u64::from(effort.trials))
                .map(|k| {
                    let seed = effort.seed.wrapping_add((k << 20) + u64::from(samples));
                    let numbers = Sampler::new(sampler, seed).points(*pixel, 0, samples);
                    let room = (&mut scratch, &mut visible);
                    estimate(of, &pencil, point, &numbers, room)
                })
                .collect();
            let middle = values.iter().copied().sum::<DVec3>() / n;
            mean += middle.element_sum() / 3.0;
            for (variance, value) in variances.iter_mut().zip(&values) {
                // As each trial sees it: n/(n − 1) times the squared deviation.
                *variance += (*value - middle).length_squared() * n / (3.0 * (n - 1.0));
            }
        }
        let scale = 1.0 / targets.pixels.max(1) as f64;
        mean *= scale;
        points.push(SlopePoint {
            samples: f64::from(samples),
            trial_variances: variances.into_iter().map(|v| v * scale).collect(),
        });
    }
    Ok((mean, Curve { points }))
}

const COLUMNS: [&str; 4] = [
    "order",
    "order, parallel",
    "variance over parallel",
    "light over parallel",
];

/// The study.
pub(super) fn run(context: &Context<'_>) -> Result<PictureStudy> {
    let effort = Effort {
        samples: context.or_least(&[4, 16, 64, 256][..], &[2, 4]),
        trials: context.or_least(16, 2),
        seed: context.seed,
    };
    let mut rows = Vec::new();
    let (mut less, mut more, mut all) = (0, 0, 0);
    for name in SCENES {
        let mut scene = context.library.load(name)?.scene;
        let size = context.size([8; 2]);
        scene.set_resolution(size[0], size[1]);
        let renderer = Renderer::new(&scene);
        let targets = Targets::find(&renderer, &all_pixels(size[0], size[1]));
        for sampler in [SamplerKind::Independent, SamplerKind::Stratified] {
            let settings = settings(LINES, sampler)?;
            let Effort {
                samples,
                trials,
                seed,
            } = effort;
            let parallel = Curve::of(&targets, settings, samples, trials, seed);
            let (truth, _) = curve(&targets, Origin::Middle, SamplerKind::Stratified, effort)?;
            for origin in [Origin::Middle, Origin::Corner] {
                let (mean, own) = curve(&targets, origin, sampler, effort)?;
                let ratio = Measured::ratio(own.last(), parallel.last());
                all += 1;
                less += u32::from(ratio.is_below(1.0));
                more += u32::from(ratio.is_above(1.0));
                // Orders of the standard deviation, as this paper has them.
                let [a, b] = [&own, &parallel].map(|c| c.order());
                let values = [a, b, ratio, Measured::exact(mean / truth)];
                let values: Vec<_> = COLUMNS.into_iter().zip(values).collect();
                let what = format!("{name}, {}, {sampler}", origin.name());
                rows.push(Row::measured(what, &values));
            }
        }
    }
    let lead = format!(
        "Lines through a common origin, weighted by the distance from it, have less variance than as many parallel lines in \
         {less} of {all} cases and more in {more}. The paper leaves them to future work."
    );
    let caption =
        "Diffuse surfaces, quadrature along what is visible; variance with the most lines.";
    let tables = vec![table(caption, &COLUMNS, &rows)];
    Ok(PictureStudy {
        title: "Lines through a common origin: Billen & Dutré 2016, section 8".to_owned(),
        summary: vec![lead],
        sections: vec![section("Future work", "", Vec::new(), tables)],
        rows,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chords through a point cover the polygon: ∫∫ |r| dr dθ is its area.
    #[test]
    fn pencils_cover_their_light() {
        let corners = [[0.0, 0.0], [2.0, 0.2], [1.5, 1.4], [-0.3, 1.0]];
        let corners = corners.map(|[x, y]| DVec3::new(x, y, 1.0));
        let polygon = ConvexPolygon::try_new(&corners).unwrap();
        for origin in [Origin::Middle, Origin::Corner] {
            let pencil = Pencil::new(&polygon, origin);
            let count = 100_000;
            let line = |k| {
                let share = (f64::from(k) + 0.5) / f64::from(count);
                let (_, [low, high]) = pencil.line(share);
                0.5 * (low * low + high * high)
            };
            let area = (0..count).map(line).sum::<f64>() * pencil.span / f64::from(count);
            // The midpoint rule on 10⁵ cells of a function with kinks: below 10⁻⁸ of it.
            assert!(
                (area / polygon.area() - 1.0).abs() < 1e-7,
                "{origin:?} {area}"
            );
        }
    }

    /// The same light as by parallel lines in closed form: stratified lines are within five
    /// standard errors of both.
    #[test]
    fn light_is_the_same() {
        let library = linelit_scenes::Library::default();
        let mut scene = library.load("cornell-box-large").unwrap().scene;
        scene.set_resolution(6, 6);
        let renderer = Renderer::new(&scene);
        let targets = Targets::find(&renderer, &all_pixels(6, 6));
        let effort = Effort {
            samples: &[256],
            trials: 8,
            seed: 5,
        };
        let sampler = SamplerKind::Stratified;
        let means = [Origin::Middle, Origin::Corner].map(|origin| {
            let (mean, curve) = curve(&targets, origin, sampler, effort).unwrap();
            let variance = curve.last().iter().sum::<f64>() / 8.0;
            // Of the mean over 36 points and 8 trials.
            (mean, (variance / (8.0 * 36.0)).sqrt())
        });
        let mut workspace = linelit_integrator::Workspace::new();
        let settings = linelit_integrator::Settings {
            samples: 4096,
            ..settings("line-analytic", sampler).unwrap()
        };
        let light = |(pixel, point): &([u32; 2], ShadingPoint)| {
            let light = renderer.direct(&settings, point, *pixel, 0, &mut workspace);
            light.element_sum() / 3.0
        };
        let truth = targets.points.iter().map(light).sum::<f64>() / 36.0;
        for (mean, error) in means {
            // The closed form's own error is a tenth of that of 256 lines.
            assert!(
                (mean - truth).abs() < 5.5 * error,
                "{mean} ± {error}, {truth}"
            );
        }
    }
}

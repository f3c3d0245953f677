//! Billen & Dutré 2016, Figs. 8 and 12: points and lines for the same time. Random lines lose;
//! stratified ones overtake.

use crate::billen_orders::LINES;
use crate::measured::{Measured, settings, trial_variances_and_seconds};
use crate::picture_study::{Context, PictureStudy, Row, section, table};
use anyhow::Result;
use linelit_elementary::{ln, pow};
use linelit_integrator::Renderer;
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use linelit_study::scene_study::{Targets, all_pixels};

const SCENES: [&str; 8] = [
    "grid-planes-small",
    "grid-planes-large",
    "triangle-soup-small",
    "triangle-soup-large",
    "colonnade-small",
    "colonnade-large",
    "logo-small",
    "logo-large",
];
/// Numbers of lines, and of points, which take less time.
const LINE_COUNTS: [u32; 4] = [4, 16, 64, 256];
const POINT_COUNTS: [u32; 6] = [4, 16, 64, 256, 1024, 4096];
/// Rounds in which all are measured in turns, and trials of each.
const ROUNDS: u64 = 6;
const TRIALS: u32 = 4;

/// The variance of lines over that of points at the time that the lines took.
#[derive(Clone, Debug)]
pub(crate) struct AtTime {
    /// The scene.
    pub scene: &'static str,
    /// For each number of lines: that, and the ratio.
    pub ratios: Vec<(u32, Measured)>,
    /// The variance of 16 lines over that of 16 points, whatever they take.
    pub as_many: Measured,
}

impl AtTime {
    /// The number of lines from which lines are better, with their intervals, for all more; `None`
    /// if they are not at the end.
    pub(crate) fn overtakes(&self) -> Option<u32> {
        let behind = |(_, ratio): &(u32, Measured)| !ratio.is_below(1.0);
        let first = self.ratios.iter().rposition(behind).map_or(0, |k| k + 1);
        self.ratios.get(first).map(|(lines, _)| *lines)
    }
}

/// The variance at a time, between and beyond measurements (time, variance) by the power law of the
/// nearest two.
fn variance_at(curve: &[[f64; 2]], time: f64) -> f64 {
    let after = curve.partition_point(|[t, _]| *t < time);
    let k = after.clamp(1, curve.len() - 1);
    let [[t0, v0], [t1, v1]] = [curve[k - 1], curve[k]];
    let order = ln(v1 / v0) / ln(t1 / t0);
    v0 * pow(time / t0, order)
}

/// Measures one scene with one pattern.
pub(crate) fn measure(
    context: &Context<'_>,
    (name, targets): (&'static str, &Targets<'_>),
    sampler: SamplerKind,
) -> Result<AtTime> {
    let curve = |estimator: &str, counts: &[u32], seed: u64| -> Result<Vec<[f64; 2]>> {
        let settings = settings(estimator, sampler)?;
        let at = |&n: &u32| {
            let (variances, seconds) =
                trial_variances_and_seconds(targets, settings, n, TRIALS, seed ^ u64::from(n));
            let variance = variances.iter().sum::<f64>() / variances.len() as f64;
            [seconds, variance]
        };
        Ok(counts.iter().map(at).collect())
    };
    let lines = context.or_least(&LINE_COUNTS[..], &LINE_COUNTS[..2]);
    let points = context.or_least(&POINT_COUNTS[..], &POINT_COUNTS[..2]);
    let mut ratios = vec![Vec::new(); lines.len()];
    let mut as_many = Vec::new();
    for round in 0..context.or_least(ROUNDS, 2) {
        let seed = context.seed.wrapping_add(round << 16);
        let by_points = curve("point-area", points, seed)?;
        let by_lines = curve(LINES, lines, seed.wrapping_add(1 << 40))?;
        // The second of both numbers is 16.
        as_many.push(by_lines[1][1] / by_points[1][1]);
        for (ratios, [time, variance]) in ratios.iter_mut().zip(by_lines) {
            ratios.push(variance / variance_at(&by_points, time));
        }
    }
    let ratios = ratios.iter().map(|r| Measured::geometric_mean(r));
    Ok(AtTime {
        scene: name,
        ratios: lines.iter().copied().zip(ratios).collect(),
        as_many: Measured::geometric_mean(&as_many),
    })
}

const COLUMNS: [&str; 4] = [
    "4 lines, same seconds",
    "16 lines, same seconds",
    "64 lines, same seconds",
    "256 lines, same seconds",
];
const AS_MANY: &str = "16 lines, as many points";

/// The study.
pub(super) fn run(context: &Context<'_>) -> Result<PictureStudy> {
    let (mut sections, mut rows, mut summary) = (Vec::new(), Vec::new(), Vec::new());
    // All scenes are opened before the first is measured.
    let size = context.size([8; 2]);
    let open = |name: &'static str| -> Result<Scene> {
        let mut scene = context.library.load(name)?.scene;
        scene.set_resolution(size[0], size[1]);
        Ok(scene)
    };
    let scenes = SCENES.into_iter().map(open).collect::<Result<Vec<_>>>()?;
    let renderers: Vec<Renderer<'_>> = scenes.iter().map(Renderer::new).collect();
    let pixels = all_pixels(size[0], size[1]);
    let find = |renderer| Targets::find(renderer, &pixels);
    let targets: Vec<Targets<'_>> = renderers.iter().map(find).collect();
    for sampler in [
        SamplerKind::Independent,
        SamplerKind::Stratified,
        SamplerKind::Sobol,
        SamplerKind::SobolBurley,
    ] {
        let all = SCENES
            .into_iter()
            .zip(&targets)
            .map(|of| measure(context, of, sampler))
            .collect::<Result<Vec<_>>>()?;
        let row = |a: &AtTime| {
            let ratios = a.ratios.iter().map(|(_, ratio)| *ratio);
            let mut values: Vec<_> = COLUMNS.into_iter().zip(ratios).collect();
            values.push((AS_MANY, a.as_many));
            Row::measured(format!("{}, {sampler}", a.scene), &values)
        };
        let own: Vec<Row> = all.iter().map(row).collect();
        let lead = sentence(sampler, &all);
        let caption = "Variance of lines over that of points for the same processor time.";
        let tables = vec![table(caption, &[&[AS_MANY], &COLUMNS[..]].concat(), &own)];
        sections.push(section(&sampler.to_string(), "", Vec::new(), tables));
        summary.push(lead);
        rows.extend(own);
    }
    Ok(PictureStudy {
        title: "Points and lines for the same time: Billen & Dutré 2016, Figs. 8 and 12".to_owned(),
        summary,
        sections,
        rows,
    })
}

/// Where lines lose and where they win, beside what the paper says of the pattern.
fn sentence(sampler: SamplerKind, all: &[AtTime]) -> String {
    let last = |a: &AtTime| a.ratios.last().map(|(_, ratio)| *ratio);
    let lose = all
        .iter()
        .filter(|a| last(a).is_some_and(|r| r.is_above(1.0)));
    let win = all
        .iter()
        .filter(|a| last(a).is_some_and(|r| r.is_below(1.0)));
    let list = |a: &AtTime| {
        let ratio = last(a).map_or(String::new(), |r| r.to_string());
        let from = a
            .overtakes()
            .map_or(String::new(), |n| format!(", ahead from {n} lines"));
        format!("{} {ratio}{from}", a.scene)
    };
    let each: Vec<String> = all.iter().map(list).collect();
    let paper = match sampler {
        SamplerKind::Independent => "The paper: points usually have the lower error in less time.",
        _ => "The paper: points are ahead at first in complex scenes, and lines overtake them.",
    };
    format!(
        "With {sampler} samples and the most lines, lines have less variance than points for the same time on {} of {} \
         scenes and more on {}: {}. {paper}",
        win.count(),
        all.len(),
        lose.count(),
        each.join("; ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_laws_are_followed() {
        let curve = [[1.0, 8.0], [2.0, 4.0], [4.0, 1.0]];
        let is = |time: f64, variance: f64| {
            let found = variance_at(&curve, time);
            assert!((found / variance - 1.0).abs() < 1e-12, "{time}: {found}");
        };
        is(1.0, 8.0);
        is(0.5, 16.0);
        is(2.0_f64.sqrt(), 8.0 / 2.0_f64.sqrt());
        is(8.0, 0.25);
    }

    #[test]
    fn the_last_loss_counts() {
        let ratio = |v: f64| Measured::exact(v);
        let at = |values: [f64; 3]| AtTime {
            scene: "",
            ratios: [4, 16, 64].into_iter().zip(values.map(ratio)).collect(),
            as_many: ratio(1.0),
        };
        assert_eq!(at([0.5, 2.0, 0.9]).overtakes(), Some(64));
        assert_eq!(at([0.5, 0.4, 0.9]).overtakes(), Some(4));
        assert_eq!(at([0.5, 0.4, 1.1]).overtakes(), None);
    }
}

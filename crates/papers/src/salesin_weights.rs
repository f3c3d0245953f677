//! Salesin & Jarosz 2019, Fig. 4: the weights of BSDF samples over a light behind two triangles.

use crate::measured::Measured;
use crate::picture_study::{Context, PictureStudy, Row, section, table};
use anyhow::{Context as _, Result};
use linelit_film::HeatMap;
use linelit_geometry::intervals::{Interval, IntervalSet, VisibleSet};
use linelit_geometry::{DVec3, Segment, ShadowTriangle};
use linelit_mis::smoothing;
use linelit_study::report::Picture;
use std::f64::consts::PI;

/// The light: from −1 to 1 along x and y, at a height of 2 over the shading point, facing it.
const HEIGHT: f64 = 2.0;
/// Half of the light's smaller extent, which the paper recommends as the width of the smoothing.
const WIDTH: f64 = 1.0;
/// The triangles between, halfway: what they hide of the light is twice as large.
const OCCLUDERS: [[[f64; 2]; 3]; 2] = [
    [[-0.42, -0.31], [0.03, -0.12], [-0.27, 0.17]],
    [[0.11, 0.05], [0.44, 0.21], [0.16, 0.36]],
];
/// Distance of two places that a step is looked for between, in half extents of the light.
const STEP: f64 = 1e-7;
/// Places along an edge at which steps are looked for.
const PLACES: u32 = 256;

/// Width of the smoothing at the ends of visible parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Smoothing {
    /// The balance heuristic.
    None,
    /// One width everywhere.
    Fixed,
    /// Narrower where less is hidden beyond (eq. 24).
    Variable,
}

/// The three panels.
const PANELS: [(Smoothing, &str); 3] = [
    (Smoothing::None, "without smoothing"),
    (Smoothing::Fixed, "fixed width"),
    (Smoothing::Variable, "variable width"),
];

/// The largest steps of a weight that is zero beyond the light and where it is hidden.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Steps {
    /// At the borders of the light.
    pub border: f64,
    /// At the edges of what the occluders hide.
    pub edge: f64,
    /// Where a line slips off a corner of an occluder.
    pub corner: f64,
}

/// A line of the light: along x (`axis` 0) or y, at an offset.
fn line(axis: usize, offset: f64) -> Segment {
    let at = |t: f64| match axis {
        0 => DVec3::new(t, offset, HEIGHT),
        _ => DVec3::new(offset, t, HEIGHT),
    };
    Segment::new(at(-1.0), at(1.0))
}

/// What is visible of a line from the origin, in shares of it.
fn visible(axis: usize, offset: f64) -> IntervalSet {
    let mut parts = IntervalSet::full();
    let triangle = ShadowTriangle::new(DVec3::ZERO, &line(axis, offset));
    for corners in OCCLUDERS {
        let corners = corners.map(|[x, y]| DVec3::new(x, y, 0.5 * HEIGHT));
        if let Some(hidden) = triangle.as_ref().and_then(|t| t.blocked_by(&corners)) {
            parts.clip(hidden.lo, hidden.hi);
        }
    }
    parts
}

/// The part that a place on a line is in, and what is hidden on both sides of it; `None` if it is
/// hidden itself.
fn around(parts: &[Interval], t: f64) -> Option<(Interval, [f64; 2])> {
    let k = parts.iter().position(|p| p.lo <= t && t <= p.hi)?;
    let before = k.checked_sub(1).map_or(0.0, |j| parts[j].hi);
    let after = parts.get(k + 1).map_or(1.0, |p| p.lo);
    Some((parts[k], [parts[k].lo - before, after - parts[k].hi]))
}

/// The weight of a BSDF sample (cosine lobe, normal towards the light) at (x, y) on the light, of
/// lines in both directions and BSDF samples; zero where the place is hidden or beyond the light.
pub(crate) fn weight(smoothing: Smoothing, [x, y]: [f64; 2]) -> f64 {
    if x.abs() > 1.0 || y.abs() > 1.0 {
        return 0.0;
    }
    let to = DVec3::new(x, y, HEIGHT);
    let cos = HEIGHT / to.length();
    // Densities per area: cos θ/π · cos θ'/r² of the lobe, eqs. 14 and 15 of lines.
    let lobe = cos * cos / (PI * to.length_squared());
    let mut densities = [lobe, 0.0, 0.0];
    let mut factor = 1.0;
    for (axis, [along, offset]) in [[x, y], [y, x]].into_iter().enumerate() {
        let parts = visible(axis, offset);
        let t = 0.5 * (along + 1.0);
        let Some((part, hidden)) = around(parts.as_slice(), t) else {
            return 0.0;
        };
        densities[axis + 1] = 0.25 / parts.measure();
        if smoothing == Smoothing::None {
            continue;
        }
        let gap = |share: f64| match smoothing {
            // Ends at the border have no gap; the border has its own factor.
            Smoothing::Fixed if share > 1e-12 => f64::INFINITY,
            _ => 2.0 * share,
        };
        let [lo, hi] = [part.lo, part.hi].map(|t| 2.0 * t - 1.0);
        let [before, after] = hidden.map(gap);
        factor *= smoothing::border(along, -1.0, 1.0, WIDTH)
            * smoothing::visible_interval(along, lo, hi, before, after, WIDTH);
    }
    smoothing::smoothed_balance(&[1.0; 3], &densities, &[factor, 1.0, 1.0], 0)
}

/// The largest steps of the weights, looked for between places 10⁻⁷ apart.
pub(crate) fn measure(smoothing: Smoothing) -> Steps {
    let along = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(PLACES) - 1.0;
    let swap = |axis: usize, [a, b]: [f64; 2]| if axis == 0 { [a, b] } else { [b, a] };
    let step = |a: [f64; 2], b: [f64; 2]| (weight(smoothing, a) - weight(smoothing, b)).abs();
    let mut steps = Steps {
        border: 0.0,
        edge: 0.0,
        corner: 0.0,
    };
    for axis in 0..2 {
        for offset in (0..PLACES).map(along) {
            for (inside, outside) in [(STEP - 1.0, -1.0 - STEP), (1.0 - STEP, 1.0 + STEP)] {
                let at = |t| swap(axis, [t, offset]);
                steps.border = steps.border.max(step(at(inside), at(outside)));
            }
            for part in visible(axis, offset).as_slice() {
                for (t, sign) in [(part.lo, 1.0), (part.hi, -1.0)] {
                    let at = |d: f64| swap(axis, [2.0 * t - 1.0 + sign * d, offset]);
                    // Ends at the light's borders are counted above.
                    if 0.0 < t && t < 1.0 {
                        steps.edge = steps.edge.max(step(at(STEP), at(-STEP)));
                    }
                }
            }
        }
        // Lines that pass by a corner on its one side and its other.
        for corner in OCCLUDERS.iter().flatten() {
            let [u, v] = swap(axis, corner.map(|c| 2.0 * c));
            for t in (0..PLACES).map(along).filter(|t| (t - u).abs() > 0.01) {
                let at = |d: f64| swap(axis, [t, v + d]);
                let both = [at(STEP), at(-STEP)].map(|at| weight(smoothing, at));
                // Where the edge itself is crossed, one of them is hidden.
                if both.iter().all(|w| *w > 0.0) {
                    steps.corner = steps.corner.max((both[0] - both[1]).abs());
                }
            }
        }
    }
    steps
}

const COLUMNS: [&str; 3] = ["at the border", "at edges", "at corners"];

/// The study.
pub(super) fn run(context: &Context<'_>) -> Result<PictureStudy> {
    let side = context.size([256; 2])[0];
    let (mut pictures, mut rows, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for (smoothing, name) in PANELS {
        let at = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(side) - 1.0;
        let row = |y: u32| (0..side).map(move |x| [at(x), -at(y)]);
        let values = (0..side).flat_map(row).map(|at| weight(smoothing, at));
        #[allow(clippy::cast_possible_truncation, reason = "colours need no more")]
        let values: Vec<f32> = values.map(|w| w as f32).collect();
        let map = HeatMap::spanning(&[0.0, 1.0]);
        let caption = format!("weight of BSDF samples, {name}");
        pictures.push(Picture::of_scalars(side, side, &values, map, &caption)?);
        let steps = measure(smoothing);
        let values = [steps.border, steps.edge, steps.corner].map(Measured::exact);
        let values: Vec<_> = COLUMNS.into_iter().zip(values).collect();
        rows.push(Row::measured(name, &values));
        all.push(steps);
    }
    let lead = sentence(&all).context("three panels")?;
    let caption = "The largest steps of the weight of a BSDF sample between places 1e-7 of half the light apart; \
                   the weight is zero beyond the light and where it is hidden.";
    Ok(PictureStudy {
        title: "Weights over a light: Salesin & Jarosz 2019, Fig. 4".to_owned(),
        summary: vec![lead],
        sections: vec![section(
            "Fig. 4",
            "",
            pictures,
            vec![table(caption, &COLUMNS, &rows)],
        )],
        rows,
    })
}

/// Weights of slope s change by 2·10⁻⁷ s between the places: far below 10⁻³, steps far above.
fn is_step(change: f64) -> bool {
    change >= 1e-3
}

/// The caption of Fig. 4: a fixed width removes the steps at borders and edges, a variable one
/// those at corners, too.
pub(crate) fn caption_holds(none: &Steps, fixed: &Steps, variable: &Steps) -> bool {
    let smooth = |s: &Steps| !is_step(s.border) && !is_step(s.edge);
    let before = is_step(none.border) && is_step(none.edge);
    let with = smooth(fixed) && smooth(variable);
    before && with && is_step(fixed.corner) && !is_step(variable.corner)
}

/// What the steps say of the paper's caption.
fn sentence(all: &[Steps]) -> Option<String> {
    let [none, fixed, variable] = all else {
        return None;
    };
    let is = |step: f64| if is_step(step) { "steps" } else { "no step" };
    Some(format!(
        "Without smoothing the weight has {} of up to {:.2} at the borders of the light, {:.2} at the edges of \
         the occluders. With one width there is {} at borders and {} at edges, but {} of up to {:.2} where lines \
         slip off a corner; with a variable width {} there ({:.0e}). {}",
        is(none.border),
        none.border,
        none.edge,
        is(fixed.border),
        is(fixed.edge),
        is(fixed.corner),
        fixed.corner,
        is(variable.corner),
        variable.corner,
        if caption_holds(none, fixed, variable) {
            "So the paper's caption says of its three panels."
        } else {
            "The paper's caption says otherwise of its three panels."
        }
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The caption of the paper's figure: what is no step is a change by the slope over 2·10⁻⁷,
    /// which is below 5,000 everywhere ([`is_step`]); steps are a tenth.
    #[test]
    fn steps_are_where_the_paper_has_them() {
        let [none, fixed, variable] = PANELS.map(|(smoothing, _)| measure(smoothing));
        assert!(
            caption_holds(&none, &fixed, &variable),
            "{none:?} {fixed:?} {variable:?}"
        );
        assert!(none.border > 0.05 && none.edge > 0.05 && fixed.corner > 0.05);
        assert!(weight(Smoothing::None, [0.0, 0.9]) > 0.0);
        assert!(weight(Smoothing::Variable, [1.1, 0.0]) <= 0.0);
    }
}

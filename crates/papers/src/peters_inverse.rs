//! Peters 2021, Fig. 3: the inverse distribution function of projected solid angle along a line,
//! and how near two steps of the paper's iteration come to it.

use crate::measured::Measured;
use crate::picture_study::{Context, PictureStudy, Row, section, table};
use anyhow::Result;
use linelit_elementary::{asin, atan2, ln, pow, sin, sin_cos};
use linelit_samplers::{Sampler, SamplerKind};
use linelit_study::report::Plot;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;

/// The normal's components along the line and towards it; the third is the paper's square root, the
/// last two are its "n_t near −1".
const NORMALS: [[f64; 2]; 5] = [
    [0.0, 1.0],
    [0.6, 0.8],
    [1.0, 0.0],
    [0.6, -0.8],
    [0.28, -0.96],
];

/// F of eq. 3, of the angle whose sine is ω.
pub(crate) fn antiderivative([ns, nt]: [f64; 2], angle: f64) -> f64 {
    let (w, root) = sin_cos(angle);
    ns * w * w + nt * (root * w + angle)
}

/// The angles between which a line that is infinitely long is above the horizon.
fn above([ns, nt]: [f64; 2]) -> [f64; 2] {
    // n_s ω + n_t √(1 − ω²) is the cosine of the angle from (n_s, n_t).
    let middle = atan2(ns, nt);
    [-FRAC_PI_2, FRAC_PI_2].map(|quarter| (middle + quarter).clamp(-FRAC_PI_2, FRAC_PI_2))
}

/// The distribution along a line that is infinitely long: F of eq. 3 from the left end of what is
/// above the horizon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Distribution {
    /// A normal in the plane of line and shading point.
    normal: [f64; 2],
    /// Where the line comes above the horizon, and where it goes below: angles.
    ends: [f64; 2],
}

impl Distribution {
    pub(crate) fn new(normal: [f64; 2]) -> Self {
        let ends = above(normal);
        Self { normal, ends }
    }

    /// The largest value, at the right end; the left end has zero.
    pub(crate) fn total(&self) -> f64 {
        let [first, last] = self.ends.map(|end| antiderivative(self.normal, end));
        last - first
    }

    /// The inverse, by bisection to the last bit.
    pub(crate) fn inverse(&self, value: f64) -> f64 {
        let [mut low, mut high] = self.ends;
        let wanted = value + antiderivative(self.normal, low);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if antiderivative(self.normal, middle) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        sin(0.5 * (low + high))
    }

    /// The exponent p of ω − ω₀ ~ value^p at the left end: below one, the derivative is infinite.
    pub(crate) fn exponent(&self) -> f64 {
        let rise = |share: f64| self.inverse(share * self.total()) - sin(self.ends[0]);
        // F is good to 2e-16 of its total: to 2e-8 of the smaller value.
        ln(rise(1e-6) / rise(1e-8)) / ln(100.0)
    }

    /// The steepest part of the inverse, away from its ends: ω over share of the total.
    fn slope(&self) -> f64 {
        let at = |share: f64| self.inverse(share * self.total());
        (at(0.9) - at(0.1)) / (0.8 * self.total())
    }
}

/// A line and a random number, as four numbers in [0, 1]: the turn of the normal, both ends between
/// where the line meets the horizon, uniform in the angle, and where ξ is between both guards.
type Case = [f64; 4];

/// ξ nearer to its ends is not iterated.
const GUARD: f64 = 1e-5;

/// The errors in ξ of the paper's iteration (algorithm 2 in f64): of what is not iterated, at the
/// guard, and after one, two and three steps. `None` where less than 10⁻⁷ of a whole line is left,
/// and rounding would be seen.
fn backward_errors([turn, from, to, xi]: Case) -> Option<[f64; 4]> {
    let xi = GUARD + xi * (1.0 - 2.0 * GUARD);
    let (ns, nt) = sin_cos(PI * (2.0 * turn - 1.0));
    let [low, high] = above([ns, nt]);
    let [first, last] = [from.min(to), from.max(to)].map(|share| low + share * (high - low));
    let value = |angle| antiderivative([ns, nt], angle);
    let (start, total) = (value(first), value(last) - value(first));
    if total < 1e-7 {
        return None;
    }
    let [w0, w1] = [first, last].map(sin);
    let begin = |xi: f64| asin((w0 + xi * (w1 - w0)).clamp(-1.0, 1.0));
    let error = |angle, xi: f64| ((value(angle) - start) / total - xi).abs();
    let mut errors = [error(begin(GUARD), GUARD); 4];
    let mut alpha = begin(xi);
    for after in &mut errors[1..] {
        let (ws, wt) = sin_cos(alpha);
        let n = ns * ws + nt * wt;
        let g = n * ws + nt * alpha - (start + xi * total);
        let g1 = 2.0 * n * wt;
        let g2 = 2.0 * (ns * wt - nt * ws) * wt - 2.0 * n * ws;
        let root = (g1 * g1 - 2.0 * g2 * g).max(0.0).sqrt();
        let sum = g1 + root.copysign(g1);
        let step = if sum.abs() > 0.0 { -2.0 * g / sum } else { 0.0 };
        alpha = (alpha + step).clamp(-FRAC_PI_2, FRAC_PI_2);
        *after = error(alpha, xi);
    }
    Some(errors)
}

/// The worst backward errors that a search finds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worst {
    /// Cases that were tried.
    pub cases: u32,
    /// Errors of what is not iterated, and after one, two and three steps.
    pub errors: [f64; 4],
    /// The error after two steps where climbs from the worst cases end.
    pub climbed: f64,
}

/// Tries random cases, every other one with numbers that are as often near an end as far from it,
/// and climbs from the worst.
pub(crate) fn worst(cases: u32, seed: u64) -> Worst {
    const CLIMBS: usize = 64;
    const BLOCK: u32 = 1 << 12;
    let numbers = Sampler::new(SamplerKind::Independent, seed);
    let near_an_end = |u: f64| match u {
        u if u < 0.5 => pow(1e-6, 2.0 * u),
        u => 1.0 - pow(1e-6, 2.0 * u - 1.0),
    };
    let (mut tried, mut errors) = (0, [0.0_f64; 4]);
    let mut best: Vec<(f64, Case)> = Vec::new();
    for k in 0..cases {
        let at = |stream| {
            numbers
                .points([k / BLOCK, 0], stream, BLOCK)
                .get_2d(k % BLOCK)
        };
        let ([a, b], [c, d]) = (at(0), at(1));
        let case = [a, b, c, d].map(|u| if k % 2 == 0 { u } else { near_an_end(u) });
        let Some(found) = backward_errors(case) else {
            continue;
        };
        tried += 1;
        errors = [0, 1, 2, 3].map(|step| errors[step].max(found[step]));
        if best.len() < CLIMBS || best.last().is_some_and(|least| found[2] > least.0) {
            best.push((found[2], case));
            best.sort_by(|a, b| b.0.total_cmp(&a.0));
            best.truncate(CLIMBS);
        }
    }
    let tops = (1..).zip(best).map(|(k, from)| climb(from, &numbers, k));
    Worst {
        cases: tried,
        errors,
        climbed: tops.fold(0.0, f64::max),
    }
}

/// The error after two steps where a climb from a case ends: random moves, shorter once none of 16
/// is up.
fn climb((mut error, mut case): (f64, Case), numbers: &Sampler, stream: u32) -> f64 {
    let (mut step, mut turn) = (0.1, 0);
    while step > 1e-9 {
        let before = error;
        let moves = [0, 1].map(|more| numbers.points([turn, 1], 2 * stream + more, 16));
        turn += 1;
        for k in 0..16 {
            let ([a, b], [c, d]) = (moves[0].get_2d(k), moves[1].get_2d(k));
            let delta = [a, b, c, d].map(|u| step * (2.0 * u - 1.0));
            let moved = [0, 1, 2, 3].map(|i| (case[i] + delta[i]).clamp(0.0, 1.0));
            let found = backward_errors(moved).map_or(0.0, |errors| errors[2]);
            if found > error {
                (error, case) = (found, moved);
            }
        }
        if error <= before {
            step *= 0.7;
        }
    }
    error
}

const COLUMNS: [&str; 5] = [
    "width of the domain",
    "left end",
    "exponent at the left end",
    "slope",
    "distance from a square root",
];

/// A row of numbers for each normal.
fn shapes() -> Vec<Row> {
    let mut rows = Vec::new();
    for normal in NORMALS {
        let f = Distribution::new(normal);
        let shares = (0..=1000).map(|k| f64::from(k) / 1000.0);
        let from_root = shares.map(|s| (f.inverse(s * f.total()) - (s * f.total()).sqrt()).abs());
        let from_root = from_root.fold(0.0, f64::max);
        let values = [
            f.total(),
            sin(f.ends[0]),
            f.exponent(),
            f.slope(),
            from_root,
        ];
        let values: Vec<_> = COLUMNS
            .into_iter()
            .zip(values.map(Measured::exact))
            .collect();
        let [ns, nt] = normal;
        rows.push(Row::measured(format!("n = ({ns}, {nt})"), &values));
    }
    rows
}

/// The study.
pub(super) fn run(context: &Context<'_>) -> Result<PictureStudy> {
    let mut rows = shapes();
    let worst = worst(context.or_least(2_000_000, 2_000), context.seed);
    let steps = [
        "not iterated, 1e-5 from the end",
        "after one step",
        "after two steps",
        "after three steps",
    ];
    let values: Vec<_> = steps
        .into_iter()
        .zip(worst.errors.map(Measured::exact))
        .collect();
    let iteration = Row::measured("worst error in ξ", &values);
    let of = |k: usize, name| rows[k].values.get(name).copied().unwrap_or(f64::NAN);
    let exponents = (0..NORMALS.len()).map(|k| of(k, COLUMNS[2]));
    let largest = exponents.fold(0.0, f64::max);
    let lead = format!(
        "The inverse rises from its left end as a power of at most {largest:.3}: below one, its derivative is \
         infinite there for all five normals. For (1, 0) it is the square root to {:.0e}. As n_t nears −1 the domain \
         shrinks, from {:.2} at n_t = 1 to {:.2} and {:.3}, and the slope grows from {:.2} to {:.2} and {:.2}.",
        of(2, COLUMNS[4]),
        of(0, COLUMNS[0]),
        of(3, COLUMNS[0]),
        of(4, COLUMNS[0]),
        of(0, COLUMNS[3]),
        of(3, COLUMNS[3]),
        of(4, COLUMNS[3]),
    );
    let [guarded, one, two, three] = worst.errors;
    let said = format!(
        "Over {} random cases in f64 the worst error in ξ is {one:.1e} after one step, {two:.2e} after the paper's \
         two (climbing from the worst: {:.2e}; paper: 1.58e-5 over 28 billion) and {three:.1e} after three. Where ξ is \
         1e-5 from an end, and nearer to it nothing is iterated, the first guess is wrong by up to {guarded:.2e}.",
        worst.cases, worst.climbed,
    );
    let mut first = section("Fig. 3", "", Vec::new(), vec![table("", &COLUMNS, &rows)]);
    first.plots.push(Plot {
        svg: plot(),
        caption: "The inverse distribution function for five normals.".to_owned(),
    });
    let tables = vec![table("", &steps, std::slice::from_ref(&iteration))];
    let second = section("The iteration", "", Vec::new(), tables);
    rows.push(iteration);
    Ok(PictureStudy {
        title: "Inverting projected solid angle: Peters 2021, Fig. 3".to_owned(),
        summary: vec![lead, said],
        sections: vec![first, second],
        rows,
    })
}

/// The five curves, in the colour of the text, each with its normal at its right end.
fn plot() -> String {
    let (width, height, left) = (560.0, 300.0, 40.0);
    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" fill="none" stroke="currentColor" font-family="sans-serif" font-size="12">"#
    );
    let at = |value: f64, w: f64| {
        let (x, y) = (left + 125.0 * value, 150.0 - 130.0 * w);
        format!("{x:.1},{y:.1}")
    };
    for w in [-1.0, 0.0, 1.0] {
        let [a, b] = [at(0.0, w), at(3.2, w)];
        let _ = write!(svg, r#"<path d="M{a}L{b}" opacity="0.3"/>"#);
        let y = 154.0 - 130.0 * w;
        let _ = write!(
            svg,
            r#"<text x="8" y="{y}" fill="currentColor" stroke="none">{w}</text>"#
        );
    }
    for (k, normal) in NORMALS.into_iter().enumerate() {
        let f = Distribution::new(normal);
        let points: Vec<String> = (0..=200)
            .map(|i| {
                let value = f.total() * (f64::from(i) / 200.0).powi(2);
                at(value, f.inverse(value))
            })
            .collect();
        let dash = ["none", "8 3", "2 3", "8 3 2 3", "1 2"][k];
        let _ = write!(
            svg,
            r#"<path d="M{}" stroke-width="2" stroke-dasharray="{dash}"/>"#,
            points.join("L")
        );
        let (x, y) = (left + 125.0 * f.total() + 4.0, 24.0 + 13.0 * k as f64);
        let [ns, nt] = normal;
        let _ = write!(
            svg,
            r#"<text x="{x:.1}" y="{y:.1}" fill="currentColor" stroke="none">({ns}, {nt})</text>"#
        );
    }
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The antiderivative of (1, 0) is ω², that of (0, 1) is symmetric about ω = 0.
    #[test]
    fn inverses_are_known() {
        let root = Distribution::new([1.0, 0.0]);
        let flat = Distribution::new([0.0, 1.0]);
        for share in [0.1, 0.25, 0.5, 0.81] {
            // Roundings of F over its slope there, at least 0.6.
            assert!((root.inverse(share) - share.sqrt()).abs() < 1e-15);
            let both = [share, 1.0 - share].map(|s| flat.inverse(s * flat.total()));
            assert!((both[0] + both[1]).abs() < 1e-14, "{both:?}");
        }
        // The horizon crosses at a slope: a square root; the end of the line at infinity: 2/3.
        assert!((root.exponent() - 0.5).abs() < 1e-6);
        assert!((flat.exponent() - 2.0 / 3.0).abs() < 1e-3);
    }

    /// Two steps are as good as the paper says, one is not; and a density at an end of the line
    /// that is at most three times the mean makes the first guess there wrong by at most 2e-5.
    #[test]
    fn two_steps_are_enough() {
        let Worst {
            errors, climbed, ..
        } = worst(100_000, 3);
        let [guarded, one, two, three] = errors;
        assert!(two <= climbed && climbed < 1.585e-5, "{errors:?} {climbed}");
        assert!(two < 0.1 * one && three < 0.1 * two, "{errors:?}");
        assert!(guarded < 2e-5, "{errors:?}");
    }
}
